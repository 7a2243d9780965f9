"""Saturating friction: it grows with the creepage towards a limit, more slowly than the discs' elasticity lets it.

    mu(v) = mu_0 [1 - exp(-v / v_0)],   v = sqrt(v_x^2 + v_y^2)

    v    total creepage, longitudinal v_x and lateral v_y [1], (set, point); mu_0 is the limit
    v_0  creepage of the rise; v_0 = 0 switches the effect off

The discs' own elasticity acts in series with it. Leaves behind, when it is missing: traction predicted too high about
the knee of the creep curve, and too low at its end.
Valid for: rough, wet, contaminated or lubricated surfaces. Burckhardt lets the friction fall in proportion to the
creepage beyond, which ends below zero: `falling_friction` beside this effect falls to a limit.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State

LEAST = 1e-9
"""Creepage in place of 0, far below any that a rig holds."""


def apply(s: State, *, rise_percent: Floats) -> State:
    """Scale the coefficient of friction of every operating point."""
    creepage = np.maximum(s.total_creepage, LEAST)
    return s.replace(mu=s.mu * -np.expm1(-creepage / np.maximum(rise_percent / 100.0, 1e-3 * LEAST)))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("rise_percent", "%", off=0.0, start=0.5, lower=0.0, upper=20.0,
              meaning="creepage at which the friction has risen to 63 % of its limit"),
    ),
    apply=apply,
    over="creepage",
    source="M. Burckhardt, Fahrwerktechnik: Radschlupf-Regelsysteme (1993)",
)  # fmt: skip
