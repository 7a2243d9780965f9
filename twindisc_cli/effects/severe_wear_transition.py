"""Severe wear transition: K jumps where the wear index of a strip exceeds a critical value.

    K(y) = K r   where T gamma / A (y) > c,   K elsewhere

    T gamma / A  energy dissipated per length rolled and area of the strip (given in N/mm2)
    r            K above over K below [1]; r = 1 switches the effect off

Leaves behind, when it is missing: too little wear predicted in the severe part of the history, too much before.
Valid for: dry steels passing from mild to severe wear.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, ratio: Floats, critical_N_mm2: Floats) -> State:
    """Set the transition of the wear coefficient."""
    return s.replace(transition_ratio=s.transition_ratio * ratio, transition_at=1e6 * critical_N_mm2)


EFFECT = Effect(
    stage="wear",
    channel="profile",
    seen_in=seen("traction", "profile", "temperature"),
    params=(
        Param(
            "ratio",
            "1",
            off=1.0,
            start=3.0,
            lower=0.1,
            upper=30.0,
            meaning="K above the transition over K below",
            log=True,
        ),
        Param(
            "critical_N_mm2",
            "N mm-2",
            off=None,
            start=6.0,
            lower=0.1,
            upper=60.0,
            meaning="critical T gamma / A",
            log=True,
        ),
    ),
    apply=apply,
    source="R. Lewis, R. S. Dwyer-Joyce, Proc. IMechE J 218 (2004) 467-478",
)
