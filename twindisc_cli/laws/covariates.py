"""What a learnt law may depend on, read from the state of a test at its operating points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects._state import Floats, State

CELSIUS = 273.15


@dataclass(frozen=True)
class Covariate:
    """A covariate: unit of the definition and the end of its keys, what it is called, and its value (set, point).

    Beyond `reach` a law over it changes nothing.
    """

    unit: str
    suffix: str
    label: str
    symbol: str
    of: Callable[[State], Floats]
    reach: float = np.inf

    def key(self, name: str) -> str:
        """The key of a parameter measured along this covariate."""
        return f"{name}_{self.suffix}" if self.suffix else name


def _over_edge(s: State) -> Floats:
    """Place across the track over the half-width of the worn zone (set, stop, strip)."""
    assert s.surface is not None
    return np.asarray(s.surface.y / s.surface.edge)


COVARIATES: Mapping[str, Covariate] = {
    "creepage": Covariate("%", "percent", "creepage", "v", lambda s: 100.0 * np.abs(s.creepage)),
    "sliding_speed": Covariate("m/s", "m_s", "sliding speed", "w", lambda s: s.sliding_speed),
    "time": Covariate("s", "s", "time", "t", lambda s: s.time),
    "cycles": Covariate("1", "", "revolutions", "n", lambda s: s.cycles),
    "energy": Covariate("kJ", "kJ", "dissipated energy", "E", lambda s: 1e-3 * s.energy),
    "temperature": Covariate("degC", "C", "disc temperature", "T", lambda s: s.temperature - CELSIUS),
    "flash_temperature": Covariate("K", "K", "flash temperature of the patch above the disc", "ΔT", lambda s: s.flash),
    "power": Covariate("W", "W", "dissipated power", "P", lambda s: s.power_before),
    "wear_index": Covariate("N mm-2", "N_mm2", "wear index", "Tγ/A", lambda s: 1e-6 * s.wear_index),
    "time_in_step": Covariate("s", "s", "time since the creepage changed", "τ", lambda s: s.time_in_step),
    "greatest_creepage": Covariate(
        "%", "percent", "greatest creepage so far", "v_max", lambda s: 100.0 * s.greatest_creepage
    ),
    "place": Covariate("mm", "mm", "place across the track", "y", lambda s: 1e3 * s.place),
    "passes": Covariate("1", "", "passes over the strip", "n_y", lambda s: s.passes),
    "y_over_edge": Covariate("1", "", "place across the track over its half-width", "y/b", _over_edge, 1.5),
}
LOCAL = ("place", "passes")
"""Covariates of single strips, over which only K can change."""
TWINS: Mapping[str, str] = {"sliding_speed": "creepage", "cycles": "time"}
"""At one rolling speed the first is proportional to the second."""


def covariate_named(name: str) -> str | None:
    """The covariate that a definition names, with its unit or without; None where there is none."""
    return next((bare for bare, covariate in COVARIATES.items() if name in (bare, covariate.key(bare))), None)
