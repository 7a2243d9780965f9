"""What a learnt law may depend on, read from the state of a test at its operating points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects._state import Floats, State
from twindisc_cli.quantities import QUANTITIES, Quantity


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


_OTHER = {
    "creepage": "creepage_size",
    "flash_temperature": "flash",
    "power": "power_before",
    "load": "normal_load",
}
"""Attributes of a state that are called otherwise than the quantity."""
_REACH = {"y_over_edge": 1.5}
COVARIATES: Mapping[str, Covariate] = {
    name: Covariate(QUANTITIES[name], _OTHER.get(name, name), _REACH.get(name, np.inf))
    for name in (
        "creepage",
        "sliding_speed",
        "sliding_distance",
        "load",
        "pressure",
        "rolling_speed",
        "order",
        "direction",
        "time",
        "cycles",
        "energy",
        "temperature",
        "flash_temperature",
        "power",
        "wear_index",
        "time_in_step",
        "greatest_creepage",
        "place",
        "passes",
        "y_over_edge",
    )
}
LOCAL = ("place", "passes")
"""Covariates of single strips, over which only K can change."""
TWINS: Mapping[str, str] = {"sliding_speed": "creepage", "cycles": "time"}
"""At one rolling speed the first is proportional to the second."""


def covariate_named(name: str) -> str | None:
    """The covariate that a definition names, with its unit or without; None where there is none."""
    return next((bare for bare, covariate in COVARIATES.items() if name in (bare, covariate.key(bare))), None)
