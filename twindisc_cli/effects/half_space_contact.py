"""Half-space contact: the patch follows the worn profiles and is not an ellipse.

    u(y) = (1 - f) u_Hertz(y) + f u_half-space(y)

    u    worn depth [m]
    f    share of the half-space solution; f = 0 switches the effect off, f = 1 is the half-space patch

Leaves behind, when it is missing: a profile residual even in y: a worn zone of another width and shape.
Valid for: elastic discs of one material.
"""

from __future__ import annotations

from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.effects._state import Floats, State


def apply(s: State, *, share: Floats) -> State:
    """Move the contact from the updated Hertz ellipse towards the half-space patch."""
    return s.replace(half_space=s.half_space + (1.0 - s.half_space) * share)


EFFECT = Effect(
    stage="contact",
    params=(Param("share", "1", off=0.0, start=1.0, lower=0.0, upper=1.0, meaning="share of the half-space patch"),),
    apply=apply,
    source="J. J. Kalker, Three-dimensional elastic bodies in rolling contact (1990), chapter 5",
)
