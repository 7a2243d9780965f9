"""What the columns of a rig's file are, guessed from their names and, in any language, from their units."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.cells import ANY, Marks, number
from twindisc_cli.measurement.channels import RATIOS, SLIP
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.header import Column, Named, Naming, clock, parts, plain
from twindisc_cli.measurement.log import read_log
from twindisc_cli.measurement.sheet import Sheet, sheets
from twindisc_cli.measurement.suggest import Cell, block, line, looks_like, what_else
from twindisc_cli.measurement.table import read_table
from twindisc_cli.measurement.units import (
    COUNT,
    FORCE,
    LENGTH,
    MASS,
    NUMBER,
    PERCENTAGE,
    RATIO,
    SPEED,
    TEMPERATURE,
    TIME,
    TORQUE,
    Quantity,
    rim_speed,
)
from twindisc_cli.measurement.vendors import vendor_of
from twindisc_cli.measurement.weighings import ALSO, WEIGHTS, WHEN
from twindisc_cli.model.experiment import Disc, Rig

Kind = Literal["log", "traction", "profile", "temperature", "mass"]
TURNING = Quantity("speed of rotation", {u: f for u, f in rim_speed(1.0).units.items() if u not in SPEED.units})
_NAMES: Mapping[str, tuple[str, ...]] = {
    "time": (
        "time", "t", "elapsed time", "test time", "step time", "x value", "timestamp", "time stamp", "date/time",
        "datetime", "date time", "elapsed", "zeit", "uhrzeit", "zeitstempel", "temps", "tiempo", "tempo",
    ),
    "step": ("step", "sweep", "stufe", "this step", "step number", "step no"),
    "creepage": ("creepage", *SLIP, "schlupf", "glissement"),
    "traction ratio": (
        "traction ratio", *RATIOS, "µ", "traction coeff", "friction coeff", "friction", "reibwert", "reibungszahl",
        "reibzahl", "coefficient of friction", "coefficient de frottement",
    ),
    "traction force": ("traction force", "friction force", "tangential force", "ft", "fx", "reibkraft"),
    "normal load": (
        "normal load", "load", "normal force", "fn", "fz", "normalkraft", "last", "ball load", "applied load",
        "contact load", "charge", "force normale", "anpresskraft",
    ),
    "torque": ("torque", "friction torque", "drehmoment", "reibmoment", "moment", "couple", "tz", "md", "mr", "m r"),
    "speed 1": ("speed 1", "n1", "n 1", "drehzahl 1", "speed upper", "upper speed", "speed top", "drehzahl oben"),
    "speed 2": ("speed 2", "n2", "n 2", "drehzahl 2", "speed lower", "lower speed", "speed bottom", "drehzahl unten"),
    "rolling speed": ("rolling speed", "entrainment speed", "mean speed", "rolling"),
    "sliding speed": ("sliding speed", "sliding velocity", "gleitgeschwindigkeit"),
    "iteration": ("iteration",),
    "cycles": ("cycles", "cycle", "zyklen"),
    "revolutions": ("revolutions", "revs", "umdrehungen", "drehungen", "tours"),
    "distance": ("distance", "rolling distance", "weg", "rollweg"),
    "sliding distance": ("sliding distance", "gleitweg"),
    "disc": ("disc", "disk", "scheibe"),
    "x": ("x", "lateral", "position", "lateral position", "scan position", "x position", "scan length"),
    "y": ("y", "y1"),
    "height": ("height", "z", "raw", "z1", "profile height", "höhe"),
    "mass loss": ("mass loss", *ALSO["mass loss"], "masseverlust", "gewichtsverlust"),
    "mass 1": ("mass 1", *ALSO["mass 1"], "gewicht scheibe 1", "masse scheibe 1", "gewicht 1", "masse 1"),
    "mass 2": ("mass 2", *ALSO["mass 2"], "gewicht scheibe 2", "masse scheibe 2", "gewicht 2", "masse 2"),
    "mass": ("mass", *ALSO["mass"], "masse", "gewicht"),
    "uncertainty": ("uncertainty", "std", "standard deviation", "unsicherheit"),
    "temperature": (
        "temperature", "temperatur", "température", "temperatura", "temp", "temp.", "disc temperature",
        "thermocouple", "thermoelement", "thermocouple 1", "tc", "tc 1", "tc1", "disc temp",
    ),
}  # fmt: skip
_KEYS = {name: key for key, group in _NAMES.items() for name in group}
_QUANTITY: Mapping[str, Quantity] = {
    "time": TIME, "step": COUNT, "creepage": PERCENTAGE, "traction ratio": RATIO, "traction force": FORCE,
    "normal load": FORCE, "torque": TORQUE, "speed 1": rim_speed(1.0), "speed 2": rim_speed(1.0),
    "rolling speed": SPEED, "sliding speed": SPEED, "iteration": COUNT, "cycles": NUMBER, "revolutions": NUMBER,
    "distance": LENGTH, "sliding distance": LENGTH, "mass": MASS, "uncertainty": MASS,
    "disc": COUNT, "x": LENGTH, "y": LENGTH, "height": LENGTH, "mass loss": MASS, "mass 1": MASS,
    "mass 2": MASS, "temperature": TEMPERATURE,
}  # fmt: skip
_BY_UNIT: tuple[tuple[Quantity, tuple[str, ...]], ...] = (
    (TORQUE, ("torque",)),
    (TURNING, ("speed 1", "speed 2")),
    (FORCE, ("normal load", "traction force")),
    (TIME, ("time",)),
    (TEMPERATURE, ("temperature",)),
    (SPEED, ("rolling speed",)),
    (LENGTH, ("y", "height")),
    (MASS, ("mass loss",)),
)
_CLOCKS = frozenset(("seconds", "minutes", "hours"))  # a time that is called by its unit
_OTHER_PLACES = re.compile(
    r"\b(pot|lube|lubricant|bath|bad|ambient|room|air|environment|oil|bearing|raum|umgebung|luft|öl|lager|ambiante|huile|air)",
    re.IGNORECASE,
)
"""Temperatures with such a word are not the disc's."""
_FEWEST = 2  # a column alone is no table
_PIECES, _PIECE = 16, 1 << 18  # of a large file, and the bytes of each, from which load and speed are guessed
_CARRYING = 0.1  # of the largest load: below it the discs are apart
_RADIUS = 0.0235  # [m] of the paper's discs, named as a guess


