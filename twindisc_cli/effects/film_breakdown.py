"""Film breakdown: a film keeps friction low until a critical creepage wears it away.

    mu(v) = mu_0 [r + (1 - r) / (1 + exp(-(v - v_c) / w))],   v = sqrt(v_x^2 + v_y^2)

    v    total creepage, longitudinal v_x and lateral v_y [1], (set, point)
    r    mu of the film over mu_0 [1]; r = 1 switches the effect off
    v_c  critical creepage, w width of the transition (both given in percent)

Leaves behind, when it is missing: traction predicted too high below a creepage, right above it.
Valid for: boundary films, frost and oxide layers, solid lubricants.
"""

from __future__ import annotations

from scipy.special import expit

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, film_ratio: Floats, critical_creepage_percent: Floats, width_percent: Floats) -> State:
    """Scale the coefficient of friction by the share of the contact where the film is gone."""
    bare = expit((100.0 * s.total_creepage - critical_creepage_percent) / width_percent)
    return s.replace(mu=s.mu * (film_ratio + (1.0 - film_ratio) * bare))


EFFECT = Effect(
    stage="friction",
    params=(
        Param("film_ratio", "1", off=1.0, start=0.5, lower=0.01, upper=1.0,
              meaning="mu of the film over mu without it"),
        Param("critical_creepage_percent", "%", start=2.5, lower=0.1, upper=9.0, log=True,
              meaning="creepage at which half of the film is gone"),
        Param("width_percent", "%", start=0.4, lower=0.03, upper=3.0, log=True, width_of="critical_creepage_percent",
              meaning="width of the transition"),
    ),
    apply=apply,
    over="creepage",
    source="S. C. Lim, M. F. Ashby, Acta Metall. 35 (1987) 1-24; L. Chevalier et al., Tribol. Int. 39 (2006) 1376",
)  # fmt: skip
