"""Tests of a group that are left out, predicted by the others, with their level drawn from its scatter or known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from twindisc_cli.laws.law import Law
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit, carried, fit, plain_fit
from twindisc_cli.loop.levels import levels_of
from twindisc_cli.loop.members import estimates, parameters_of, resized, typical
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.validate import rms, typical_base
from twindisc_cli.model.experiment import Floats

FOLDS = 4
"""A group is left out in so many parts, one after the other: every fourth test, each test of fewer."""


@dataclass(frozen=True)
class GroupError:
    """Root mean square of measured minus predicted over all tests of a group, in `unit`.

    constant: without the terms, the base parameters (the level) of each test its own. left_out: a quarter of the tests,
    or one, by the terms of the others and the level that these let expect at its place in the order;
    left_out_at_own_level: the same with the level of each test known. NaN where no term acts in two tests.
    """

    unit: str
    constant: float
    left_out: float
    left_out_at_own_level: float


@dataclass(frozen=True)
class Learnt:
    """What predicts: one fit of all tests with shared terms, or one fit of each.

    acts: of terms with parameters of their own, the tests that they act in, by name; laws: those that are resized.
    """

    fits: Sequence[Fit]
    acts: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    laws: Mapping[str, Law] = field(default_factory=dict)

    @property
    def is_shared(self) -> bool:
        """Whether all tests share one set of parameters."""
        return len(self.fits) == 1

    @property
    def cases(self) -> list[Case]:
        """The tests in their order."""
        return [case for fitted in self.fits for case in fitted.problem.cases]

    @property
    def is_informative(self) -> bool:
        """Whether a term acts in more than one test."""
        return bool(self.fits[0].terms) if self.is_shared else any(len(acts) > 1 for acts in self.acts.values())


def group_errors(learnt: Learnt) -> dict[str, GroupError]:
    """The error of each channel without the terms, and of tests left out by the terms of the others."""
    cases = learnt.cases
    names = list(dict.fromkeys(c for case in cases for c in case.noise))
    constant = [_residuals(plain_fit(_problem(case))) for case in cases]
    drawn, known = _left_out(learnt) if learnt.is_informative else ([], [])
    results = {}
    for channel in names:
        of = channels()[channel]
        errors = [
            of.factor * rms(np.concatenate([m[channel] for m in every if channel in m])) if every else float("nan")
            for every in (constant, drawn, known)
        ]
        results[channel] = GroupError(of.unit, *errors)
    return results


def _problem(case: Case) -> Problem:
    return Problem([case], tuple(case.noise))


def _residuals(fitted: Fit) -> dict[str, Floats]:
    """Measured minus predicted of a fit of one test, by channel."""
    return _residuals_at(fitted.problem, fitted.theta)


def _residuals_at(problem: Problem, theta: Floats) -> dict[str, Floats]:
    """Measured minus predicted of one test at parameters (parameter,), by channel."""
    (case,), (prediction,) = problem.cases, problem.predict(theta[None])
    return {c: case.values(c) - channels()[c].predicted(case.model, prediction)[0] for c in case.noise}


def _left_out(learnt: Learnt) -> tuple[list[dict[str, Floats]], list[dict[str, Floats]]]:
    """Residuals of every test with its level drawn, and with its level known."""
    count = len(learnt.cases)
    folds = min(count, FOLDS)
    drawn, known = dict[int, dict[str, Floats]](), dict[int, dict[str, Floats]]()
    for fold in range(folds):
        kept = [i for i in range(count) if i % folds != fold]
        fits = [_refitted(learnt.fits[0], kept)] if learnt.is_shared else [learnt.fits[i] for i in kept]
        levels = levels_of(fits, kept)
        typical_values = {key: value for fitted in fits for key, value in typical_base(fitted).items()}
        for number in range(fold, count, folds):
            case = _declared(learnt, number, fits[0], kept)
            level = typical_values | {key: of.drawn(float(number))[0] for key, of in levels.items()}
            alone = Problem([replace(case, known=dict(case.known) | level)], ())
            drawn[number] = _residuals_at(alone, np.empty(0))
            known[number] = _residuals(plain_fit(_problem(case)))
    return [drawn[i] for i in range(count)], [known[i] for i in range(count)]


def _refitted(fitted: Fit, kept: Sequence[int]) -> Fit:
    """A fit of all tests, fitted to some of them."""
    cases = [fitted.problem.cases[i] for i in kept]
    problem = replace(fitted.problem, cases=cases, nuisance=None, tracks=None)
    return fit(problem, carried(problem, fitted))


def _declared(learnt: Learnt, number: int, shared: Fit, kept: Sequence[int]) -> Case:
    """A test with the terms that act in it declared, as the tests that were kept have them."""
    case = learnt.cases[number]
    effects, laws = dict(case.test.effects), dict(case.test.laws)
    for name in shared.terms if learnt.is_shared else learnt.acts:
        if learnt.is_shared:
            values, trial = shared.values(name), shared.problem.effect(name)
            law = trial.law(values) if isinstance(trial, Trial) else None
        else:
            fits = [learnt.fits[i] for i in learnt.acts[name] if i in kept]
            if number not in learnt.acts[name] or not fits:
                continue
            inner = typical(*estimates(fits, name))
            own = parameters_of(fits, name)
            values = {p.key: float(p.outer(np.array(v))) for p, v in zip(own, inner, strict=True)}
            law = resized(learnt.laws[name], values["size"]) if name in learnt.laws else None
        if law is None:
            effects[name] = values
        else:
            laws[name] = law
    test = replace(case.test, effects=effects, laws=laws)
    return replace(case, model=replace(case.model, experiment=test))
