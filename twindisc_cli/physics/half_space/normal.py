"""Normal contact of any two profiles on elastic half-spaces, on a grid of rectangular elements.

    u(x, y) + h(x, y) = delta   and p > 0   in the patch       u = K * p  (Boussinesq, Love's rectangles)
    u(x, y) + h(x, y) > delta   and p = 0   elsewhere          sum p dx dy = N

Symbols: x along rolling, y across [m]; h undeformed gap [m]; p pressure [Pa]; delta approach [m]; N load [N];
E* effective modulus [Pa]. Fields have shape (y, x). The patch may fall into several pieces.

Method: conjugate gradients with the load held (I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219), the deflection by
FFT, so that an iteration costs n^2 log n. A grid is doubled until two of them agree within the accuracy asked for;
their difference is reported. Valid for bodies of equal (or incompressible) material, patches small against the radii.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.physics.half_space import (
    CoarseGridError,
    DataEdgeError,
    NoContactError,
    NoConvergenceError,
    ProfileError,
)
from twindisc_cli.physics.half_space.influence import rectangle_influence
from twindisc_cli.physics.half_space.strips import foundation_load

Array = NDArray[np.float64]

FEWEST_ELEMENTS = 8  # across the patch, at the least
_COARSE, _FINEST = 40, 640
_MOST_ITERATIONS = 600  # of conjugate gradients, at the most
_TOLERANCE = 1e-6  # relative change of the pressure
_FEW_ENTER = 0.01  # of the elements in contact: the direction is kept


@dataclass(frozen=True)
class NormalContact:
    """Pressure of a patch on its grid.

    x, y             centres of the elements [m], shapes (x,) and (y,)
    pressure         [Pa], shape (y, x)
    approach         of distant points of the two bodies, from where the gap is as given [m]
    relative_change  largest of peak pressure, area and approach against a grid half as fine [1]; NaN for one grid alone
    """

    x: Array
    y: Array
    pressure: Array
    approach: float
    relative_change: float = float("nan")

    @property
    def element_size(self) -> tuple[float, float]:
        """Length and width of an element, along x and y [m]."""
        return float(self.x[1] - self.x[0]), float(self.y[1] - self.y[0])

    @property
    def patch(self) -> NDArray[np.bool_]:
        """Elements in contact, shape (y, x)."""
        return self.pressure > 0.0

    @property
    def normal_load(self) -> float:
        """Sum of pressure times area [N]."""
        dx, dy = self.element_size
        return float(self.pressure.sum()) * dx * dy

    @cached_property
    def peak_pressure(self) -> float:
        """Largest pressure [Pa]."""
        return float(self.pressure.max())

    @property
    def line_load(self) -> Array:
        """Load per width of each row [N/m], shape (y,)."""
        return np.asarray(self.pressure.sum(axis=1) * self.element_size[0])

    @cached_property
    def half_length(self) -> Array:
        """Half the loaded length of each row [m], shape (y,); its edges are found between the elements."""
        edges = _beyond(self.pressure) + _beyond(self.pressure[:, ::-1])
        return np.asarray(0.5 * self.element_size[0] * (self.patch + edges).sum(axis=1))

    @property
    def area(self) -> float:
        """Area of the patch [m2]."""
        return 2.0 * float(self.half_length.sum()) * self.element_size[1]

    @cached_property
    def extent(self) -> tuple[float, float]:
        """Outer edges of the patch across [m], found between the elements from the largest pressure of each row."""
        largest = self.pressure.max(axis=1)[None, :]
        rows = np.flatnonzero(largest[0])
        half = 0.5 * self.element_size[1]
        left, right = _beyond(largest[:, ::-1])[0, ::-1], _beyond(largest)[0]
        first, last = rows[0], rows[-1]
        step = self.element_size[1]
        return float(self.y[first] - half - step * left[first]), float(self.y[last] + half + step * right[last])


def solve_profile(
    *,
    y: Array,
    gap: Array,
    curvature_x: float,
    normal_load: float,
    effective_modulus: float,
    relative_accuracy: float = 0.005,
) -> NormalContact:
    """Patch and pressure of a gap that is curvature_x * x^2 / 2 + gap(y), on a grid as fine as the accuracy needs.

    y                  ascending points across [m], shape (m,); the patch must end before they do
    gap                undeformed distance on x = 0 [m], shape (m,)
    curvature_x        1/R_1 + 1/R_2 in the rolling direction [1/m]
    normal_load        N [N];    effective_modulus  E* [Pa]
    relative_accuracy  of peak pressure, area and approach, from one grid to the one twice as fine
    """
    from scipy.interpolate import CubicSpline

    y, gap = np.asarray(y, dtype=float), np.asarray(gap, dtype=float)
    _check_numbers(y, gap)
    _check_positive(curvature_x, normal_load, effective_modulus)
    touch = gap.min()
    shape = CubicSpline(y, gap - touch)

    def solved(box: _Box, count: int, start: Array | None = None) -> NormalContact:
        x_grid, y_grid = box.centres(count)
        field = 0.5 * curvature_x * x_grid**2 + shape(y_grid)[:, None]
        return _conjugate_gradients(x_grid, y_grid, field, normal_load, effective_modulus, start)

    first = _first_box(y, shape, curvature_x, normal_load, effective_modulus)
    box, coarse = _fit_box(solved, first, (float(y[0]), float(y[-1])))
    points = int(np.count_nonzero(coarse.pressure.max(axis=1)[np.abs(y[:, None] - coarse.y).argmin(axis=1)]))
    if points < FEWEST_ELEMENTS:
        raise CoarseGridError(
            f"the profile has {points} points across the patch, at least {FEWEST_ELEMENTS} are needed"
        )
    contact = _refine(solved, box, coarse, relative_accuracy)
    return replace(contact, approach=contact.approach + float(touch))


def solve_gap(*, x: Array, y: Array, gap: Array, normal_load: float, effective_modulus: float) -> NormalContact:
    """Patch and pressure of any gap [m], shape (y, x), given at the centres x, y [m] of a uniform grid."""
    x, y, gap = (np.asarray(values, dtype=float) for values in (x, y, gap))
    for points, count in ((x, gap.shape[1]), (y, gap.shape[0])):
        _check_numbers(points, np.zeros(count))
        if np.ptp(np.diff(points)) > 1e-6 * (points[1] - points[0]):
            raise ProfileError("the grid must ascend in equal steps")
    _check_numbers(y, gap)
    _check_positive(normal_load, effective_modulus)
    contact = _conjugate_gradients(x, y, gap, normal_load, effective_modulus, None)
    if any(_at_ends(contact.patch)):
        raise DataEdgeError("the loaded patch reaches the end of the gap that is given: extend it outward")
    fewest = min(int(contact.patch.any(axis=axis).sum()) for axis in (0, 1))
    if fewest < FEWEST_ELEMENTS:
        raise CoarseGridError(f"the patch is {fewest} elements across, at least {FEWEST_ELEMENTS} are needed")
    return contact


@dataclass(frozen=True)
class _Box:
    """The part of the plane that is solved: |x| < half_length, first < y < last [m]."""

    half_length: float
    first: float
    last: float

    def centres(self, count: int) -> tuple[Array, Array]:
        """Centres of count by count elements."""
        unit = (np.arange(count) + 0.5) / count
        return self.half_length * (2.0 * unit - 1.0), self.first + (self.last - self.first) * unit


_Solver = Callable[..., NormalContact]


def _first_box(y: Array, shape: Callable[[Array], Array], curvature: float, load: float, modulus: float) -> _Box:
    """Around the patch of a foundation that carries the load."""
    fine = np.linspace(y[0], y[-1], 2000)
    width = float(fine[1] - fine[0])
    line_load = foundation_load(
        gap=shape(fine)[None, :],
        strip_width=width,
        normal_load=np.array([[load]]),
        effective_modulus=np.array([[modulus]]),
    )[0]
    loaded = fine[line_load > 0.0]
    half_length = np.sqrt(4.0 * line_load.max() / (np.pi * modulus * curvature))
    margin = 0.15 * float(loaded[-1] - loaded[0]) + width
    return _Box(1.2 * half_length, max(y[0], loaded[0] - margin), min(y[-1], loaded[-1] + margin))


def _fit_box(solved: _Solver, box: _Box, limits: tuple[float, float]) -> tuple[_Box, NormalContact]:
    """Grow or shrink the box until the patch fills most of it and touches none of its sides."""
    for _ in range(30):
        contact = solved(box, _COARSE)
        low_x, high_x, low_y, high_y = _at_ends(contact.patch)
        if (low_y and box.first <= limits[0]) or (high_y and box.last >= limits[1]):
            raise DataEdgeError("the loaded patch reaches the end of the profile: measure or extend it further outward")
        rows, columns = (np.flatnonzero(contact.patch.any(axis=axis)) for axis in (1, 0))
        width, height = (
            contact.element_size[1] * (np.ptp(rows) + 1),
            0.5 * contact.element_size[0] * (np.ptp(columns) + 1),
        )
        loose = np.ptp(rows) < 0.6 * _COARSE or np.ptp(columns) < 0.6 * _COARSE
        if not (low_x or high_x or low_y or high_y or loose):
            return box, contact
        half_length = box.half_length * 1.5 if low_x or high_x else 1.15 * height
        first = box.first - 0.5 * width if low_y else contact.y[rows[0]] - 0.08 * width
        last = box.last + 0.5 * width if high_y else contact.y[rows[-1]] + 0.08 * width
        box = _Box(half_length, max(limits[0], float(first)), min(limits[1], float(last)))
    raise NoConvergenceError("no grid was found that holds the patch")


def _refine(solved: _Solver, box: _Box, contact: NormalContact, accuracy: float) -> NormalContact:
    """Double the grid until peak pressure, area and approach change less than the accuracy."""
    change = {"nothing": np.inf}
    while contact.x.size < _FINEST:
        before, start = contact, contact.pressure.repeat(2, axis=0).repeat(2, axis=1)
        contact = solved(box, 2 * before.x.size, start)
        change = {
            "peak pressure": abs(before.peak_pressure / contact.peak_pressure - 1.0),
            "area": abs(before.area / contact.area - 1.0),
            "approach": abs(before.approach / contact.approach - 1.0),
        }
        if max(change.values()) <= accuracy:
            return replace(contact, relative_change=max(change.values()))
    worst = max(change, key=lambda name: change[name])
    raise NoConvergenceError(
        f"the {worst} still changes by {change[worst]:.1e} on the finest grid, {accuracy:.1e} was asked for: "
        "smooth what is sharp or rough in the profile"
    )


def _conjugate_gradients(
    x: Array, y: Array, gap: Array, load: float, modulus: float, start: Array | None
) -> NormalContact:
    """Polonsky and Keer's iteration; pressures are scaled by pi E*, so that the deflection is a plain convolution."""
    element = (x[1] - x[0]) * (y[1] - y[0])
    target = load / (element * np.pi * modulus)
    deflect = _deflection(x, y)
    pressure = np.ones_like(gap) if start is None else start.copy()
    pressure *= target / pressure.sum()
    direction, previous, keep = np.zeros_like(gap), 1.0, 0.0
    for _ in range(_MOST_ITERATIONS):
        patch = pressure > 0.0
        distance = deflect(pressure) + gap
        approach = distance[patch].mean()
        distance -= approach
        power = float((distance[patch] ** 2).sum())
        direction = np.where(patch, distance + keep * power / previous * direction, 0.0)
        response = deflect(direction)
        response -= response[patch].mean()
        step = float((distance * direction).sum() / (response * direction).sum())
        new = np.maximum(pressure - step * direction, 0.0)
        overlap = (new == 0.0) & (distance < 0.0) & ~patch
        new[overlap] -= step * distance[overlap]
        keep, previous = float(overlap.sum() < _FEW_ENTER * patch.sum()), power
        new *= target / new.sum()
        change = float(np.abs(new - pressure).sum()) / target
        pressure = new
        if change < _TOLERANCE:
            return NormalContact(x, y, pressure * np.pi * modulus, float(approach))
    raise NoConvergenceError(f"the pressure still changes by {change:.1e} after {_MOST_ITERATIONS} iterations")


