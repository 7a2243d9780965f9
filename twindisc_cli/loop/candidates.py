"""What could be added to a fit: effects of the catalogue and laws learnt from what is left, by what they promise."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect
from twindisc_cli.identify.span import span_of
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.law import law_key
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.trial import Trial, formula
from twindisc_cli.loop.channels.mass import weighed_stops
from twindisc_cli.loop.channels.profile import recorded_stops
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.learn import (
    Pair,
    Response,
    covariates_of,
    equal_here,
    is_timed,
    pairs,
    responses,
    typical_change,
    with_elsewhere,
)
from twindisc_cli.loop.problem import Case, Parameter, Problem, parameters_of
from twindisc_cli.loop.terms import in_test
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.ties import falling, first_of_most
from twindisc_cli.loop.tolerances import known_sensors
from twindisc_cli.loop.validate import LinearPrediction
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.prediction import Prediction

SIZES = (3.0, 1.0, 0.25)  # of the typical size: a response may be steep or saturated, or bend
MOST_FOLLOWED = 16  # sets of an effect beside which the parameters of the fit are moved
DECADES = (2.5, 5.5)  # of a factor that spans decades: its logarithm over that of the typical one
LEAST_START = 0.05  # share of a size on the grid that an effect starts with, at least
LARGE_CHANGE = 0.1  # of a factor
TRANSITIONS = 12  # places of a transition over what the tests cover
HELD = 0.01  # white length that a weight of one costs in a sum of sizes: one within the grid costs next to nothing


@dataclass(frozen=True)
class Proposal:
    """A term that may be added: its name, how it acts, inner start values of its own parameters, what it promises.

    promise: logarithm of the evidence to first order, less its cost; cost: what the choice of a law's form costs.
    """

    name: str
    effect: Effect
    starts: Sequence[Floats]
    promise: float
    cost: float = 0.0
    pair: Pair | None = None

    @property
    def is_law(self) -> bool:
        """Whether it is a law and no effect of the catalogue."""
        return isinstance(self.effect, Trial)

    @property
    def shape(self) -> str | None:
        """The formula of a law."""
        return self.effect.shape if isinstance(self.effect, Trial) else None


def by_promise(proposal: Proposal) -> tuple[float, str]:
    """To sort by falling promise."""
    return falling(proposal.promise), proposal.name


def proposals(
    fitted: Fit,
    known: Sequence[Response] | None = None,
    names: Sequence[str] | None = None,
    there: LinearPrediction | None = None,
) -> list[Proposal]:
    """Every effect, or those of these names, and every law that may be added to a fit, by falling promise.

    known: responses nearby; there: a test that is only predicted, about this fit.
    """
    return sorted([*effects(fitted, names), *laws(fitted, known, there)], key=by_promise)


def proposals_in(fitted: Fit, shown: Container[str]) -> list[Proposal]:
    """The same of what shows first in these channels."""
    names = [name for name, effect in catalogue().items() if fitted.problem.shown_in(effect) in shown]
    return proposals(fitted, responses(fitted, shown=shown), names)


def effects(fitted: Fit, names: Sequence[str] | None = None) -> list[Proposal]:
    """The effects of the catalogue, or those of these names, that the tests can show and that are not in the model."""
    target, results = _target(fitted), []
    for name in searched(fitted.problem):
        if names is not None and name not in names:
            continue
        if catalogue()[name].level_of:
            results += _levels(fitted, target, name)
            continue
        sets, moved = _responses_of(fitted, target, name)
        results.append(_effect(fitted, name, sets, _beyond(moved, target)))
        for test, own in fitted.problem.own_samples(moved, catalogue()[name].channel):
            results.append(_effect(fitted, name, sets, _beyond(np.where(own, moved, 0.0), target), test))
    return sorted(results, key=by_promise)


def _levels(fitted: Fit, target: tuple[Floats, Floats], name: str) -> list[Proposal]:
    """The level of each test that has none of its own yet; the others have the one they share, one of them at least."""
    shown = [(test, *_responses_of(fitted, target, name, test)) for test in without_level(fitted.problem, name)]
    shown = [(test, sets, moved) for test, sets, moved in shown if np.any(moved != 0.0)]
    return [
        _effect(fitted, name, sets, _beyond(moved, target), test)
        for test, sets, moved in (shown if len(shown) > 2 else shown[1:])
    ]


def without_level(problem: Problem, name: str) -> list[str]:
    """Tests that may have a level of their own, as an effect of this name gives them, and have none yet."""
    return [test for test in problem.own_terms if in_test(name, test) not in problem.terms]


def _effect(fitted: Fit, name: str, sets: Floats, moved: Floats, test: str = "") -> Proposal:
    """An effect from what its parameters (set, parameter) do to white samples (set, sample), in one test or in all.

    It promises what the best start takes, averaged over what only shapes it, less the cost of its sizes. It starts
    where it promises most, and where it does what is least like that, of what promises half as much.
    """
    off = _off(name)
    sized = ~np.isnan(off)
    begin, moved = (_shares if np.sum(sized) == 1 else _sums)(fitted, off, sets, moved)
    score, length = _scores(fitted, moved), _length(moved)
    first = first_of_most(score)
    similarity = np.where(score >= 0.5 * score[first], np.abs(moved @ moved[first]) / np.sqrt(length), np.inf)
    starts = [begin[i] for i in dict.fromkeys((first, first_of_most(-similarity)))]
    shaped = float(np.log(np.mean(np.exp(0.5 * (score - score[first])))))
    paid = 0.5 * np.log(len(fitted.residual)) * np.sum(sized)
    cost = fitted.problem.cost_of_one if test else 0.0
    promise = 0.5 * float(score[first]) + shaped - paid - cost
    return Proposal(in_test(name, test), replace(catalogue()[name], test=test), starts, promise, cost)


def _shares(fitted: Fit, off: Floats, sets: Floats, moved: Floats) -> tuple[Floats, Floats]:
    """Parameters (set, parameter) with the size that the residual asks, to first order, and what they do (set, sample).

    They are inside the grid.
    """
    share = np.clip(moved @ fitted.residual / _length(moved), LEAST_START, 1.0)
    return np.where(np.isnan(off), sets, off + share[:, None] * (sets - off)), moved


def _sums(fitted: Fit, off: Floats, sets: Floats, moved: Floats) -> tuple[Floats, Floats]:
    """The same of an effect of several sizes: what each does alone, added up as the residual asks, for every shape.

    Parameters are inside the grid. A size and its opposite do the opposite: without what holds their weights, these are
    what rounding makes of the difference, 10^12 and more.
    """
    sized = ~np.isnan(off)
    _, shape = np.unique(sets[:, ~sized], axis=0, return_inverse=True)
    begin, sums = [], []
    for here in (shape == number for number in range(int(shape.max()) + 1)):
        count = int(np.sum(here))
        held, nothing = HELD * np.eye(count), np.zeros(count)
        weight, _ = nnls(np.concatenate([moved[here].T, held]), np.concatenate([fitted.residual, nothing]))
        begin.append(np.where(sized, off + weight @ (sets[here] - off), sets[here][0]))
        sums.append(weight @ moved[here])
    return np.clip(begin, sets.min(axis=0), sets.max(axis=0)), np.array(sums)


def _off(name: str) -> Floats:
    """Inner values that switch an effect off, NaN of parameters that only shape it (parameter,)."""
    own = parameters_of(name, catalogue()[name])
    return np.array([np.nan if p.off is None else p.inner(p.off) for p in own])


def laws(fitted: Fit, known: Sequence[Response] | None = None, there: LinearPrediction | None = None) -> list[Proposal]:
    """Every law over every pair that says anything, the best forms of each.

    Among these is the form that says most of the tests that are fitted and of another, only predicted, together.
    """
    results = list[Proposal]()
    for pair in pairs(fitted, known):
        if _is_in(fitted.problem, law_key(pair.quantity, pair.covariate)) or pair.log_evidence < 0.0:
            continue
        forms = _forms(fitted, pair)
        if not forms:
            continue
        more = forms[0].promise > SEARCH.strong and not fitted.problem.is_integrated
        more = more and not fitted.problem.assumed(fitted.problem.shown_in(forms[0].effect)).any()
        forms = forms[: SEARCH.strong_forms_fitted if more else SEARCH.forms_fitted]
        if there is not None and not pair.test:
            forms.append(_forms(fitted, with_elsewhere(fitted, pair, there))[0])
        results += {form.shape: form for form in sorted(forms, key=by_promise, reverse=True)}.values()
    return results


def _forms(fitted: Fit, pair: Pair) -> list[Proposal]:
    """The forms of a law over a pair, by falling promise."""
    own = fitted.problem.cost_of_one if pair.test else 0.0
    return [
        Proposal(pair.name, trial, _starts_of(pair.name, trial, pair), promise - own, cost + own, pair)
        for promise, trial, cost in pair.proposals(len(fitted.residual))
    ]


def _starts_of(name: str, law: Trial, pair: Pair) -> list[Floats]:
    """Inner start values of a law (start, parameter): as promised, and with the change that was tried if it is large.

    Near no change there may be no slope that leads there.
    """
    parameters = parameters_of(name, law)
    promised = np.array([p.inner(p.start) for p in parameters])
    large = QUANTITIES[pair.quantity].kind == "factor" and abs(pair.change) > LARGE_CHANGE
    if law.is_curve or not large:
        return [promised]
    tried = [p.inner(pair.change) if p.off is not None else own for p, own in zip(parameters, promised, strict=True)]
    return [promised, np.array(tried)]


def laws_elsewhere(fitted: Fit, named: Sequence[tuple[str, str]], other: Prediction) -> list[Proposal]:
    """Laws, by quantity and covariate, over what runs as the covariate in the tests that are fitted, not in another."""
    here = fitted.problem.predict(fitted.theta[None])
    wanted = [(quantity, over) for quantity, own in named for over in equal_here(here, quantity, own, other)]
    return laws(fitted, responses(fitted, wanted)) if wanted else []


def laws_at_other_stages(
    fitted: Fit, named: Mapping[tuple[str, str], Container[str]], there: LinearPrediction | None = None
) -> list[Proposal]:
    """Laws, by quantity and covariate, over the same covariates of other quantities that their channels show."""
    wanted = [
        (stage, covariate)
        for (_, covariate), shown in named.items()
        for stage, of in QUANTITIES.items()
        if fitted.problem.shown_in(of) in shown and covariate in covariates_of(fitted.problem, stage)
    ]
    new = sorted({pair for pair in wanted if pair not in named})
    return laws(fitted, responses(fitted, new), there) if new else []


def warmed(effect: Effect) -> str | None:
    """The quantity, mu or wear, that an effect or a law changes with the disc's temperature; None of any other."""
    if isinstance(effect, Trial):
        return effect.quantity if effect.covariate == "temperature" and effect.quantity in ("mu", "wear") else None
    return {"friction": "mu", "wear": "wear"}.get(effect.stage) if effect.needs_temperature else None


