"""A result as files: HDF5 for programs, a figure for people, JSON kept inside the HDF5 file.

The HDF5 file opens with `xarray.open_dataset(path, engine="h5netcdf")`. It holds no times and no paths, so that the
same inputs give the same bytes. It knows the sha256 of each file beside it, and ends in its own (`recorded`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.digests import program_digest
from twindisc_cli.errors import ValidityError
from twindisc_cli.results.drawn import DPI, drawn_files
from twindisc_cli.results.files import write_all
from twindisc_cli.results.origin import SCHEMA, Origin
from twindisc_cli.results.recorded import beside, sealed
from twindisc_cli.results.result import Array, Axis, Dataset, Result
from twindisc_cli.version import __version__

if TYPE_CHECKING:
    import h5py

CONVENTIONS = "CF-1.11"
_COMPRESSED_FROM = 8192  # values: a smaller array gains less than the filter takes


def images(
    result: Result,
    origin: Origin,
    extra: Mapping[str, bytes],
    *,
    formats: Sequence[str] = ("png",),
    dpi: int = DPI,
    panels: bool = False,
) -> dict[str, bytes]:
    """The files of a result by name: the extra files, the figures, and COMMAND.h5, which knows the others, last.

    panels: whether each panel of a figure is a file of its own, too.

    ValidityError where a number is not finite that must be.
    """
    if result.undefined:
        what = f"{', '.join(result.undefined)} came out as no finite number: outside of what the theory covers"
        raise ValidityError(f"{what}; nothing was written")
    files = dict(extra)
    figures = {**({} if result.figure is None else {result.command: result.figure}), **result.figures}
    drawn = result.drawn if (*formats, dpi, panels) == ("png", DPI, False) else {}
    for name, draw in figures.items() if formats else ():
        files |= (
            {f"{name}.png": drawn[name]} if name in drawn else drawn_files(name, draw(), formats, dpi, panels=panels)
        )
    hashes = {name: sha256(data).hexdigest() for name, data in files.items()}
    files[f"{result.command}.h5"] = hdf5_image(result, origin, beside=hashes)
    return files


def put(folder: Path, files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write the files of a result to a folder; all of them or none. The paths written, the HDF5 file first.

    What an earlier result had beside it, and this one has not, is removed.
    """
    *others, hdf5 = (folder / name for name in files)
    left = [folder / name for name in beside(hdf5) if name not in files]
    write_all({folder / name: data for name, data in files.items()}, gone=left)
    return (hdf5, *others)


def write(folder: Path, result: Result, origin: Origin, extra: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write COMMAND.h5, COMMAND.png and the extra files to a folder. The paths written, the HDF5 file first."""
    return put(folder, images(result, origin, extra))


def plain(value: Any) -> Any:
    """The value as JSON can hold it: arrays as lists, numbers of numpy as Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def hdf5_image(result: Result, origin: Origin, *, beside: Mapping[str, str]) -> bytes:
    """The bytes of the HDF5 file, made in memory; `beside` holds the sha256 of each file beside it."""
    import h5py

    with h5py.File("result", "w", driver="core", backing_store=False, libver="earliest") as file:
        _write_dataset(file, result.dataset)
        config = file.create_group("config")
        for number, text in enumerate(origin.configs, start=1):
            config.attrs["toml" if number == 1 else f"toml_{number}"] = text
        ends = Axis("end_time", origin.turned[0], "s", "ends of iterations and pauses")
        turned = Array("revolutions", ("end_time",), origin.turned[1], "1", "revolutions until then")
        _write_dataset(config, Dataset((ends,), (turned,)))
        file.create_group("outcome").attrs["json"] = json.dumps(plain(result.json), allow_nan=False)
        group = file.create_group("provenance")
        group.attrs["kind"] = origin.provenance
        for name, digest in sorted(origin.inputs.items()):
            group.attrs[name] = digest
        attributes = {
            "Conventions": CONVENTIONS,
            "title": f"{result.command}: {origin.name}",
            "schema": SCHEMA,
            "twindisc_version": __version__,
            "twindisc_program": program_digest(),
            "run_key": origin.run_key(result.command),
            "provenance": origin.provenance,
            "summary": "\n".join(result.summary),
            "exit_code": result.exit_code,
            "files": json.dumps(beside),
            "options": json.dumps(origin.options, sort_keys=True),
            **result.dataset.attrs,
        }
        for name, value in attributes.items():
            file.attrs[name] = value
        file.flush()
        return sealed(bytes(file.id.get_file_image()), _record(result, origin, beside))


def _record(result: Result, origin: Origin, beside: Mapping[str, str]) -> dict[str, Any]:
    """What shows whether a result still holds, and its outcome as it is reported again."""
    return {
        "schema": SCHEMA,
        "twindisc_version": __version__,
        "program": program_digest(),
        "run_key": origin.run_key(result.command),
        "options": origin.options,
        "configs": origin.configs,
        "inputs": origin.inputs,
        "sources": [{"definition": source.definition, "inputs": source.inputs} for source in origin.sources],
        "files": beside,
        "summary": result.summary,
        "json": plain(result.json),
        "exit_code": result.exit_code,
    }


def _write_dataset(file: h5py.Group, dataset: Dataset) -> None:
    """Axes as dimension scales, arrays with a scale on every dimension, all with units and long_name."""
    for axis in dataset.axes:
        _write_values(file, axis)
        file[axis.name].make_scale(axis.name)
    for array in dataset.arrays:
        _write_values(file, array)
        for dimension, name in enumerate(array.dims):
            file[array.name].dims[dimension].attach_scale(file[name])


def _write_values(file: h5py.Group, item: Axis | Array) -> None:
    import h5py

    values = np.asarray(item.values)
    kinds = {"U": object, "O": object, "b": np.int8}
    values = values.astype(kinds.get(values.dtype.kind, values.dtype))
    large: dict[str, Any] = {"compression": "gzip", "shuffle": True} if values.size >= _COMPRESSED_FROM else {}
    text: dict[str, Any] = {"dtype": h5py.string_dtype()} if values.dtype == object else {}
    data = file.create_dataset(item.name, data=values, track_times=False, **large, **text)
    data.attrs["units"] = item.unit
    data.attrs["long_name"] = item.long_name
