"""Results of several tests side by side: what they share as curves, and in what their definitions differ.

A result is read from its HDF5 file alone. Every quantity has one table, a row for each point of each test, from which
its figure and its CSV, Excel and Parquet files are made.
"""

from __future__ import annotations

import io
import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from twindisc_cli.campaign.table import Table
from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.quantities import UNITS, Floats, for_reading, split_key
from twindisc_cli.results.recorded import Recorded, recorded
from twindisc_cli.time_axes import TIME_AXES

COMMANDS = ("identify-mu", "simulate-wear", "fit-k", "thermal", "close-loop")
UNSAID = ("test", "measured", "reported", "loop")
"""Tables of a definition that no legend names: what a test is called, and where its data lie."""
MOST_LISTED = 3
"""Keys that a legend names of a test."""
UNKNOWN = "–"
"""What stands for a key that a test does not have."""
_STEPS = "history.steps"


@dataclass(frozen=True)
class Shown:
    """The results of one test: its definition, and by command its JSON and its arrays.

    turned: ends of iterations and pauses [s], and the revolutions until then, each (iteration,). number: which of the
    tests it is, from 1.
    """

    name: str
    definition: Mapping[str, Any]
    json: Mapping[str, Mapping[str, Any]]
    arrays: Mapping[str, Mapping[str, Floats]]
    provenance: str
    turned: tuple[Floats, Floats]
    number: int


@dataclass(frozen=True)
class Series:
    """One test in one figure: points or a curve (n,), in the units of the headers; NaN where no interval is known."""

    test: str
    x: Floats
    y: Floats
    low: Floats
    high: Floats
    is_line: bool


@dataclass(frozen=True)
class Quantity:
    """One figure: what it shows, headers `name [unit]` of its axes, whether x is logarithmic, a series a test."""

    name: str
    title: str
    x: str
    y: str
    series: tuple[Series, ...]
    logarithmic: bool = False


def read(paths: Sequence[Path]) -> list[Shown]:
    """The results that paths name: folders of a test, or result files of it."""
    results: dict[Path, dict[str, Recorded]] = {}
    problems = []
    for path in paths:
        files = [path] if path.suffix == ".h5" else [path / f"{command}.h5" for command in COMMANDS]
        whole = {file: recorded(file) for file in files}
        for file, what in whole.items():
            if isinstance(what, Recorded) and file.stem in COMMANDS:
                results.setdefault(file.parent.resolve(), {})[file.stem] = what
        if not any(isinstance(what, Recorded) for what in whole.values()):
            problems.append(_missing(path, whole))
    if problems:
        raise DefinitionError(problems)
    tests = [_shown(n, folder, of_commands) for n, (folder, of_commands) in enumerate(results.items(), start=1)]
    if len({test.name for test in tests}) < len(tests):
        above = os.path.commonpath([folder.parent for folder in results])
        tests = [
            replace(test, name=folder.relative_to(above).as_posix())
            for test, folder in zip(tests, results, strict=True)
        ]
    return tests


def _missing(path: Path, whole: Mapping[Path, Recorded | str]) -> Problem:
    if not path.exists():
        return Problem("no such result; name a folder of results (results/my_test) or an .h5 file", path)
    if path.suffix == ".h5":
        return Problem(f"{next(iter(whole.values()))}; run its command again", path)
    return Problem(f"holds no result that can be compared; {', '.join(COMMANDS)} write such", path)


def _shown(number: int, folder: Path, results: Mapping[str, Recorded]) -> Shown:
    import h5py

    arrays: dict[str, dict[str, Floats]] = {}
    provenance, turned = "", (np.empty(0), np.empty(0))
    for command in results:
        with h5py.File(str(folder / f"{command}.h5")) as file:
            provenance = str(file.attrs.get("provenance", ""))
            if "config/end_time" not in file:
                raise DefinitionError(Problem("is of an older version; run its command again", file.filename))
            turned = (np.asarray(file["config/end_time"]), np.asarray(file["config/revolutions"]))
            numbers = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset)}
            arrays[command] = {name: np.asarray(item) for name, item in numbers.items() if item.dtype.kind in "fiub"}
    config = tomllib.loads(next(iter(results.values())).configs[0])
    return Shown(
        name=str(config["test"]["name"]),
        definition=config,
        json={command: result.stored.json for command, result in results.items()},
        arrays=arrays,
        provenance=provenance,
        turned=turned,
        number=number,
    )


