"""Two slope factors: the creep curve of a contaminated contact starts flatter, and is flatter still where it slips.

    xi = k_A G a b C11 v / (mu N),   T/(mu N) = f(xi) p(e, r e) / p(e, e),   e = pi xi / 4
    p(e_A, e_S) = (2 / pi) [e_A / (1 + e_A^2) + arctan(e_S)]

    f    creep curve of the declared theory, xi its normalised creepage, v creepage
    k_A  slope in the area of adhesion over that of clean discs [1]; k_A = 1 and r = 1 switch the effect off
    r    slope in the area of slip over that in the area of adhesion, k_S / k_A [1]

Leaves behind, when it is missing: traction predicted too high below and about the knee of the creep curve, right at
its end; it bends more slowly than any elastic theory lets it.
Valid for: wet, dirty or worn-in surfaces measured over the whole creep curve.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, adhesion: Floats, slip_to_adhesion: Floats) -> State:
    """Reduce the slopes of the traction curve."""
    return s.replace(slope=s.slope * adhesion, slip_slope=s.slip_slope * slip_to_adhesion)


EFFECT = Effect(
    stage="traction",
    params=(
        Param("adhesion", "1", off=1.0, start=0.7, lower=0.02, upper=1.0, log=True,
              meaning="slope in the area of adhesion over that of clean discs"),
        Param("slip_to_adhesion", "1", off=1.0, start=0.4, lower=0.02, upper=1.0, log=True,
              meaning="slope in the area of slip over that in the area of adhesion"),
    ),
    apply=apply,
    over="creepage",
    source="O. Polach, Wear 258 (2005) 992-1000",
)  # fmt: skip
