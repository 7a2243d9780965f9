"""Units and quantities, once: every conversion, every label and every end of a key follows from this table.

    SI = shown * factor + offset

A unit is written `N mm-2` in result files and `N mm⁻²` for reading; a key that carries it ends in its `suffix`
(`depth_um`). A quantity is what a covariate, a channel, an axis or a column of results shows: its key, its symbol, its
label, and the unit in which people read it; the SI unit follows from that unit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
CELSIUS = 273.15
"""0 degC in K."""


@dataclass(frozen=True)
class Unit:
    """A unit: its SI unit, SI = value * factor + offset, and what a key that carries it ends in."""

    name: str
    si: str
    factor: float = 1.0
    offset: float = 0.0
    suffix: str = ""

    def to_si(self, values: Any) -> Floats:
        """Values (...) in this unit as SI values (...)."""
        return np.asarray(values, dtype=float) * self.factor + self.offset

    def of_si(self, values: Any) -> Floats:
        """SI values (...) in this unit (...)."""
        return np.asarray(values, dtype=float) * self.per_si - self.offset * self.per_si

    @property
    def solidus(self) -> str:
        """The unit as headers of tables have it: `W/(m K)` for `W m-1 K-1`."""
        parts = [re.fullmatch(r"(.+?)(-(\d))?", part) for part in self.name.split()]
        above = [m[1] for m in parts if m and not m[2]]
        below = [m[1] + (m[3] if m[3] != "1" else "") for m in parts if m and m[2]]
        if not below:
            return self.name
        under = " ".join(below)
        return f"{' '.join(above) or '1'}/{under if len(below) == 1 else f'({under})'}"

    @property
    def per_si(self) -> float:
        """How many of it make an SI unit: a whole number where the factor is one over it."""
        many = 1.0 / self.factor
        return float(round(many)) if abs(many - round(many)) < 1e-6 * many else many


_ALL = (
    Unit("1", "1"),
    Unit("%", "1", 1e-2, suffix="percent"),
    Unit("thousands", "1", 1e3),
    Unit("s", "s", suffix="s"),
    Unit("ms", "s", 1e-3),
    Unit("min", "s", 60.0),
    Unit("h", "s", 3600.0),
    Unit("m", "m", suffix="m"),
    Unit("cm", "m", 1e-2),
    Unit("mm", "m", 1e-3, suffix="mm"),
    Unit("um", "m", 1e-6, suffix="um"),
    Unit("nm", "m", 1e-9),
    Unit("mm2", "m2", 1e-6, suffix="mm2"),
    Unit("mm3", "m3", 1e-9, suffix="mm3"),
    Unit("kg", "kg"),
    Unit("g", "kg", 1e-3),
    Unit("mg", "kg", 1e-6, suffix="mg"),
    Unit("ug", "kg", 1e-9),
    Unit("N", "N", suffix="N"),
    Unit("kN", "N", 1e3),
    Unit("mN", "N", 1e-3),
    Unit("kgf", "N", 9.80665),
    Unit("lbf", "N", 4.4482216152605),
    Unit("N m", "N m"),
    Unit("N cm", "N m", 1e-2),
    Unit("N mm", "N m", 1e-3, suffix="N_mm"),
    Unit("mN m", "N m", 1e-3),
    Unit("kN m", "N m", 1e3),
    Unit("J", "J", suffix="J"),
    Unit("kJ", "J", 1e3, suffix="kJ"),
    Unit("W", "W", suffix="W"),
    Unit("K", "K", suffix="K"),
    Unit("degC", "K", 1.0, CELSIUS, suffix="C"),
    Unit("degF", "K", 5.0 / 9.0, CELSIUS - 160.0 / 9.0),
    Unit("Pa", "Pa"),
    Unit("MPa", "Pa", 1e6, suffix="MPa"),
    Unit("GPa", "Pa", 1e9, suffix="GPa"),
    Unit("HV", "Pa", 9.80665e6, suffix="HV"),
    Unit("N mm-2", "N m-2", 1e6, suffix="N_mm2"),
    Unit("m s-1", "m s-1", suffix="m_s"),
    Unit("mm s-1", "m s-1", 1e-3),
    Unit("m min-1", "m s-1", 1.0 / 60.0),
    Unit("km h-1", "m s-1", 1.0 / 3.6),
    Unit("m s-2", "m s-2"),
    Unit("mm s-2", "m s-2", 1e-3),
    Unit("rpm", "rad s-1", 2.0 * np.pi / 60.0, suffix="rpm"),
    Unit("rad s-1", "rad s-1"),
    Unit("Hz", "rad s-1", 2.0 * np.pi),
    Unit("mrad", "rad", 1e-3, suffix="mrad"),
    Unit("rad m-1", "rad m-1", suffix="rad_m"),
    Unit("s m-1", "s m-1", suffix="s_m"),
    Unit("um km-1", "1", 1e-9, suffix="um_km"),
    Unit("um mm-1", "1", 1e-3, suffix="um_mm"),
    Unit("W K-1", "W K-1", suffix="W_K"),
    Unit("J K-1", "J K-1", suffix="J_K"),
    Unit("W m-1 K-1", "W m-1 K-1", suffix="W_mK"),
    Unit("W m-2 K-1", "W m-2 K-1", suffix="W_m2K"),
    Unit("J kg-1 K-1", "J kg-1 K-1", suffix="J_kgK"),
    Unit("kg m-3", "kg m-3", suffix="kg_m3"),
    Unit("m-1", "m-1", suffix="1_m"),
)
UNITS: Mapping[str, Unit] = {unit.name: unit for unit in _ALL}
SUFFIXES: Mapping[str, Unit] = {
    unit.suffix: unit for unit in sorted(_ALL, key=lambda unit: -len(unit.suffix)) if unit.suffix
}
"""Units by what a key that carries them ends in, the longest ends first."""
DIFFERENCES = frozenset({"rise_C", "flash_C", "flash_mean_C", "temperature_rise_C"})
"""Keys of temperatures that are differences."""
_READ = {"1": "", "um": "µm", "ug": "µg", "degC": "°C", "degF": "°F"}
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def unit_named(name: str) -> Unit:
    """The unit of a name; one that is in no table is its own SI unit, as a user's quantity may have."""
    return UNITS.get(name, Unit(name, name))


