"""The level that each test has of its own (mu, K, h S) beside the terms that it shares with others.

log p_i = m + u_i + e_i,   cov(u_i, u_j) = tau^2 rho^|i - j|

p_i   base parameter of test i in the order in which the tests are given
u_i   its level about the mean of all, which scatters by tau and is correlated between neighbours by rho
e_i   error of its estimate, widened by what the fit leaves

Of a parameter that the tests share, as K, p_i is what a fit leaves of each of them, to first order beside its terms.

log p_i = a + b x_i + e_i,   F = b^2 sum w (x - m)^2 / max[sum w e^2 / (n - 2), 1] ~ F(1, n - 2)

x_i   logarithm of what differs between the tests and is constant within each, or itself where it has no zero of its own
w_i   1 / (s_i^2 + t^2), with s_i the standard error of log p_i and t the scatter about the line beyond it
m     weighted mean of x
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, fdtrc

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.hierarchy import SAME, Wander, pool, prediction_half, wander
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Case
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.quantities import UNITS

FOLLOWS = 0.05
"""Levels are said to go with what differs between the tests below this probability of so much by chance."""
OF_THREE = 0.95
"""Share of the variance that a line through the levels of three tests explains, to be named without a proof."""
ENVIRONMENT = "environment_temperature"
"""What the temperature around the discs, over which there are no laws, is called among what differs."""


@dataclass(frozen=True)
class Follows:
    """A line of the logarithm of the levels over what differs between the tests, by the name of a covariate.

    slope: an exponent [1] where `power`, else a relative change in 1 / unit of the covariate; std: its standard error.
    share: of the variance that it explains. p_value: of so much by chance, times the number of covariates that differ.
    others: of these, the ones over which a line is as well founded.
    """

    covariate: str
    power: bool
    slope: float
    std: float
    share: float
    p_value: float
    others: tuple[str, ...] = ()

    @property
    def proven(self) -> bool:
        """Whether chance is excluded; else three tests lie on a line."""
        return self.p_value < FOLLOWS


@dataclass(frozen=True)
class Levels:
    """A base parameter of several tests: their numbers (test,), and how its logarithm scatters over their order.

    follows: what it goes with that differs between the tests.
    """

    key: str
    unit: str
    tests: Ints
    wander: Wander
    follows: Follows | None = None

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


# ------------------------------------------------------------------------------------------------- what differs


def with_what_differs(every: Mapping[str, Levels], tests: Sequence[Experiment]) -> dict[str, Levels]:
    """Levels by key with what they follow that differs between the tests, in the order of their numbers."""
    differing = differing_between(tests)
    return {key: replace(levels, follows=followed(levels, differing)) for key, levels in every.items()}


def differing_between(tests: Sequence[Experiment]) -> dict[str, Floats]:
    """Means of each test (test,) of what differs more between the tests than within each, in the units of laws."""
    every = [_recorded(test) for test in tests]
    common = [name for name in every[0] if all(name in of for of in every)]
    means = {name: np.array([float(np.mean(of[name])) for of in every]) for name in common}
    within = {name: float(np.mean([np.std(of[name]) for of in every])) for name in common}
    return {name: x for name, x in means.items() if np.all(np.isfinite(x)) and np.std(x) > within[name] and _differs(x)}


def _differs(x: Floats) -> bool:
    """Whether numbers differ by more than numbers that are meant to be the same do."""
    return bool(np.ptp(x) > SAME * np.abs(x).max())


def _recorded(test: Experiment) -> dict[str, Floats]:
    """What may be constant within a test and differ from the others' (sample,), in the units of laws."""
    driven, columns = test.history.driven, test.measured.columns
    found = {
        "load": test.rig.normal_load * test.history.load_factor[driven],
        "rolling_speed": test.rig.rolling_speed * test.history.speed_factor[driven],
        **{name: column.values for name, column in columns.items()},
    }
    found = {name: covariate_of(name).quantity.shown.of_si(values) for name, values in found.items()}
    if test.thermal is not None:
        found[ENVIRONMENT] = UNITS["degC"].of_si([test.thermal.environment_temperature])
    return found


def followed(levels: Levels, differing: Mapping[str, Floats]) -> Follows | None:
    """The best founded line of at least three levels over what differs between the tests, (test,) by covariate."""
    y, s, own = levels.wander.y, levels.wander.s, {name: x[levels.tests] for name, x in differing.items()}
    if len(y) < 3 or np.ptp(y) == 0.0:
        return None
    lines = [_line(y, s, name, x, len(differing)) for name, x in own.items() if _differs(x)]
    founded = sorted((line for line in lines if _holds(line, y, s)), key=lambda line: -line.share)
    return replace(founded[0], others=tuple(line.covariate for line in founded[1:])) if founded else None


def _line(y: Floats, s: Floats, name: str, x: Floats, tried: int) -> Follows:
    """The line of log levels y with standard errors s over a covariate, each (test,), one of so many that differ."""
    power = bool(np.all(x > 0.0)) and not _has_no_zero(name)
    x, free = np.log(x) if power else x, len(y) - 2
    plain = y - np.polyval(np.polyfit(x, y, 1), x)
    w = 1.0 / (s**2 + max(float(plain @ plain) / free - float(np.mean(s**2)), 0.0))
    x, y = x - np.average(x, weights=w), y - np.average(y, weights=w)
    spread = float(w @ x**2)
    slope = float(w @ (x * y)) / spread
    left = float(w @ (y - slope * x) ** 2)
    noise = max(left / free, 1.0)
    p_value = min(1.0, tried * float(fdtrc(1, free, slope**2 * spread / noise)))
    return Follows(name, power, slope, float(np.sqrt(noise / spread)), 1.0 - left / float(w @ y**2), p_value)


def _has_no_zero(name: str) -> bool:
    """Whether a covariate is a temperature on a scale whose zero is a convention."""
    return name == ENVIRONMENT or covariate_of(name).quantity.shown.offset != 0.0


def _holds(line: Follows, y: Floats, s: Floats) -> bool:
    """Whether chance is excluded; of three tests also where they lie on a line and differ by more than repeats do."""
    if line.proven or len(y) > 3:
        return line.proven
    w = 1.0 / (s**2 + ACCEPTANCE.repeat_scatter**2)
    apart = float(w @ (y - np.average(y, weights=w)) ** 2)
    return line.share >= OF_THREE and bool(chdtrc(len(y) - 1, apart) < FOLLOWS)
