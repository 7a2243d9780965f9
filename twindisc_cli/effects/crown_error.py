"""Crown error: the transverse radius of the discs is not the declared one.

    R_t = r R_t0

    R_t0   declared transverse radius of either disc, R_t the true one; r = 1 switches the effect off

Leaves behind, when it is missing: a profile residual even in y, and a track of another width over its depth; next to
nothing in the traction.
Valid for: discs with a crown, whose unworn profiles were not recorded. It is looked for where the load does not change
and K is the same across the track.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, radius_ratio: Floats) -> State:
    """Roll on other transverse radii."""
    return s.replace(crown=s.crown * radius_ratio)


EFFECT = Effect(
    stage="operation",
    channel="profile",
    params=(
        Param("radius_ratio", "1", off=1.0, start=1.05, lower=0.25, upper=4.0, log=True,
              meaning="transverse radius over the declared one"),
    ),
    apply=apply,
    needs_crowns=True,
    source="K. L. Johnson, Contact Mechanics (1985), section 4.2",
)  # fmt: skip
