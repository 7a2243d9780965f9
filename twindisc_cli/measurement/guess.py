"""What the columns of a rig's file are, guessed from their names and, in any language, from their units."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.channels import RATIOS, SLIP
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.header import Column, Named, clock, parts, plain
from twindisc_cli.measurement.log import read_log
from twindisc_cli.measurement.sheet import Sheet, sheets
from twindisc_cli.measurement.table import read_table
from twindisc_cli.measurement.units import (
    COUNT,
    FORCE,
    LENGTH,
    MASS,
    PERCENTAGE,
    RATIO,
    SPEED,
    TEMPERATURE,
    TIME,
    TORQUE,
    Quantity,
    rim_speed,
)
from twindisc_cli.model.experiment import Disc, Rig

Kind = Literal["log", "traction", "profile", "temperature", "mass"]
TURNING = Quantity("speed of rotation", {u: f for u, f in rim_speed(1.0).units.items() if u not in SPEED.units})
_NAMES: Mapping[str, tuple[str, ...]] = {
    "time": ("time", "t", "elapsed time", "test time", "zeit", "temps"),
    "step": ("step", "sweep", "stufe"),
    "creepage": ("creepage", *SLIP, "schlupf", "glissement"),
    "traction ratio": ("traction ratio", *RATIOS, "µ", "reibwert", "reibungszahl", "reibzahl"),
    "traction force": ("traction force", "friction force", "tangential force", "ft", "reibkraft"),
    "normal load": ("normal load", "load", "normal force", "fn", "normalkraft", "last"),
    "torque": ("torque", "friction torque", "drehmoment", "moment", "couple"),
    "speed 1": ("speed 1",),
    "speed 2": ("speed 2",),
    "rolling speed": ("rolling speed", "entrainment speed", "mean speed", "rolling"),
    "iteration": ("iteration",),
    "disc": ("disc",),
    "y": ("y",),
    "height": ("height", "z"),
    "mass loss": ("mass loss", "weight loss", "masseverlust"),
    "temperature": ("temperature", "temperatur", "température", "temp", "temp.", "disc temperature"),
}
_KEYS = {name: key for key, group in _NAMES.items() for name in group}
_QUANTITY: Mapping[str, Quantity] = {
    "time": TIME, "step": COUNT, "creepage": PERCENTAGE, "traction ratio": RATIO, "traction force": FORCE,
    "normal load": FORCE, "torque": TORQUE, "speed 1": rim_speed(1.0), "speed 2": rim_speed(1.0),
    "rolling speed": SPEED, "iteration": COUNT, "disc": COUNT, "y": LENGTH, "height": LENGTH, "mass loss": MASS,
    "temperature": TEMPERATURE,
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
_OTHER_PLACES = re.compile(
    r"\b(ambient|room|air|environment|oil|bearing|raum|umgebung|luft|öl|lager|ambiante|huile|air)", re.IGNORECASE
)
"""Temperatures with such a word are not the disc's."""
_FEWEST = 2
_CARRYING = 0.1
_RADIUS = 0.0235


@dataclass(frozen=True)
class Guess:
    """What a file is, and its columns by what they are: as they are named in it, with a unit where it must be said.

    by_unit: those that only their unit tells; has_turning: whether the discs' speeds are given as rotation.
    """

    kind: Kind
    columns: Mapping[str, Named]
    by_unit: frozenset[str]
    has_turning: bool


def guess(data: bytes, file: str) -> Guess:
    """Look for a header that tells what the file is; MeasurementError where there is none."""
    best: Mapping[str, Named] = {}
    for sheet in sheets(Content(data), file):
        cells = list(_cells(sheet))
        if len(cells) < _FEWEST:
            continue
        columns, by_unit = _columns(cells)
        best = columns if len(columns) > len(best) else best
        if (kind := _kind(columns)) is not None:
            own = {name: columns[name] for name in needed(kind, columns)}
            turning = any(text == own["speed 1"].column and _knows(TURNING, unit) for text, unit, _ in cells
                          if "speed 1" in own)  # fmt: skip
            return Guess(kind, own, frozenset(by_unit), turning)
    what = (
        "is no log (time, speeds or creepage, torque or traction), curve, profile, temperature or mass that its header "
        f"tells; understood: {', '.join(best) or 'nothing'}. Write a definition (twindisc init) and name its columns "
        "there under [measured.columns]"
    )
    raise MeasurementError(Problem(what, file))