def flash_law(fitted: Fit, quantity: str) -> Proposal | None:
    """A quantity on a line over the flash temperature, beside a fit; None where that is not known or never changes."""
    flash = np.concatenate([np.ravel(p.state.flash) for p in fitted.problem.predict(fitted.theta[None])])
    span = float(flash.min()), float(flash.max())
    if not span[1] > span[0]:
        return None
    start = {QUANTITIES[quantity].size_key: typical_change(fitted, quantity), "begin_K": span[0], "end_K": span[1]}
    trial = formula(quantity, "flash_temperature", "linear", start, span, 1.0)
    name = law_key(quantity, "flash_temperature")
    inner = np.array([p.inner(p.start) for p in parameters_of(name, trial)])
    return Proposal(name, trial, [inner], 0.0, float(np.log(SEARCH.curve_families)))


def stops_of_wear(cases: Sequence[Case]) -> int:
    """At how many stops of a test wear was recorded, by profiles or a balance: the most of any."""
    return max((max(len(recorded_stops(case.test)), weighed_stops(case.test)) for case in cases), default=0)


def searched(problem: Problem) -> list[str]:
    """Names of the effects that may be missing: neither declared nor added yet, nor known from the measurement."""
    declared = {name for case in problem.cases for name in case.test.effects}
    stops = stops_of_wear(problem.cases)
    timed = any(is_timed(case) for case in problem.cases)
    crowned = knows_crowns(problem)
    yawed = any(np.any(case.test.history.yaw != 0.0) for case in problem.cases)
    for channel in ("traction", "profile"):
        seen = [{name for name, _, _ in known_sensors(case.test)} for case in problem.cases if channel in case.noise]
        own = {name for name in set().union(*seen) if catalogue()[name].channel == channel}
        declared |= {name for name in own if all(name in known for known in seen)}
    return [
        name
        for name, effect in catalogue().items()
        if problem.shown_in(effect)
        and (without_level(problem, name) if effect.level_of else not _is_in(problem, name))
        and name not in declared
        and (stops > 1 or not effect.needs_stops)
        and (timed or not effect.needs_time)
        and (yawed or not effect.needs_yaw)
        and (crowned or not effect.needs_crowns)
    ]