_SAMPLE = 60  # rows that show what a column is
_WEIGHED = ("mass loss", *WEIGHTS, "mass")
_SIGNALS = frozenset(("torque", "traction ratio", "traction force"))
_MISTAKABLE: Mapping[Kind, tuple[str, ...]] = {
    "log": ("normal load", "torque", "time", "speed 1", "speed 2", "temperature"), "profile": ("y", "height"),
}  # fmt: skip
"""What a column looks like that is said where it is not read, by what the file is."""


@dataclass(frozen=True)
class Guess:
    """What a file is, and its columns by what they are: as they are named in it, with a unit where it must be said.

    by_unit: those known by their unit only; has_turning: whether the discs' speeds are given as rotation; sheet: the
    part of the file, where it has several; unused: what is not read, and looks as if it should be.
    """

    kind: Kind
    columns: Mapping[str, Named]
    by_unit: frozenset[str]
    has_turning: bool
    sheet: str | None = None
    unused: Sequence[str] = field(default=())


def guess(content: Content, file: str, declared: Naming | None = None) -> Guess:
    """Look for a header that shows what the file is; MeasurementError where there is none, or several.

    declared: what is said of columns beforehand.
    """
    vendor = vendor_of(content, file)
    best, result = _Reading([], {}, set()), dict[str, _Reading]()
    for sheet in sheets(content, file):
        reading = _read(sheet, declared or {}, vendor.columns if vendor else {})
        if len(reading.columns) > len(best.columns) or (not best.columns and len(reading.cells) > len(best.cells)):
            best = reading
        if _kind(reading.columns) is not None and sheet.part not in result:
            result[sheet.part] = reading
            if not sheet.part:
                break
    if not result:
        raise MeasurementError(_none_of_ours(best, file))
    if len(result) > 1:
        one, other = list(result)[:2]
        named = [json.dumps(part, ensure_ascii=False) for part in (one, other)]
        what = f"has several parts that fit, {one} and {other}; say which. {_HOW}"
        raise MeasurementError(Problem(what, file, block=(f"sheet = {named[0]}  # or {named[1]}",)))
    ((part, reading),) = result.items()
    return _guess(reading, part if content.sheet is None else content.sheet, file)


