"""Wear threshold: a strip wears only by what its wear index exceeds a threshold.

    du/dn = K/H max(0, P_l/V - c 2 a(y))

    P_l/V  energy dissipated per length rolled and length of contact [N/m]
    c      threshold of T gamma / A (given in N/mm2); c = 0 switches the effect off

Leaves behind, when it is missing: wear predicted, but not recorded, at small creepage and at the edges.
Valid for: surfaces with a protective layer or an endurance limit.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, threshold_N_mm2: Floats) -> State:
    """Set the threshold of wear."""
    return s.replace(threshold=s.threshold + 1e6 * threshold_N_mm2)


EFFECT = Effect(
    stage="wear",
    channel="profile",
    seen_in=seen("traction", "profile", "temperature"),
    params=(
        Param(
            "threshold_N_mm2",
            "N mm-2",
            off=0.0,
            start=2.0,
            lower=0.0,
            upper=60.0,
            meaning="T gamma / A below which nothing wears",
        ),
    ),
    apply=apply,
    source="S. Fouvry, P. Kapsa, L. Vincent, Wear 200 (1996) 186-205",
)
