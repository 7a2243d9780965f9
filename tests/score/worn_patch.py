"""What a worn patch transmits beyond the ellipse of its area and mean strip: the exact theory on its own strips.

Traction p(x, y) along rolling only, p <= p_n (mu = 1), on strips of half-length a(y) cut into equal elements that
scale with it. An element's centre moves by its own length h from the leading edge to the trailing one,

    u(x) - u(x + h) = v h - slip,   slip = 0 where p < p_n,   slip >= 0 where p = p_n

u of a uniformly loaded rectangle is Cerruti's (K. L. Johnson, Contact Mechanics (1985), 3.2), of both discs,

    u = p / (pi G) [(1 - nu) x asinh(y / |x|) + y asinh(x / |y|)]   over the corners.

What is taken from it is the difference to the same solution on the equivalent ellipse, in which the errors of the
elements and of the traction across rolling, which is left out, cancel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .traction import equivalent_ellipse

Floats = NDArray[np.float64]
POISSON = 0.3
ELEMENTS, STRIPS = 20, 12  # along rolling, and across one half of the patch
XI = np.array([0.0, 0.2, 0.4, 0.7, 1.0, 1.3, 1.6, 1.8, 2.0, 2.2, 2.5, 3.0, 3.6, 5.0, 8.0])
_ROUNDS = 40  # until which elements slide is found long before


@dataclass(frozen=True)
class Beyond:
    """Linear stiffness over that of the equivalent ellipse [1], and T/(mu N) beyond its at XI [1]."""

    stiffening: float
    departure: Floats


def beyond_ellipse(y: Floats, half_length: Floats, line_load: Floats) -> Beyond:
    """What a patch of strips (y,) symmetrical about y = 0, half-lengths [m], line loads [N/m], transmits beyond it."""
    spacing = float(y[1] - y[0])
    ellipse = equivalent_ellipse(half_length, spacing)
    edge = float(np.abs(y[half_length > 0.0]).max()) + 0.5 * spacing
    middles = _middles(edge)
    squares, loads = (np.interp(middles, y[y > 0.0], row[y > 0.0]) for row in (half_length**2, line_load))
    own = _curve(middles, np.sqrt(np.maximum(squares, 1e-3 * squares.max())), loads)
    across = np.sqrt(1.0 - (_middles(ellipse.b) / ellipse.b) ** 2)
    plain = _curve(_middles(ellipse.b), ellipse.a * across, across**2)
    return Beyond(own[0] / plain[0], own[1] - plain[1])


def _middles(edge: float) -> Floats:
    """Middles of the strips of one half of a patch [m]."""
    return np.asarray((np.arange(STRIPS) + 0.5) * edge / STRIPS)


def _curve(y: Floats, a: Floats, load: Floats) -> tuple[float, Floats]:
    """Stiffness times pi [1/G] and T/(mu N) at XI of the patch of strips (strip,) on both sides of y = 0."""
    h, width = 2.0 * a / ELEMENTS, float(y[1] - y[0])
    x = (np.arange(ELEMENTS) + 0.5) * h[:, None] - a[:, None]
    area = np.repeat(h, ELEMENTS) * width
    moved = (_rise(x, y, h, width, 0.0) - _rise(x, y, h, width, 1.0)).reshape(area.size, -1)
    bound = np.sqrt(1.0 - (x / a[:, None]) ** 2) * (load / a)[:, None]
    bound = bound.ravel() * load.sum() * width / (bound.ravel() @ area)
    force = load.sum() * width
    slope = np.repeat(h, ELEMENTS)
    stiffness = float(np.linalg.solve(moved, slope) @ area)
    curve = [float(_traction(moved, slope * xi * force / stiffness, bound) @ area) / force for xi in XI]
    return stiffness, np.array(curve)


def _rise(x: Floats, y: Floats, h: Floats, width: float, ahead: float) -> Floats:
    """pi G u (strip, element; strip, element) at the middles, or a length `ahead` of them, under unit tractions."""
    at = (x + ahead * h[:, None])[:, :, None, None]
    total = np.zeros((*x.shape, *x.shape))
    for side in (1.0, -1.0):
        right, left = at - x + 0.5 * h[:, None], at - x - 0.5 * h[:, None]
        up = y[:, None, None, None] - side * y[:, None] + 0.5 * width
        down = up - width
        total += _corner(right, up) - _corner(right, down) - _corner(left, up) + _corner(left, down)
    return total


def _corner(x: Floats, y: Floats) -> Floats:
    return np.asarray((1.0 - POISSON) * x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y)))


def _traction(moved: Floats, slope: Floats, bound: Floats) -> Floats:
    """Tractions (element,) at which nothing slides but where it meets the bound."""
    slides = np.zeros(bound.size, dtype=bool)
    p = bound
    for _ in range(_ROUNDS):
        sticks = ~slides
        p = bound.copy()
        rest = slope[sticks] - moved[np.ix_(sticks, slides)] @ bound[slides]
        p[sticks] = np.linalg.solve(moved[np.ix_(sticks, sticks)], rest)
        slip = slope - moved @ p
        now = np.where(slides, slip > 0.0, p > bound)
        if (now == slides).all():
            break
        slides = now
    return np.clip(p, -bound, bound)
