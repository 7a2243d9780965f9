"""A test that was not fitted, predicted by what was found elsewhere, and what it says of the explanations.

    log p = -min(chi2, n) / 2 - m / 2 log(1 + max(chi2 - n, 0) / m) - log|S| / 2
    chi2 = r' S^-1 r,   S = 1 + J (C + R) J'

    r   white residual (n,) of the test as an explanation predicts it, J its Jacobian over the inner parameters
    C   covariance of the parameters after the fit, R what base parameters scatter from one repeat to the next
    m   blocks of neighbours in all channels

No parameter is fitted to it. Noise is white, but what a formula misses beyond it is not: it errs over a whole block,
and where every explanation misses the test by far, which misses it less says little. So the excess counts by Student's
density of m degrees of freedom (K. L. Lange et al., J. Am. Stat. Assoc. 84 (1989) 881-896).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit, carried, linearised, plain_fit, remembered
from twindisc_cli.loop.levels import levels_of
from twindisc_cli.loop.problem import Case, Problem, base_parameters, case_of, stated
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.loop.tolerances import with_nuisances
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.prediction import Prediction


@dataclass(frozen=True)
class PredictedTest:
    """A test with its prediction by a fit of other tests: root mean square errors by channel, in SI units."""

    case: Case
    prediction: Prediction

    @property
    def level(self) -> Mapping[str, float]:
        """The base parameters it is predicted with, by key; NaN where not known."""
        return {base.key: self.case.known.get(base.key, np.nan) for base in base_parameters()}

    def misses(self, channel: str) -> Floats:
        """Measured minus predicted in the order of the record (sample,); NaN where it cannot be predicted."""
        miss = self.case.values(channel) - channels()[channel].predicted(self.case.model, self.prediction)[0]
        return np.asarray(miss[self.case.noise[channel].order])

    def error(self, channel: str) -> float:
        """Root mean square of measured minus predicted; NaN where the channel cannot be predicted."""
        return rms(self.misses(channel))


def rms(misses: Floats) -> float:
    """Root mean square; NaN without samples."""
    return float(np.sqrt(np.mean(misses**2))) if len(misses) else float("nan")


def predict_test(test: Experiment | Case, fitted: Fit) -> PredictedTest:
    """Predict a test, or one whose noise is known, by a fit of others, with the effects and laws all of these declare.

    Base parameters are as fitted, those of single tests as these have them in the middle; else as either test says.
    A mu that the test gives for single steps stays its own.
    """
    return _predicted(_unfitted(test, fitted))


def at_its_own_level(predicted: PredictedTest) -> PredictedTest:
    """The same with the level of the test known: base parameters are fitted to it."""
    case = predicted.case
    own = tuple(name for name in case.noise if channels()[name].parameters)
    fitted = plain_fit(Problem([case], own)) if own else None
    return _predicted(remembered([case], fitted)[0]) if fitted is not None else predicted


def with_its_noise(test: Case, fitted: Fit) -> Case:
    """A test with the noise that its prediction by a fit of others leaves at its own level, where that is less."""
    predicted = at_its_own_level(predict_test(test, fitted))
    return replace(test, noise=predicted.case.with_noise_about(predicted.prediction).noise)


def _predicted(case: Case) -> PredictedTest:
    known = {base.key: np.array([case.known.get(base.key, np.nan)]) for base in base_parameters()}
    step_mu = case.test.history.given_mu
    if np.isfinite(step_mu).any():
        known["mu"] = np.where(np.isfinite(step_mu), step_mu, known["mu"][:, None])
    return PredictedTest(case, case.model.predict(known))


def _unfitted(test: Experiment | Case, fitted: Fit) -> Case:
    """A test with the effects, laws and base parameters of a fit of others."""
    first, *others = [case.test for case in fitted.problem.cases]
    case = test if isinstance(test, Case) else case_of(test)
    effects = {name: of for name, of in first.effects.items() if all(name in test.effects for test in others)}
    laws = {name: law for name, law in first.laws.items() if all(name in test.laws for test in others)}
    own = replace(case.test, effects=effects, laws=laws)
    known = stated(first) | stated(case.test) | typical_base(fitted)
    return replace(case, model=replace(case.model, experiment=own), known=known)


def typical_base(fitted: Fit) -> dict[str, float]:
    """The fitted base parameters by key, those of single tests as these have them in the middle."""
    values: dict[str, list[float]] = {}
    for p in fitted.problem.parameters:
        if p.term is None:
            values.setdefault(p.key, []).append(fitted.value(p)[0])
    return {key: float(np.median(several)) for key, several in values.items()}


def drawn_levels(fitted: Fit) -> dict[str, tuple[float, float]]:
    """90 % interval of the level of one more test, by key: drawn from the scatter of those fitted, or of repeats."""
    intervals = {}
    for p in fitted.problem.parameters:
        if p.term is None:
            value, half = fitted.value(p)[0], NINETY * ACCEPTANCE.repeat_scatter
            intervals[p.key] = value * float(np.exp(-half)), value * float(np.exp(half))
    return intervals | {key: of.drawn()[1:] for key, of in levels_of([fitted]).items()}


@dataclass(frozen=True)
class LinearPrediction:
    """A test that is only predicted, to first order about a fit of others.

    theta: its inner parameters as the fit has them (parameter,); miss: white residual (sample,); spread: what these
    parameters may be off by does to it (sample, direction); pulled: what a pull at each parameter of the fit does
    (sample, parameter of the fit).
    """

    problem: Problem
    theta: Floats
    miss: Floats
    spread: Floats
    pulled: Floats

    @cached_property
    def followed(self) -> Problem:
        """The test on the tracks of the fit, for which no integration is needed."""
        return self.problem.followed(self.theta)

    @cached_property
    def plain(self) -> Floats:
        """White prediction (sample,) as a first look takes it."""
        return np.asarray(self.followed.white(self.followed.predict(self.theta[None], rough=True))[0])

    @property
    def blocks(self) -> int:
        """Blocks of neighbours in all channels."""
        return ACCEPTANCE.judged_blocks * len(self.problem.channels)

    @property
    def inner(self) -> Floats:
        """1 + A'A for the spread A, whose determinant is that of 1 + AA' (direction, direction)."""
        return np.asarray(np.eye(self.spread.shape[1]) + self.spread.T @ self.spread)

    @cached_property
    def chi2(self) -> float:
        """Squared length of the residual, as far as parameters that are off do not make it."""
        return float(self.miss @ self.within(self.miss))

    @property
    def excess(self) -> float:
        """By how much that is more than the noise makes."""
        return max(self.chi2 - len(self.miss), 0.0)

    @property
    def density(self) -> float:
        """Logarithm of the density that is predicted for the test."""
        missed = min(self.chi2, len(self.miss)) + self.blocks * float(np.log1p(self.excess / self.blocks))
        return -0.5 * (missed + float(np.linalg.slogdet(self.inner)[1]))

    def within(self, columns: Floats) -> Floats:
        """(1 + AA')^-1 times columns (sample, ...), for the spread A."""
        return np.asarray(columns - self.spread @ np.linalg.solve(self.inner, self.spread.T @ columns))


@dataclass(frozen=True)
class Elsewhere:
    """A test that is only predicted, as a problem whose nuisances are those of the base model."""

    problem: Problem

    def _with_terms_of(self, fitted: Fit) -> Problem:
        """The test with the terms of a fit of others."""
        return self.problem.with_terms(*fitted.terms, trial=fitted.problem.trial)

    def prediction(self, fitted: Fit) -> Prediction:
        """The test as a fit of others predicts it."""
        problem = self._with_terms_of(fitted)
        return problem.predict(carried(problem, fitted)[None])[0]

    def density(self, fitted: Fit) -> tuple[float, float]:
        """Logarithm of the density that a fit of others predicts for the test, and the chi2 of what it misses."""
        there = self.to_first_order(fitted)
        return there.density, there.chi2

    def to_first_order(self, fitted: Fit) -> LinearPrediction:
        """The test as a fit of others predicts it, to first order in the parameters."""
        problem = self._with_terms_of(fitted)
        theta = carried(problem, fitted)
        miss, slopes, _ = linearised(problem, theta, problem.discount(problem.measured))
        places = {(p.name, p.case): i for i, p in enumerate(fitted.problem.parameters)}
        shared = [i for i, p in enumerate(problem.parameters) if (p.name, p.case) in places]
        own = [places[problem.parameters[i].name, problem.parameters[i].case] for i in shared]
        scatter = [ACCEPTANCE.repeat_scatter**2 * (problem.parameters[i].term is None) for i in shared]
        size, direction = np.linalg.eigh(fitted.covariance[np.ix_(own, own)] + np.diag(scatter))
        spread = slopes[:, shared] @ (direction * np.sqrt(np.maximum(size, 0.0)))
        return LinearPrediction(problem, theta, miss, spread, slopes[:, shared] @ fitted.covariance[own])


def elsewhere(test: Case, base: Fit) -> Elsewhere | None:
    """A test to be predicted by fits of others, whose base model is given; None where they share no channel."""
    case = _unfitted(test, base)
    shared = tuple(c for c in base.problem.channels if c in case.noise)
    problem = Problem([case], shared, effort=base.problem.effort)
    if not problem.channels:
        return None
    return Elsewhere(with_nuisances(problem, carried(problem, base), np.zeros((len(problem.measured), 1))))
