"""The average over explanations: its weights, and what predicts beyond the samples that were fitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache

import numpy as np
import pytest
from records.sources import sweeps
from rigs import Floats, experiment, history, spread, traction_samples

from twindisc_cli.laws.trial import Trial, curve, formula
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit, at, fit
from twindisc_cli.loop.holdout import without
from twindisc_cli.loop.judge import Judged, judge
from twindisc_cli.loop.mixture import Mixture, jumps, mixture_of
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.term_intervals import INTERVAL
from twindisc_cli.model.experiment import Measured, Options
from twindisc_cli.model.forward import ForwardModel

SEEN = {("traction", "creepage"): np.array([0.01, 0.02, 0.06, 0.1])}
OVER = (0.02, 20.0)
STARTS = {
    "linear": {"size": -0.2, "begin_percent": 1.0, "end_percent": 10.0},
    "power": {"size": -0.2, "reference_percent": 3.0, "exponent": 0.5},
    "logistic": {"size": -0.2, "at_percent": 3.0, "width_percent": 1.0},
    "step": {"size": -0.2, "at_percent": 3.0},
    "window": {"size": -0.2, "begin_percent": 3.0, "end_percent": 15.0},
}
LAWS: dict[str, Trial] = {
    "curve": curve("mu", "creepage", np.array([1.0, 3.0, 10.0]), np.eye(3)),
    **{shape: formula("mu", "creepage", shape, start, OVER, 1.0) for shape, start in STARTS.items()},
}


@cache
def of_a_sweep(shape: str) -> Judged:
    """An explanation of a sweep by a law of this shape over creepage, where it begins; by falling friction for ""."""
    problem = Problem([case_of(sweeps()[9])], ("traction",))
    terms = ("law",) if shape else ("falling_friction",)
    problem = problem.with_terms(*terms, trial={"law": LAWS[shape]} if shape else {})
    there = at(problem, problem.start())
    return Judged(Explanation(there, {}, there.chi2), there, there, there, [])


def weights_at(*shapes: str) -> tuple[Floats, Floats]:
    """Weights of 0.7 and 0.3 at the samples of a sweep (member, sample), and which of these are beyond those seen."""
    test = sweeps()[9]
    model = ForwardModel(test)
    assert test.measured.traction is not None
    creepage = test.measured.traction.creepage
    members = [of_a_sweep(shape) for shape in shapes]
    mixture = Mixture(members, np.array([0.7, 0.3]), SEEN, [jumps(member.explanation) for member in members])
    found = mixture.weights_at("traction", model, model.predict({"mu": np.array([0.05])}))
    return found, (creepage < 0.01) | (creepage > 0.1)


@pytest.mark.parametrize(("shape", "weight"), [("curve", 0.7), ("linear", 0.0), ("power", 0.0), ("logistic", 0.7)])
def test_what_grows_without_bound_gives_way_beyond_the_samples_seen(shape: str, weight: float) -> None:
    found, beyond = weights_at(shape, "")
    assert beyond.any()
    assert not beyond.all()
    assert found[0, beyond] == pytest.approx(weight)
    assert found[0, ~beyond] == pytest.approx(0.7)
    assert found.sum(axis=0) == pytest.approx(1.0)


@pytest.mark.parametrize("shape", ["step", "window"])
def test_a_step_says_nothing_between_the_samples_between_which_it_stands(shape: str) -> None:
    found, beyond = weights_at(shape, "")
    measured = sweeps()[9].measured.traction
    assert measured is not None
    gap = (measured.creepage > 0.02) & (measured.creepage < 0.06)
    assert gap.any()
    assert found[0, gap] == pytest.approx(0.0)
    assert found[0, ~gap & ~beyond] == pytest.approx(0.7)


def test_what_grows_without_bound_stays_where_nothing_else_predicts() -> None:
    found, _ = weights_at("linear", "power")
    assert found[0] == pytest.approx(0.7)


COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 1)
TIME = spread(COURSE, 20)


def problem_of(missed: float, change: Floats | float = 0.0) -> Problem:
    """A steady friction with noise, a change, and a slow swing of this size that nothing explains."""
    ratio = 0.6 + change + missed * np.sin(TIME / 40.0) + 0.004 * np.random.default_rng(0).standard_normal(len(TIME))
    measured = Measured(traction=traction_samples(COURSE, TIME, ratio, 0.004))
    test = experiment(COURSE, thermal=None, options=Options(friction_coefficient=0.6), measured=measured)
    return Problem([case_of(test)], ("traction",))


def averaged(
    problem: Problem, evidence: Mapping[str, float], erring: Collection[str] = ()
) -> tuple[Mixture, list[Explanation]]:
    """The average over an effect each, "" for the base model, the first the answer; costs make their evidence.

    erring: the effects that raise an error.
    """
    before = fit(problem)
    members = []
    for name, size in evidence.items():
        fitted = fit(problem.with_terms(name)) if name else before
        members.append(Explanation(fitted, {"choice": fitted.evidence - size}, fitted.chi2))
    masks = [{"traction": np.zeros(len(TIME), dtype=bool)}]
    wrong = {member.labels for member in members if member.terms and member.terms[0] in erring}
    return mixture_of(judge(members[0], before, before, masks), members, wrong, masks), members


def mixed(problem: Problem, evidence: Mapping[str, float]) -> tuple[list[float], list[Fit]]:
    """Weights and fits of the same, in their order."""
    found, members = averaged(problem, evidence)
    weight = {member.explanation.terms: w for member, w in zip(found.members, found.weights, strict=True)}
    return [float(weight.get(m.terms, 0.0)) for m in members], [m.fit for m in members]


def test_where_all_are_as_evident_the_base_model_outweighs_each_by_their_number() -> None:
    found, _ = mixed(
        problem_of(0.0), {"falling_friction": 3.0, "": 3.0, "third_body_layer": 3.0, "running_in_friction": 3.0}
    )
    first, base, *others = found
    assert [first, *others] == pytest.approx([base / 4.0] * 3)


def test_only_what_raises_an_error_predicts_nothing() -> None:
    evidence = {"falling_friction": 3.0, "third_body_layer": 3.0, "running_in_friction": 3.0}
    found, _ = averaged(problem_of(0.0), evidence, ["third_body_layer"])
    assert {member.explanation.terms for member in found.members} == {("falling_friction",), ("running_in_friction",)}
    assert found.weights == pytest.approx([0.5, 0.5])


def test_the_closest_explanation_is_not_alone_where_others_are_as_evident() -> None:
    """A form with more parameters is closer to the samples it was fitted to than any average with it."""
    evidence = {"running_in_friction": 3.0, "falling_friction": 3.0}
    found, _ = averaged(problem_of(0.0, 0.05 * np.exp(-TIME / 100.0)), evidence)
    alone, average = (of.error("traction", "unseen_after", held_out=False) for of in (found.members[0], found))
    assert average > 1.2 * alone
    assert found.weights == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("missed", [0.0, 0.01, 0.02])
def test_where_the_best_leaves_more_than_the_noise_the_odds_shrink_by_that(missed: float) -> None:
    """The odds of QAIC: differences of the evidence over the variance that the best leaves."""
    found, fits = mixed(problem_of(missed), {"running_in_friction": 2.0, "falling_friction": 0.5})
    left = min(f.chi2 / (len(f.residual) - len(f.theta)) for f in fits)
    assert (left > 1.5) is (missed > 0.0)
    assert np.log(found[0] / found[1]) == pytest.approx(1.5 / max(left, 1.0))


def test_what_the_samples_held_out_speak_for_predicts_other_tests() -> None:
    """Friction that settles over the first of six steps, which is held out: only on all samples does it show."""
    whole = problem_of(0.0, 0.05 * np.exp(-TIME / (0.3 * TIME[19])))
    masks = [{"traction": np.arange(len(TIME)) < 20}]
    seen = Problem([case_of(without(whole.cases[0].test, masks[0]))], ("traction",))
    before, members = fit(seen), []
    for name in ("falling_friction", "running_in_friction"):
        fitted = fit(seen.with_terms(name))
        members.append(Explanation(fitted, {"choice": fitted.evidence - 3.0}, fitted.chi2))
    found = mixture_of(judge(members[0], fit(whole), before, masks), members, frozenset(), masks)
    assert found.weights == pytest.approx([0.5, 0.5])
    assert found.on_all.weights[1] > 0.999
    assert found.on_all.on_all.weights == pytest.approx(found.on_all.weights)


@pytest.mark.parametrize("width", [1e-5, 0.005])
def test_a_transition_that_may_be_a_jump_is_one(width: float) -> None:
    """Friction that rises at 3.5 % creepage, seen at 3 and 4 %: at once, or over a range that the samples show."""
    creepage = problem_of(0.0).cases[0].test.measured.traction
    assert creepage is not None
    rise = 0.1 * np.tanh((creepage.creepage - 0.035) / (2.0 * width)) - 0.1
    found, _ = averaged(problem_of(0.0, rise), {"": 3.0, "film_breakdown": 3.0})
    here = {member.explanation.terms: places for member, places in zip(found.members, found.jumps, strict=True)}
    if width > 1e-4:
        assert here["film_breakdown",] == []
        return
    ((covariate, place),) = here["film_breakdown",]
    assert covariate == "creepage"
    assert 3.0 < place.item() < 4.0


def test_a_transition_may_be_a_jump_where_the_rest_of_the_model_follows() -> None:
    """A film that breaks down between 2 and 6 % beside falling friction: two levels fit as well as its wide slope."""
    course = history((0.005, 0.01, 0.015, 0.02, 0.06, 0.07, 0.08, 0.09), 1)
    time, creepage = spread(course, 5), np.repeat(course.creepage, 5)
    film = 0.5 + 0.5 / (1.0 + np.exp((0.03 - creepage) / 0.004))
    noise = 0.02 * np.random.default_rng(2).standard_normal(len(creepage))
    ratio = 0.6 * film * (0.4 + 0.6 * np.exp(-15.0 * creepage)) + noise
    measured = Measured(traction=traction_samples(course, time, ratio, 0.02))
    test = experiment(course, thermal=None, options=Options(friction_coefficient=0.6), measured=measured)
    fitted = fit(Problem([case_of(test)], ("traction",)).with_terms("falling_friction", "film_breakdown"))
    assert fitted.values("film_breakdown")["width_percent"] > 0.1
    assert of_two_levels(creepage, ratio) / 0.02**2 < fitted.chi2 + INTERVAL
    ((covariate, place),) = jumps(Explanation(fitted, {}, fitted.chi2))
    assert covariate == "creepage"
    assert 2.0 < place.item() < 6.0


def of_two_levels(creepage: Floats, ratio: Floats) -> float:
    """Squared misses of a friction that falls, with a level below 4 % creepage and another above, on a fine grid."""
    least = np.inf
    for left in np.linspace(0.0, 1.0, 21):
        for decay in np.geomspace(1.0, 100.0, 41):
            falling = left + (1.0 - left) * np.exp(-decay * creepage)
            levels = np.stack([falling * (creepage < 0.04), falling * (creepage > 0.04)], axis=1)
            least = min(least, float(np.sum((ratio - levels @ np.linalg.pinv(levels) @ ratio) ** 2)))
    return least
