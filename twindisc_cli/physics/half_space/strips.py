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
almost linearly, and a_j = sqrt(2 q_j / (pi slope_j)) closes smoothly at the edge of a patch.

One iteration is a step in the slope, then a Newton step in q that accounts for it; strips enter and leave the loaded
set between iterations. Under a change of slope with short waves, q follows such that slope * a stays; the curvature
then changes with Psi + t Psi' in place of Psi, and with that the iteration converges in a few steps.

A gap that grows with the load on it, g_i + sum_j C_ij q_j, is solved along with the rest: that is a wear step taken
implicitly, with C_ij the depth that strip i loses during the step per line load on strip j.

Symbols: y [m] uniform, shape (strip,); g [m] gap of both profiles together, shape (..., strip); kappa [1/m] sum of the
rolling curvatures; N [N]; E* [Pa]; delta [m] approach. Valid for a gap symmetric in x, smooth bodies of equal (or
incompressible) material, patches wider than eight strips.

Accuracy against the full solution of `normal`, 256 strips over 2 mm: Hertz a, b, p0, approach within 0.2 %; flats of
0.2 to 1.4 mm on a radius of 30 mm, peak pressure within 0.8 %, area 0.3 %, approach 0.04 %, outer edges within a third
of a strip. A single strip is worse where a sharp shoulder lies inside the patch, for there the pressure along x is not
a semi-ellipse, and at the outer edges: line load up to 3 % of the largest, half-length up to 5 %.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from twindisc_cli.physics.half_space.influence import StripFunctions, strip_functions

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]

FEWEST_STRIPS = 8  # of a track
_MOST_ITERATIONS = 80  # of pressure and strips in contact, at the most
_FIRST_STIFFNESS = 1.45  # line load over E* and approach of a strip: exact for a Hertz ellipse with a/b near 0.6
_ENTRY_LOAD = 1e-3  # of the largest: a strip that comes into contact begins with so little
_ENTRY_CHANGE = 1e-2  # so that no step ends in which strips came or went
_REENTRY_OVERLAP = 5e-5  # forgiven to a strip that left, times four each time it does: it ends coming and going
_CHUNK = 40_000  # elements of an influence matrix at a time: they stay in the processor's cache


