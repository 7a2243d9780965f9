"""What the columns of a rig's file are, guessed from their names and, in any language, from their units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.channels import RATIOS, SLIP
from twindisc_cli.measurement.header import clock, parts, plain
from twindisc_cli.measurement.sheet import Sheet, sheets
from twindisc_cli.measurement.units import FORCE, LENGTH, MASS, SPEED, TEMPERATURE, TIME, TORQUE, Quantity, rim_speed

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
    "temperature": ("temperature", "temperatur", "température"),
}
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
_FEWEST = 2


@dataclass(frozen=True)
class Guess:
    """What a file is, and its columns: the name in the file by the name here; by_unit: those that only a unit tells."""

    kind: Kind
    columns: Mapping[str, str]
    by_unit: frozenset[str] = frozenset()
    has_turning: bool = False


def guess(data: bytes, file: str) -> Guess:
    """Look for a header that tells what the file is; MeasurementError where there is none."""
    best: tuple[dict[str, str], set[str], bool] | None = None
    for sheet in sheets(data, file):
        found = _columns(sheet)
        if best is None or len(found[0]) > len(best[0]):
            best = found
        if (kind := _kind(found[0])) is not None:
            return Guess(kind, found[0], frozenset(found[1]), found[2])
    seen = ", ".join(best[0]) if best and best[0] else "nothing"
    what = (
        "is no log (time, speeds or creepage, torque or traction), curve, profile, temperature or mass that can be "
        f"told from its header; understood: {seen}. Name its columns under [measured.columns] of a definition"
    )
    raise MeasurementError(Problem(what, file))


def _columns(sheet: Sheet) -> tuple[dict[str, str], set[str], bool]:
    """The columns of a header by what they are, those told by their unit, and whether speeds are of rotation."""
    _, below = sheet.first()
    cells = [(cell.strip(), *_named(cell, below[n] if n < len(below) else "")) for n, cell in enumerate(sheet.header)]
    if sum(bool(text) for _, text, _ in cells) < _FEWEST or all(_is_number(text) for _, text, _ in cells if text):
        return {}, set(), False
    found: dict[str, str] = {}
    names = {name: key for key, group in _NAMES.items() for name in group}
    taken = set()
    for n, (_, text, _) in enumerate(cells):
        key = names.get(plain(text)) or names.get(plain(text.partition("_")[0]) if "_" in text else "")
        if key and key not in found:
            found[key] = text
            taken.add(n)
    by_unit = set()
    for n, (_, text, unit) in enumerate(cells):
        if n in taken or not unit or not text:
            continue
        key = next((k for quantity, keys in _BY_UNIT if _knows(quantity, unit) for k in keys if k not in found), None)
        if key:
            found[key] = text
            by_unit.add(key)
    turning = any(_knows(TURNING, unit) for _, text, unit in cells if text == found.get("speed 1"))
    return found, by_unit, turning


def _named(cell: str, below: str) -> tuple[str, str]:
    """Name and unit of a header cell; the unit may stand in the row below."""
    text, unit = parts(cell)
    under = below.strip().strip("[]()")
    return text, unit if unit is not None else "" if _is_number(under) or clock(under) is not None else under


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


def _kind(columns: Mapping[str, str]) -> Kind | None:
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


def needed(kind: Kind, columns: Mapping[str, str]) -> Iterator[str]:
    """The columns of a file that are read of it, as one of its kind."""
    of: dict[Kind, Sequence[str]] = {
        "traction": ("creepage", "traction ratio", "step"),
        "profile": ("y", "height", "disc", "iteration"),
        "temperature": ("time", "temperature"),
        "mass": ("iteration", "mass loss", "disc"),
        "log": ("time", "step", "speed 1", "speed 2", "creepage", "rolling speed", "torque", "traction ratio",
                "traction force", "normal load"),
    }  # fmt: skip
    return (name for name in of[kind] if name in columns)
