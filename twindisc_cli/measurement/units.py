"""Units of measured columns, converted to SI at the door: value_SI = value * factor + offset."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass


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


def _scaled(**units: float) -> dict[str, tuple[float, float]]:
    return {name: (factor, 0.0) for name, factor in units.items()}


TIME = Quantity("time", _scaled(s=1.0, ms=1e-3, min=60.0, h=3600.0))
LENGTH = Quantity("length", _scaled(m=1.0, cm=1e-2, mm=1e-3, um=1e-6, nm=1e-9))
RATIO = Quantity("a ratio", {"1": (1.0, 0.0), "%": (1e-2, 0.0)}, default="1")
PERCENTAGE = Quantity("a ratio", {"%": (1e-2, 0.0), "1": (1.0, 0.0)})
MASS = Quantity("mass", _scaled(mg=1e-6, ug=1e-9, g=1e-3, kg=1.0))
FORCE = Quantity("force", _scaled(N=1.0, kN=1e3, mN=1e-3, kgf=9.80665, lbf=4.4482216152605))
TORQUE = Quantity("torque", _scaled(**{"N m": 1.0, "N cm": 1e-2, "N mm": 1e-3, "mN m": 1e-3, "kN m": 1e3}))
SPEED = Quantity("speed", _scaled(**{"m/s": 1.0, "mm/s": 1e-3, "m/min": 1.0 / 60.0, "km/h": 1.0 / 3.6}))


def rim_speed(radius: float) -> Quantity:
    """The speed of a disc's rim [m/s], also given by its speed of rotation where the radius [m] is finite."""
    turning = {"rpm": 2.0 * math.pi / 60.0, "rad/s": 1.0, "Hz": 2.0 * math.pi}
    turns = _scaled(**{unit: value * radius for unit, value in turning.items()}) if math.isfinite(radius) else {}
    return Quantity("speed of a disc", {**turns, **SPEED.units})


TEMPERATURE = Quantity(
    "temperature", {"degC": (1.0, 273.15), "K": (1.0, 0.0), "degF": (5.0 / 9.0, 273.15 - 160.0 / 9.0)}
)
COUNT = Quantity("a number counted from 1", {"1": (1.0, 0.0)}, default="1")

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
