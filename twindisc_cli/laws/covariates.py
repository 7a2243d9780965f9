"""What a learnt law may depend on, read from the state of a test at its operating points."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from twindisc_cli.effects._state import Floats, State
from twindisc_cli.quantities import QUANTITIES, UNITS, Quantity


@dataclass(frozen=True)
class Covariate:
    """A covariate: the quantity it is, and the attribute of a state that holds its SI value (set, point).

    Beyond `reach`, in the unit that is shown, a law over it changes nothing.
    """

    quantity: Quantity
    attribute: str
    reach: float = np.inf

    @property
    def unit(self) -> str:
        """The unit of its values in a definition."""
        return self.quantity.shown.solidus

    @property
    def label(self) -> str:
        """What it is called."""
        return self.quantity.label

    @property
    def symbol(self) -> str:
        """Its symbol in formulas."""
        return self.quantity.symbol

    @property
    def title(self) -> str:
        """Label and symbol, as axes have them; a declared column has no symbol of its own."""
        return self.label if self.symbol == self.label else f"{self.label} {self.symbol}"

    def key(self, name: str) -> str:
        """The key of a parameter measured along this covariate."""
        suffix = self.quantity.shown.suffix
        return f"{name}_{suffix}" if suffix else name

    def of(self, state: State) -> Floats:
        """Its values at the operating points (set, point), in its unit."""
        return self.quantity.shown.of_si(getattr(state, self.attribute))

    @property
    def expression(self) -> str:
        """The same as text, of a state `s`."""
        unit = self.quantity.shown
        factor = "" if unit.per_si == 1.0 else f"{unit.per_si!r} * "
        return f"{factor}s.{self.attribute}" + (f" - {unit.offset * unit.per_si!r}" if unit.offset else "")


class Column(Covariate):
    """A column of the user's file, declared as `name [unit]`; attribute: what is declared. NaN in tests without it."""

    def of(self, state: State) -> Floats:
        """Its values at the operating points (point,), in its unit."""
        return self.quantity.shown.of_si(state.columns.get(self.attribute, np.full(state.duration.shape, np.nan)))

    @property
    def expression(self) -> str:
        """The same as text, of a state `s`."""
        unit = self.quantity.shown
        return (
            f"{unit.per_si!r} * np.asarray(s.columns.get({self.attribute!r}, np.nan)) - {unit.offset * unit.per_si!r}"
        )


_OTHER = {
    "creepage": "creepage_size",
    "flash_temperature": "flash",
    "power": "power_before",
    "load": "normal_load",
}
"""Attributes of a state that are called otherwise than the quantity."""
_REACH = {"y_over_edge": 1.5}
_NAMES = (
    "creepage", "sliding_speed", "sliding_distance", "load", "pressure", "rolling_speed", "order", "direction", "time",
    "cycles", "energy", "temperature", "flash_temperature", "power", "wear_index", "time_in_step", "time_since_pause",
    "greatest_creepage", "place", "passes", "y_over_edge",
)  # fmt: skip
COVARIATES: Mapping[str, Covariate] = {
    name: Covariate(QUANTITIES[name], _OTHER.get(name, name), _REACH.get(name, np.inf)) for name in _NAMES
}
LOCAL = ("place", "passes")
"""Covariates of single strips, over which only K can change."""


@cache
def covariate_of(name: str) -> Covariate:
    """The covariate of a name; a declared column where it is none of COVARIATES."""
    return COVARIATES[name] if name in COVARIATES else _column(name)


def _column(declared: str) -> Column:
    """A column that is declared as `name [unit]`, or as a name where it has no unit."""
    label, _, unit = (part.strip(" ]") for part in declared.partition("["))
    unit = re.sub("[µμ]", "u", unit).replace("°", "deg")
    units = {of.solidus: name for name, of in UNITS.items()}
    return Column(Quantity(identifier(declared), label, label, units.get(unit, unit) or "1"), declared)


def identifier(covariate: str) -> str:
    """A covariate as a part of names: `oil_temperature` for `oil temperature [degC]`."""
    return re.sub(r"\W+", "_", covariate.partition("[")[0].strip().casefold())


def covariate_named(name: str, columns: Iterable[str] = ()) -> str | None:
    """The covariate that a definition names, with its unit or without; None where there is none.

    columns: what the definition declares.
    """
    keys = {bare: {bare, of.key(bare)} for bare, of in COVARIATES.items()}
    keys |= {column: {column, covariate_of(column).label, identifier(column)} for column in columns}
    return next((bare for bare, names in keys.items() if name in names), None)
