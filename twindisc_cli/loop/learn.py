"""Learning a law: which quantity changes over which covariate, and how, from what the present model leaves.

    change(x) = sum_j f_j [x in bin j],   A = G'G,  g = G'r
    log Z     = f's prior N(0, s^2 k) integrated: g'L (1 + L'A L)^-1 L'g / 2 - log|1 + L'A L| / 2,   s^2 k = L L'

    r   white residual of the present fit, G its response to the bins, both without what the fitted parameters absorb

The families (a line, exponentials, powers, steps, windows, humps, waves, smooth curves) are averaged inside, then over
each other, so that a flexible family pays for its flexibility. To first order the forward model is asked once a bin.
Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning (2006), section 5.4.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from twindisc_cli.effects._effect import FIRST_SEEN
from twindisc_cli.identify.span import span_of
from twindisc_cli.laws.covariates import Column, covariate_of
from twindisc_cli.laws.law import Law, law_key
from twindisc_cli.laws.quantities import MULTIPLIED, QUANTITIES
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.laws.trial import Trial, bins, curve, formula
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.terms import in_test
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.ties import falling, first_of_most
from twindisc_cli.loop.validate import LinearPrediction
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.points import knows_times
from twindisc_cli.model.prediction import Prediction

MOST_BINS = 28  # of a covariate, more than a curve has knots
TIME_BINS = 60  # steps in time are sharper than any other change
ACROSS_BINS = 40  # across the track: narrower than a shoulder
KNOTS, STRONG_KNOTS = 20, 40  # of a curve, at the most, and of one that says much
FEWEST_KNOTS = 3  # of a curve: two are a line
ACROSS_KNOTS = 27  # of a curve across the track, both sides of it
LEVELS = np.array([0.1, 0.3, 1.0, 3.0])
LENGTHS = np.array([0.08, 0.15, 0.3, 0.6, 1.2])
UNTIMED = ("creepage", "y_over_edge", "load", "pressure", "rolling_speed", "order")
"""Covariates that samples recorded without time can show."""
WHERE_LOADS_DIFFER: Mapping[str, Sequence[str]] = {"sliding_distance": ("mu", "wear"), "power": ("mu",)}
"""Covariates over which some quantities are learnt only where loads differ: under one, the energy goes with the sliding
distance and the power with the creepage."""
GROWING = ("time", "energy", "sliding_distance")
"""Covariates that only grow in a test: what jumps at one moment jumps at one place of each."""
CHOSEN = {"step": 1, "window": 2}
"""Parameters of a formula that are chosen among the bins and not fitted."""
PARTS = np.linspace(-1.0, 1.0, 9)
"""Of the bins beside an edge, which lie inside where it stands elsewhere."""
POSITIVE = ("width", "scale", "period")
"""Parameters of formulas that are positive."""
CLOSE, CLOSER = 7, 3
"""Values of a parameter of a strong change that are tried between its neighbours on a grid, and how often."""
NOTHING = 1e-12  # rounding, relative to the longest response


@dataclass(frozen=True)
class Pair:
    """A quantity over a covariate, as the present fit sees it.

    edges (bin + 1,) and places (bin,) in the covariate's unit; A (bin, bin), g (bin,); typical: size of a change;
    samples: of the channel that the quantity shows in. test: the only one in which the law would act. change: of the
    quantity, to which the samples respond so. slopes: their responses (sample, bin), of which A is what base parameters
    do not absorb. responding: the places to which samples that are fitted respond, where A is not theirs alone.
    """

    quantity: str
    covariate: str
    edges: Floats
    places: Floats
    A: Floats
    g: Floats
    typical: float
    samples: int
    test: str = ""
    change: float = 0.0
    slopes: Floats = field(default_factory=lambda: np.empty((0, 0)), repr=False)
    responding: Mask | None = None

    @property
    def name(self) -> str:
        """What a law of this pair is called."""
        return in_test(law_key(self.quantity, self.covariate), self.test)

    @property
    def span(self) -> tuple[float, float]:
        """Range of the covariate."""
        return float(self.places[0]), float(self.places[-1])

    @cached_property
    def members(self) -> list[tuple[str, list[dict[str, float]], Floats]]:
        """Families of formulas: shape, start values of each member, and the members' values (bin, member)."""
        only = QUANTITIES[self.quantity].shapes
        return [
            (shape, starts, np.array(columns).T)
            for shape, starts, columns in _families(self.places, self.edges)
            if not only or shape in only
        ]

    @cached_property
    def log_evidence(self) -> float:
        """Logarithm of the evidence of a law over this pair, relative to none."""
        result = [self._of_formulas(columns) for _, _, columns in self.members]
        if not QUANTITIES[self.quantity].shapes:
            result.append(self._of_curves())
        return float(logsumexp(result) - np.log(len(result))) if result else -np.inf

    def _of_formulas(self, columns: Floats) -> float:
        length, along = self._seen(columns)
        variance = (LEVELS[:, None] * self.typical) ** 2
        each = 0.5 * variance * along**2 / (1.0 + variance * length) - 0.5 * np.log1p(variance * length)
        return float(logsumexp(each) - np.log(each.size))

    def _of_curves(self) -> float:
        return float(logsumexp(self._curves[0]) - np.log(self._curves[0].size))

    @cached_property
    def _curves(self) -> tuple[Floats, list[tuple[float, float]]]:
        """Evidence of smooth curves, and the length and size of each."""
        result, which = [], []
        for length in LENGTHS:
            root = np.linalg.cholesky(_matern(self.places, length) + 1e-9 * np.eye(len(self.places)))
            value, vector = np.linalg.eigh(root.T @ self.A @ root)
            value, along = np.maximum(value, 0.0), vector.T @ (root.T @ self.g)
            for level in LEVELS * self.typical:
                v = level**2
                result.append(float(np.sum(0.5 * v * along**2 / (1.0 + v * value) - 0.5 * np.log1p(v * value))))
                which.append((float(length), float(level)))
        return np.array(result), which

    def _seen(self, columns: Floats) -> tuple[Floats, Floats]:
        """Squared length of each member's response (member,), and how far the residual goes along it."""
        length = np.sum(columns * (self.A @ columns), axis=0)
        seen = length > NOTHING * max(float(length.max(initial=0.0)), 1e-300)
        return np.where(seen, length, 0.0), np.where(seen, columns.T @ self.g, 0.0)

    def _closer(
        self, shape: str, starts: Sequence[Mapping[str, float]], best: int, column: Floats
    ) -> tuple[dict[str, float], Floats]:
        """The best start of a family and its values (bin,), sought closer and closer between its neighbours.

        Where a change is many times the noise, a formula that is right promises less than another, or a curve, as long
        as its place or its width is that of a coarse grid.
        """
        free = [key for key in starts[best] if key not in SHAPES[shape].fixed]
        start = {key: _unbounded(key, starts[best][key]) for key in free}
        reach = {key: _apart(sorted({_unbounded(key, each[key]) for each in starts}), start[key]) for key in free}
        values = dict(starts[best])
        for _ in range(CLOSER if free else 0):
            axes = [start[key] + reach[key] * np.linspace(-1.0, 1.0, CLOSE) for key in free]
            sets = dict(zip(free, (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")), strict=True))
            tried = {key: _bounded(key, each) for key, each in sets.items()}
            columns = SHAPES[shape].value(self.places[:, None], **{**values, **tried})
            gain = _gain(*self._seen(columns))
            at = first_of_most(gain)
            if gain[at] > _gain(*self._seen(column[:, None]))[0]:
                start, column = {key: float(each[at]) for key, each in sets.items()}, columns[:, at]
                values |= {key: float(each[at]) for key, each in tried.items()}
            reach = {key: 2.0 * each / (CLOSE - 1) for key, each in reach.items()}
        return values, column

    @property
    def several_in_a_bin(self) -> bool:
        """Whether bins hold several samples, so that places and widths within them mean something."""
        return self.samples >= 2 * len(self.places)

    @property
    def odd(self) -> bool:
        """Whether a recorded signal would change with something else than time, as sensors hardly do."""
        return QUANTITIES[self.quantity].stage == "sensor" and self.covariate not in ("time", "y_over_edge")

    def proposals(self, samples: int) -> list[tuple[float, Trial, float]]:
        """The best formulas and the best curve: promised evidence less its cost, the law on trial, and the cost."""
        results = []
        choice = float(np.log(SEARCH.curve_families)) + SEARCH.odd_signal_cost * self.odd
        for shape, starts, columns in self.members:
            length, along = self._seen(columns)
            gain = _gain(length, along)
            best = first_of_most(gain)
            start, column = starts[best], columns[:, best]
            if self.several_in_a_bin and 0.5 * gain[best] > SEARCH.strong:
                start, column = self._closer(shape, starts, best, column)
            members = _shifted(column) if shape in CHOSEN and self.several_in_a_bin else column[:, None]
            promised = _gain(*self._seen(members)).max()
            length, along = self._seen(column[:, None])
            size = float(np.clip(along[0] / max(length[0], 1e-300), -self.most, self.most))
            if size == 0.0:
                continue
            start = {QUANTITIES[self.quantity].size_key: size, **self._keyed(start)}
            trial = replace(formula(self.quantity, self.covariate, shape, start, self.span, self.most), test=self.test)
            cost = choice + 0.5 * float(np.log(samples)) * CHOSEN.get(shape, 0)
            paid = cost + 0.5 * np.log(samples) * len(trial.params)
            results.append((0.5 * float(promised) - paid, trial, cost))
        if QUANTITIES[self.quantity].shapes or self.most_knots < FEWEST_KNOTS:
            return sorted(results, key=lambda f: falling(f[0]))
        cost = choice + float(np.log(len(self._curves[1])))
        results.append((float(self._curves[0].max()) - cost, self.curve(*self.smoothness), cost))
        return sorted(results, key=lambda f: falling(f[0]))

    @property
    def smoothness(self) -> tuple[float, float]:
        """The length and the size of a curve that say most."""
        evidence, which = self._curves
        return which[first_of_most(evidence)]

    @property
    def sampled(self) -> Mask:
        """Which places samples that are fitted respond to (bin,)."""
        if self.responding is not None:
            return self.responding
        length = np.diag(self.A)
        return np.asarray(length > NOTHING * float(length.max()))

    def gap(self, place: float) -> float:
        """Width of the bins about a place of the covariate to which no sample responds; 0 where samples do."""
        ends = np.flatnonzero(np.diff(np.concatenate([[False], ~self.sampled, [False]]).astype(int)))
        runs = self.edges[ends].reshape(-1, 2)
        here = (runs[:, 0] <= place) & (place <= runs[:, 1])
        return float(np.diff(runs[here], axis=1).sum())

    def between(self, place: float) -> tuple[float, float]:
        """The nearest places below and above one that samples respond to; the ends where there is none."""
        known = np.concatenate([self.edges[:1], self.places[self.sampled], self.edges[-1:]])
        return float(known[known < place].max(initial=known[0])), float(known[known > place].min(initial=known[-1]))

    @property
    def most_knots(self) -> int:
        """Knots of a curve at the most: no more than a third of the samples that it is learnt from."""
        most = STRONG_KNOTS if self._curves[0].max() > SEARCH.strong else KNOTS
        return min(ACROSS_KNOTS if self.covariate == "y_over_edge" else most, self.samples // 3)

    @property
    def most(self) -> float:
        """Largest change that is tried."""
        return 0.9 if QUANTITIES[self.quantity].kind == "factor" else 30.0 * self.typical

    def _keyed(self, start: Mapping[str, float]) -> dict[str, float]:
        pure = ("exponent", "phase")
        return {name if name in pure else covariate_of(self.covariate).key(name): v for name, v in start.items()}

    def curve(self, length: float, level: float) -> Trial:
        """A smooth curve through the places, as its prior lets expect it between knots at some of them.

        Where no sample is, it goes straight from place to place, and on as it was at the last. Of what multiplies a
        base parameter it has no level of its own: the parameter is the mean over the places.
        """
        most = self.most_knots
        places = self.places if self.covariate == "y_over_edge" else self.places[self.sampled]
        count = len(places)
        knots = places if count <= most else np.interp(np.linspace(0.0, count - 1.0, most), np.arange(count), places)
        prior = _matern(np.concatenate([places, knots]), length)[:, count:]
        root = np.linalg.cholesky(prior[count:] + 1e-9 * np.eye(len(knots)))
        mix = np.asarray(level * np.linalg.solve(root, prior[:count].T).T, dtype=np.float64)
        if self.covariate == "y_over_edge":
            mix[[0, -1]] = 0.0
        if self.quantity in MULTIPLIED.values():
            mix -= mix.mean(axis=0)
        return replace(curve(self.quantity, self.covariate, places, mix), test=self.test)


def _gain(length: Floats, along: Floats) -> Floats:
    """Fall of chi2 by each member (member,), whose response has a squared length and a product with the residual."""
    return np.where(length > 0.0, along**2 / np.maximum(length, 1e-300), 0.0)


def _unbounded(key: str, value: float) -> float:
    """A parameter of a formula, the logarithm of one that is positive."""
    return float(np.log(value)) if key in POSITIVE else value


def _bounded(key: str, value: Floats) -> Floats:
    """The parameter of such a number."""
    return np.exp(value) if key in POSITIVE else value


def _apart(values: Sequence[float], value: float) -> float:
    """How far a value of a grid is from the farther of its neighbours."""
    at = values.index(value)
    return max((abs(other - value) for other in values[max(at - 1, 0) : at + 2]), default=0.0)


def _shifted(column: Floats) -> Floats:
    """A step or a window (bin,) with its edges elsewhere in the bins beside them: (bin, member).

    A bin counts by its part inside. Where a change is many times the noise, the whole of the bins at the edges may
    cost so much that a smooth formula, which is wrong, promises more.
    """
    members = column[:, None]
    for edge in np.flatnonzero(np.diff(column)):
        outside, inside = (edge, edge + 1) if column[edge + 1] > column[edge] else (edge + 1, edge)
        part = np.zeros((len(column), len(PARTS)))
        part[outside], part[inside] = np.maximum(PARTS, 0.0), np.minimum(PARTS, 0.0)
        members = (members[:, :, None] + part[:, None, :]).reshape(len(column), -1)
    return np.clip(members, 0.0, 1.0)


def _matern(at: Floats, length: float) -> Floats:
    """Matern covariance of smoothness 5/2 between places, its length in spans of the covariate."""
    distance = np.abs(at[:, None] - at) / max(float(np.ptp(at)), 1e-300) * np.sqrt(5.0) / length
    return np.asarray((1.0 + distance + distance**2 / 3.0) * np.exp(-distance))


Family = tuple[str, list[dict[str, float]], list[Floats]]
"""A shape, the start values of its members, and their values (bin,)."""


def _families(x: Floats, edges: Floats) -> Iterator[Family]:
    """Families of formulas over places x (bin,)."""
    low, high = float(x[0]), float(x[-1])
    span = high - low
    origin = 0.0 if low >= 0.0 and low < 0.5 * span else low
    yield "linear", [{"begin": low, "end": high}], [(x - low) / span]
    scales = span * np.geomspace(0.03, 3.0, 10)
    settling = [np.exp(-(x - origin) / s) for s in scales]
    yield "exponential", [{"origin": origin, "scale": float(s)} for s in scales], settling
    if len(x) > 2:
        yield from _sharp(x, edges[1:-1])
    if len(x) > 3:
        yield from _smooth(x, low, high)
    if len(x) >= 12:
        waves = [(span / n, np.pi * p) for n in np.arange(1.0, len(x) / 4.0, 0.5) for p in (0.0, 0.25, 0.5, 0.75)]
        swinging = [np.sin(2.0 * np.pi * x / t + p) for t, p in waves]
        yield "sine", [{"period": float(t), "phase": float(p)} for t, p in waves], swinging


def _sharp(x: Floats, inner: Floats) -> Iterator[Family]:
    """Steps and windows between the inner edges of bins."""
    yield "step", [{"at": float(e)} for e in inner], [np.where(x > e, 1.0, 0.0) for e in inner]
    if len(x) > 3:
        ends = inner if len(inner) <= 40 else inner[:: len(inner) // 40 + 1]
        spans = [(float(a), float(b)) for i, a in enumerate(ends) for b in ends[i + 1 :]]
        inside = [np.where((x > a) & (x <= b), 1.0, 0.0) for a, b in spans]
        yield "window", [{"begin": a, "end": b} for a, b in spans], inside


def _smooth(x: Floats, low: float, high: float) -> Iterator[Family]:
    """Bumps, rises, and powers of what is never negative."""
    span, centres = high - low, np.linspace(low, high, 14)
    humps = [(float(c), float(w * span)) for c in centres for w in (0.04, 0.08, 0.15, 0.3)]
    yield "bump", [{"at": c, "width": w} for c, w in humps], [np.exp(-0.5 * ((x - c) / w) ** 2) for c, w in humps]
    rises = [(float(c), float(w * span)) for c in centres[1:-1] for w in (0.015, 0.04, 0.1)]
    rising = [0.5 * (1.0 + np.tanh(0.5 * (x - c) / w)) for c, w in rises]
    yield "logistic", [{"at": c, "width": w} for c, w in rises], rising
    if low >= 0.0 and high > 0.0:
        powers = [e for e in (-2.0, -1.0, -0.5, 0.5, 2.0, 3.0) if e > 0.0 or low > 0.02 * high]
        growing = [np.maximum(x / high, 1e-6) ** e - 1.0 for e in powers]
        yield "power", [{"reference": high, "exponent": e} for e in powers], growing


@dataclass(frozen=True)
class Response:
    """What a change of a quantity in each bin of a covariate does to white samples: slopes (sample, bin) over it.

    change: the one that was tried, in SI.
    """

    quantity: str
    covariate: str
    edges: Floats
    slopes: Floats
    typical: float
    change: float

    def of_samples(self, some: Mask) -> Response:
        """The response of some of the samples (sample,); the others have none."""
        return replace(self, slopes=np.where(some[:, None], self.slopes, 0.0))


def pairs(fitted: Fit, known: Sequence[Response] | None = None) -> list[Pair]:
    """Every quantity over every covariate that the tests can show, seen from a fit.

    Of several responses to one that which explains more. known: the responses of a fit nearby, where they have been
    computed.
    """
    problem = fitted.problem
    span = span_of(fitted.jacobian)
    results = []
    for response in responses(fitted) if known is None else known:
        channel = problem.shown_in(QUANTITIES[response.quantity])
        results.append(_pair(fitted, span, response, problem.count(channel)))
        for test, own in problem.own_samples(response.slopes.T, channel):
            results.append(_pair(fitted, span, response.of_samples(own), problem.count(channel, test), test))
    best = dict[str, Pair]()
    for pair in results:
        if pair is not None and (pair.name not in best or pair.log_evidence > best[pair.name].log_evidence):
            best[pair.name] = pair
    return [*best.values()]


def seen_again(fitted: Fit, name: str, pair: Pair) -> Pair | None:
    """The pair of a curve as seen from a fit with that curve in it: what all samples ask of it, where they are now.

    None where it shows nowhere.
    """
    problem, curve = fitted.problem, fitted.problem.trial[name]
    assert isinstance(curve, Trial)
    responded = responses(fitted, [(pair.quantity, pair.covariate)], change=pair.change)
    if not responded:
        return None
    response, own = responded[0], fitted.own(name)
    if pair.test:
        response = response.of_samples(problem.owner == problem.own_terms.index(pair.test))
    span = span_of(fitted.jacobian[:, ~own])
    again = _pair(fitted, span, response, pair.samples, pair.test)
    return again and replace(again, g=again.g + again.A @ curve.heights(fitted.theta[own], again.places))


def _pair(fitted: Fit, span: Floats, response: Response, samples: int, test: str = "") -> Pair | None:
    """A law from the response of the samples, beyond what the fitted parameters span; None where it shows nowhere."""
    slopes = fitted.problem.discount(response.slopes.T).T
    G = slopes - span @ (span.T @ slopes)
    seen = np.linalg.norm(G, axis=0) * response.typical > 0.03
    if seen.sum() < 2:
        return None
    edges = response.edges
    centres = 0.5 * (edges[1:] + edges[:-1])
    A, g = G.T @ G, G.T @ fitted.residual
    quantity, covariate, typical, change = response.quantity, response.covariate, response.typical, response.change
    return Pair(quantity, covariate, edges, centres, A, g, typical, samples, test, change, slopes)


def with_elsewhere(fitted: Fit, pair: Pair, there: LinearPrediction) -> Pair:
    """The pair with what a test that is only predicted says of it, to first order, beside what those fitted say.

    A change in a bin acts there by itself, and by the parameters that follow it where they are fitted. What counts for
    less there, as it is missed by far in any case, counts for less here.
    """
    rows = _bin_rows(there.followed, there.theta, pair.quantity, pair.covariate, pair.edges, pair.change)
    slopes = np.nan_to_num(there.problem.discount((rows - there.plain) / pair.change)).T
    G = slopes - there.pulled @ (fitted.jacobian.T @ pair.slopes)
    within = there.within(G) / (1.0 + there.excess / there.blocks)
    return replace(pair, A=pair.A + G.T @ within, g=pair.g + within.T @ there.miss, responding=pair.sampled)


def responses(
    fitted: Fit,
    wanted: Sequence[tuple[str, str]] | None = None,
    shown: Container[str] | None = None,
    *,
    change: float | None = None,
) -> list[Response]:
    """The responses of the samples to quantities over covariates, where a fit is: to those wanted, or to every one.

    shown: only to what shows in these channels; change: to this one alone, of those that are tried.
    """
    problem = fitted.followed
    predictions = problem.predict(fitted.theta[None], rough=True)
    plain = problem.white(predictions)[0]
    results = []
    every = _searched(problem, predictions, problem.channels if shown is None else shown)
    for quantity, covariate in every if wanted is None else wanted:
        of, typical = QUANTITIES[quantity], typical_change(fitted, quantity)
        if typical == 0.0:  # a channel that does not change has no size that a shift could have
            continue
        edges = _edges(fitted, predictions, covariate)
        if edges is not None and of.channel == FIRST_SEEN.get(of.stage) == "traction" and problem.shows_wear:
            edges = _sampled(edges, problem, predictions, covariate)
        if edges is None:
            continue
        tried = of.probes if of.kind == "factor" else (0.03 * typical,)
        for level in tried if change is None else (change,):
            rows = _bin_rows(problem, fitted.theta, quantity, covariate, edges, level)
            slopes = np.nan_to_num((rows - plain) / level).T
            results.append(Response(quantity, covariate, edges, slopes, typical, level))
    return results


def _searched(problem: Problem, predictions: list[Prediction], shown: Container[str]) -> Iterator[tuple[str, str]]:
    """Every quantity that channels show, over every covariate that runs unlike the others."""
    for quantity, of in QUANTITIES.items():
        if problem.shown_in(of) in shown:
            for covariate in _distinct(predictions, covariates_of(problem, quantity)):
                yield quantity, covariate


def proportional(predictions: list[Prediction], quantity: str, covariate: str) -> list[str]:
    """Other covariates of a quantity that run as one does in all tests."""
    if covariate == "y_over_edge":
        return []
    unit = _unit(predictions, covariate)
    others = [name for name in QUANTITIES[quantity].covariates if name not in (covariate, "y_over_edge")]
    return [name for name in others if np.allclose(_unit(predictions, name), unit, atol=1e-6)]


def equal_here(here: list[Prediction], quantity: str, covariate: str, other: Prediction) -> list[str]:
    """Covariates of a quantity that run as one does in all tests here, and do not in another."""
    there = proportional([other], quantity, covariate)
    return [name for name in proportional(here, quantity, covariate) if name not in there]


def confounded(predictions: list[Prediction], quantity: str, covariate: str) -> list[str]:
    """Those that are proportional, and not the same numbers, as time is where nothing paused."""
    names = proportional(predictions, quantity, covariate)
    return [n for n in names if not np.array_equal(_along(predictions, n), _along(predictions, covariate))]


def passed_together(law: Law, tests: int) -> list[str]:
    """Other covariates that only grow, of which a jump over one that does says as much where there is one test."""
    if law.shape not in CHOSEN or law.covariate not in GROWING or tests > 1:
        return []
    return [name for name in GROWING if name in QUANTITIES[law.quantity].covariates and name != law.covariate]


def covariates_of(problem: Problem, quantity: str) -> list[str]:
    """What a quantity may change over: its covariates and, where any formula may be, columns that all tests declare."""
    own = QUANTITIES[quantity].covariates
    if own == ("y_over_edge",) or QUANTITIES[quantity].shapes:
        return [*own]
    if len({load for case in problem.cases for load in _loads(case)}) == 1:
        own = tuple(name for name in own if quantity not in WHERE_LOADS_DIFFER.get(name, ()))
    first, *others = [case.test.measured.columns for case in problem.cases]
    return [*own, *(name for name in first if all(name in columns for columns in others))]


def _loads(case: Case) -> Floats:
    """The loads [N] under which the discs turn in a test (load,)."""
    history = case.test.history
    return np.unique(np.round(case.test.rig.normal_load * history.load_factor[history.driven], 9))


def _bin_rows(problem: Problem, theta: Floats, quantity: str, covariate: str, edges: Floats, level: float) -> Floats:
    """White predictions (bin, sample) with the quantity changed in one bin after the other."""
    count = len(edges) - 1
    trial = bins(quantity, covariate, edges)
    parameters = {"level": np.full(count, level), "bin": np.arange(count, dtype=float)}
    sets = np.tile(theta, (count, 1))
    return problem.white(problem.moved(sets, extra={"a bin": parameters}, trial={"a bin": trial}, rough=True))


def is_timed(case: Case) -> bool:
    """Whether a test has samples that know their time or step; of separate steps, whether one has several samples."""
    traction, history = case.test.measured.traction, case.test.history
    if history.separate:
        times = [s.time for s in (traction, case.test.measured.temperature) if s is not None]
        known = np.unique(np.concatenate([t[np.isfinite(t)] for t in times]))
        return bool(np.any(np.bincount(history.step[history.iteration_at(known)]) > 1))
    return "temperature" in case.noise or bool(traction is not None and knows_times(history, traction))


def typical_change(fitted: Fit, quantity: str) -> float:
    """A typical size of a change: a share of a factor, a part of what a shifted quantity spans [its unit]."""
    of = QUANTITIES[quantity]
    if of.kind == "factor":
        return 1.0 if of.stage == "wear" else 0.3
    cases = fitted.problem.cases
    if quantity == "creepage":
        return 30.0 * float(np.median([np.median(np.abs(case.test.history.creepage)) for case in cases]))
    sizes = [
        np.ptp(case.values(of.channel)) * (_cooling(fitted, number) if of.unit == "W" else 1.0)
        for number, case in enumerate(cases)
        if of.channel in case.noise
    ]
    return 0.2 * float(np.max(sizes)) / of.scale


def _cooling(fitted: Fit, number: int) -> float:
    """The power that a kelvin of a test's disc is worth [W/K]."""
    return float(fitted.problem.base_of(number, fitted.theta[None])["convection_W_K"][0])


def _distinct(predictions: list[Prediction], covariates: Sequence[str]) -> list[str]:
    """Covariates without those that are proportional to an earlier one in all tests, as on a rising ramp."""
    kept: dict[str, Floats] = {}
    for name in covariates:
        if name != "y_over_edge":
            unit = _unit(predictions, name)
            if any(np.allclose(unit, other, atol=1e-6) for other in kept.values()):
                continue
            kept[name] = unit
    return [name for name in covariates if name in kept or name == "y_over_edge"]


def _unit(predictions: list[Prediction], covariate: str) -> Floats:
    """A covariate over its range, 0 to 1, at all operating points of all tests that last (point,)."""
    values = _along(predictions, covariate)
    return np.asarray((values - values.min()) / max(float(np.ptp(values)), 1e-300))


def _along(predictions: list[Prediction], covariate: str) -> Floats:
    """A covariate at all operating points of all tests that last (point,)."""
    return np.concatenate([_at_points(p, covariate)[p.state.duration > 0.0] for p in predictions])


def _at_points(prediction: Prediction, covariate: str) -> Floats:
    """A covariate at all operating points of a test (point,)."""
    state = prediction.state
    values: Floats = np.broadcast_to(covariate_of(covariate).of(state), (1, len(state.time)))[0]
    return values


def _sampled(edges: Floats, problem: Problem, predictions: list[Prediction], covariate: str) -> Floats | None:
    """The bins of a law of friction with samples of traction or temperature in them; None where these are in one.

    In steps without any of them it would be free to make up for what is missing elsewhere, as in the wear. The disc's
    temperature remembers what was before its samples, and the wear all that was.
    """
    rows = list[Floats]()
    for case, prediction in zip(problem.cases, predictions, strict=True):
        points, values = case.model.points, _at_points(prediction, covariate)
        rows += [values[points.of_traction], values[points.of_temperature]]
    known = np.concatenate(rows)
    low, high = known.min(), known.max()
    inner = edges[(low < edges) & (edges < high)]
    return np.array([max(edges[0], low), *inner, min(edges[-1], high)]) if inner.size else None


def _edges(fitted: Fit, predictions: list[Prediction], covariate: str) -> Floats | None:
    """Bins of a covariate over all tests (bin + 1,); None where it does not vary or is not known."""
    over = covariate_of(covariate)
    if covariate == "y_over_edge":
        return np.linspace(-over.reach, over.reach, ACROSS_BINS + 1) if "profile" in fitted.problem.channels else None
    if covariate == "order" and not any(case.test.history.separate for case in fitted.problem.cases):
        return None  # time says as much
    if covariate == "pressure" and len(np.unique(_along(predictions, "load"))) == 1:
        return None  # it changes with the worn section alone, as the energy does
    untimed = covariate in UNTIMED or isinstance(over, Column)
    if not untimed and not any(is_timed(case) for case in fitted.problem.cases):
        return None
    values = _along(predictions, covariate)
    if not np.isfinite(values).all() or np.ptp(values) <= 1e-9 * max(np.abs(values).max(), 1e-300):
        return None
    distinct = np.unique(np.round(values, 9))
    most = TIME_BINS if covariate == "time" else MOST_BINS
    if len(distinct) <= min(most, 20):
        inner = 0.5 * (distinct[1:] + distinct[:-1])
        return np.concatenate([[distinct[0] - 1e-9 * abs(distinct[0])], inner, [distinct[-1]]])
    if covariate == "time":
        history = fitted.problem.cases[0].test.history
        ends = np.unique(history.end_time - history.begin_time)
        inner = ends if len(ends) <= most else np.linspace(0.0, ends[-1], most + 1)[1:]
        if len(ends) <= most // 2:
            inner = np.interp(np.arange(1, len(ends) * (most // len(ends)) + 1) / (most // len(ends)),
                              np.arange(len(ends) + 1), np.concatenate([[0.0], ends]))  # fmt: skip
        return np.concatenate([[0.0], inner[:-1], [max(float(values.max()), inner[-1])]])
    both = np.sort(np.concatenate([
        np.linspace(distinct[0], distinct[-1], most // 2 + 1),
        np.quantile(values, np.linspace(0.0, 1.0, most // 2 + 1)[1:-1]),
    ]))  # fmt: skip
    keep = np.concatenate([[True], np.diff(both) > 2e-3 * np.ptp(distinct)])
    return np.asarray(both[keep])