def knows_crowns(problem: Problem) -> bool:
    """Whether wear with other transverse radii than the declared ones is tabulated, so that they are tried."""
    return not problem.is_local and all(case.model.knows_crowns for case in problem.cases)


def _is_in(problem: Problem, name: str) -> bool:
    """Whether an effect or a law is a term already, in all tests or in one."""
    return any(in_test(name, test) in problem.terms for test in ("", *problem.tests))


def _responses_of(fitted: Fit, target: tuple[Floats, Floats], name: str, test: str = "") -> tuple[Floats, Floats]:
    """Inner parameters of an effect on a grid (set, parameter), and what each does to white samples (set, sample).

    test: the only one it acts in.
    Beside those that say most the parameters of the fit are moved as they absorb it to first order: a load that is 15 %
    less moves mu by 16 %, where slopes are others.
    """
    own = in_test(name, test)
    problem = fitted.problem.with_terms(*fitted.terms, own, trial={own: replace(catalogue()[name], test=test)})
    sets = _grid(fitted, name)
    theta = np.concatenate([np.tile(fitted.theta, (len(sets), 1)), sets], axis=1)
    rows = _moved(problem, theta, target)
    most = np.argsort(-_scores(fitted, _beyond(rows, target)), kind="stable")[:MOST_FOLLOWED]
    theta[:, : len(fitted.theta)] += rows @ np.linalg.pinv(fitted.jacobian).T
    rows[most] = _moved(problem, theta[most], target)
    return sets, rows


