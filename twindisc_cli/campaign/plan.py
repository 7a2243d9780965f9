"""Which tests a campaign is made of: definitions by file or glob, or one definition varied by a campaign file.

A campaign file is TOML with a `base` definition and what changes in it, by the dotted key of the definition:

    base = "../configs/ambient.toml"
    [vary]                                                  # every combination of these
    rig.normal_load_N = { from = 50.0, to = 400.0, count = 4, spacing = "log" }
    "history.steps[1].iterations" = [5, 10, 20]              # steps counted from 1; steps[*]: all of them
    [[variations]]                                          # or one test after the other
    name = "soft"                                           # left out: named after the values
    material.hardness_HV = 300
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any, TypeGuard

from twindisc_cli.definition import Test, load, load_text, test_name
from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.reading import LARGEST_DEFINITION, read_regular, read_toml

Value = float | int | str | bool
_PART = re.compile(r"([^.\[\]]+)|\[(\d+|\*)\]")
_RANGE_KEYS = {"from", "to", "count", "spacing"}
_CAMPAIGN_KEYS = {"base", "vary", "variations"}
_MOST_COUNT = 1_000_000  # tests: a slip of the keyboard asks for more, no campaign does
_LARGEST = 1e300  # beyond it products overflow


@dataclass(frozen=True)
class Job:
    """One test of a campaign: its name, its file, and, where it is varied, the base in that file and what changes.

    The definition of a variation is written when it is read: a hundred thousand of them are planned in a few seconds.
    """

    name: str
    path: Path
    base: Mapping[str, Any] | None = None
    varied: Mapping[str, Value] = field(default_factory=dict)


def read(job: Job) -> Test:
    """The test of a job, from its file or from its variation."""
    if job.base is None:
        return load(job.path)
    import tomli_w

    text = tomli_w.dumps(_varied(job.base, {**job.varied, "test.name": job.name}, job.path))
    try:
        return load_text(text, job.path)
    except DefinitionError as error:  # its lines are those of the variation, which is in no file
        raise type(error)([replace(problem, line=0) for problem in error.problems]) from None


def plan(given: Sequence[str]) -> list[Job]:
    """The tests of files, globs and campaign files, in order. DefinitionError lists what is wrong with all of them."""
    jobs: list[Job] = []
    problems: list[Problem] = []
    for path in _files(given, problems):
        try:
            jobs.extend(_jobs(path))
        except DefinitionError as error:
            problems.extend(error.problems)
    problems.extend(_equal_names(jobs))
    if problems:
        raise DefinitionError(problems)
    return jobs


def _files(given: Sequence[str], problems: list[Problem]) -> list[Path]:
    """Every file once, in the order given; a glob's files by name."""
    files: dict[Path, None] = {}
    for pattern in given:
        path = Path(pattern)
        result = _matches(path)
        regular = [file for file in result if file.is_file()]
        files.update((file, None) for file in regular)
        if not result:
            problems.append(Problem("no such file", pattern))
        elif result == [path] and path.is_dir():
            problems.append(Problem(f"is a folder; write {path.as_posix()}/*.toml", pattern))
        elif result == [path] and not regular:
            problems.append(Problem("is a pipe or a device; name a file", pattern))
        elif not regular:
            problems.append(Problem(f"fits {result[0].as_posix()}, but no file; write {pattern}/*.toml", pattern))
    return list(files)


def _matches(pattern: Path) -> list[Path]:
    """The file of that name, or those of a glob; none where it can be neither."""
    try:
        if pattern.exists():
            return [pattern]
        return sorted(Path(pattern.anchor).glob(str(pattern.relative_to(pattern.anchor))))
    except (ValueError, OSError, NotImplementedError):
        return []


def _jobs(path: Path) -> Iterator[Job]:
    document = _document(path)
    if "base" in document:
        yield from _variations(path, document)
    else:
        yield Job(_name(document, path), path)


