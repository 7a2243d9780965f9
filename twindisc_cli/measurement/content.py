"""The bytes of a measured file, and what the definition says of how to read them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from twindisc_cli.errors import MeasurementError, Problem, did_you_mean
from twindisc_cli.reading import read_regular

_GZIP = b"\x1f\x8b"
_LARGEST = 1 << 31  # 2 GiB unpacked: what a packed file may grow to


@dataclass(frozen=True)
class Content:
    """A file's bytes and how they are read.

    sheet: of a workbook, group of a .tdms, variable of a .mat, number of a block; skip: cells that say that nothing was
    measured, None where that is found; ignore: columns that are not looked at.
    """

    data: bytes
    sheet: str | None = None
    skip: tuple[str, ...] | None = None
    ignore: tuple[str, ...] = ()

    @property
    def markers(self) -> frozenset[float]:
        """What `skip` holds of numbers."""
        return frozenset(float(cell) for cell in self.skip or () if _is_number(cell))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def read_bytes(path: Path) -> bytes:
    """The content of a measured file, or a clear reason why there is none."""
    try:
        return read_regular(path)
    except FileNotFoundError:
        here = sorted(p.name for p in path.parent.glob("*.csv")) if path.parent.is_dir() else []
        raise MeasurementError(Problem(f"no such file{did_you_mean(path.name, here)}", str(path))) from None
    except IsADirectoryError:
        raise MeasurementError(Problem("is a folder; name a CSV file in it", str(path))) from None
    except OSError as error:
        raise MeasurementError(Problem(f"cannot be read: {error.strerror or error}", str(path))) from None


def unpacked(content: Content, file: str) -> tuple[Content, str]:
    """What is inside a .gz, and its name; any other file as it is."""
    if not content.data.startswith(_GZIP):
        return content, file
    import gzip
    import io
    import zlib

    try:
        with gzip.open(io.BytesIO(content.data)) as inner:
            data = inner.read(_LARGEST + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise MeasurementError(Problem(f"is a damaged .gz: {error}", file)) from None
    if len(data) > _LARGEST:
        raise MeasurementError(Problem("holds more than 2 GiB; cut it into several files", file))
    return replace(content, data=data), file.removesuffix(".gz")
