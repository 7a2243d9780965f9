"""Third-body layer: debris between the discs shears, and the creep curve starts with a smaller slope.

    xi = k G a b C11 v / (mu N)

    xi   normalised creepage, v creepage
    k    initial slope over that of clean elastic discs [1]; k = 1 switches the effect off

Leaves behind, when it is missing: traction predicted too high below saturation, right above it.
Valid for: thin layers of debris, sand, oxide or leaves.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, slope_ratio: Floats) -> State:
    """Reduce the initial slope of the traction curve."""
    return s.replace(slope=s.slope * slope_ratio)


EFFECT = Effect(
    stage="traction",
    params=(
        Param("slope_ratio", "1", off=1.0, start=0.6, lower=0.02, upper=1.0, log=True,
              meaning="initial slope over that of clean discs"),
    ),
    apply=apply,
    source="J. J. Kalker, Rolling contact phenomena (1990); E. A. H. Vollebregt, Wear 314 (2014) 276-287",
)  # fmt: skip