@dataclass(frozen=True)
class StripContact:
    """A normal contact on strips; leading dimensions are independent contacts.

    y            centres of the strips [m], shape (strip,)
    half_length  a, half the length of the patch in the rolling direction [m], shape (..., strip); 0 outside
    line_load    q, load per width [N/m], shape (..., strip); 0 outside
    approach     of distant points of the two bodies, from where the gap is as given [m], shape (...)
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


@dataclass(frozen=True)
class _Problem:
    """What is given, over a window of strips.

    y (strip,), gap (case, strip), compliance (case, strip, strip), the rest (case, 1); mirrored: y starts at 0 or
    half a strip beside it, and what lies beyond is the mirror image.
    """

    y: Array
    gap: Array
    curvature: Array
    load: Array
    modulus: Array
    compliance: Array | None
    mirrored: bool = False

    @property
    def width(self) -> float:
        return float(self.y[1] - self.y[0])

    def total(self, values: Array) -> Array:
        """Sum over all strips of values (case, strip), those beyond the mirror included: (case, 1)."""
        whole = values.sum(-1, keepdims=True)
        return np.asarray(2.0 * whole - values[:, :1] * self.twins.start if self.mirrored else whole)

    @property
    def twins(self) -> slice:
        """The strips that have a mirror image: all but one at y = 0."""
        return slice(int(self.y[0] < 0.25 * self.width), None)

    def carried(self, load: Array) -> Array:
        """A line load (case, strip) made to be N in all: strips that have just entered or left have changed its sum."""
        return np.asarray(load * (self.load / (self.total(load) * self.width)))

    def window(self, part: slice) -> _Problem:
        """These strips of all cases."""
        cut = None if self.compliance is None else self.compliance[:, part, part]
        return replace(self, y=self.y[part], gap=self.gap[:, part], compliance=cut)

    def cases(self, part: slice | Mask) -> _Problem:
        """All strips of these cases."""
        cut = None if self.compliance is None else self.compliance[part]
        numbers = self.curvature[part], self.load[part], self.modulus[part]
        return _Problem(self.y, self.gap[part], *numbers, cut, self.mirrored)


@dataclass(frozen=True)
class _State:
    """An iterate: load, slope, loaded, times left of shape (case, strip), approach and error of shape (case, 1)."""

    load: Array
    slope: Array
    loaded: Mask
    left: Array
    approach: Array
    error: Array

    @property
    def half_length(self) -> Array:
        return np.where(self.loaded, np.sqrt(2.0 * self.load / (np.pi * self.slope)), 0.0)

    def cases(self, part: Mask) -> _State:
        """These cases."""
        return _State(**{name: values[part] for name, values in vars(self).items()})


@dataclass(frozen=True)
class Strips:
    """Strips and what presses on them, for one gap after another.

    y (strip,) [m]; cases: shape of the independent contacts; curvature [1/m], load [N], modulus [Pa] of each (case, 1)
    """

    y: Array
    cases: tuple[int, ...]
    curvature: Array
    load: Array
    modulus: Array
    mirrored: bool

    @classmethod
    def of(
        cls,
        *,
        y: Array,
        cases: tuple[int, ...] = (),
        curvature_x: ArrayLike,
        normal_load: ArrayLike,
        effective_modulus: ArrayLike,
        mirrored: bool = False,
    ) -> Strips:
        """Checked, and for as many cases as any of the numbers has.

        curvature_x: 1/R_1 + 1/R_2 in the rolling direction [1/m]; normal_load N [N]; effective_modulus E* [Pa].
        mirrored: y starts at 0, or half a strip beside it, and gap and compliance hold for the mirror image as well; so
        does what is found.
        """
        y = np.asarray(y, dtype=float)
        if y.ndim != 1 or y.size < FEWEST_STRIPS or not np.isfinite(y).all():
            raise ProfileError(f"strips need a row of at least {FEWEST_STRIPS} finite places (no NaN), not {y.shape}")
        spacing = np.diff(y)
        if spacing.min() <= 0.0 or np.ptp(spacing) > 1e-6 * spacing.mean():
            raise ProfileError("the transverse grid must ascend in equal steps")
        values = [np.asarray(number, dtype=float) for number in (curvature_x, normal_load, effective_modulus)]
        if not all(np.all(np.isfinite(value) & (value > 0.0)) for value in values):
            raise NoContactError("the contact needs a positive, finite load, rolling curvature and modulus")
        cases = np.broadcast_shapes(cases, *(value.shape for value in values))
        curvature, load, modulus = (np.broadcast_to(value, cases).reshape(-1, 1) for value in values)
        return cls(y, cases, curvature, load, modulus, mirrored)

    def pressed(
        self,
        gap: Array,
        *,
        compliance: Array | None = None,
        start: StripContact | None = None,
        relative_accuracy: float = 1e-3,
    ) -> StripContact:
        """Line load and half-length of every strip, and the approach.

        gap                undeformed distance of the profiles on x = 0 [m], shape (..., strip)
        compliance         growth of the gap at strip i per line load at strip j [m2/N], shape (..., strip, strip)
        start              an earlier solution of the same shape, close to this one
        relative_accuracy  of the iteration, in the line load over its largest; the strips' own width comes on top
        """
        problem = self._given(gap, compliance)
        chunk = max(1, _CHUNK // max(64, self.y.size // 2) ** 2)
        solved = []
        for first in range(0, len(problem.gap), chunk):
            part = slice(first, first + chunk)
            chosen = problem.cases(part)
            state = _first_state(chosen) if start is None else _warm_state(chosen, start, part)
            solved.append(_converge(chosen, state, relative_accuracy))
        return StripContact(
            y=self.y,
            half_length=np.concatenate([state.half_length for state in solved]).reshape(*self.cases, -1),
            line_load=np.concatenate([state.load for state in solved]).reshape(*self.cases, -1),
            approach=np.concatenate([state.approach for state in solved]).reshape(self.cases),
        )

    def _given(self, gap: Array, compliance: Array | None) -> _Problem:
        """What is given, checked, with all cases in one row."""
        count = self.y.size
        if gap.shape[-1:] != (count,):
            raise ProfileError(f"gap of shape {gap.shape} does not lie on a grid y of shape {self.y.shape}")
        if not np.isfinite(gap).all():
            raise ProfileError("the profile holds numbers that are not finite (NaN)")
        if compliance is not None:
            if not (compliance.shape[-2:] == (count, count) and np.isfinite(compliance).all()):
                raise ProfileError("the compliance must hold a finite number for each pair of strips")
            compliance = np.broadcast_to(compliance, (*self.cases, count, count)).reshape(-1, count, count)
        gap = np.broadcast_to(gap, (*self.cases, count)).reshape(-1, count)
        return _Problem(self.y, gap, self.curvature, self.load, self.modulus, compliance, self.mirrored)


def equivalent_ellipse(contact: StripContact) -> tuple[Array, Array]:
    """Semi-axes a, b [m], each (...), of the ellipse with the area of the patch and its ratio of second moments.

    With Kalker's C11(a/b) of this ellipse and one flexibility L = 8 a / (3 C11 G) on all strips, the force at small
    creepage agrees with the exact theory within 1 % for one patch that grows from Hertz to a flat of 1 mm, and within
    3 % at 1.4 mm. Two patches far apart have no such ellipse.
    """
    length, y = contact.half_length, contact.y
    area = contact.area
    centre = _ratio((length * y).sum(-1), length.sum(-1))
    across = 2.0 * (length * (y - centre[..., None]) ** 2).sum(-1)
    ratio = np.sqrt(2.0 / 3.0 * (length**3).sum(-1) / across)
    return np.sqrt(area / np.pi * ratio), np.sqrt(area / np.pi / ratio)


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


def _first_state(problem: _Problem) -> _State:
    """The load on a foundation, with the slope of an ellipse."""
    load = foundation_load(
        gap=problem.gap, strip_width=problem.width, normal_load=problem.load, effective_modulus=problem.modulus
    )
    slope = np.broadcast_to(0.55 * problem.modulus * problem.curvature, load.shape)
    unknown = np.full_like(problem.load, np.nan)
    return _State(load, slope, load > 0.0, np.zeros_like(load), unknown, unknown)


def _warm_state(problem: _Problem, start: StripContact, part: slice) -> _State:
    load, half_length = (v.reshape(-1, problem.y.size)[part] for v in (start.line_load, start.half_length))
    if load.shape != problem.gap.shape:
        raise ProfileError(f"the start has shape {start.line_load.shape}, the contact {problem.gap.shape}")
    loaded = load > 0.0
    slope = _spread(2.0 / np.pi * _ratio(load, half_length**2), loaded)
    unknown = np.full_like(problem.load, np.nan)
    return _State(problem.carried(load), slope, loaded, np.zeros_like(load), unknown, unknown)


def _converge(problem: _Problem, state: _State, accuracy: float) -> _State:
    """Step on the strips that are or may become loaded, until nothing changes and no strip beyond them overlaps.

    Each case ends by itself, whatever is solved beside it.
    """
    places, ended = np.arange(len(state.load)), list[tuple[Places, _State]]()
    for _ in range(_MOST_ITERATIONS):
        part = _window(state.loaded, problem.mirrored)
        state = _put(_step(problem.window(part), _cut(state, part)), part, problem.y.size)
        state = _touch_beyond(problem, state, part, state.error < accuracy)
        settled = state.error[:, 0] < accuracy
        if settled.any():
            _check_patch(state.loaded[settled], problem.mirrored)
            ended.append((places[settled], replace(state, load=problem.carried(state.load)).cases(settled)))
            if settled.all():
                return _in_order(ended)
            places, problem, state = places[~settled], problem.cases(~settled), state.cases(~settled)
    raise NoConvergenceError(f"the strips did not settle: change {state.error.max():.1e} in step {_MOST_ITERATIONS}")


def _in_order(parts: list[tuple[Places, _State]]) -> _State:
    """The states of all cases, from those of some of them and their places."""
    order = np.argsort(np.concatenate([places for places, _ in parts]))
    names = vars(parts[0][1])
    return _State(**{name: np.concatenate([getattr(state, name) for _, state in parts])[order] for name in names})


def _step(problem: _Problem, state: _State) -> _State:
    """Step in the slope and Newton step in the line load, then strips leave (tension) and enter (overlap)."""
    half_length = np.sqrt(2.0 * np.maximum(state.load, 1e-9 * problem.load / problem.width) / (np.pi * state.slope))
    on = _influence(problem, half_length)
    slope = _new_slope(problem, state, on)
    deflected = _times(on.deflection, state.load)
    tangent = _times(on.load_tangent, state.load)
    # A steeper slope shortens the strip: what that adds to the deflection at constant load.
    shortened = state.load * (slope / state.slope - 1.0)
    shift = _times(on.deflection - on.load_tangent, shortened)
    known = deflected - tangent + shift + np.pi * problem.modulus * problem.gap
    free, unit = np.moveaxis(_solve_loaded(state.loaded, on.load_tangent, known, np.ones_like(known)), -1, 0)
    approach = (problem.load / problem.width + problem.total(free)) / problem.total(unit)
    load = approach * unit - free
    overlap = approach - known - _times(on.load_tangent, load)
    forgiven = (state.left > 0.0) * _REENTRY_OVERLAP * 4.0**state.left if state.left.any() else 0.0
    enter = ~state.loaded & (overlap > forgiven * deflected.max(-1, keepdims=True))
    leave = state.loaded & (load <= 0.0)
    largest = load.max(-1, keepdims=True)
    change = np.abs(load - state.load).max(-1, keepdims=True) / largest
    return _State(
        load=np.where(enter, _ENTRY_LOAD * largest, np.maximum(load, 0.0)),
        slope=_spread(slope, state.loaded & ~leave),
        loaded=(state.loaded & ~leave) | enter,
        left=state.left + leave,
        approach=approach / (np.pi * problem.modulus),
        error=np.where((enter | leave).any(-1, keepdims=True), np.maximum(change, _ENTRY_CHANGE), change),
    )


def _new_slope(problem: _Problem, state: _State, on: StripFunctions) -> Array:
    """The slope after a step towards the rolling curvature, at most halved or doubled."""
    slope = np.where(state.loaded, state.slope, 0.0)
    missing = 2.0 * problem.modulus * problem.curvature - _times(on.curvature, slope)
    change = _solve_loaded(state.loaded, on.slope_tangent, missing)[..., 0]
    return np.asarray(state.slope * np.clip(1.0 + change / state.slope, 0.5, 2.0))


def _solve_loaded(loaded: Mask, matrix: Array, *right: Array) -> Array:
    """Solutions on the loaded strips for each right side, 0 on the others; shape (case, strip, right side)."""
    left = matrix * (loaded[:, :, None] & loaded[:, None, :])
    diagonal = np.arange(loaded.shape[-1])
    left[:, diagonal, diagonal] += ~loaded
    return np.asarray(np.linalg.solve(left, loaded[:, :, None] * np.stack(right, -1)), dtype=float)


def _influence(problem: _Problem, half_length: Array) -> StripFunctions:
    """Influence of strip j on the centre of strip i, times pi E*, each of shape (case, i, j)."""
    y, width = problem.y, problem.width
    edges = np.append(y, y[-1] + width) - 0.5 * width
    # Seen from y_i the strip j spans edges that are mirrored: the functions are odd and depend on y_i - y_j only.
    seen = edges[:, None] - y
    if problem.mirrored:
        seen = np.concatenate([seen, edges[:, None] + y])
    result = strip_functions(seen / half_length[:, None, :])
    over_strip = StripFunctions(*(values[:, 1 : y.size + 1] - values[:, : y.size] for values in result))
    if problem.mirrored:
        for here, values in zip(over_strip, result, strict=True):
            here[..., problem.twins] += (values[:, y.size + 2 :] - values[:, y.size + 1 : -1])[..., problem.twins]
    if problem.compliance is not None:
        growth = np.pi * problem.modulus[..., None] * problem.compliance
        np.add(over_strip.deflection, growth, out=over_strip.deflection)
        np.add(over_strip.load_tangent, growth, out=over_strip.load_tangent)
    return over_strip


def _window(loaded: Mask, mirrored: bool) -> slice:
    """The loaded strips of all cases and some beyond each end."""
    result = np.flatnonzero(loaded.any(axis=0))
    margin = 3 + (result[-1] - result[0]) // 32
    return slice(0 if mirrored else max(0, result[0] - margin), result[-1] + 1 + margin)


def _cut(state: _State, part: slice) -> _State:
    return replace(
        state,
        load=state.load[:, part],
        slope=state.slope[:, part],
        loaded=state.loaded[:, part],
        left=state.left[:, part],
    )


def _put(state: _State, part: slice, size: int) -> _State:
    """The inverse of `_cut`, with the slope carried on to both ends."""

    shape = len(state.load), size
    load, slope, loaded, left = np.zeros(shape), np.zeros(shape), np.zeros(shape, dtype=bool), np.zeros(shape)
    load[:, part], slope[:, part], loaded[:, part], left[:, part] = state.load, state.slope, state.loaded, state.left
    slope[:, : part.start], slope[:, part.stop :] = state.slope[:, :1], state.slope[:, -1:]
    return replace(state, load=load, slope=slope, loaded=loaded, left=left)


def _touch_beyond(problem: _Problem, state: _State, part: slice, settled: Mask) -> _State:
    """Let strips outside the window enter where they overlap in a case that has settled (case, 1).

    So far off, a strip acts as a line of point forces.
    """
    if not settled.any():
        return state
    touching = np.zeros_like(state.loaded)
    for beyond in (slice(0, part.start), slice(part.stop, problem.y.size)):
        if beyond.start < beyond.stop:
            touching[:, beyond] = settled & _overlapping(problem, state, part, beyond)
    if not touching.any():
        return state
    return replace(
        state,
        load=np.where(touching, _ENTRY_LOAD * state.load.max(-1, keepdims=True), state.load),
        loaded=state.loaded | touching,
        error=np.where(touching.any(-1, keepdims=True), np.maximum(state.error, _ENTRY_CHANGE), state.error),
    )


def _overlapping(problem: _Problem, state: _State, part: slice, beyond: slice) -> Mask:
    """Which of some strips, without load themselves, those of a window press into each other (case, strip)."""
    here, there = problem.y[part], problem.y[beyond, None]
    inverse = problem.width / np.abs(there - here)
    if problem.mirrored:
        inverse[:, problem.twins] += problem.width / (there + here[problem.twins])
    influence = inverse / (np.pi * problem.modulus[..., None])
    if problem.compliance is not None:
        influence = influence + problem.compliance[:, beyond, part]
    return np.asarray(_times(influence, state.load[:, part]) + problem.gap[:, beyond] < state.approach)


def _check_patch(loaded: Mask, mirrored: bool) -> None:
    if (loaded[:, 0].any() and not mirrored) or loaded[:, -1].any():
        raise DataEdgeError("the loaded patch reaches the end of the profile: measure or extend it further outward")
    if (fewest := int(loaded.sum(axis=-1).min()) * (2 if mirrored else 1)) < FEWEST_STRIPS:
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
    """Where the line from the last two loaded strips reaches zero, at most one strip beyond the last."""
    last = load.shape[-1] - 1 - np.argmax(load[..., ::-1] > 0.0, axis=-1)
    outer, inner = (np.take_along_axis(load, (last - k)[..., None], -1)[..., 0] for k in (0, 1))
    return np.asarray(y[last] + (y[1] - y[0]) * outer / np.maximum(inner - outer, outer))