@dataclass(frozen=True)
class _Reading:
    """The cells of a header, its columns by what they are, and those known by their unit."""

    cells: Sequence[Cell]
    columns: Mapping[str, Named]
    by_unit: set[str]


def _read(sheet: Sheet, declared: Naming, of_vendor: Naming) -> _Reading:
    cells = list(_cells(sheet))
    if len(cells) < _FEWEST:
        return _Reading(cells, {}, set())
    columns, by_unit = _columns(cells, declared, of_vendor)
    stamps = next((cell.name for cell in cells if "time" not in columns and _are_stamps(sheet, cell.place)), None)
    columns |= {"time": Named(stamps)} if stamps else {}
    return _Reading(cells, _profile(columns, cells, sheet), by_unit)


def _guess(reading: _Reading, part: str, file: str) -> Guess:
    """What a file is whose header is understood; MeasurementError where a load stands in it that is not."""
    kind = _kind(reading.columns)
    assert kind is not None  # was looked for
    own = {name: reading.columns[name] for name in needed(kind, reading.columns)}
    units = {cell.name: cell.unit for cell in reading.cells}
    speeds = (own[name] for name in ("speed 1", "rolling speed") if name in own)
    turning = any(TURNING.knows(named.unit or units.get(str(named.column)) or "") for named in speeds)
    others = what_else(reading.cells, (str(named.column) for named in own.values()))
    loads = others.get("normal load", [])
    if kind == "log" and "normal load" not in own and loads:
        cell = next(cell for cell in reading.cells if cell.name == loads[0])
        what = f"{loads[0]} looks like a load; without one, rows without load would count. {_HOW}"
        ignored = f"# or, where it is none: ignore = {json.dumps(loads, ensure_ascii=False)}"
        raise MeasurementError(Problem(what, file, block=(line("normal load", cell), ignored)))
    same_kind = [name for key in _MISTAKABLE.get(kind, ()) for name in others.get(key, [])]
    return Guess(
        kind,
        own,
        frozenset(reading.by_unit & set(own)),
        turning,
        part or None,
        list(dict.fromkeys(same_kind)),
    )


_HOW = "Put this into a file such as block.toml, check it, and name it after the measured file:"


def _none_of_ours(best: _Reading, file: str) -> Problem:
    """What is said of a file that is not understood, with lines that would name its columns where they are there."""
    understood = ", ".join(best.columns) or "nothing"
    lines = block(best.cells, {key: str(named.column) for key, named in best.columns.items()})
    what = (
        "is not a log (time, speeds or creepage, torque or traction), curve, profile, temperature or mass "
        f"by its header; understood: {understood}."
    )
    driven = any(key in text for text in lines for key in ("columns.speed", "columns.creepage"))
    if "time" in best.columns and _SIGNALS & set(best.columns) and not driven:
        return Problem(
            f"{what} No column says how the discs move: a log needs two speeds, a creepage or a sliding speed", file
        )
    if lines:
        return Problem(f"{what} {_HOW}", file, block=tuple(lines))
    held = ", ".join(cell.written or cell.name for cell in best.cells[:12])
    return Problem(f"{what} It holds {held or 'no table'}: nothing that a twin-disc test is read from", file)


