"""Wear partition: both discs wear, each by its share.

    u_1 = q u,   u_2 = (1 - q) u

    u    worn depth of both discs together [m]
    q    part that disc 1 bears [1]; q = 0 switches the effect off (disc 2 wears alone)

Leaves behind, when it is missing: a profile of disc 2 that is predicted too deep for its width.
Valid for: discs of like material; q = 1/2 for equal ones.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, disc1_share: Floats) -> State:
    """Give disc 1 its part of the wear."""
    return s.replace(disc1_share=s.disc1_share + (1.0 - s.disc1_share) * disc1_share)


EFFECT = Effect(
    stage="wear",
    seen_in=seen("profile"),
    params=(
        Param("disc1_share", "1", off=0.0, start=0.3, lower=0.0, upper=0.95,
              meaning="part of the worn depth that disc 1 bears"),
    ),
    apply=apply,
    source="J. F. Archard, Journal of Applied Physics 24 (1953) 981-988",
)  # fmt: skip
