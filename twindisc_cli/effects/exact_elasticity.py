"""Exact elasticity: Kalker's full theory of rolling contact in place of the declared traction law.

    T/(mu N) = (1 - f) [declared law](xi) + f [exact theory](xi; a/b, nu)

    xi   normalised creepage [1]
    f    share of the exact theory; f = 0 switches the effect off, f = 1 is the exact theory

Leaves behind, when it is missing: traction predicted a little too low around the knee of the creep curve.
Valid for: elastic discs of one material.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, share: Floats) -> State:
    """Move the traction law towards the exact theory."""
    return s.replace(exactness=s.exactness + (1.0 - s.exactness) * share)


EFFECT = Effect(
    stage="traction",
    params=(
        Param("share", "1", off=0.0, start=1.0, lower=0.0, upper=1.0,
              meaning="share of the exact theory in the traction law"),
    ),
    apply=apply,
    source="J. J. Kalker, Three-dimensional elastic bodies in rolling contact (1990)",
)  # fmt: skip
