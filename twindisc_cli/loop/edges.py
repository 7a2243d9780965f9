"""Where the edges of a step or a window stand: places of a covariate, at which a fit has no slope."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twindisc_cli.identify.span import span_of
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.fit import Fit, finite, fit
from twindisc_cli.loop.problem import Problem
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.model.experiment import Floats

ANEW = 0.1
"""Share of the range of a covariate over which an edge is sought anew: as long as a step that was held out."""


def refined_edges(fitted: Fit, name: str, trial: Trial, reach: Mapping[str, float]) -> Fit:
    """A fit with the edges of a step or a window, which have no slope, where they explain most: two finer scans.

    The first reaches so far from each of these edges, the second from each of its places to the next.
    """
    reach = dict(reach)
    for _ in range(2):
        for key in reach:
            tried = trial.fixed[key] + reach[key] * np.linspace(-1.0, 1.0, SEARCH.edge_places)
            trial = trial.fixed_at({key: middle_of_least(tried, chi2_at(fitted, name, key, tried))})
            fitted = fit(with_trial(fitted, name, trial), fitted.theta)
            reach[key] = float(tried[1] - tried[0])
    return fitted


def edges_anew(fitted: Fit) -> Fit:
    """A fit with the edges of all its steps and windows where these samples have them, near where others had them.

    An edge that these let stand there stays: another test may have placed it.
    """
    jumping = {name: t for name, t in fitted.problem.trial.items() if isinstance(t, Trial) and t.jumps.size}
    states = [prediction.state for prediction in fitted.problem.predict(fitted.theta[None])] if jumping else []
    for name, trial in jumping.items():
        of = covariate_of(trial.covariate)
        values = np.concatenate([np.ravel(of.of(state)) for state in states])
        reach = ANEW * of.quantity.difference.per_si * float(np.ptp(values))
        for key in trial.fixed:
            now = fitted.problem.trial[name]
            assert isinstance(now, Trial)
            again = refined_edges(fitted, name, now, {key: reach})
            fitted = again if again.chi2 < fitted.chi2 - 2.0 * SEARCH.evidence_error else fitted
    return fitted


def chi2_at(fitted: Fit, name: str, key: str, places: Floats) -> Floats:
    """chi2 (place,) of a fit with an edge of a law at other places, to first order fitted anew at each.

    The response to its size is what the law does there; those to the other parameters stay.
    """
    own = fitted.own(name)
    off = np.where(own, 0.0, fitted.theta)
    missed = missed_at(fitted.problem, fitted.theta, name, key, places)
    without = missed_at(fitted.problem, off, name, key, places[:1])
    span = span_of(fitted.jacobian[:, ~own])
    rest, moved = (rows - (rows @ span) @ span.T for rows in (without, without - missed))
    along = np.sum(moved * rest, axis=1)
    return np.asarray(np.sum(rest**2) - along**2 / np.maximum(np.sum(moved**2, axis=1), 1e-300))


def missed_at(problem: Problem, theta: Floats, name: str, key: str, places: Floats) -> Floats:
    """White residuals (place, sample) at inner parameters (parameter,), with an edge of a law at other places."""
    trial = problem.effect(name)
    assert isinstance(trial, Trial)
    sets, known = np.tile(theta, (len(places), 1)), {k: np.array([v]) for k, v in trial.fixed.items()}
    values = {**problem.terms_of(theta)[name], **known, key: places}
    predictions = problem.moved(sets, extra={name: values}, trial={name: trial.unfixed})
    return finite(problem.discount(problem.measured - problem.white(predictions)))


def with_trial(fitted: Fit, name: str, trial: Trial) -> Problem:
    """The problem of a fit with another form of a law."""
    return fitted.problem.with_terms(*fitted.terms, trial={name: trial})


def middle_of_least(places: Floats, chi2: Floats) -> float:
    """Middle of the first run of places (n,) at which chi2 (n,) is least, to within its numerical error.

    Between two samples an edge may stand anywhere: which of the places has the least rounding error says nothing.
    """
    least = np.flatnonzero(chi2 <= chi2.min() + 2.0 * SEARCH.evidence_error)
    run = least[: 1 + int(np.argmin(np.append(np.diff(least) == 1, False)))]
    return float(0.5 * (places[run[0]] + places[run[-1]]))
