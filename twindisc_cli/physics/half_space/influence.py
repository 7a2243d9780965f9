"""Influence coefficients: how far a normal pressure on one place presses in the half-space at another.

A point force F presses in by u = F / (pi E* r) (Boussinesq), with 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 for both
bodies together. All functions here return u * pi * E*, so that the modulus stays with the caller.

Semi-elliptic strip. A line load q [N/m] spread over |x| < a as p(x) = 2 q / (pi a) * sqrt(1 - (x/a)^2), from y = 0 to
y = Y, gives on the centre line x = 0, with t = Y/a

    deflection       q     * Phi(t),   Phi(t) = (4/pi) int_0^1 sqrt(1 - s^2) asinh(t/s) ds
    -d^2 u / dx^2    q/a^2 * Psi(t),   Psi(t) = (4/pi) t / sqrt(1 + t^2) * K(m),   m = 1 / (1 + t^2)

    Phi'(t) = (4/pi) sqrt(1 + t^2) * (K(m) - E(m)),   Psi'(t) = (4/pi) (K(m) - E(m)) / sqrt(1 + t^2),

K and E complete elliptic integrals of the parameter m.

Rectangle. A uniform pressure p on -c < x < c, -d < y < d gives p * [F(x, y)] summed over its corners, with
F(X, Y) = X asinh(Y/|X|) + Y asinh(X/|Y|) (Love 1929).

Source: K. L. Johnson, Contact Mechanics (1985), chapters 3 and 4; the integrals over x are elementary steps from there.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The strip functions are tabulated over ln t. Between nodes they are linear: error below 2e-7 of an O(1) function. What
# strips far thinner than long are loaded by depends on small differences, which a step of 0.005 leaves unsettled.
_LOG_FIRST, _LOG_LAST, _LOG_STEP = -14.0, 18.0, 0.001


class StripFunctions(NamedTuple):
    """Functions of t = Y/a, each of the shape of t.

    deflection       Phi
    load_tangent     Phi - t Phi'/2, the derivative of q Phi with respect to q where a grows as sqrt(q)
    curvature        Psi
    slope_tangent    Psi + t Psi', which the curvature condition feels of a change of pressure slope (see `strips`)
    """

    deflection: Array
    load_tangent: Array
    curvature: Array
    slope_tangent: Array


def strip_functions(t: Array) -> StripFunctions:
    """The functions of a semi-elliptic strip; odd in t, any shape, |t| < 6e7."""
    position = np.abs(t)
    np.log(np.maximum(position, 1e-6, out=position), out=position)
    position = (position - _LOG_FIRST) / _LOG_STEP
    node = position.astype(np.intp)
    position -= node
    results = []
    for values, steps in _strip_table():
        value = steps.take(node, mode="clip")
        value *= position
        value += values.take(node, mode="clip")
        results.append(np.copysign(value, t, out=value))
    return StripFunctions(*results)


@cache
def _strip_table() -> tuple[tuple[Array, Array], ...]:
    """For each of the functions its values at t = exp(_LOG_FIRST + k * _LOG_STEP), and their differences."""
    from scipy.special import ellipe, ellipkm1

    # Every second value is a node, those between are the middles of Simpson's rule.
    log_t = np.linspace(_LOG_FIRST, _LOG_LAST, 2 * round((_LOG_LAST - _LOG_FIRST) / _LOG_STEP) + 1)
    t = np.exp(log_t)
    root = np.hypot(1.0, t)
    m, complete = 1.0 / root**2, ellipkm1((t / root) ** 2)
    # K - E loses its digits where m is small: there its series is exact to rounding.
    difference = np.where(m < 1e-4, np.pi / 4.0 * m * (1.0 + 3.0 / 8.0 * m), complete - ellipe(m))
    rate = 4.0 / np.pi * root * difference * t
    pieces = (rate[:-2:2] + 4.0 * rate[1::2] + rate[2::2]) * _LOG_STEP / 6.0
    phi = np.cumsum(np.append(4.0 / np.pi * t[0] * np.log(4.0 / t[0]), pieces))
    psi = 4.0 / np.pi * t / root * complete
    psi_rate = 4.0 / np.pi * t / root * difference
    nodes = (phi, phi - 0.5 * rate[::2], psi[::2], (psi + psi_rate)[::2])
    return tuple((values[:-1], np.diff(values)) for values in nodes)


def rectangle_influence(*, x: Array, y: Array, dx: float, dy: float) -> Array:
    """Deflection times pi E* at the points (x, y) [m] per uniform pressure on a rectangle dx by dy around the origin.

    x and y broadcast. No point may lie on the line of an edge.
    """
    corners = [(x + 0.5 * i * dx, y + 0.5 * k * dy, i * k) for i in (-1, 1) for k in (-1, 1)]
    return np.asarray(sum(sign * (u * np.arcsinh(v / abs(u)) + v * np.arcsinh(u / abs(v))) for u, v, sign in corners))
