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
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .traction import equivalent_ellipse

Floats = NDArray[np.float64]
POISSON = 0.3
ELEMENTS, STRIPS = 20, 12  # along rolling, and across one half of the patch
XI = np.array([0.0, 0.2, 0.4, 0.7, 1.0, 1.3, 1.6, 1.8, 2.0, 2.2, 2.5, 3.0, 3.6, 5.0, 8.0])
_ROUNDS = 40  # until which elements slide is found long before


@dataclass(frozen=True)
class Strips:
    """The exact theory on strips (strip,) on both sides of y = 0: middles, half-lengths [m] and loads.

    The influence of its elements on each other is large: it is not kept.
    """

    y: Floats
    a: Floats
    load: Floats

    @cached_property
    def stiffness(self) -> float:
        """Linear stiffness times pi [1/G]."""
        length, width = self._elements
        return float(np.linalg.solve(self._moved(), length) @ length) * width

    @cached_property
    def curve(self) -> Floats:
        """T/(mu N) at XI."""
        length, width = self._elements
        force, moved = self.load.sum() * width, self._moved()
        bound = (np.sqrt(1.0 - (self._x / self.a[:, None]) ** 2) * (self.load / self.a)[:, None]).ravel()
        bound = bound * force / (bound @ length * width)
        slopes = [length * xi * force / self.stiffness for xi in XI]
        return np.array([_traction(moved, slope, bound) @ length * width / force for slope in slopes])

    @property
    def _elements(self) -> tuple[Floats, float]:
        """Length of every element (strip * element,), and width of all [m]."""
        return np.repeat(2.0 * self.a / ELEMENTS, ELEMENTS), float(self.y[1] - self.y[0])

    @property
    def _x(self) -> Floats:
        """Middles of the elements (strip, element) [m]."""
        return np.asarray(((np.arange(ELEMENTS) + 0.5) * 2.0 / ELEMENTS - 1.0) * self.a[:, None])

    def _moved(self) -> Floats:
        """Change of pi G u over an element's own length (element, element) under unit tractions."""
        width = self._elements[1]
        edges = (np.arange(ELEMENTS + 1) * 2.0 / ELEMENTS - 1.0) * self.a[:, None]
        middles = edges + self.a[:, None] / ELEMENTS  # the last one is behind the patch
        x = middles[:, :, None, None] - edges
        total = np.zeros_like(x)
        for side in (1.0, -1.0):
            away = (self.y[:, None] - side * self.y)[:, None, :, None]
            total += _corner(x, away + 0.5 * width) - _corner(x, away - 0.5 * width)
        return -np.diff(-np.diff(total, axis=3), axis=1).reshape(self._x.size, -1)


@dataclass(frozen=True)
class Beyond:
    """What a patch transmits beyond the equivalent ellipse."""

    own: Strips
    ellipse: Strips

    @property
    def stiffening(self) -> float:
        """Linear stiffness over that of the ellipse [1]."""
        return self.own.stiffness / self.ellipse.stiffness

    @property
    def departure(self) -> Floats:
        """T/(mu N) beyond its at XI [1]."""
        return np.asarray(self.own.curve - self.ellipse.curve)


def beyond_ellipse(y: Floats, half_length: Floats, line_load: Floats) -> Beyond:
    """What a patch of strips (y,) symmetrical about y = 0, half-lengths [m], line loads [N/m], transmits beyond it."""
    spacing = float(y[1] - y[0])
    ellipse = equivalent_ellipse(half_length, spacing)
    edge = float(np.abs(y[half_length > 0.0]).max()) + 0.5 * spacing
    middles = _middles(edge)
    squares, loads = (np.interp(middles, y[y > 0.0], row[y > 0.0]) for row in (half_length**2, line_load))
    own = Strips(middles, np.sqrt(np.maximum(squares, 1e-3 * squares.max())), loads)
    across = np.sqrt(1.0 - (_middles(ellipse.b) / ellipse.b) ** 2)
    plain = Strips(_middles(ellipse.b), ellipse.a * across, across**2)
    return Beyond(own, plain)


def _middles(edge: float) -> Floats:
    """Middles of the strips of one half of a patch [m]."""
    return np.asarray((np.arange(STRIPS) + 0.5) * edge / STRIPS)


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
