"""The level that each test has of its own (mu, K, h S) beside the terms that it shares with others.

log p_i = m + u_i + e_i,   cov(u_i, u_j) = tau^2 rho^|i - j|

p_i   base parameter of test i in the order in which the tests are given
u_i   its level about the mean of all, which scatters by tau and is correlated between neighbours by rho
e_i   error of its estimate, widened by what the fit leaves

Of a parameter that the tests share, as K, p_i is what a fit leaves of each of them, to first order beside its terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.hierarchy import Wander, pool, prediction_half, wander
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Case
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Floats, Ints


@dataclass(frozen=True)
class Levels:
    """A base parameter of several tests: their numbers (test,), and how its logarithm scatters over their order."""

    key: str
    unit: str
    tests: Ints
    wander: Wander

    @property
    def value(self) -> Floats:
        """As fitted (test,), in `unit`."""
        return np.exp(self.wander.y)

    @property
    def shrunk(self) -> Floats:
        """As its neighbours in the order let expect it, too (test,), in `unit`."""
        return np.exp(self.wander.level(self.tests)[0])

    @property
    def drift(self) -> float:
        """Relative change of the shrunk level from the first to the last test [1]."""
        shrunk = self.shrunk
        return float(shrunk[-1] / shrunk[0] - 1.0)

    @property
    def range(self) -> float:
        """Largest shrunk level over the smallest, less one [1]."""
        shrunk = self.shrunk
        return float(shrunk.max() / shrunk.min() - 1.0)

    def drawn(self, place: float | None = None) -> tuple[float, float, float]:
        """The level of another test with its 90 % interval: at a place in the order, or drawn from the scatter."""
        if place is None:
            pooled = pool(self.wander.y, self.wander.s)
            middle, std = pooled.mean, float(np.hypot(pooled.between, pooled.std))
        else:
            middle, std = (float(values[0]) for values in self.wander.level(place))
        half = prediction_half(len(self.tests), std)
        low, value, high = np.exp(middle + half * np.array([-1.0, 0.0, 1.0]))
        return float(value), float(low), float(high)


def is_apart(distance: float, scatter: float) -> bool:
    """Whether a level lies further from the others, in its logarithm, than repeats of a test do, or than these do."""
    return abs(distance) > ACCEPTANCE.level_apart * max(scatter, ACCEPTANCE.repeat_scatter)


def apart_from_others(levels: Levels) -> list[tuple[int, float]]:
    """Numbers of tests whose level lies apart from those of at least two others, and how many times theirs it is."""
    y, found = levels.wander.y, []
    for i, number in enumerate(levels.tests if len(y) > 2 else ()):
        others = np.delete(y, i)
        distance = float(y[i] - np.median(others))
        if is_apart(distance, float(np.std(others, ddof=1))):
            found.append((int(number), float(np.exp(distance))))
    return found


def levels_of(fits: Sequence[Fit], tests: Sequence[int] | None = None) -> dict[str, Levels]:
    """Levels of the base parameters that at least two tests show, by key, from a fit of all tests or one of each.

    tests: the number of each case in the order of the fits; from 0 on where not given.
    """
    rows: dict[str, list[tuple[int, float, float, str]]] = {}
    first = 0
    for fitted in fits:
        wide = fitted.excess
        for i, p in enumerate(fitted.problem.parameters):
            own = p.case if p.case is not None else 0 if len(fitted.problem.cases) == 1 else None
            if p.term is None and own is not None:
                number = first + own if tests is None else tests[first + own]
                std = float(np.sqrt(wide * fitted.covariance[i, i]))
                rows.setdefault(p.key, []).append((number, float(fitted.theta[i]), std, p.unit))
        for key, own, inner, std, unit in _of_shared(fitted) if len(fitted.problem.cases) > 1 else ():
            number = first + own if tests is None else tests[first + own]
            rows.setdefault(key, []).append((number, inner, std, unit))
        first += len(fitted.problem.cases)
    return {key: _levels(key, row) for key, row in rows.items() if len(row) > 1}


def _of_shared(fitted: Fit) -> list[tuple[str, int, float, float, str]]:
    """What each test says of base parameters that all share: key, test, inner value, its error, unit.

    To first order: the other base parameters move with them, the terms stay as fitted.
    """
    problem, base = fitted.problem, [(i, p) for i, p in enumerate(fitted.problem.parameters) if p.term is None]
    shared = [(i, p, number) for i, p in base if p.case is None for number in range(len(problem.cases))]
    columns = [np.where(problem.owner == number, fitted.jacobian[:, i], 0.0) for i, _, number in shared]
    others = [fitted.jacobian[:, i] for i, p in base if p.case is not None]
    slopes = np.column_stack([*columns, *others])
    inverse = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    moved, std = -inverse @ (slopes.T @ fitted.residual), np.sqrt(fitted.excess * np.diag(inverse))
    return [
        (
            p.key,
            number,
            float(fitted.theta[i] + _declared(problem.cases[number], p.key) + moved[at]),
            float(std[at]),
            p.unit,
        )
        for at, ((i, p, number), column) in enumerate(zip(shared, columns, strict=True))
        if column.any() and std[at] > 0.0
    ]


def _declared(case: Case, key: str) -> float:
    """How far declared effects lift a base parameter of one test above that of the others, in its logarithm."""
    levels = [values for name, values in case.test.effects.items() if catalogue()[name].level_of == key]
    return float(sum(np.log(value) for values in levels for value in values.values()))


def _levels(key: str, rows: Sequence[tuple[int, float, float, str]]) -> Levels:
    numbers, inner, std, units = zip(*rows, strict=True)
    return Levels(key, units[0], np.array(numbers), wander(inner, std, numbers))
