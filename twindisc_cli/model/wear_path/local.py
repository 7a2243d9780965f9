"""Wear paths on which every strip wears by its own K: integrated beside one on which all wear by the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from twindisc_cli.model.experiment import Floats, Ints, Rig
from twindisc_cli.model.integration import Loaded, Setup, Weights, integrate
from twindisc_cli.model.wear_path.path import (
    CREEPAGES,
    STRAIGHT,
    WearPath,
    edges_of,
    paths_of,
    power_of_strips,
    sides_of,
)
from twindisc_cli.physics.half_space import OutOfRangeError

SAMPLES = 4
"""How often in a step of an integration the history is asked."""
BEYOND = 1.2
"""How far beyond the sections that are counted an integration of local wear goes."""
FEWEST_STEPS = 32
"""Steps of an integration of local wear, at least."""
PASSING = 0.1
"""Where a step of an integration of local wear is left, as `integration.SETTLED`: ten times less moves depths by up to
0.08 %."""
EVEN_STEPS = 8
"""The even integration beside it goes on to a multiple of so many steps, to serve others."""
Factors = Callable[[Floats, Floats, Floats], Floats]
"""K over its base value for wear indices [N/m2], places across the track [m] and passes of strips, (case, any)."""


@dataclass(frozen=True)
class Course:
    """A history as the strips see it, of each case after each of its pieces, (case, point).

    section   worn [m2], of the discs under the path's load;   pace  energy dissipated per length rolled [N]
    creepage  normalised [1];   cycles  revolutions so far
    """

    section: Floats
    pace: Floats
    creepage: Floats
    cycles: Floats

    def of(self, cases: Ints | list[int]) -> Course:
        """Some of the cases."""
        return Course(self.section[cases], self.pace[cases], self.creepage[cases], self.cycles[cases])


def local_paths(rig: Rig, path: WearPath, course: Course, factors: Factors, *, by_place: bool) -> list[WearPath]:
    """The path of each case (case,) on which every strip wears by its own K, which may depend on its place.

    Where K is the same in all strips, it is the path itself; along a line its wear index and passes are.
    The sections are those before anything is known of the own paths, on which more may be worn.
    """
    section = course.section
    if path.scaling is STRAIGHT:
        if by_place:
            raise OutOfRangeError(
                "along a line contact a wear coefficient that changes across the track is not followed"
            )
        return [path] * len(section)
    path, steps = _divided(path, BEYOND * float(section.max()))
    nodes = path.section[: steps + 1]
    weighted = weights_on(nodes, path.y, course=course, factors=factors)
    setup = Setup(rig, path.contact, path.wander, path.start)
    integrated = integrate(
        setup, path.y, nodes, cases=len(section), weights=weighted, mirrored=not by_place, settled=PASSING
    )
    further = path.section[: EVEN_STEPS * -(-steps // EVEN_STEPS) + 1]
    even = _integrated_evenly(setup, float(path.y[-1]), len(path.y), tuple(further.tolist()))
    errors = path.error, path.pressure_error
    own = paths_of(setup, integrated, y=path.y, nodes=nodes, errors=errors, creepages=CREEPAGES[-1:])
    path, even = path.on(nodes), even.on(nodes)
    return [_moved(path, one, even) for one in own]


def weights_on(nodes: Floats, y: Floats, *, course: Course, factors: Factors) -> Weights:
    """The weights of an integration through nodes (node,) or (case, node) [m2] on strips y [m], of each case."""
    section, steps = course.section, np.diff(nodes)[..., None]
    along = nodes[..., :-1, None] + (np.arange(SAMPLES) + 0.5) / SAMPLES * steps
    along = np.broadcast_to(along, (len(section), *along.shape[-2:]))
    piece = [np.searchsorted(own, places) for own, places in zip(section, along, strict=True)]
    piece = np.minimum(piece, section.shape[1] - 1)
    pace, creepage = (np.take_along_axis(of[:, None, :], piece, axis=-1) for of in (course.pace, course.creepage))
    cycles = [np.interp(*of) for of in zip(along, section, course.cycles, strict=True)]
    return _LocalWeights(pace, creepage, np.array(cycles), factors, np.full((len(section), len(y)), np.inf))


def _divided(path: WearPath, section: float) -> tuple[WearPath, int]:
    """A path with at least FEWEST_STEPS steps up to a section [m2], into which its own are divided, and how many go."""
    last = len(path.section) - 1
    steps = min(last, max(1, int(np.searchsorted(path.section, section, side="right"))))
    if steps >= FEWEST_STEPS:
        return path, steps
    part = steps / FEWEST_STEPS
    at = part * np.arange(int(last / part) + 1)
    return path.on(np.interp(at, np.arange(last + 1), path.section)), FEWEST_STEPS


@lru_cache(maxsize=64)
def _integrated_evenly(setup: Setup, half: float, count: int, nodes: tuple[float, ...]) -> WearPath:
    """The path integrated nodes [m2] on so many strips within a half-width [m], all of which wear by one K."""
    y, along = np.linspace(-half, half, count), np.array(nodes)
    integrated = integrate(setup, y, along, settled=PASSING)
    (own,) = paths_of(setup, integrated, y=y, nodes=along, errors=(np.nan, np.nan), creepages=CREEPAGES[-1:])
    return own


def _share(part: Floats, whole: Floats) -> Floats:
    """Part of a whole (node, strip), at most 1; beyond the outermost strips where there is any, as in these."""
    there, strip = whole > 0.0, np.arange(whole.shape[1])
    first, last = np.argmax(there, axis=1), len(strip) - 1 - np.argmax(there[:, ::-1], axis=1)
    inside = np.clip(strip, first[:, None], last[:, None])
    share = np.divide(part, whole, out=np.zeros_like(whole), where=there)
    return np.asarray(np.minimum(np.take_along_axis(share, inside, axis=1), 1.0))


def _moved(path: WearPath, own: WearPath, even: WearPath) -> WearPath:
    """The path, moved as far as the integration with own wear coefficients lies from that with even ones, node by node.

    What the steps of both integrations leave of error is the same to first order, and falls out. Wear indices of both
    are known where all slides; in partial slip they lie as far apart.
    """

    def ratio(name: str) -> Floats:
        return np.asarray(getattr(path, name) * getattr(own, name) / getattr(even, name))

    depth = own.depth + _share(own.depth, even.depth) * (path.depth - even.depth)
    worn = depth.sum(axis=1, keepdims=True) * (path.y[1] - path.y[0])
    depth *= np.divide(own.section[:, None], worn, out=np.ones_like(worn), where=worn > 0.0)
    b = ratio("b")
    return replace(
        own,
        depth=depth,
        a=ratio("a"),
        b=b,
        p0=ratio("p0"),
        area=ratio("area"),
        stiffness=ratio("stiffness"),
        stiffness_y=ratio("stiffness_y"),
        square=path.square + own.square - even.square,
        edge=edges_of(path.y, depth, b),
        spread=ratio("spread"),
    )


@dataclass(frozen=True)
class _LocalWeights:
    """Weights of an integration by the wear index of each strip, its place and the passes over it.

    pace: energy per length rolled [N], creepage: normalised [1], cycles: revolutions so far, at SAMPLES of each step
    (case, step, sample); first: revolutions before the first contact of each strip (case, strip), filled in as the
    integration goes.
    """

    pace: Floats
    creepage: Floats
    cycles: Floats
    factors: Factors
    first: Floats

    def __call__(self, step: int, y: Floats, loaded: Loaded) -> Floats:
        """K of each strip over the mean of the energy's, (case, strip), itself a mean over the step."""
        load, intensity = loaded.line_load[:, None, :], loaded.intensity[:, None, :]
        power = power_of_strips(y, load, intensity, self.creepage[:, step, :, None])
        factor = self._factor(step, y, loaded, self.pace[:, step, :, None] * intensity * power)
        share = power * load * sides_of(y)
        mean = np.sum(factor * share, axis=-1, keepdims=True) / share.sum(axis=-1, keepdims=True)
        return np.asarray(np.where(mean > 0.0, factor / np.where(mean > 0.0, mean, 1.0), 1.0).mean(axis=1))

    def _factor(self, step: int, y: Floats, loaded: Loaded, index: Floats) -> Floats:
        """K over its base value in each strip, (case, sample, strip)."""
        cycles, first = self.cycles[:, step, :, None], self.first[:, : len(y)]
        np.minimum(first, np.where(loaded.line_load > 0.0, cycles[:, 0], np.inf), out=first)
        passes = np.maximum(cycles - first[:, None, :], 0.0)
        place = np.broadcast_to(y, index.shape)
        flat = (values.reshape(len(index), -1) for values in (index, place, passes))
        return self.factors(*flat).reshape(index.shape)