# ---------------------------------------------------------------------------------------------- what differs


def differing(tests: Sequence[Shown]) -> dict[str, list[str]]:
    """The keys at which the definitions differ, with the value of each test (UNKNOWN where it has none).

    Steps stand there one by one where their number and their first and last creepage are the same.
    """
    flat = [dict(_flat(test.definition, "")) for test in tests]
    keys = dict.fromkeys(key for values in flat for key in values)
    results = {key: [values.get(key, UNKNOWN) for values in flat] for key in keys}
    differ = {key: values for key, values in results.items() if len(set(values)) > 1}
    return {key: v for key, v in differ.items() if not (_STEPS in differ and key.startswith(f"{_STEPS}["))}


def labels(tests: Sequence[Shown]) -> list[str]:
    """What a legend calls each test: its name, and the keys in which it differs from the others."""
    differ = list(differing(tests).items())
    texts = [", ".join(_said(key, values[i]) for key, values in differ[:MOST_LISTED]) for i in range(len(tests))]
    return [f"{test.name}: {what}" if what else test.name for test, what in zip(tests, texts, strict=True)]


def _said(key: str, value: str) -> str:
    """What a definition says at a key: `environment temperature 20 °C`, `iterations 7 in step 11`."""
    _, *tables, last = key.split(".")
    name, unit = split_key(last)
    step = re.fullmatch(r"steps\[(\d+)\]", tables[0]) if tables else None
    words = " ".join([*(tables if step is None else ()), *name.split("_")])
    said = f"no {words}" if value == UNKNOWN else f"{words} {value} {for_reading(unit.name)}".rstrip()
    return f"{said} in step {step[1]}" if step else said


def _flat(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if not prefix and key in UNSAID:
            continue
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif f"{prefix}{key}" == _STEPS and isinstance(value, list):
            yield _STEPS, f"{len(value)} ({_digest(value)})"
            for number, step in enumerate(value, start=1):
                yield from _flat(step, f"{_STEPS}[{number}].")
        else:
            yield f"{prefix}{key}", f"{value:g}" if isinstance(value, float) else str(value)


def _digest(steps: Sequence[Any]) -> str:
    """A short sign of a history: its creepages, or how many where they are many."""
    creepages = [f"{step.get('creepage_percent', 0.0):g}" for step in steps if isinstance(step, Mapping)]
    return f"{creepages[0]} … {creepages[-1]} %" if creepages else "pauses"


# ---------------------------------------------------------------------------------------------- quantities


def quantities(tests: Sequence[Shown], over: str) -> list[Quantity]:
    """Every quantity that at least one of the results has."""
    results = []
    for name, title, x, y, make, logarithmic in _MAKERS:
        series = tuple(one for test in tests for one in make(test, over))
        if x == _OVER_TIME:
            title, x = f"{title} over {TIME_AXES[over].partition(' [')[0]}", TIME_AXES[over]
        results += [Quantity(name, title, x, y, series, logarithmic)] if series else []
    return results


def table(quantity: Quantity, tests: Sequence[Shown], texts: Sequence[str]) -> Table:
    """The table behind a figure: a row for each point of each test."""
    label = {test.name: text for test, text in zip(tests, texts, strict=True)}
    series = quantity.series
    names = np.array([s.test for s in series for _ in s.x], dtype=object)
    columns: dict[str, Any] = {
        "test": names,
        "what differs": np.array([label[name] for name in names], dtype=object),
        quantity.x: np.concatenate([s.x for s in series]),
        quantity.y: np.concatenate([s.y for s in series]),
    }
    stem, _, unit = quantity.y.rpartition(" [")
    bounds = {"low": np.concatenate([s.low for s in series]), "high": np.concatenate([s.high for s in series])}
    if any(np.isfinite(values).any() for values in bounds.values()):
        columns |= {f"{stem} {end} [{unit}": values for end, values in bounds.items()}
    return Table(columns)


def excel_bytes(tables: Mapping[str, Table]) -> bytes:
    """A workbook with a sheet for each table."""
    try:
        from openpyxl import Workbook
    except ImportError:
        what = "workbooks need the package openpyxl: pip install 'twindisc[xlsx]'"
        raise DefinitionError(Problem(what, key="--xlsx")) from None
    book = Workbook()
    book.remove(book.active)
    for name, one in tables.items():
        sheet = book.create_sheet(name.replace("_", " ")[:31])
        sheet.append(list(one.columns))
        for row in zip(*(column.tolist() for column in one.columns.values()), strict=True):
            sheet.append([None if isinstance(cell, float) and not np.isfinite(cell) else cell for cell in row])
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()


def _series(
    test: Shown, x: Any, y: Any, low: Any = np.nan, high: Any = np.nan, *, is_line: bool = False
) -> Iterator[Series]:
    """A series of the places where both coordinates are known; none where there are none."""
    across, up, below, above = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in (x, y, low, high)))
    known = np.isfinite(across) & np.isfinite(up)
    if known.any():
        below, above = (np.where(np.isfinite(v), v, np.nan) for v in (below, above))
        yield Series(test.name, across[known], up[known], below[known], above[known], is_line)