def _deflection(x: Array, y: Array) -> Callable[[Array], Array]:
    """The operator from pressure over pi E* to deflection [m] on a grid, by FFT over a doubled domain."""
    from scipy.fft import fft, ifft, irfft, next_fast_len, rfft, rfft2

    size = tuple(next_fast_len(2 * points.size - 1, real=True) for points in (y, x))
    offsets = [np.minimum(k, n - k) for n in size for k in (np.arange(n),)]
    dx, dy = float(x[1] - x[0]), float(y[1] - y[0])
    kernel = rectangle_influence(x=offsets[1] * dx, y=offsets[0][:, None] * dy, dx=dx, dy=dy)
    spectrum = rfft2(kernel)

    def deflect(pressure: Array) -> Array:
        along = rfft(pressure, size[1])  # the padding's rows are zero
        product = fft(along, size[0], axis=0, overwrite_x=True) * spectrum
        array: Array = irfft(ifft(product, axis=0, overwrite_x=True)[: y.size], size[1])
        return array[:, : x.size]

    return deflect


def _beyond(pressure: Array) -> Array:
    """How far the patch reaches past the far side of the last element of every run along axis 1, in elements.

    Near its edge the pressure is sqrt(c * distance): c is seen on the second to fourth element, and the distance is
    what then carries the load of the last three. Shape of pressure; 0 but at the ends of runs of four and more.
    """
    padded = np.pad(pressure, ((0, 0), (3, 1)))
    last, second, third, fourth, outer = (padded[:, 3 - k : padded.shape[1] - 1 - k] for k in (0, 1, 2, 3, -1))
    slope = 0.5 * (fourth**2 - second**2)
    end = (last > 0.0) & (outer == 0.0) & (slope > 0.0)
    distance = (1.5 * (last + second + third) / np.sqrt(np.where(end, slope, 1.0))) ** (2.0 / 3.0)
    return np.where(end, np.clip(distance - 3.0, -0.5, 0.5), 0.0)


def _at_ends(patch: NDArray[np.bool_]) -> tuple[bool, bool, bool, bool]:
    """Whether the patch touches the first and last column, the first and last row."""
    return bool(patch[:, 0].any()), bool(patch[:, -1].any()), bool(patch[0].any()), bool(patch[-1].any())


def _check_numbers(points: Array, values: Array) -> None:
    if points.ndim != 1 or points.size < FEWEST_ELEMENTS or values.shape[:1] != points.shape:
        raise ProfileError(f"values of shape {values.shape} do not lie on {points.shape} points")
    if not (np.isfinite(points).all() and np.isfinite(values).all()):
        raise ProfileError("the profile holds numbers that are not finite (NaN)")
    if np.diff(points).min() <= 0.0:
        raise ProfileError("the points of a profile must ascend")


def _check_positive(*numbers: float) -> None:
    if not all(np.isfinite(number) and number > 0.0 for number in numbers):
        raise NoContactError("the contact needs a positive, finite load, rolling curvature and modulus")