def typical(data: bytes, file: str, found: Guess) -> tuple[float, float, float]:
    """Median load [N] and rolling speed [m/s] under load, NaN where not recorded; the radius [m] that was assumed."""
    if found.kind != "log":
        return np.nan, np.nan, _RADIUS
    steel = {"youngs_modulus": 2e11, "poisson_ratio": 0.3, "hardness": 7e9}
    disc = Disc(_RADIUS, _RADIUS, **steel)
    rig = Rig(disc, disc, normal_load=np.nan, rolling_speed=1.0)
    log = read_log(data, file, rig=rig, torque_disc=2, naming=found.columns)
    carrying = np.abs(log.load) > _CARRYING * np.max(np.abs(log.load)) if log.has_load else np.ones(len(log.time), bool)
    return float(np.median(log.load[carrying])), float(np.median(np.abs(log.speed[carrying]))), _RADIUS


def first_temperature(data: bytes, file: str, columns: Mapping[str, Named]) -> float:
    """The first temperature [K] of a file: of a disc that has not run yet."""
    table = read_table(data, file, (Column("temperature", TEMPERATURE),), columns, gaps=True)
    return float(table.columns["temperature"][0]) if len(table) else np.nan


def _cells(sheet: Sheet) -> Iterator[tuple[str, str, str | None]]:
    """Name and unit of each cell of a header that may be one, and the unit that must be said; none of a row of numbers.

    A unit stands in the cell, in the row below, or at the end of the name.
    """
    _, below = sheet.first()
    for n, cell in enumerate(sheet.header):
        text, unit = parts(cell)
        under = below[n].strip().strip("[]()") if n < len(below) else ""
        if not text or _is_number(text) or clock(text) is not None:
            continue
        words = text.split("_")
        key = _KEYS.get(plain(words[0]), "")
        tails = ("/".join(words[-k:]) for k in (1, 2))
        tail = next((t for t in tails if key and _knows(_QUANTITY[key], t)), None)
        if unit is None and len(words) > 1 and tail:
            yield text, tail, tail
        else:
            yield text, unit if unit is not None else "" if _is_number(under) or clock(under) else under, None


def _columns(cells: Sequence[tuple[str, str, str | None]]) -> tuple[dict[str, Named], set[str]]:
    """The columns of a header by what they are, and those told by their unit.

    First those that are called so, then those whose name begins so, then those of a unit.
    """
    found: dict[str, Named] = {}
    by_unit: set[str] = set()
    rest = []
    for text, unit, said in cells:
        key = _KEYS.get(plain(text)) or (_KEYS.get(plain(text.split("_")[0])) if said else None)
        if key and key not in found:
            found[key] = Named(text, said)
        else:
            rest.append((text, unit))
    for text, unit in rest:
        key = _begun(plain(text))
        if key and key not in found and (not unit or _knows(_QUANTITY[key], unit)):
            found[key] = Named(text)
    taken = {named.column for named in found.values()}
    for text, unit in rest:
        if text in taken or (_OTHER_PLACES.search(text) and unit and _knows(TEMPERATURE, unit)):
            continue
        kinds = (k for quantity, keys in _BY_UNIT if unit and _knows(quantity, unit) for k in keys if k not in found)
        if key := next(kinds, None):
            found[key] = Named(text)
            by_unit.add(key)
    return found, by_unit


def _begun(name: str) -> str | None:
    """What a name with a further word behind it is: `t over n derived`, `temp. scheibe`; no single letter counts."""
    known = (k for k in sorted(_KEYS, key=len, reverse=True) if len(k) > 1 and name.startswith(f"{k} "))
    key = _KEYS.get(next(known, ""))
    return None if key == "temperature" and _OTHER_PLACES.search(name) else key


def _knows(quantity: Quantity, unit: str) -> bool:
    try:
        quantity.conversion(unit)
    except ValueError:
        return False
    return True


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _kind(columns: Mapping[str, Named]) -> Kind | None:
    """What a file with these columns is."""
    has = set(columns)
    traction = bool(has & {"torque", "traction ratio", "traction force"})
    if "time" in has and traction and ({"speed 1", "speed 2"} <= has or "creepage" in has):
        return "log"
    if {"creepage", "traction ratio"} <= has:
        return "traction"
    if {"y", "height"} <= has:
        return "profile"
    if {"iteration", "mass loss"} <= has:
        return "mass"
    return "temperature" if {"time", "temperature"} <= has else None


def needed(kind: Kind, columns: Mapping[str, Named]) -> Iterator[str]:
    """The columns of a file that are read of it, as one of its kind."""
    of: dict[Kind, Sequence[str]] = {
        "traction": ("creepage", "traction ratio", "step"),
        "profile": ("y", "height", "disc", "iteration"),
        "temperature": ("time", "temperature"),
        "mass": ("iteration", "mass loss", "disc"),
        "log": ("time", "step", "speed 1", "speed 2", "creepage", "rolling speed", "torque", "traction ratio",
                "traction force", "normal load", "temperature"),
    }  # fmt: skip
    return (name for name in of[kind] if name in columns)
