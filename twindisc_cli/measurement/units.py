"""Units of measured columns, converted to SI at the door: value_SI = value * factor + offset."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from twindisc_cli.quantities import UNITS, unit_named


@dataclass(frozen=True)
class Quantity:
    """A kind of column: its name and its units, each with factor and offset. `default` holds where no unit is given."""

    name: str
    units: Mapping[str, tuple[float, float]]
    default: str | None = None

    def conversion(self, unit: str | None) -> tuple[float, float]:
        """Return factor and offset of a unit; ValueError lists the known ones."""
        known = ", ".join(self.units) or "none"
        if unit is None:
            if self.default is None:
                raise ValueError(f"has no unit; write one of [{known}] after the name")
            unit = self.default
        plain = _plain(unit)
        if plain not in self.units:
            raise ValueError(f"unknown unit [{unit}] for {self.name}; known: {known}")
        return self.units[plain]


def _plain(unit: str) -> str:
    """The unit as the tables spell it: um for µm, degC for °C, N m for Nm and N·m."""
    text = re.sub(r"[µμ]", "u", unit.strip()).replace("°", "deg")
    text = re.sub(r"\s*[·*⋅.\s]\s*", " ", text)
    return next((plain for plain, others in _ALIASES.items() if text in others), text)


def _in(*names: str) -> dict[str, tuple[float, float]]:
    """Units as files write them, with factor and offset to SI."""
    return {UNITS[name].solidus: (UNITS[name].factor, UNITS[name].offset) for name in names}


TIME = Quantity("time", _in("s", "ms", "min", "h"))
LENGTH = Quantity("length", _in("m", "cm", "mm", "um", "nm"))
RATIO = Quantity("a ratio", _in("1", "%"), default="1")
PERCENTAGE = Quantity("a ratio", _in("%", "1"))
MASS = Quantity("mass", _in("mg", "ug", "g", "kg"))
FORCE = Quantity("force", _in("N", "kN", "mN", "kgf", "lbf"))
TORQUE = Quantity("torque", _in("N m", "N cm", "N mm", "mN m", "kN m"))
SPEED = Quantity("speed", _in("m s-1", "mm s-1", "m min-1", "km h-1"))


def kind_of(name: str) -> Quantity:
    """The kind of a unit: all units of the table that have the same SI unit, this one first."""
    unit = unit_named(name)
    alike = [other for other in UNITS.values() if other.si == unit.si and other.name != unit.name]
    units = {other.solidus: (other.factor, other.offset) for other in (unit, *alike)}
    return Quantity(f"a quantity in {unit.solidus}", units, default="1" if name == "1" else None)


def rim_speed(radius: float) -> Quantity:
    """The speed of a disc's rim [m/s], also given by its speed of rotation where the radius [m] is finite."""
    turning = _in("rpm", "rad s-1", "Hz") if math.isfinite(radius) else {}
    turns = {unit: (factor * radius, 0.0) for unit, (factor, _) in turning.items()}
    return Quantity("speed of a disc", {**turns, **SPEED.units})


TEMPERATURE = Quantity("temperature", _in("degC", "K", "degF"))
COUNT = Quantity("a number counted from 1", _in("1"), default="1")

_ALIASES = {
    "1": ("", "-"),
    "%": ("percent", "pct"),
    "s": ("sec", "S", "seconds"),
    "min": ("minutes",),
    "h": ("hr", "hours"),
    "N m": ("Nm",),
    "N cm": ("Ncm",),
    "N mm": ("Nmm",),
    "mN m": ("mNm",),
    "kN m": ("kNm",),
    "rpm": ("RPM", "1/min", "r/min", "rev/min", "min-1"),
    "rad/s": ("rad s-1",),
    "m/s": ("m s-1",),
    "mm/s": ("mm s-1",),
    "Hz": ("1/s", "rev/s"),
    "degC": ("C", "deg C", "Celsius"),
    "degF": ("F", "deg F"),
}