def split_key(key: str) -> tuple[str, Unit]:
    """A key without its unit, and the unit that it carries: depth and um of depth_um; 1 where it carries none."""
    if key == "T_over_N" or key.endswith("_T_over_N"):
        return key, UNITS["1"]
    end = next((suffix for suffix in SUFFIXES if key.endswith(f"_{suffix}")), "")
    if key in DIFFERENCES:
        return key.removesuffix(f"_{end}"), UNITS["K"]
    return (key.removesuffix(f"_{end}"), SUFFIXES[end]) if end else (key, UNITS["1"])


def for_reading(name: str) -> str:
    """A unit for reading: `N mm-2` becomes `N mm⁻²`, um becomes µm, 1 becomes nothing."""
    text = " ".join(_READ.get(part, part) for part in name.split())
    return re.sub(r"(?<=[A-Za-z])-?\d", lambda m: m[0].translate(_RAISED), text)


@dataclass(frozen=True)
class Quantity:
    """What is shown along an axis or in a column: key, symbol, label, and the unit that people read it in.

    axis: where an axis says more than label and unit, or in another unit: its label and that unit.
    note: what a result file adds to the label.
    """

    key: str
    symbol: str
    label: str
    unit: str
    axis: tuple[str, str] | None = None
    note: str = ""

    @property
    def shown(self) -> Unit:
        """The unit that people read it in."""
        return unit_named(self.unit)

    @property
    def si(self) -> str:
        """The unit of result files."""
        return self.shown.si

    @property
    def difference(self) -> Unit:
        """The unit of differences: K where temperatures are shown in degC."""
        return self.shown if self.shown.offset == 0.0 else unit_named(self.si)

    @property
    def axis_label(self) -> str:
        """Label of an axis, with its unit."""
        label, unit = self.axis or (self.label, self.unit)
        return f"{label} [{for_reading(unit) or '1'}]"

    def drawn(self, values: Any) -> Floats:
        """SI values (...) as its axis shows them (...)."""
        return unit_named(self.axis[1] if self.axis else self.unit).of_si(values)

    @property
    def long_name(self) -> str:
        """What it is called in result files."""
        return f"{self.label}{self.note}"


QUANTITIES: Mapping[str, Quantity] = {quantity.key: quantity for quantity in (
    Quantity("creepage", "v", "creepage", "%"),
    Quantity("sliding_speed", "w", "sliding speed", "m s-1"),
    Quantity("sliding_distance", "s", "sliding distance", "m"),
    Quantity("load", "N", "normal load", "N"),
    Quantity("pressure", "p", "mean pressure of the patch", "MPa"),
    Quantity("rolling_speed", "V", "rolling speed", "m s-1"),
    Quantity("order", "i", "number of the step", "1"),
    Quantity("direction", "d", "direction in which the creepage last changed", "1"),
    Quantity("time", "t", "time", "s", note=" since the start of the test"),
    Quantity("cycles", "n", "revolutions", "1", ("revolutions", "thousands"), note=" so far"),
    Quantity("energy", "E", "dissipated energy", "kJ", note=" so far, of the model before"),
    Quantity("temperature", "T", "disc temperature", "degC", ("disc temperature of the model", "degC"),
             note=" of the model before"),
    Quantity("flash_temperature", "ΔT", "flash temperature of the patch above the disc", "K"),
    Quantity("power", "P", "dissipated power", "W"),
    Quantity("wear_index", "Tγ/A", "wear index", "N mm-2"),
    Quantity("time_in_step", "τ", "time since the creepage changed", "s"),
    Quantity("time_since_pause", "τ_p", "time since the last pause", "s"),
    Quantity("greatest_creepage", "v_max", "greatest creepage so far", "%"),
    Quantity("y", "y", "position across the track", "mm", ("across the track, y", "mm")),
    Quantity("place", "y", "place across the track", "mm"),
    Quantity("passes", "n_y", "passes over the strip", "1"),
    Quantity("y_over_edge", "y/b", "place across the track over its half-width", "1"),
    Quantity("disc", "", "disc", "1", note=" that was recorded"),
    Quantity("iteration", "", "iteration", "1", note=": how many were completed when it was recorded"),
)}  # fmt: skip
"""What covariates, samples and axes show, by key."""
