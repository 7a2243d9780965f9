"""Misalignment: yaw of the axes adds lateral creepage, tilt adds spin.

    v_y = yaw,   phi = tilt / R2     (Eq. 4)

    yaw   angle between the axes in the contact plane (given in mrad); yaw = 0 and tilt = 0 switch the effect off
    tilt  angle out of the contact plane (given in mrad), R2 rolling radius of disc 2 [m]; counted positive, for a case
          and its lateral mirror image, with both signs turned, have the same traction

Leaves behind, when it is missing: traction predicted too high where the creepage is not much above the yaw angle.
Valid for: small angles; along a line contact under an even load, where tilt gives each strip the creepage v - phi y.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, yaw_mrad: Floats, tilt_mrad: Floats) -> State:
    """Add lateral creepage and spin to every operating point."""
    return s.replace(
        lateral_creepage=s.lateral_creepage + 1e-3 * yaw_mrad,
        spin=s.spin + 1e-3 * tilt_mrad / s.rolling_radius,
    )


EFFECT = Effect(
    stage="operation",
    params=(
        Param("yaw_mrad", "mrad", off=0.0, start=2.0, lower=-40.0, upper=40.0,
              meaning="angle between the axes in the contact plane"),
        Param("tilt_mrad", "mrad", off=0.0, start=5.0, lower=0.0, upper=100.0,
              meaning="angle between the axes out of the contact plane"),
    ),
    apply=apply,
    needs_yaw=True,
    source="L. Chevalier et al., Tribology International 39 (2006) 1376-1387, Eqs. 2-4",
)  # fmt: skip
