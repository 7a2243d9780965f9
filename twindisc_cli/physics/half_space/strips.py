"""Normal contact as transverse strips: fast enough for a wear loop, close to the full half-space solution.

Every strip of width dy at y_j carries a pressure that is semi-elliptic in the rolling direction, with its own
half-length a_j and line load q_j,

    p(x, y_j) = 2 q_j / (pi a_j) * sqrt(1 - (x/a_j)^2).

On the centre line x = 0 of every loaded strip the deflection and its curvature must fit the undeformed gap
h = kappa x^2 / 2 + g(y), with the influence functions Phi and Psi of `influence`:

    sum_j q_j       dPhi_ij = pi E* (delta - g_i)        sum q_j dy = N        q_j >= 0, no overlap elsewhere
    sum_j q_j/a_j^2 dPsi_ij = pi E* kappa                d..._ij = difference over the width of strip j, seen from y_i

Hertz's ellipse satisfies both exactly, so what is left there is the width of the strips. The pressure is written
p = slope_j * sqrt(a_j^2 - x^2): slope_j varies slowly over y (it is constant for Hertz), enters the second condition
linearly, and a_j = sqrt(2 q_j / (pi slope_j)) closes smoothly at the edge of a patch. One iteration is a Newton step
in q and a damped linear solve for the slope; strips enter and leave the loaded set between steps.

A gap that grows with the load on it, g_i + sum_j C_ij q_j, is solved along with the rest: that is a wear step taken
implicitly, with C_ij the depth that strip i loses during the step per line load on strip j.

Symbols: y [m] uniform, shape (strip,); g [m] gap of both profiles together, shape (..., strip); kappa [1/m] sum of the
rolling curvatures; N [N]; E* [Pa]; delta [m] approach. Valid for a gap symmetric in x, smooth bodies of equal (or
incompressible) material, patches longer than a few strips.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics.half_space import (
    CoarseGridError,
    DataEdgeError,
    NoContactError,
    NoConvergenceError,
    ProfileError,
)
from twindisc_cli.physics.half_space.influence import strip_functions

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEWEST_STRIPS = 8
_MOST_ITERATIONS = 80
_SLOPE_DAMPING = 0.5
# Winkler stiffness of the first guess over E*: the value that makes it exact for a Hertz ellipse with a/b near 0.6.
_FIRST_STIFFNESS = 1.45
# Load of a strip that has just entered, over the largest.
_ENTRY_LOAD = 1e-3
# A strip right at the edge may pull once loaded and overlap once unloaded. From step 20 on it stays out at an overlap
# that grows by this much per step, over the largest deflection.
_FORGIVEN_PER_STEP = 2e-5
# Strips squared times cases that are solved together: keeps the matrices in the processor's cache.
_CHUNK = 40_000


@dataclass(frozen=True)
class StripContact:
    """A normal contact on strips; leading dimensions are independent contacts.

    y            centres of the strips [m], shape (strip,)
    half_length  a, half the length of the patch in the rolling direction [m], shape (..., strip); 0 outside
    line_load    q, load per width [N/m], shape (..., strip); 0 outside
    approach     of distant points of the two bodies [m], shape (...)
    """

    y: Array
    half_length: Array
    line_load: Array
    approach: Array

    @property
    def strip_width(self) -> float:
        """Width of a strip [m]."""
        return float(self.y[1] - self.y[0])

    @cached_property
    def centre_pressure(self) -> Array:
        """Pressure on the centre line x = 0 [Pa], shape (..., strip)."""
        return 2.0 / np.pi * _ratio(self.line_load, self.half_length)

    @property
    def peak_pressure(self) -> Array:
        """Largest pressure of the patch [Pa], shape (...)."""
        return np.asarray(self.centre_pressure.max(axis=-1))

    @property
    def area(self) -> Array:
        """Area of the patch [m2], shape (...)."""
        return np.asarray(2.0 * self.half_length.sum(axis=-1) * self.strip_width)

    @property
    def normal_load(self) -> Array:
        """Load carried by all strips [N], shape (...)."""
        return np.asarray(self.line_load.sum(axis=-1) * self.strip_width)

    @property
    def extent(self) -> tuple[Array, Array]:
        """Outer edges of the patch [m], each of shape (...), found between the strips."""
        return -_outer_edge(-self.y[::-1], self.line_load[..., ::-1]), _outer_edge(self.y, self.line_load)

    @property
    def semi_width(self) -> Array:
        """Half the distance between the outer edges [m], shape (...)."""
        first, last = self.extent
        return 0.5 * (last - first)


@dataclass(frozen=True)
class _Problem:
    """What is given, over a window of strips.

    y (strip,), gap (case, strip), compliance (case, strip, strip), the rest (case, 1).
    """

    y: Array
    gap: Array
    curvature: Array
    load: Array
    modulus: Array
    compliance: Array

    @property
    def width(self) -> float:
        return float(self.y[1] - self.y[0])

    def window(self, part: slice) -> _Problem:
        cut = self.compliance[:, part, part]
        return _Problem(self.y[part], self.gap[:, part], self.curvature, self.load, self.modulus, cut)


@dataclass(frozen=True)
class _State:
    """An iterate: line load, slope and loaded set of shape (case, strip), approach (case, 1), error (case, 1)."""

    load: Array
    slope: Array
    loaded: Mask
    approach: Array
    error: Array

    @property
    def half_length(self) -> Array:
        return np.where(self.loaded, np.sqrt(2.0 * self.load / (np.pi * self.slope)), 0.0)


def solve_strips(
    *,
    y: Array,
    gap: Array,
    curvature_x: ArrayLike,
    normal_load: ArrayLike,
    effective_modulus: ArrayLike,
    compliance: Array | None = None,
    start: StripContact | None = None,
    relative_accuracy: float = 1e-3,
) -> StripContact:
    """Find line load and half-length of every strip, and the approach.

    y                  centres of the strips [m], uniform and ascending, shape (strip,)
    gap                undeformed distance of the profiles on x = 0 [m], any constant added, shape (..., strip)
    curvature_x        1/R_1 + 1/R_2 in the rolling direction [1/m], shape (...)
    normal_load        N [N], shape (...)
    effective_modulus  E* [Pa], shape (...)
    compliance         growth of the gap at strip i per line load at strip j [m2/N], shape (..., strip, strip)
    start              an earlier solution of the same shape, close to this one
    relative_accuracy  of the iteration, in the line load over its largest value; the strips' own width comes on top
    """
    y, gap = np.asarray(y, dtype=float), np.asarray(gap, dtype=float)
    growth = np.zeros((1, 1)) if compliance is None else np.asarray(compliance, dtype=float)
    _check(y, gap, growth)
    given = [np.asarray(value, dtype=float) for value in (curvature_x, normal_load, effective_modulus)]
    if not all(np.all(np.isfinite(value) & (value > 0.0)) for value in given):
        raise NoContactError("the contact needs a positive, finite load, rolling curvature and modulus")
    cases = np.broadcast_shapes(gap.shape[:-1], growth.shape[:-2], *(value.shape for value in given))
    count, strips = math.prod(cases), y.size
    gaps = np.broadcast_to(gap, (*cases, strips)).reshape(count, strips)
    curvature, load, modulus = (np.broadcast_to(value, cases).reshape(count, 1) for value in given)
    growths = np.broadcast_to(growth, (*cases, strips, strips)).reshape(count, strips, strips)
    half_length, line_load, approach = np.zeros((count, strips)), np.zeros((count, strips)), np.zeros(count)
    chunk = max(1, _CHUNK // max(64, strips // 2) ** 2)
    for first in range(0, count, chunk):
        part = slice(first, first + chunk)
        problem = _Problem(y, gaps[part], curvature[part], load[part], modulus[part], growths[part])
        state = _first_state(problem) if start is None else _warm_state(problem, start, part)
        state = _converge(problem, state, relative_accuracy)
        half_length[part], line_load[part] = state.half_length, np.where(state.loaded, state.load, 0.0)
        approach[part] = state.approach[:, 0]
    shape = (*cases, strips)
    return StripContact(y, half_length.reshape(shape), line_load.reshape(shape), approach.reshape(cases))


def foundation_load(*, gap: Array, strip_width: float, normal_load: Array, effective_modulus: Array) -> Array:
    """Line load [N/m] on a Winkler foundation, a first guess: q = k E* max(0, d - g), d in closed form from sorted g.

    gap [m] (case, strip), load [N] and modulus [Pa] (case, 1).
    """
    stiffness = _FIRST_STIFFNESS * effective_modulus
    ordered = np.sort(gap, axis=-1)
    depth = (normal_load / (stiffness * strip_width) + np.cumsum(ordered, axis=-1)) / np.arange(1, gap.shape[-1] + 1)
    above = np.append(ordered[:, 1:], np.full_like(depth[:, :1], np.inf), axis=-1)
    last = np.argmax(depth <= above, axis=-1)[:, None]
    return np.asarray(stiffness * np.maximum(np.take_along_axis(depth, last, -1) - gap, 0.0))


def _check(y: Array, gap: Array, growth: Array) -> None:
    if y.ndim != 1 or y.size < FEWEST_STRIPS or gap.shape[-1:] != y.shape:
        raise ProfileError(f"gap of shape {gap.shape} does not lie on a grid y of shape {y.shape}")
    if not (np.isfinite(y).all() and np.isfinite(gap).all() and np.isfinite(growth).all()):
        raise ProfileError("the profile holds numbers that are not finite (NaN)")
    spacing = np.diff(y)
    if spacing.min() <= 0.0 or np.ptp(spacing) > 1e-6 * spacing.mean():
        raise ProfileError("the transverse grid must ascend in equal steps")


def _first_state(problem: _Problem) -> _State:
    """The load on a foundation, with the slope of an ellipse."""
    load = foundation_load(
        gap=problem.gap, strip_width=problem.width, normal_load=problem.load, effective_modulus=problem.modulus
    )
    slope = np.broadcast_to(0.55 * problem.modulus * problem.curvature, load.shape)
    unknown = np.full_like(problem.load, np.nan)
    return _State(load, slope, load > 0.0, unknown, unknown)


def _warm_state(problem: _Problem, start: StripContact, part: slice) -> _State:
    load, half_length = (v.reshape(-1, problem.y.size)[part] for v in (start.line_load, start.half_length))
    if load.shape != problem.gap.shape:
        raise ProfileError(f"the start has shape {start.line_load.shape}, the contact {problem.gap.shape}")
    loaded = load > 0.0
    scale = problem.load / (load.sum(axis=-1, keepdims=True) * problem.width)
    slope = _spread(2.0 / np.pi * _ratio(load, half_length**2), loaded)
    unknown = np.full_like(problem.load, np.nan)
    return _State(load * scale, slope, loaded, unknown, unknown)


def _converge(problem: _Problem, state: _State, accuracy: float) -> _State:
    """Step on the strips that are or may become loaded, until nothing changes and no strip beyond them overlaps."""
    for number in range(_MOST_ITERATIONS):
        part = _window(state.loaded)
        forgiven = _FORGIVEN_PER_STEP * max(0, number - 20)
        state = _put(_step(problem.window(part), _cut(state, part), forgiven), part, problem.y.size)
        if state.error.max() < accuracy:
            state = _touch_beyond(problem, state, part)
        if state.error.max() < accuracy:
            _check_patch(state.loaded)
            return state
    raise NoConvergenceError(f"the strips did not settle: change {state.error.max():.1e} in step {_MOST_ITERATIONS}")


def _step(problem: _Problem, state: _State, forgiven: float) -> _State:
    """Newton step in the line load, damped solve for the slope, then strips leave (tension) and enter (overlap).

    forgiven is the overlap over the largest deflection below which a strip stays out.
    """
    half_length = np.sqrt(2.0 * np.maximum(state.load, 1e-9 * problem.load / problem.width) / (np.pi * state.slope))
    deflection, tangent, curvature = _matrices(problem, half_length)
    now = _times(deflection, state.load)
    known = now - _times(tangent, state.load) + np.pi * problem.modulus * problem.gap
    free, unit, slope = _solve_loaded(problem, state.loaded, tangent, curvature, known)
    approach = (problem.load / problem.width + free.sum(-1, keepdims=True)) / unit.sum(-1, keepdims=True)
    load = approach * unit - free
    overlap = approach - known - _times(tangent, load)
    enter = ~state.loaded & (overlap > forgiven * now.max(-1, keepdims=True))
    leave = state.loaded & (load <= 0.0)
    largest = load.max(-1, keepdims=True)
    change = np.abs(load - state.load).max(-1, keepdims=True) / largest
    return _State(
        load=np.where(enter, _ENTRY_LOAD * largest, np.maximum(load, 0.0)),
        slope=_new_slope(state, slope, leave),
        loaded=(state.loaded & ~leave) | enter,
        approach=approach / (np.pi * problem.modulus),
        error=np.where((enter | leave).any(-1, keepdims=True), np.inf, change),
    )


def _solve_loaded(
    problem: _Problem, loaded: Mask, tangent: Array, curvature: Array, known: Array
) -> tuple[Array, Array, Array]:
    """Loads for the known deflection, loads for a unit of it, slopes for the rolling curvature; 0 where not loaded."""
    pair = loaded[:, :, None] & loaded[:, None, :]
    alone = np.eye(problem.y.size) * ~loaded[:, None, :]
    left = np.stack([np.where(pair, tangent, alone), np.where(pair, 0.5 * curvature, alone)])
    ones = np.ones_like(known)
    bend = problem.modulus * problem.curvature * ones
    right = np.stack([np.stack([known, ones], -1), np.stack([bend, bend], -1)])
    solved = np.linalg.solve(left, np.where(loaded[:, :, None], right, 0.0))
    return solved[0, ..., 0], solved[0, ..., 1], solved[1, ..., 0]


def _new_slope(state: _State, solved: Array, leave: Mask) -> Array:
    """The damped slope of the strips that stay, carried on to the others."""
    stay = state.loaded & ~leave
    ratio = np.clip(np.where(stay, solved, state.slope) / state.slope, 0.5, 2.0)
    return _spread(state.slope * ratio**_SLOPE_DAMPING, stay)


def _matrices(problem: _Problem, half_length: Array) -> tuple[Array, Array, Array]:
    """Influence of strip j on the centre of strip i, times pi E*, each of shape (case, i, j)."""
    y, growth = problem.y, np.pi * problem.modulus[..., None] * problem.compliance
    edges = np.append(y, 2.0 * y[-1] - y[-2]) - 0.5 * (y[1] - y[0])
    deflection, tangent, curvature = strip_functions((edges[:, None] - y) / half_length[:, None, :])
    # Seen from y_i the strip j spans edges that are mirrored: the functions are odd and depend on y_i - y_j only.
    return np.diff(deflection, axis=1) + growth, np.diff(tangent, axis=1) + growth, np.diff(curvature, axis=1)


def _window(loaded: Mask) -> slice:
    """The loaded strips of all cases and some beyond each end."""
    found = np.flatnonzero(loaded.any(axis=0))
    margin = max(3, (found[-1] - found[0]) // 12)
    return slice(max(0, found[0] - margin), found[-1] + 1 + margin)


def _cut(state: _State, part: slice) -> _State:
    return _State(state.load[:, part], state.slope[:, part], state.loaded[:, part], state.approach, state.error)


def _put(state: _State, part: slice, size: int) -> _State:
    """The inverse of `_cut`, with the slope carried on to both ends."""
    pad = ((0, 0), (part.start, max(0, size - part.stop)))
    return _State(
        np.pad(state.load, pad),
        np.pad(state.slope, pad, mode="edge"),
        np.pad(state.loaded, pad),
        state.approach,
        state.error,
    )


def _touch_beyond(problem: _Problem, state: _State, part: slice) -> _State:
    """Let strips outside the window enter where they overlap; so far off, a strip acts as a line of point forces."""
    beyond = np.ones(problem.y.size, dtype=bool)
    beyond[part] = False
    if not beyond.any():
        return state
    inverse = problem.width / np.abs(problem.y[beyond][:, None] - problem.y[part])
    influence = inverse / (np.pi * problem.modulus[..., None]) + problem.compliance[:, beyond, part]
    deflection = _times(influence, state.load[:, part])
    enter = np.zeros_like(state.loaded)
    enter[:, beyond] = deflection + problem.gap[:, beyond] < state.approach
    load = np.where(enter, _ENTRY_LOAD * state.load.max(-1, keepdims=True), state.load)
    error = np.where(enter.any(-1, keepdims=True), np.inf, state.error)
    return _State(load, state.slope, state.loaded | enter, state.approach, error)


def _check_patch(loaded: Mask) -> None:
    if loaded[:, 0].any() or loaded[:, -1].any():
        raise DataEdgeError("the loaded patch reaches the end of the profile: measure or extend it further outward")
    if (fewest := int(loaded.sum(axis=-1).min())) < FEWEST_STRIPS:
        raise CoarseGridError(
            f"only {fewest} strips carry load, at least {FEWEST_STRIPS} are needed: refine the grid in y"
        )


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _spread(values: Array, known: Mask) -> Array:
    """Fill the unknown values of each row with the nearest known one to the left, else to the right."""
    index = np.where(known, np.arange(known.shape[-1]), -1)
    left = np.maximum.accumulate(index, axis=-1)
    first = np.argmax(known, axis=-1)[:, None]
    return np.asarray(np.take_along_axis(values, np.where(left < 0, first, left), axis=-1))


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Their ratio, 0 where the denominator is 0."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0.0)


def _outer_edge(y: Array, load: Array) -> Array:
    """Where the line load reaches zero beyond the last loaded strip.

    The last three strips together hold the load of a triangle with the slope seen just inside them, which is steadier
    than the last strip alone.
    """
    width = y[1] - y[0]
    last = load.shape[-1] - 1 - np.argmax(load[..., ::-1] > 0.0, axis=-1)
    q = [np.take_along_axis(load, np.maximum(last - k, 0)[..., None], -1)[..., 0] for k in range(4)]
    slope = np.maximum(0.5 * (q[3] - q[1]), 0.1 * q[0])
    length = np.sqrt(2.0 * (q[0] + q[1] + q[2]) / slope)
    return np.asarray(y[last] + width * np.clip(length - 2.5, 0.0, 1.0))