def typical(content: Content, file: str, result: Guess) -> tuple[float, float, float]:
    """Median load [N] and rolling speed [m/s] under load, NaN where not recorded; the radius [m] that was assumed."""
    if result.kind != "log":
        return np.nan, np.nan, _RADIUS
    steel = {"youngs_modulus": 2e11, "poisson_ratio": 0.3, "hardness": 7e9}
    disc = Disc(_RADIUS, _RADIUS, **steel)
    rig = Rig(disc, disc, normal_load=np.nan, rolling_speed=1.0)
    try:
        log = read_log(_thinned(content), file, rig=rig, torque_disc=2, naming=result.columns)
    except MeasurementError:  # said of the whole file, with its own lines
        log = read_log(content, file, rig=rig, torque_disc=2, naming=result.columns)
    if log.has_load and not np.any(log.load):
        raise MeasurementError(Problem("is 0 in every row: no step of a test is loaded", file, key="normal load"))
    carrying = np.abs(log.load) > _CARRYING * np.max(np.abs(log.load)) if log.has_load else np.ones(len(log.time), bool)
    return float(np.median(np.abs(log.load[carrying]))), float(np.median(np.abs(log.speed[carrying]))), _RADIUS


def _thinned(content: Content) -> Content:
    """Pieces of a large text from its beginning to its end, of whole lines: enough for a median."""
    data, apart = content.data, len(content.data) // _PIECES
    if apart <= 2 * _PIECE or b"\0" in data[:_PIECE] or data.startswith(b"\x1f\x8b"):
        return content
    begins = [0, *(data.find(b"\n", n * apart) + 1 for n in range(1, _PIECES))]
    ends = [data.find(b"\n", begin + _PIECE) + 1 for begin in begins]
    if not all(begins[1:]) or not all(ends):
        return content
    return replace(content, data=b"".join(data[begin:end] for begin, end in zip(begins, ends, strict=True)))


def first_temperature(content: Content, file: str, columns: Mapping[str, Named]) -> float:
    """The first temperature [K] of a file: of a disc that has not run yet."""
    table = read_table(content, file, (Column("temperature", TEMPERATURE),), columns, gaps=True)
    return float(table.columns["temperature"][0]) if len(table) else np.nan


def spanned(content: Content, file: str, result: Guess) -> float:
    """How wide a profile is [m]."""
    y = read_table(content, file, (Column("y", LENGTH),), result.columns, gaps=True).columns["y"]
    return float(np.ptp(y)) if len(y) else 0.0


def last_digit(content: Content, file: str, columns: Mapping[str, Named]) -> float:
    """The place of the last digit of the masses [kg] in a file."""
    table = read_table(content, file, [Column(name, MASS) for name in _WEIGHED if name in columns], columns)
    digits = []
    for name, (factor, _) in table.scales.items():
        written = np.abs(table.written(name))
        whole = [np.allclose(written * 10.0**d, np.round(written * 10.0**d), rtol=0.0, atol=1e-4) for d in range(9)]
        digits.append(abs(factor) * 10.0 ** -(whole.index(True) if any(whole) else 9))
    return min(digits)


def _cells(sheet: Sheet) -> Iterator[Cell]:
    """Name and unit of each cell of a header that may be one, and the unit that must be said; none of a row of numbers.

    A unit stands in the cell, in the row below, or at the end of the name. A column without a name goes by its place,
    one without any numbers is left out.
    """
    sample = [row for _, row in sheet.top(_SAMPLE)]
    below = sample[0] if sample else []
    for n, cell in enumerate(sheet.header):
        held = [row[n].strip() for row in sample if n < len(row)]
        if held and not any(_is_number(text) or clock(text) is not None for text in held):
            continue
        text, unit = parts(cell)
        under = below[n].strip().strip("[]()") if n < len(below) else ""
        if _is_number(text) or clock(text) is not None:
            continue
        if not text:
            if held:
                yield Cell(f"#{n + 1}", "", unit, None, cell.strip() or f"#{n + 1}", n + 1)
            continue
        tail = _unit_in(text) if unit is None else None
        if unit is None and plain(text) in _CLOCKS:
            tail = ("time", plain(text))
        if tail:
            yield Cell(cell.strip(), tail[0], tail[1], tail[1], cell.strip(), n + 1)
        else:
            under = "" if _is_number(under) or clock(under) is not None or len(under) > 12 else under
            name, unit = (text, unit) if unit is not None else (cell.strip(), under or None)
            yield Cell(_apart(sheet.header, n) or name, text, unit, None, cell.strip(), n + 1)


