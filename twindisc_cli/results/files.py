"""Files that are either whole or not there."""

from __future__ import annotations

import glob
import os
from collections.abc import Mapping
from pathlib import Path

from twindisc_cli.errors import OutputError, Problem


def write_all(files: Mapping[Path, bytes]) -> None:
    """Write every file under a temporary name beside it, then rename them in order.

    On any failure, a full disk or an interrupt, the temporary files go and what was there before stays.
    """
    waiting: dict[Path, Path] = {}
    path = Path()
    try:
        for path, data in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            _remove_abandoned(path)
            temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
            waiting[temporary] = path
            with temporary.open("wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
        for temporary, path in waiting.items():
            temporary.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        what = f"cannot be written: {reason}; nothing was changed, choose another folder with -o or make room"
        raise OutputError(Problem(what, str(path))) from error
    finally:
        for temporary in waiting:
            temporary.unlink(missing_ok=True)


def _remove_abandoned(path: Path) -> None:
    """Remove the temporary files beside `path` of processes that were killed while they wrote it."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.tmp"):
        process = left.suffixes[-2].removeprefix(".") if len(left.suffixes) > 1 else ""
        if process.isdigit() and not _lives(int(process)):
            left.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    """Whether there is such a process; yes where that cannot be told."""
    if os.name != "posix":
        return True  # there, asking would end it
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
