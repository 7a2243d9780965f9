"""Units of measured columns, converted to SI at the door: value_SI = value * factor + offset.

The common ones are those of `quantities`; any other is looked up in pint, which is loaded for it and knows thousands.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from typing import Any

from twindisc_cli.quantities import UNITS, unit_named


@dataclass(frozen=True)
class Quantity:
    """A kind of column: its name and its common units, each with factor and offset; `default` where none is given.

    by_pint: units of pint to which any other is converted, with the factor from there to SI.
    """

    name: str
    units: Mapping[str, tuple[float, float]]
    default: str | None = None
    by_pint: Mapping[str, float] = field(default_factory=dict)

    def conversion(self, unit: str | None) -> tuple[float, float]:
        """Return factor and offset of a unit; ValueError lists the common ones."""
        known = ", ".join(self.units) or "none"
        if not unit:
            if self.default is None:
                raise ValueError(f"has no unit; write one of [{known}] after the name")
            unit = self.default
        plain = unit if unit in self.units else _plain(unit)
        if plain in self.units:
            return self.units[plain]
        result = None if plain in _COMMON else self._looked_up(plain)
        if result is None:
            more = "" if not self.by_pint or find_spec("pint") else "; others with twindisc[rigs]"
            raise ValueError(f"unknown unit [{unit}] for {self.name}; known: {known}{more}")
        return result

    def knows(self, unit: str) -> bool:
        """Whether it is measured in this unit."""
        try:
            self.conversion(unit)
        except ValueError:
            return False
        return True

    def _looked_up(self, unit: str) -> tuple[float, float] | None:
        """Factor and offset of a unit that pint knows as one of this quantity."""
        for reference, factor in self.by_pint.items():
            line = _line(unit, reference)
            if line is not None:
                return line[0] * factor, line[1] * factor
        return None


_WORD = r"[A-Za-z°%Åμµ]+(?:\^?-?[1-4])?"
_WRITTEN = re.compile(rf"{_WORD}(?:[ */-]+{_WORD}){{0,3}}")


_TURNS = re.compile(r"rad|deg|°|rev|turn|rp")
"""Pint takes kHz for 1000 rad/s: a speed of rotation says what turns."""


@cache
def _line(unit: str, reference: str) -> tuple[float, float] | None:
    """How pint converts a unit to another, as factor and offset; None where it does not, or is not installed."""
    registry = _registry() if len(unit) <= 30 and _WRITTEN.fullmatch(unit) else None
    if registry is None or (reference == "rad/s" and not _TURNS.search(unit)):
        return None
    written = re.sub(r"(?<=[A-Za-z])[\s-]+(?=[A-Za-z])", " * ", unit)
    written = re.sub(r"\bin\b", "inch", written)
    try:
        at = [float(registry.Quantity(value, written).to(reference).magnitude) for value in (0.0, 1.0)]
    except Exception:  # what is no unit ends in errors of many kinds
        return None
    return at[1] - at[0], at[0]


@cache
def _registry() -> Any:
    """The units of pint, None where it is not installed."""
    try:
        from pint import UnitRegistry
    except ImportError:
        return None
    return UnitRegistry(autoconvert_offset_to_baseunit=True)


def _plain(unit: str) -> str:
    """The unit as the tables spell it: um for µm, degC for °C, N m for Nm and N·m."""
    text = re.sub(r"[µμ]", "u", unit.strip()).replace("°", "deg")
    text = re.sub(r"\s*[·*⋅.\s]\s*", " ", text)
    return next((plain for plain, others in _ALIASES.items() if text in others), text)


def _in(*names: str) -> dict[str, tuple[float, float]]:
    """Units as files write them, with factor and offset to SI."""
    return {UNITS[name].solidus: (UNITS[name].factor, UNITS[name].offset) for name in names}


TIME = Quantity("time", _in("s", "ms", "min", "h"), by_pint={"s": 1.0})
LENGTH = Quantity("length", _in("m", "cm", "mm", "um", "nm"), by_pint={"m": 1.0})
RATIO = Quantity("a ratio", _in("1", "%"), default="1")
PERCENTAGE = Quantity("a ratio", _in("%", "1"))
MASS = Quantity("mass", _in("mg", "ug", "g", "kg"), by_pint={"kg": 1.0})
FORCE = Quantity("force", _in("N", "kN", "mN", "kgf", "lbf"), by_pint={"N": 1.0})
TORQUE = Quantity("torque", _in("N m", "N cm", "N mm", "mN m", "kN m"), by_pint={"N*m": 1.0})
SPEED = Quantity("speed", _in("m s-1", "mm s-1", "m min-1", "km h-1"), by_pint={"m/s": 1.0})


def kind_of(name: str) -> Quantity:
    """The kind of a unit: all units of the table that have the same SI unit, this one first."""
    unit = unit_named(name)
    same_si = [other for other in UNITS.values() if other.si == unit.si and other.name != unit.name]
    units = {other.solidus: (other.factor, other.offset) for other in (unit, *same_si)}
    return Quantity(f"a quantity in {unit.solidus}", units, default="1" if name == "1" else None)


def rim_speed(radius: float) -> Quantity:
    """The speed of a disc's rim [m/s], also given by its speed of rotation where the radius [m] is finite."""
    turning = _in("rpm", "rad s-1", "Hz") if math.isfinite(radius) else {}
    turns = {unit: (factor * radius, 0.0) for unit, (factor, _) in turning.items()}
    references = {"rad/s": radius, "m/s": 1.0} if turns else SPEED.by_pint
    return Quantity("speed of a disc", {**turns, **SPEED.units}, by_pint=references)


TEMPERATURE = Quantity("temperature", _in("degC", "K", "degF"), by_pint={"K": 1.0})
NUMBER = Quantity("a number", {"1": (1.0, 0.0), "rev": (1.0, 0.0), "krev": (1e3, 0.0)}, default="1")
COUNT = Quantity("a number counted from 1", _in("1"), default="1")

_ALIASES = {
    "1": ("", "-"),
    "%": ("percent", "pct"),
    "rev": ("revs", "revolutions", "cycles", "cyc"),
    "krev": ("k", "kcycles", "x1000", "1000", "10^3", "1e3"),
    "s": ("sec", "S", "seconds"),
    "min": ("minutes",),
    "h": ("hr", "hours"),
    "N m": ("Nm",),
    "N cm": ("Ncm",),
    "N mm": ("Nmm",),
    "mN m": ("mNm",),
    "kN m": ("kNm",),
    "rpm": ("RPM", "1/min", "r/min", "rev/min", "min-1", "U/min", "tr/min", "min^-1", "U min-1", "1 / min"),
    "rad/s": ("rad s-1",),
    "m/s": ("m s-1",),
    "mm/s": ("mm s-1",),
    "Hz": ("1/s", "rev/s"),
    "degC": ("C", "deg C", "Celsius"),
    "degF": ("F", "deg F"),
    "N": ("Newton", "Newtons", "newton"),
    "um": ("microns", "micron", "micrometer", "Micrometer", "micrometre", "micrometers"),
    "mm": ("millimeter", "millimetre", "Millimeter"),
}
_COMMON = frozenset(
    unit
    for quantity in (TIME, LENGTH, RATIO, MASS, FORCE, TORQUE, SPEED, TEMPERATURE, rim_speed(1.0))
    for unit in quantity.units
)
"""Units that stand in a table: of another quantity, they are none of this one."""