def _of(test: Shown, command: str, *names: str) -> list[Floats] | None:
    """Arrays of a command's result; None where it has not all of them."""
    arrays = test.arrays.get(command, {})
    return [arrays[name] for name in names] if all(name in arrays for name in names) else None


def _creep_curve(test: Shown, _: str) -> Iterator[Series]:
    result = _of(test, "identify-mu", "creepage", "traction_ratio", "traction_ratio_half_interval")
    if result:
        v, ratio, half = result
        yield from _series(test, 100.0 * v, ratio, ratio - half, ratio + half)


def _friction(test: Shown, _: str) -> Iterator[Series]:
    result = _of(test, "identify-mu", "creepage", "mu", "mu_low", "mu_high")
    if result:
        v, mu, low, high = result
        yield from _series(test, 100.0 * v, mu, low, high)


def _traction(test: Shown, over: str) -> Iterator[Series]:
    result = _of(test, "close-loop", "traction_at_time", "traction_at_cycles", "traction_measured")
    if result:
        time, cycles, ratio = result
        yield from _series(test, _along(test, over, time, cycles), ratio)


def _profile(test: Shown, _: str) -> Iterator[Series]:
    measured = _of(test, "fit-k", "y", "measured_height")
    simulated = _of(test, "simulate-wear", "y", "height")
    if measured:
        yield from _series(test, 1e3 * measured[0], 1e6 * measured[1], is_line=True)
    elif simulated:
        yield from _series(test, 1e3 * simulated[0], 1e6 * simulated[1][-1], is_line=True)


def _depth(test: Shown, over: str) -> Iterator[Series]:
    result = _of(test, "simulate-wear", "time", "depth")
    if result:
        time, depth = result
        yield from _series(test, _along(test, over, time, _cycles(test, time)), 1e6 * depth, is_line=True)


def _wear(test: Shown, _: str) -> Iterator[Series]:
    weighed = test.json.get("fit-k", {}).get("wear_rates") or []
    if weighed:
        pairs = [(row["Tgamma_over_A_N_mm2"], row["wear_rate_ug_m_mm2"]) for row in weighed]
        yield from _series(test, *np.array(pairs, dtype=float).T)


def _volume(test: Shown, _: str) -> Iterator[Series]:
    weighed = _of(test, "fit-k", "energy", "weighed_volume", "weighed_volume_error")
    simulated = _of(test, "simulate-wear", "energy", "volume")
    if weighed:
        energy, volume, error = weighed
        half = NINETY * error
        yield from _series(test, 1e-3 * energy, 1e9 * volume, 1e9 * (volume - half), 1e9 * (volume + half))
    elif simulated:
        yield from _series(test, 1e-3 * simulated[0], 1e9 * simulated[1], is_line=True)