def _apart(header: Sequence[str], place: int) -> str:
    """What names a column beside one that is called the same but for small and capital letters; else empty."""
    text, same = parts(header[place])[0], [cell for cell in header if plain(cell) == plain(header[place])]
    if not any(plain(other) == plain(text) and other != text for other in (parts(cell)[0] for cell in header)):
        return ""
    return header[place].strip() if len(same) == 1 else f"#{place + 1}"


def _unit_in(text: str) -> tuple[str, str] | None:
    """Name and unit of `slip_percent`, `x in um`, `Lateral um`."""
    words = re.split(r"_|\s+in\s+|\s+", text)
    for count in (1, 2):
        stem, unit = " ".join(words[:-count]), "/".join(words[-count:])
        key = _KEYS.get(plain(stem)) or _KEYS.get(plain(words[0]))
        if stem and key and _QUANTITY[key].knows(unit):
            return stem, unit
    return None


def _columns(cells: Sequence[Cell], declared: Naming, of_vendor: Naming) -> tuple[dict[str, Named], set[str]]:
    """The columns of a header by what they are, and those known by their unit.

    First those that are declared, then those of the maker, then those that are called so, then those whose name begins
    so, then those of a unit.
    """
    there = {plain(name) for cell in cells for name in (cell.name, cell.text, f"#{cell.place}")}
    results = {key: named for key, named in declared.items() if named.column and plain(named.column) in there}
    results |= {key: n for key, n in of_vendor.items() if key not in results and _is_there(str(n.column), cells, there)}
    taken = {plain(str(named.column)) for named in results.values()}
    by_unit: set[str] = set()
    rest = []
    for cell in (cell for cell in cells if not {plain(cell.name), plain(cell.text), f"#{cell.place}"} & taken):
        key = _KEYS.get(plain(cell.text)) or (_KEYS.get(plain(cell.text.split(" ")[0])) if cell.unit_to_give else None)
        if key and len(cell.text) == 1 and cell.unit and not _QUANTITY[key].knows(cell.unit):
            key = None  # T [°C] is no time
        if key and key not in results:
            results[key] = Named(cell.name, cell.unit_to_give)
        else:
            rest.append(cell)
    for cell in rest:
        key = _begun(plain(cell.text))
        if key and key not in results and (not cell.unit or _QUANTITY[key].knows(cell.unit)):
            results[key] = Named(cell.name, cell.unit_to_give)
    names = {named.column for named in results.values()}
    for cell in rest:
        if cell.name in names or (_OTHER_PLACES.search(cell.text) and cell.unit and TEMPERATURE.knows(cell.unit)):
            continue
        kinds = (k for quantity, keys in _BY_UNIT if cell.unit and quantity.knows(cell.unit) for k in keys)
        kinds = (k for k in kinds if k != "mass loss" or looks_like(cell.text, None) == "mass loss")
        key = next((k for k in kinds if k not in results), None)
        if key and not (key == "traction force" and {"torque", "traction ratio"} & set(results)):
            results[key] = Named(cell.name, cell.unit_to_give)
            by_unit.add(key)
    for key, named in declared.items():
        if named.column is None and key in results:
            results[key] = replace(results[key], unit=named.unit or results[key].unit, sign=named.sign)
    return results, by_unit


