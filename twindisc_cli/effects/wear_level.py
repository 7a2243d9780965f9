"""Level of wear: in one of several tests the material wears faster or slower than in the others.

    K_i = f K

    K    wear coefficient of the other tests [1]
    f    its multiple in test i [1]; f = 1 switches the effect off

Leaves behind, when it is missing: worn depths and losses that are too small in one test and too large in the others.
Valid for: tests on other pieces, surfaces or lubricants; K of repeats scatters by tens of per cent, too.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, factor: Floats) -> State:
    """Multiply the wear coefficient of every operating point."""
    return s.replace(wear_factor=s.wear_factor * factor)


EFFECT = Effect(
    stage="wear",
    params=(
        Param("factor", "1", off=1.0, start=1.5, lower=0.02, upper=50.0, log=True,
              meaning="K of this test over that of the others"),
    ),
    apply=apply,
    source="M. B. Peterson, W. O. Winer (eds.), Wear Control Handbook, ASME (1980); ASTM G77: scatter of repeats",
    level_of="K",
    same_as="other pieces of the material, another surface or another lubricant in that test",
)  # fmt: skip