def _moved(problem: Problem, theta: Floats, target: tuple[Floats, Floats]) -> Floats:
    """White rows (set, sample) of inner parameters (set, parameter), less those of a fit."""
    inside = np.clip(theta, *problem.bounds)
    rows = problem.discount(problem.white(problem.predict(inside, integrated="none", rough=True)))
    return np.nan_to_num(rows - target[0])


def _scores(fitted: Fit, moved: Floats) -> Floats:
    """By how much chi2 falls with the best share of each response (set, sample) to first order (set,)."""
    return np.asarray(np.maximum(moved @ fitted.residual, 0.0) ** 2 / _length(moved))


def _length(moved: Floats) -> Floats:
    """Squared length of each response (set, sample), never zero (set,)."""
    return np.asarray(np.sum(moved**2, axis=1) + 1e-12)


def _beyond(moved: Floats, target: tuple[Floats, Floats]) -> Floats:
    """Responses (set, sample) without what the fitted parameters can absorb."""
    span = target[1]
    return np.asarray(moved - (moved @ span) @ span.T)


def _target(fitted: Fit) -> tuple[Floats, Floats]:
    """White prediction of a fit (sample,), and the directions that its parameters reach."""
    problem = fitted.problem
    plain = problem.white(problem.predict(fitted.theta[None], integrated="none", rough=True))[0]
    return problem.discount(plain), span_of(fitted.jacobian)


def _grid(fitted: Fit, name: str) -> Floats:
    """Inner parameters of one effect on a coarse grid (set, parameter) that covers what its parameters may be.

    Of several sizes one is on at a time.
    """
    effect, own = catalogue()[name], parameters_of(name, catalogue()[name])
    shapes = sum(p.off is None for p in own)
    several = len(own) - shapes > 1
    transitions = {param.width_of for param in effect.params}
    axes = [
        (_covered(fitted, effect.over, p) if p.key in transitions else []) or _places(p, shapes, with_off=several)
        for p in own
    ]
    sets = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    sized = ~np.isnan(_off(name))
    return np.asarray(sets[np.sum(sets[:, sized] != _off(name)[sized], axis=1) == 1])


def _covered(fitted: Fit, covariate: str, place: Parameter) -> list[float]:
    """Inner values of the place of a transition over what the tests cover of its covariate, within its bounds.

    None where that is not known.
    """
    predictions = fitted.problem.predict(fitted.theta[None], integrated="none", rough=True) if covariate else []
    values = np.concatenate([np.ravel(covariate_of(covariate).of(p.state)) for p in predictions] or [np.empty(0)])
    values = values[values > 0.0]
    if not len(values):
        return []
    low, high = (float(np.clip(end, place.lower, place.upper)) for end in (values.min(), values.max()))
    return sorted({place.inner(float(value)) for value in np.geomspace(low, high, TRANSITIONS)})


def _places(parameter: Parameter, shapes: int, *, with_off: bool) -> list[float]:
    """Inner values of a parameter of an effect, which has so many parameters that only shape it, over its range."""
    low, high = parameter.inner(parameter.lower), parameter.inner(parameter.upper)
    if parameter.off is not None:
        off = parameter.inner(parameter.off)
        size = parameter.inner(parameter.start) - off
        parts = (*(SIZES if shapes < 2 else SIZES[1:2]), *(DECADES if parameter.log and shapes < 2 else ()))
        places = [off + sign * part * size for part in parts for sign in (1.0, -1.0)]
        return [place for place in places if low <= place <= high] + [off] * with_off
    if parameter.log:
        return list(np.linspace(low, high, 15 if shapes == 1 else 7)[1:-1])
    return [parameter.inner(parameter.start)]