def _temperature(test: Shown, over: str) -> Iterator[Series]:
    result = _of(test, "thermal", "time", "temperature")
    if result:
        time, kelvin = result
        along = _along(test, over, time, _cycles(test, time))
        yield from _series(test, along, UNITS["degC"].of_si(kelvin), is_line=True)


def _parameter(key: str, command: str, test: Shown, _: str) -> Iterator[Series]:
    """A base parameter with its interval, from close-loop where it was run, else from its own command."""
    results = test.json.get("close-loop", {}).get("base", {}).get(key)
    if not results:
        own = test.json.get(command, {})
        results = {"value": own.get(key), "low": own.get(f"{key}_low"), "high": own.get(f"{key}_high")}
    numbers = [np.nan if results.get(part) is None else results[part] for part in ("value", "low", "high")]
    yield from _series(test, test.number, *numbers)


def _along(test: Shown, over: str, time: Floats, cycles: Floats) -> Floats:
    """Samples (n,) at times [s] and revolutions, as the axis shows them."""
    if over in UNITS:
        return UNITS[over].of_si(time)
    return cycles if over == "cycles" else cycles * _circumference(test) * 1e-3


def _circumference(test: Shown) -> float:
    """Of the mean disc [m]; of a plate, the other's."""
    radii = [float(test.definition["rig"][disc]["rolling_radius_mm"]) for disc in ("disc1", "disc2")]
    return 2e-3 * np.pi * float(np.mean([radius for radius in radii if np.isfinite(radius)]))


def _cycles(test: Shown, time: Floats) -> Floats:
    """Revolutions at times (n,), with those that a pause or an idle run does not count."""
    ends, revolutions = test.turned
    return np.asarray(np.interp(time, np.append(0.0, ends), np.append(0.0, revolutions)))


_OVER_TIME, _OVER_TESTS = "", "test [1]"
_MAKERS: tuple[tuple[str, str, str, str, Callable[[Shown, str], Iterator[Series]], bool], ...] = (
    ("creep_curve", "T/N over creepage", "creepage [%]", "traction ratio [1]", _creep_curve, True),
    ("friction", "identified coefficient of friction", "creepage [%]", "coefficient of friction [1]", _friction, True),
    ("traction", "T/N", _OVER_TIME, "traction ratio [1]", _traction, False),
    ("profile", "final profile", "y [mm]", "height change [um]", _profile, False),
    ("depth", "simulated depth of the track", _OVER_TIME, "depth [um]", _depth, False),
    ("wear_rate", "weighed wear rate over the wear index", "Tgamma/A [N/mm2]", "wear rate [ug/m/mm2]", _wear, True),
    ("wear", "worn volume over dissipated energy, weighed or simulated", "dissipated energy [kJ]", "worn volume [mm3]",
     _volume, False),
    ("temperature", "disc temperature", _OVER_TIME, "temperature [degC]", _temperature, False),
    ("mu", "base coefficient of friction", _OVER_TESTS, "mu [1]", partial(_parameter, "mu", ""), False),
    ("K", "wear coefficient", _OVER_TESTS, "K [1]", partial(_parameter, "K", "fit-k"), False),
    ("hS", "convection", _OVER_TESTS, "hS [W/K]", partial(_parameter, "convection_W_K", "thermal"), False),
)  # fmt: skip
"""Name, title, headers of both axes, series of a test over a time axis, whether x is logarithmic."""


def outcome(tests: Sequence[Shown], quantities: Sequence[Quantity]) -> dict[str, Any]:
    """What --json says: the tests, where their definitions differ, and what was drawn."""
    return {
        "tests": [test.name for test in tests],
        "differs": json.loads(json.dumps(differing(tests))),
        "quantities": [{"name": q.name, "x": q.x, "y": q.y, "tests": [s.test for s in q.series]} for q in quantities],
    }
