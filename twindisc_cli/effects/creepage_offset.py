"""Creepage offset: the true creepage differs from the nominal one by a constant.

    v = v_nominal + v_0

    v_0  offset from a radius mismatch or a speed error (given in percent); v_0 = 0 switches the effect off

Leaves behind, when it is missing: traction shifted along the creepage axis: wrong below saturation, right above it.
Valid for: rolling radii or speeds that are not what the definition says.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, offset_percent: Floats) -> State:
    """Shift the creepage of every operating point."""
    return s.replace(creepage=s.creepage + offset_percent / 100.0)


EFFECT = Effect(
    stage="operation",
    params=(
        Param("offset_percent", "%", off=0.0, start=0.05, lower=-1.0, upper=1.0,
              meaning="true creepage minus nominal creepage"),
    ),
    apply=apply,
    source="L. Chevalier et al., Tribology International 39 (2006) 1376-1387, Eq. 1",
)  # fmt: skip
