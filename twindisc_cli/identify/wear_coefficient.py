"""The wear coefficient K by the paper's bisection on depth (section 3.3, Eqs. 16, 17, Fig. 11).

    K  = (K0 + K1) / 2                       Eq. 16
    Er = (Um - Us) / Um * 100 %              Eq. 17;  stop at |Er| < 1 %

    Um, Us   measured and simulated depth [m]; Er is positive where the simulation is too shallow

The paper defines Um and Us as minima of profiles, negative numbers, and moves K1 down where Us > Um. For minima that is
the wrong way round, and Er < 1 % without its modulus stops at once where the simulation is too deep. Its procedure
holds for depths, which these are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

TOLERANCE = 1.0  # in the tolerance of depth that the caller gives
_WIDENINGS = 12  # by a factor of ten each: no K is further off
_HALVINGS = 60  # all digits of a double


@dataclass(frozen=True)
class Bisection:
    """The K found [1], each K tried with its Er [%], in order, and the bracket it started from."""

    wear_coefficient: float
    trail: tuple[tuple[float, float], ...]
    bracket: tuple[float, float]

    @property
    def converged(self) -> bool:
        """Whether the last Er is below 1 %."""
        return abs(self.trail[-1][1]) < TOLERANCE


def bisect_depth(depth: Callable[[float], float], *, measured_depth: float, start: float) -> Bisection:
    """The K at which `depth`, simulated over K [m], is the measured one [m]; the bracket is sought around `start`."""

    def error(k: float) -> float:
        return (measured_depth - depth(k)) / measured_depth * 100.0

    low, high = 0.5 * start, 2.0 * start
    for _ in range(_WIDENINGS):
        if error(low) > 0.0:
            break
        low *= 0.25
    for _ in range(_WIDENINGS):
        if error(high) < 0.0:
            break
        high *= 4.0
    bracket, trail = (low, high), []
    for _ in range(_HALVINGS):
        k = 0.5 * (low + high)
        trail.append((k, error(k)))
        if abs(trail[-1][1]) < TOLERANCE:
            break
        low, high = (k, high) if trail[-1][1] > 0.0 else (low, k)
    return Bisection(wear_coefficient=trail[-1][0], trail=tuple(trail), bracket=bracket)
