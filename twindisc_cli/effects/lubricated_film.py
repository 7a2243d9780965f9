"""Lubricated film: oil that shears by Eyring's law carries part of the traction, which so grows with the slip.

    mu(w) = mu_0 [1 - s + s asinh(w / w_E) / asinh(0.1 V / w_E)],   xi = k G a b C11 v / (mu N)

    w    sliding speed [m/s], V rolling speed [m/s]; mu_0 is the friction at a creepage of a tenth
    s    share of that friction which the film carries, boundary contact the rest [1]; s = 0 without a film
    w_E  sliding speed at which the film's shear stress reaches the Eyring stress: (Eyring stress) (film) / viscosity
    k    slope of the film and the discs in series over that of the discs [1]; k = 1: a stiff film

Above w_E the traction grows with the logarithm of the sliding speed, below it in proportion.
Leaves behind, when it is missing: traction predicted too high at small creepage, too low at large, with no plateau.
Valid for: elastohydrodynamic and mixed lubrication before the film is heated by its own shear.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, share: Floats, eyring_speed_m_s: Floats, slope_ratio: Floats) -> State:
    """Scale the coefficient of friction of every operating point that rolls, and the initial slope."""
    at_a_tenth = np.arcsinh(0.1 * s.rolling_speed / eyring_speed_m_s)
    rolls = at_a_tenth > 0.0
    film = np.where(rolls, np.arcsinh(s.sliding_speed / eyring_speed_m_s) / np.where(rolls, at_a_tenth, 1.0), 1.0)
    return s.replace(mu=s.mu * (1.0 - share + share * film), slope=s.slope * slope_ratio)


EFFECT = Effect(
    stage="friction",
    params=(
        Param("share", "1", off=0.0, start=0.6, lower=0.0, upper=1.0,
              meaning="share of the friction at a tenth of the rolling speed that the film carries"),
        Param("eyring_speed_m_s", "m s-1", start=0.03, lower=1e-4, upper=3.0, log=True,
              meaning="sliding speed at which the film shears at the Eyring stress"),
        Param("slope_ratio", "1", off=1.0, start=0.5, lower=0.02, upper=1.0, log=True,
              meaning="initial slope of film and discs over that of the discs"),
    ),
    apply=apply,
    over="creepage",
    source="K. L. Johnson, J. L. Tevaarwerk, Proc. R. Soc. A 356 (1977) 215-236; C. R. Evans, K. L. Johnson, "
    "Proc. IMechE C 200 (1986) 303-312",
)  # fmt: skip