def _document(path: Path) -> dict[str, Any]:
    """The tables of a file; empty where it cannot be read, which the test itself will report."""
    try:
        return read_toml(read_regular(path, largest=LARGEST_DEFINITION).decode("utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return {}


def _name(document: Mapping[str, Any], path: Path) -> str:
    test = document.get("test")
    name = test.get("name") if isinstance(test, Mapping) else None
    return name if isinstance(name, str) else path.stem


def _equal_names(jobs: Sequence[Job]) -> Iterator[Problem]:
    """Two tests of one name would write the same files."""
    seen: dict[str, Job] = {}
    for job in jobs:
        other = seen.setdefault(job.name, job)
        if other is not job:
            where = f"also the test of {other.path}" if other.path != job.path else "the name of two variations"
            yield Problem(f"{job.name} is {where}; give each its own name", str(job.path))


def _variations(path: Path, document: Mapping[str, Any]) -> Iterator[Job]:
    """The tests of a campaign file."""
    if unknown := sorted(set(document) - _CAMPAIGN_KEYS):
        known = "a campaign file holds base, vary and variations"
        raise DefinitionError([Problem(f"unknown key; {known}", str(path), key=key) for key in unknown])
    base_path = path.parent / str(document["base"])
    base = _document(base_path)
    if not base:
        raise DefinitionError(Problem(f"{base_path} is not a test definition that can be read", str(path), key="base"))
    tables = _checked_tables(path, document)
    if not tables:
        raise DefinitionError(Problem("nothing is varied: give [vary] or [[variations]]", str(path)))
    keys = dict.fromkeys(key for table in tables for key in table if key != "name")
    differing = {key for key in keys if len({str(table.get(key)) for table in tables}) > 1}
    seen: set[tuple[str, ...]] = set()
    for table in tables:
        values = {key: value for key, value in table.items() if key != "name"}
        if tuple(values) not in seen:
            seen.add(tuple(values))
            _varied(base, values, path)
        naming = {key: value for key, value in values.items() if key in differing} or values
        name = str(table["name"]) if "name" in table else f"{test_name(path.stem)}-{_label(naming)}"
        yield Job(name, base_path, base, values)


def _checked_tables(path: Path, document: Mapping[str, Any]) -> list[dict[str, Value]]:
    """What each variation changes: the product of [vary], then the rows of [[variations]]."""
    vary, rows = document.get("vary", {}), document.get("variations", [])
    if not isinstance(vary, Mapping):
        raise DefinitionError(Problem("is a table of keys with their values: [vary]", str(path), key="vary"))
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise DefinitionError(Problem("are tables, one a test: [[variations]]", str(path), key="variations"))
    ranges = {key: _values(path, key, value) for key, value in _flat(vary).items()}
    if math.prod(len(values) for values in ranges.values()) > _MOST_COUNT:
        raise DefinitionError(Problem(f"more than {_MOST_COUNT} combinations", str(path), key="vary"))
    tables = [dict(zip(ranges, values, strict=True)) for values in product(*ranges.values())] if ranges else []
    return tables + [_flat(row) for row in rows]


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Dotted keys of nested tables; a range is a value, not a table."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping) and not ("from" in value and "to" in value):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _values(path: Path, key: str, given: Any) -> list[Value]:
    """The values of one varied key: a list as it stands, or `count` values `from` one `to` another."""
    if isinstance(given, list) and given:
        return given
    if not isinstance(given, Mapping) or set(given) - _RANGE_KEYS or "count" not in given:
        what = 'give a list, or { from = 1.0, to = 2.0, count = 5 }, with spacing = "log" for equal ratios'
        raise DefinitionError(Problem(what, str(path), key=f"vary.{key}"))
    first, last, count, spacing = (given.get(key) for key in ("from", "to", "count", "spacing"))
    if not _is_number(first) or not _is_number(last):
        raise DefinitionError(Problem("a range goes from one number to another", str(path), key=f"vary.{key}"))
    if not isinstance(count, int) or not 2 <= count <= _MOST_COUNT:
        what = f"a range has 2 to {_MOST_COUNT} values"
        raise DefinitionError(Problem(what, str(path), key=f"vary.{key}.count"))
    if spacing not in (None, "linear", "log"):
        raise DefinitionError(Problem('is "linear" or "log"', str(path), key=f"vary.{key}.spacing"))
    share = [i / (count - 1) for i in range(count)]
    if spacing != "log":
        return [_tidy(first + (last - first) * s) for s in share]
    if first == 0.0 or (first > 0.0) != (last > 0.0) or last == 0.0:
        raise DefinitionError(Problem("equal ratios need ends of one sign", str(path), key=f"vary.{key}"))
    return [_tidy(first * (last / first) ** s) for s in share]


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _LARGEST


def _tidy(value: float) -> float:
    """The value to twelve digits, so that 0.1 + 0.2 is 0.3 in the names and in the definitions."""
    return float(f"{value:.12g}")


def _varied(base: Mapping[str, Any], values: Mapping[str, Value], path: Path) -> dict[str, Any]:
    """The base definition with the values of one variation; path: the file that a mistake in their keys is of."""
    document = copy.deepcopy(dict(base))
    for key, value in values.items():
        try:
            _set(document, _parts(key), value)
        except LookupError as error:
            raise DefinitionError(Problem(f"the base has no {error.args[0]}", str(path), key=key)) from None
    return document


def _parts(key: str) -> list[str | int]:
    """The parts of a dotted key: names, items counted from 0, and `*` for every item."""
    return [int(m[2]) - 1 if (m[2] or "").isdigit() else m[2] or m[1] for m in _PART.finditer(key)]


def _set(holder: Any, parts: Sequence[str | int], value: Value) -> None:
    """Set what the parts lead to; a missing table is made. LookupError names what is not there."""
    if not parts:
        raise LookupError("such key")
    part, *rest = parts
    places: Sequence[str | int] = [part]
    if part == "*":
        fits = isinstance(holder, list)
        places = range(len(holder)) if fits else ()
    elif isinstance(part, int):
        fits = isinstance(holder, list) and 0 <= part < len(holder)
    else:
        fits = isinstance(holder, dict)
    if not fits:
        raise LookupError("items there" if part == "*" else f"{_in_words(part)} there")
    for place in places:
        if not rest:
            holder[place] = value
            continue
        if isinstance(holder, dict):
            holder.setdefault(place, {})
        _set(holder[place], rest, value)


def _in_words(part: str | int) -> str:
    return part if isinstance(part, str) else f"item {part + 1}"


def _label(values: Mapping[str, Value]) -> str:
    """A name from the values: the last part of each key, or the whole key where two end in the same part."""
    last = {key: key.rpartition(".")[2] for key in values}
    plain = len(set(last.values())) == len(last)
    words = [f"{last[key] if plain else key}-{_shown(value)}" for key, value in values.items()]
    return re.sub(r"[^A-Za-z0-9._-]", "", "-".join(words))


def _shown(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
