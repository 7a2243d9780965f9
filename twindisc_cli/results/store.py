"""A result as files: HDF5 for programs, PNG for people, JSON kept inside the HDF5 file.

The HDF5 file opens with `xarray.open_dataset(path, engine="h5netcdf")`. It holds no times and no paths, so that the
same inputs give the same bytes; `run_key` tells whether it is up to date.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli import __version__
from twindisc_cli.errors import ValidityError
from twindisc_cli.results.files import write_all
from twindisc_cli.results.result import Array, Axis, Dataset, Result

if TYPE_CHECKING:
    import h5py
    from matplotlib.figure import Figure

SCHEMA = 1
CONVENTIONS = "CF-1.11"
_COMPRESSED_FROM = 8192
_DPI = 150


@dataclass(frozen=True)
class Origin:
    """What a result was made from.

    configs: the resolved definition as TOML, of the test first, then of further tests. inputs: sha256 of each measured
    file by name. provenance: what kind of data they are. options: what else decides the result.
    """

    name: str
    configs: tuple[str, ...]
    inputs: Mapping[str, str]
    provenance: str
    options: Mapping[str, Any]

    def run_key(self, command: str) -> str:
        """sha256 of version, command, definitions and inputs: the same key, the same result."""
        parts = (SCHEMA, __version__, command, self.configs, dict(sorted(self.inputs.items())), self.options)
        return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Stored:
    """What an up-to-date result file still knows of its run."""

    summary: tuple[str, ...]
    json: dict[str, Any]
    exit_code: int
    files: tuple[Path, ...]


def images(result: Result, origin: Origin, extra: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files of a result by name: the extra files, COMMAND.png, and COMMAND.h5, which knows the others, last.

    ValidityError where a number is not finite that must be.
    """
    if result.undefined:
        what = f"{', '.join(result.undefined)} came out as no finite number: outside of what the theory covers"
        raise ValidityError(f"{what}; nothing was written")
    files = dict(extra)
    if result.figure is not None:
        files[f"{result.command}.png"] = png(result.figure())
    files[f"{result.command}.h5"] = hdf5_image(result, origin, beside=list(files))
    return files


def put(folder: Path, files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write the files of a result to a folder; all of them or none. The paths written, the HDF5 file first."""
    write_all({folder / name: data for name, data in files.items()})
    *beside, hdf5 = (folder / name for name in files)
    return (hdf5, *beside)


def write(folder: Path, result: Result, origin: Origin, extra: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write COMMAND.h5, COMMAND.png and the extra files to a folder. The paths written, the HDF5 file first."""
    return put(folder, images(result, origin, extra))


def up_to_date(path: Path, run_key: str) -> Stored | None:
    """The stored outcome, where the file is whole, has this run key, and its neighbours are still there."""
    import h5py

    if not path.is_file():
        return None
    try:
        with h5py.File(str(path), "r") as file:
            if file.attrs.get("run_key") != run_key:
                return None
            beside = json.loads(file.attrs["files"])
            stored = Stored(
                summary=tuple(file.attrs["summary"].splitlines()),
                json=json.loads(file["json"].asstr()[()]),
                exit_code=int(file.attrs["exit_code"]),
                files=(path, *(path.parent / name for name in beside)),
            )
    except (OSError, KeyError, ValueError):
        return None
    return stored if all(p.is_file() for p in stored.files) else None


def png(figure: Figure) -> bytes:
    """The figure as PNG, without the date and the version of the program that drew it."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI, metadata={"Software": None})
    return buffer.getvalue()


def plain(value: Any) -> Any:
    """The value as JSON can hold it: arrays as lists, numbers of numpy as Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def hdf5_image(result: Result, origin: Origin, *, beside: list[str]) -> bytes:
    """The bytes of the HDF5 file, made in memory."""
    import h5py

    with h5py.File("result", "w", driver="core", backing_store=False, libver="earliest") as file:
        _write_dataset(file, result.dataset)
        for number, config in enumerate(origin.configs, start=1):
            name = "config" if number == 1 else f"config_{number}"
            _write_text(file, name, config, "resolved test definition, TOML")
        _write_text(file, "json", json.dumps(plain(result.json), allow_nan=False), "outcome as printed by --json")
        group = file.create_group("provenance")
        group.attrs["kind"] = origin.provenance
        for name, digest in sorted(origin.inputs.items()):
            group.attrs[name] = digest
        attributes = {
            "Conventions": CONVENTIONS,
            "title": f"{result.command}: {origin.name}",
            "schema": SCHEMA,
            "twindisc_version": __version__,
            "run_key": origin.run_key(result.command),
            "provenance": origin.provenance,
            "summary": "\n".join(result.summary),
            "exit_code": result.exit_code,
            "files": json.dumps(beside),
            **result.dataset.attrs,
        }
        for name, value in attributes.items():
            file.attrs[name] = value
        file.flush()
        return bytes(file.id.get_file_image())


def _write_dataset(file: h5py.File, dataset: Dataset) -> None:
    """Axes as dimension scales, arrays with a scale on every dimension, all with units and long_name."""
    for axis in dataset.axes:
        _write_values(file, axis)
        file[axis.name].make_scale(axis.name)
    for array in dataset.arrays:
        _write_values(file, array)
        for dimension, name in enumerate(array.dims):
            file[array.name].dims[dimension].attach_scale(file[name])


def _write_values(file: h5py.File, item: Axis | Array) -> None:
    values = np.asarray(item.values)
    kinds = {"U": object, "O": object, "b": np.int8}
    values = values.astype(kinds.get(values.dtype.kind, values.dtype))
    large: dict[str, Any] = {"compression": "gzip", "shuffle": True} if values.size >= _COMPRESSED_FROM else {}
    text: dict[str, Any] = {"dtype": _text_type()} if values.dtype == object else {}
    data = file.create_dataset(item.name, data=values, track_times=False, **large, **text)
    data.attrs["units"] = item.unit
    data.attrs["long_name"] = item.long_name


def _write_text(file: h5py.File, name: str, text: str, long_name: str) -> None:
    data = file.create_dataset(name, data=text, dtype=_text_type(), track_times=False)
    data.attrs["units"] = "1"
    data.attrs["long_name"] = long_name


def _text_type() -> Any:
    import h5py

    return h5py.string_dtype()
