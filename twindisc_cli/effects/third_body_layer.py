"""Third-body layer: debris between the discs shears, and the creep curve starts with a smaller slope and bends softly.

    T/(mu N) = [f(xi) + Lambda P(xi)] / (1 + Lambda),   P = (2 / pi) [e / (1 + e^2) + arctan(e)],   e = pi xi / 4
    xi = k G a b C11 v / (mu N),   1/k = 1 + Lambda + 0.07 Lambda / (Lambda + 0.12)

    f       creep curve of the declared theory, xi normalised creepage, v creepage
    k       initial slope over that of clean elastic discs [1]; k = 1 switches the effect off
    Lambda  slope of the discs alone over that of the layer alone [1]

A layer is a bed of springs in series with the discs, and so are the tips of rough surfaces.
Leaves behind, when it is missing: traction predicted too high below and about saturation, right above it.
Valid for: thin layers of debris, sand, oxide or leaves; rough surfaces.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, slope_ratio: Floats) -> State:
    """Put a layer between the discs."""
    return s.softened(slope_ratio)


EFFECT = Effect(
    stage="traction",
    params=(
        Param("slope_ratio", "1", off=1.0, start=0.6, lower=0.02, upper=1.0, log=True,
              meaning="initial slope over that of clean discs"),
    ),
    apply=apply,
    source="J. J. Kalker, Rolling contact phenomena (1990); E. A. H. Vollebregt, Wear 314 (2014) 276-287; O. Polach, "
    "Wear 258 (2005) 992-1000 (P)",
)  # fmt: skip
