"""What a result file says of itself, and whether it still holds: is it whole, and are the files beside it its own?

Behind the end that HDF5 sees, a result file says in two lines what is needed for that: a record of the run as JSON, and
the sha256 of all that comes before. That is compared before anything is read, and the HDF5 library is not needed.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from twindisc_cli.digests import digest_of, digest_of_text, program_digest
from twindisc_cli.results.origin import SCHEMA, Origin
from twindisc_cli.version import __version__

_RECORD = b"\nrecord "
_MARK = b"\nsha256 "
_SHOWN = 3  # keys in a sentence


@dataclass(frozen=True)
class Stored:
    """What an up-to-date result file still knows of its run; inputs, where it was compared with them."""

    summary: tuple[str, ...]
    json: dict[str, Any]
    exit_code: int
    files: tuple[Path, ...]
    inputs: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """A whole result file: its outcome, and what it was made from."""

    stored: Stored
    run_key: str
    version: str
    program: str
    schema: int
    options: dict[str, Any]
    configs: tuple[str, ...]
    inputs: dict[str, str]
    sources: list[dict[str, Any]]


def sealed(image: bytes, record: Mapping[str, Any]) -> bytes:
    """The bytes of an HDF5 file, behind them the record of the run, and the sha256 of both."""
    content = image + _RECORD + json.dumps(record).encode()
    return content + _MARK + sha256(content).hexdigest().encode() + b"\n"


def _record(data: bytes) -> dict[str, Any]:
    """The record at the end of a result file; ValueError where the file is not whole."""
    content, _, digest = data.rpartition(_MARK)
    if digest != sha256(content).hexdigest().encode() + b"\n":
        raise ValueError
    record: dict[str, Any] = json.loads(content.rpartition(_RECORD)[2])
    return record


def up_to_date(path: Path, run_key: str) -> Stored | None:
    """The stored outcome, where the file is whole, has this run key, and its neighbours are the ones it knows."""
    result = recorded(path)
    return result.stored if isinstance(result, Recorded) and result.run_key == run_key else None


def recorded(path: Path) -> Recorded | str:
    """What a result file holds, or why it does not count."""
    try:
        if not path.is_file():
            return "is not there"
        record = _record(path.read_bytes())
    except ValueError:
        return "was changed or damaged since it was written, or is of an older version"
    except OSError:
        return "cannot be read"
    try:
        result = _understood(path, record)
        for name, digest in record["files"].items():
            neighbour = path.parent / Path(name).name
            if not neighbour.is_file():
                return f"{name} beside it is gone"
            if sha256(neighbour.read_bytes()).hexdigest() != digest:
                return f"{name} beside it was changed"
    except (OSError, KeyError, ValueError, TypeError, AttributeError):
        return "cannot be read"
    return result


def beside(path: Path) -> list[str]:
    """The names of the files that belong to a result file; none where it does not count."""
    try:
        return [Path(name).name for name in _record(path.read_bytes())["files"]] if path.is_file() else []
    except (OSError, KeyError, ValueError, TypeError, AttributeError):
        return []


def _understood(path: Path, record: Mapping[str, Any]) -> Recorded:
    """What the record of a result file at this path says."""
    stored = Stored(
        summary=tuple(record["summary"]),
        json=record["json"],
        exit_code=int(record["exit_code"]),
        files=(path, *(path.parent / Path(name).name for name in record["files"])),
    )
    return Recorded(
        stored=stored,
        run_key=record["run_key"],
        version=record["twindisc_version"],
        program=str(record.get("program", "")),
        schema=int(record["schema"]),
        options=record["options"],
        configs=tuple(record["configs"]),
        inputs=record["inputs"],
        sources=record["sources"],
    )


def why(path: Path, command: str, origin: Origin) -> str:
    """Why a result has to be made; an empty text where it is up to date."""
    result = recorded(path)
    if isinstance(result, str):
        return result
    if result.run_key == origin.run_key(command):
        return ""
    if not _by_this_program(result):
        return made_by_another(result)
    return "; ".join(_differences(result, origin)) or "something it was made from has changed"


def _by_this_program(result: Recorded) -> bool:
    """Whether a result was made by the files of the program as they are now."""
    return (result.program, result.schema) == (program_digest(), SCHEMA)


def made_by_another(result: Recorded | str) -> str:
    """That a result was made by another version of the program; an empty text where it was not."""
    if isinstance(result, str) or _by_this_program(result):
        return ""
    return f"made by another version{f' ({result.version})' if result.version != __version__ else ''}: made again"


def _differences(result: Recorded, origin: Origin) -> Iterator[str]:
    """What is another than it was, in the order in which a user would look."""
    if len(result.configs) != len(origin.configs):
        yield "is of other tests"
        return
    keys = [key for pair in zip(result.configs, origin.configs, strict=True) for key in _changed(*map(_flat, pair))]
    if keys:
        more = f" and {len(keys) - _SHOWN} more" if len(keys) > _SHOWN else ""
        yield f"the definition says something else at {', '.join(keys[:_SHOWN])}{more}"
    yield from (f"{name} was changed" for name in _changed(result.inputs, origin.inputs))
    options = json.loads(json.dumps(origin.options))
    yield from (f"{name} is another" for name in _changed(result.options, options))


def _changed(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    return sorted(key for key in {*old, *new} if old.get(key) != new.get(key) or (key in old) != (key in new))


def _flat(text: str) -> dict[str, str]:
    """The values of a definition by their dotted keys, as they would be written."""

    def walk(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
        for key, value in table.items():
            if isinstance(value, Mapping):
                yield from walk(value, f"{prefix}{key}.")
            else:
                yield f"{prefix}{key}", repr(value)

    return dict(walk(tomllib.loads(text), ""))


def unchanged(path: Path, definitions: Sequence[Path], options: Mapping[str, Any]) -> Stored | None:
    """The stored outcome, where nothing it was made from has changed by a byte; no definition is checked for that."""
    result = recorded(path)
    if isinstance(result, str) or not _by_this_program(result):
        return None
    if result.options != json.loads(json.dumps(options)) or len(result.sources) != len(definitions):
        return None
    inputs: list[Path] = []
    for definition, source in zip(definitions, result.sources, strict=True):
        if digest_of_text(definition) != source["definition"]:
            return None
        named = {definition.parent / name: digest for name, digest in source["inputs"].items()}
        if any(digest_of(path) != digest for path, digest in named.items()):
            return None
        inputs += named
    return replace(result.stored, inputs=tuple(inputs))