def _is_there(name: str, cells: Sequence[Cell], there: set[str]) -> bool:
    """Whether a maker's column stands in a header; one by its place where no column has a name."""
    if name.startswith("#"):
        return all(cell.name.startswith("#") for cell in cells) and name in {cell.name for cell in cells}
    return plain(name) in there or plain(parts(name)[0]) in there


def _profile(results: dict[str, Named], cells: Sequence[Cell], sheet: Sheet) -> dict[str, Named]:
    """Columns x and y or x and z are place and height; a height without a unit has that of the place.

    Of x and y beside a height, the place is the one that changes.
    """
    if {"x", "y", "height"} <= set(results):
        places = {cell.name: cell.place for cell in cells}
        held = {key: _held(sheet, places.get(str(results[key].column), 0)) for key in ("x", "y")}
        results = {**results, "y": results["x" if len(held["y"]) == 1 < len(held["x"]) else "y"]}
    elif "x" in results and ("height" in results) != ("y" in results):
        results = {**results, "height": results.get("height") or results["y"], "y": results["x"]}
        units = {cell.name: cell.unit for cell in cells}
        height = results["height"]
        if height.unit is None and units.get(str(height.column)) is None:
            results["height"] = Named(height.column, units.get(str(results["x"].column)))
    results.pop("x", None)
    return results


def _are_stamps(sheet: Sheet, place: int) -> bool:
    """Whether a column holds time stamps, whatever it is called."""
    held = _held(sheet, place) - {""}
    return bool(held) and all(clock(text) is not None for text in held)


def _held(sheet: Sheet, place: int) -> set[str]:
    """The different cells of a column in the first rows."""
    return {row[place - 1] for _, row in sheet.top(_SAMPLE) if 0 < place <= len(row)}


def _begun(name: str) -> str | None:
    """What a name with a further word behind it is: `t over n derived`, `temp. scheibe`; no single letter counts."""
    several = (k for k in _KEYS if len(k) > 1 and _KEYS[k] != "disc")
    known = (k for k in sorted(several, key=len, reverse=True) if name.startswith(f"{k} "))
    key = _KEYS.get(next(known, ""))
    return None if key == "temperature" and _OTHER_PLACES.search(name) else key


def _is_number(text: str) -> bool:
    return any(np.isfinite(number(text, marks)) for marks in (ANY, Marks(".", ","), Marks(",", ".")))


def _kind(columns: Mapping[str, Named]) -> Kind | None:
    """What a file with these columns is."""
    has = set(columns)
    traction = bool(has & _SIGNALS)
    if "time" in has and traction and ({"speed 1", "speed 2"} <= has or has & {"creepage", "sliding speed"}):
        return "log"
    if {"creepage", "traction ratio"} <= has:
        return "traction"
    if {"y", "height"} <= has:
        return "profile"
    if has & set(_WEIGHED) and has & set(WHEN):
        return "mass"
    return "temperature" if {"time", "temperature"} <= has else None


def needed(kind: Kind, columns: Mapping[str, Named]) -> Iterator[str]:
    """The columns of a file that are read of it, as one of its kind."""
    motion: tuple[str, ...] = (
        ("speed 1", "speed 2") if {"speed 1", "speed 2"} <= set(columns) else ("creepage", "rolling speed")
    )
    motion = motion if set(motion) & set(columns) - {"rolling speed"} else ("sliding speed",)
    signal = next((name for name in ("torque", "traction ratio", "traction force") if name in columns), "torque")
    of: dict[Kind, tuple[str, ...]] = {
        "traction": ("creepage", "traction ratio", "step"),
        "profile": ("y", "height", "disc", "iteration"),
        "temperature": ("time", "temperature"),
        "mass": (*[name for name in WHEN if name in columns][:1], *_WEIGHED, "disc", "uncertainty"),
        "log": ("time", "step", *motion, signal, "normal load", "temperature"),
    }
    return (name for name in of[kind] if name in columns)
