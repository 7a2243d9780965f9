"""The search: what is weighed against what, what is chosen, what is learnt, and what is never offered."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from definitions import shipped
from rigs import LOAD, ROOM, SPEED, Floats, Instruments, Plant, experiment, history, one_of, spread, traction_samples

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.trial import curve, formula
from twindisc_cli.loop.candidates import Proposal, _moved, _responses_of, _target, effects, laws, searched
from twindisc_cli.loop.choose import chosen
from twindisc_cli.loop.explanation import Explanation, ranked
from twindisc_cli.loop.extend import _likeliest_laws, extended, most_promising
from twindisc_cli.loop.fit import at, fit, refit
from twindisc_cli.loop.learn import Pair
from twindisc_cli.loop.problem import Case, Problem, case_of, problem_of
from twindisc_cli.loop.screen import left_over_explained, unexplained_residual
from twindisc_cli.loop.search import (
    Search,
    _near,
    _nothing_left,
    catalogued,
    search,
    swap_and_drop,
    without_older_laws,
    without_two_terms,
)
from twindisc_cli.loop.terms import EffectTerm, LawTerm, Term
from twindisc_cli.loop.thresholds import ACCEPTANCE, SEARCH
from twindisc_cli.loop.validate import elsewhere
from twindisc_cli.model.experiment import Measured, Thermal
from twindisc_cli.model.forward import ForwardModel

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 2)
TIME = spread(COURSE, 6)
AT = COURSE.creepage[np.searchsorted(COURSE.end_time, TIME)]
SIGMA = 0.004


def traction_case(ratio: Floats, seed: int = 0) -> Case:
    noisy = ratio + SIGMA * np.random.default_rng(seed).standard_normal(len(TIME))
    samples = traction_samples(COURSE, TIME, noisy)
    return case_of(experiment(COURSE, thermal=None, measured=Measured(traction=samples)))


TRACTIONS: dict[str, Floats] = {
    "falling_friction": 0.6 * (0.5 + 0.5 * np.exp(-3.0 * AT * SPEED)),
    "film_breakdown": 0.6 * (0.4 + 0.6 / (1.0 + np.exp(-(AT - 0.035) / 0.005))),
    "running_in_friction": 0.6 * (1.0 - 0.3 * np.exp(-50.0 * TIME / 12000.0)),
    "sensor_drift": 0.6 - 0.04 * TIME / 1000.0,
    "a burst between two times": 0.6 + 0.06 * ((TIME > 250.0) & (TIME < 480.0)),
    "a dip about one creepage": 0.6 - 0.06 * (AT == 0.03),
    "a swing": 0.6 * (1.0 + 0.05 * np.sin(TIME / 60.0)),
    "a outlier sample": 0.6 + 0.03 * (TIME[0] == TIME),
}


@cache
def found_in(name: str) -> Search:
    return search(Problem([traction_case(TRACTIONS[name])], ("traction",)), lambda stage: None)


def told(found: Search) -> set[Term]:
    """What stands in the answer, and what cannot be told from it."""
    near = [
        e
        for rivals in found.rivals.values()
        for e in rivals
        if (found.answer.evidence - e.evidence) / found.answer.evidence_scale < SEARCH.equivalent
    ]
    return {label for e in [found.answer, *near] for label in e.labels}


# ------------------------------------------------------------------------------------------------ what is chosen


@dataclass(frozen=True)
class Made(Explanation):
    """An explanation whose evidence is made up: of the tests that are fitted, and of one that is only predicted."""

    gain: float = 0.0
    gain_there: float = 0.0

    @property
    def here(self) -> float:
        return self.gain

    @property
    def there(self) -> float:
        return self.gain_there


PAIR = Pair("mu", "time", np.arange(3.0), np.arange(2.0), np.eye(2), np.zeros(2), 0.3, 60)
PLAIN = Problem([traction_case(np.full(len(TIME), 0.6))], ("traction",))
LAW = formula("mu", "time", "bump", {"size": 0.1, "at_s": 400.0, "width_s": 90.0}, (0.0, 1008.0), 1.0)
LINE = formula("mu", "time", "linear", {"size": 0.1, "begin_s": 0.0, "end_s": 1008.0}, (0.0, 1008.0), 1.0)


def made(gain: float, *terms: str, before: float | None = None, gain_there: float = 0.0) -> Made:
    problem = PLAIN.with_terms(*terms, trial={"mu_over_time": LAW})
    fitted = at(problem, problem.start())
    return Made(fitted, {}, fitted.chi2 if before is None else before, gain=gain, gain_there=gain_there)


@pytest.mark.parametrize(("older", "loss"), [(False, 0.0), (True, 0.0), (True, 100.0)])
def test_a_law_that_was_there_before_gives_way_to_two_effects(
    older: bool, loss: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once another term stands beside it; the newest term was compared with two effects when it was chosen.

    Two effects that lose evidence once the nuisances are found where they are fitted do not stand for it.
    """
    monkeypatch.setattr(
        "twindisc_cli.loop.search.refitted", lambda two: replace(two, costs={**two.costs, "nuisances": loss})
    )
    ratio = TRACTIONS["falling_friction"] * TRACTIONS["film_breakdown"] / 0.6 - 0.09 * TIME / 1000.0
    problem = Problem([traction_case(ratio)], ("traction",))
    levels = 100.0 * np.unique(AT)
    trial = {"law": curve("mu", "creepage", levels, 0.5 * np.eye(len(levels)))}
    base = fit(problem)

    def explained(*terms: str) -> Explanation:
        own = {name: law for name, law in trial.items() if name in terms}
        return Explanation(fit(problem.with_terms(*terms, trial=own)), dict.fromkeys(terms, 0.0), base.chi2)

    answer, drift = explained("law", "sensor_drift"), explained("sensor_drift")
    halves = ranked([explained("sensor_drift", name) for name in ("falling_friction", "film_breakdown")])
    before = explained("law") if older else drift
    found, _ = without_older_laws(answer, {"law": halves, "sensor_drift": []}, before)
    two = {EffectTerm(name) for name in ("sensor_drift", "film_breakdown", "falling_friction")}
    assert found.labels == (two if older and not loss else answer.labels)


def test_one_effect_beside_another_that_says_nothing_is_no_pair_in_the_place_of_a_law(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It would be one wherever rounding lets the second promise more than nothing."""
    problem = Problem([traction_case(TRACTIONS["falling_friction"])], ("traction",))
    levels = 100.0 * np.unique(AT)
    trial = {"mu_over_creepage": curve("mu", "creepage", levels, 0.5 * np.eye(len(levels)))}
    base = Explanation.of_base(fit(problem))

    def explained(*terms: str) -> Explanation:
        own = {name: law for name, law in trial.items() if name in terms}
        return replace(base, fit=fit(problem.with_terms(*terms, trial=own)), costs=dict.fromkeys(terms, 0.0))

    law, one, pair = (explained(*terms) for terms in (["mu_over_creepage"], ["falling_friction"],
                                                      ["falling_friction", "torque_offset"]))  # fmt: skip
    monkeypatch.setattr("twindisc_cli.loop.search.most_promising", lambda half, proposed, best: [pair])
    assert one.here > pair.here > law.here - SEARCH.equivalent
    assert chosen(base, [one]) is one
    assert [e.terms for e in catalogued(law, base, [one])] == [law.terms, pair.terms]


def test_of_each_channel_the_likeliest_law_is_fitted() -> None:
    """Eight laws of the traction say more than any of the profile does."""

    def proposed(name: str, channel: str, evidence: float) -> Proposal:
        effect = replace(catalogue()["torque_offset"], channel=channel)
        pair = replace(PAIR, quantity=name)
        pair.__dict__["log_evidence"] = evidence
        return Proposal(pair.name, effect, [], evidence, pair=pair)

    traction = [proposed(f"t{i}", "traction", 20.0 - i) for i in range(SEARCH.fitted_each_round + 1)]
    profile = [proposed("p1", "profile", 4.0), proposed("p2", "profile", 5.0)]
    names = _likeliest_laws([*traction, *profile])
    assert names == {p.name for p in [*traction[:-1], profile[1]]}


def test_a_law_whose_rivals_were_not_recorded_stays() -> None:
    """So it is where terms are exchanged until their number is exhausted, as with loads by step."""
    answer, before = made(40.0, "mu_over_time", "torque_offset"), made(20.0, "mu_over_time")
    assert without_older_laws(answer, {"torque_offset": []}, before) == (answer, {"torque_offset": []})


def test_evidence_pays_for_the_choice_of_forms() -> None:
    problem = PLAIN.with_terms("mu_over_time", trial={"mu_over_time": LAW})
    fitted = at(problem, problem.start())
    assert Explanation(fitted, {"mu_over_time": 3.2}, 0.0).evidence == pytest.approx(fitted.evidence - 3.2)


def test_what_is_explained_cools_the_odds() -> None:
    """1 + c sqrt(fall of chi2), and no less than one."""
    cold, warm = made(0.0), made(0.0, before=made(0.0).fit.chi2 + 2500.0)
    assert cold.evidence_scale == 1.0
    assert warm.evidence_scale == pytest.approx(1.0 + 50.0 * SEARCH.tempering)
    assert made(0.0, before=0.0).evidence_scale == 1.0


def test_what_says_too_little_is_not_chosen() -> None:
    base = made(0.0)
    assert chosen(base, []) is None
    assert chosen(base, [made(SEARCH.effect_evidence - 0.1, "torque_offset")]) is None
    best = made(SEARCH.effect_evidence + 0.1, "torque_offset")
    assert chosen(base, [made(1.0, "sensor_drift"), best]) is best


def test_more_is_asked_of_a_law_and_an_effect_goes_first_where_they_are_alike() -> None:
    base = made(0.0)
    between = 0.5 * (SEARCH.effect_evidence + SEARCH.law_evidence)
    assert chosen(base, [made(between, "mu_over_time")]) is None
    law, effect = made(30.0, "mu_over_time"), made(30.5 - SEARCH.equivalent, "sensor_drift")
    assert chosen(base, [law, effect]) is effect
    far = made(29.5 - SEARCH.equivalent, "sensor_drift")
    assert chosen(base, [law, far]) is law


def test_a_test_that_is_only_predicted_counts_for_a_term_up_to_what_those_fitted_say() -> None:
    base, sure, half = made(0.0), SEARCH.effect_evidence + 1.0, 0.5 * SEARCH.effect_evidence
    assert chosen(base, [made(half - 0.2, "sensor_drift", gain_there=500.0)]) is None
    assert chosen(base, [made(half + 0.2, "sensor_drift", gain_there=half - 0.4)]) is None
    assert chosen(base, [made(half + 0.2, "sensor_drift", gain_there=half)]) is not None
    assert chosen(base, [made(sure, "sensor_drift", gain_there=-3.0)]) is None
    better = made(sure, "torque_offset", gain_there=20.0)
    assert chosen(base, [made(sure + 10.0, "sensor_drift"), better]) is better


def test_an_effect_of_several_sizes_promises_what_one_of_them_does_and_pays_for_the_others() -> None:
    """A contact that is softer: two slope factors hold it, of which the second is then one."""
    course = history((0.0005, 0.001, 0.0015, 0.002, 0.003, 0.005, 0.01, 0.02), 2)
    time = spread(course, 6)
    plain = experiment(course, thermal=None, measured=Measured(traction=traction_samples(course, time, 0.0 * time)))
    softer = ForwardModel(replace(plain, effects={"third_body_layer": {"slope_ratio": 0.85}}))
    ratio = softer.predict({"mu": np.array([0.6])}).traction[0]
    noisy = ratio + SIGMA * np.random.default_rng(0).standard_normal(len(time))
    case = case_of(replace(plain, measured=Measured(traction=traction_samples(course, time, noisy))))
    promise = {proposal.name: proposal.promise for proposal in effects(fit(Problem([case], ("traction",))))}
    cost = 0.5 * np.log(len(time))
    assert promise["third_body_layer"] > 10.0
    assert promise["two_slope_factors"] > promise["third_body_layer"] - cost - 0.5


def test_a_slope_that_has_fallen_to_a_fifth_is_fitted_where_half_of_it_shows_nothing() -> None:
    """Vermeulen and Johnson's 1 - (1 - x / 3)^3 at mu = 0.3: x = 3 at 0.6 % of creepage, in the second half at 3 %."""
    slid = np.minimum(AT / 0.006 * np.where(TIME > 600.0, 0.2, 1.0), 1.0)
    fitted = fit(Problem([traction_case(0.3 * (1.0 - (1.0 - slid) ** 3))], ("traction",)))
    tried = most_promising(Explanation(fitted, {}, fitted.chi2), laws(fitted))
    (best,) = (e for e in tried if e.terms == ("slope_over_time",) and e.laws["slope_over_time"].shape == "step")
    assert best.here - fitted.evidence > 50.0
    assert best.fit.values("slope_over_time")["size"] == pytest.approx(-0.8, abs=0.05)


def test_what_an_effect_does_is_asked_where_the_base_parameters_have_absorbed_it() -> None:
    """A load that is 15 % less is another mu for the most part: once mu is moved, little of it is left to absorb."""
    base = refit(Problem([traction_case(TRACTIONS["falling_friction"])], ("traction",)))
    target = _target(base)
    sets, rows = _responses_of(base, target, "load_error")
    problem = base.problem.with_terms("load_error")
    alone = _moved(problem, np.column_stack([np.tile(base.theta, (len(sets), 1)), sets]), target)
    absorbed, before = (np.linalg.norm(moved @ target[1], axis=1) for moved in (rows, alone))
    assert np.all(before > 5.0)
    assert np.all(absorbed < 0.1 * before)


def test_a_term_at_its_bound_is_not_chosen() -> None:
    bound = catalogue()["torque_offset"].params[0].upper
    case = traction_case(0.3 + bound + 0.1 + 0.0 * TIME)
    test = replace(case.test, options=replace(case.test.options, friction_coefficient=0.3))
    problem = Problem([case_of(test)], ("traction",))
    base, pressed = fit(problem), fit(problem.with_terms("torque_offset"))
    assert pressed.at_bound
    assert chosen(Explanation(base, {}, base.chi2), [Explanation(pressed, {}, base.chi2)]) is None


def test_of_several_forms_the_best_stands_for_all() -> None:
    law = made(9.0, "mu_over_time")
    other = replace(made(7.0, "mu_over_time"), fit=fit(PLAIN.with_terms("x", trial={"x": LINE})))
    assert law.labels == other.labels == {LawTerm("mu", "time")}
    assert [e.evidence for e in ranked([other, made(8.0, "sensor_drift"), law])] == [9.0, 8.0]


# ------------------------------------------------------------------------------------------------ one channel


@pytest.mark.parametrize("name", [name for name in TRACTIONS if name in catalogue()])
def test_an_effect_of_the_catalogue_is_named_and_not_learnt(name: str) -> None:
    found = found_in(name)
    (term,) = found.answer.terms
    assert EffectTerm(name) in told(found)
    assert not found.answer.laws
    assert term == name or EffectTerm(name) in told(found)
    assert not found.answer.fit.at_bound
    assert not unexplained_residual(found.answer.fit, "traction").significant(ACCEPTANCE.unexplained_beside)


LEARNT: dict[str, set[Term]] = {
    "a burst between two times": {LawTerm("mu", "time"), LawTerm("traction_ratio", "time")},
    "a dip about one creepage": {LawTerm("mu", "creepage"), LawTerm("traction_ratio", "creepage")},
    "a swing": {LawTerm("mu", "time"), LawTerm("traction_ratio", "time")},
}


@pytest.mark.parametrize("name", LEARNT)
def test_what_no_effect_can_be_is_learnt_over_what_it_depends_on(name: str) -> None:
    """Nothing in the catalogue has such a law; factor and shift of T/N are the same in full sliding."""
    found = found_in(name)
    assert list(found.answer.laws) == list(found.answer.terms) != []
    assert told(found) & LEARNT[name]
    fits = (found.answer.fit, found.base.fit)
    after, before = (f.problem.predict(f.theta[None])[0].traction[0] for f in fits)
    assert np.corrcoef(after - before, TRACTIONS[name])[0, 1] > 0.9
    assert found.answer.fit.chi2 < 1.4 * len(TIME)


def test_the_edges_of_a_burst_are_where_it_was() -> None:
    """Samples are 14 s apart, and one beside an edge may be taken for an outlier."""
    found = found_in("a burst between two times")
    every = [found.answer, *(e for rivals in found.rivals.values() for e in rivals)]
    over_time = next(e for e in every if e.labels & LEARNT["a burst between two times"])
    (trial,) = over_time.laws.values()
    assert trial.shape == "window"
    assert trial.fixed["begin_s"] == pytest.approx(250.0, abs=28.0)
    assert trial.fixed["end_s"] == pytest.approx(480.0, abs=28.0)


@pytest.mark.parametrize("edge", [0.023, 0.028, 0.037])
def test_where_no_sample_tells_an_edge_the_other_test_does(edge: float) -> None:
    """mu steps up between creepages of 2 and 4 %; only the test that is predicted has any between these."""

    def stepping(*creepage: float) -> Case:
        course = history(creepage, 2)
        time = spread(course, 6)
        at_time = course.creepage[np.searchsorted(course.end_time, time)]
        ratio = 0.5 + 0.1 * (at_time > edge) + SIGMA * np.random.default_rng(1).standard_normal(len(time))
        return case_of(
            experiment(course, thermal=None, measured=Measured(traction=traction_samples(course, time, ratio)))
        )

    problem = Problem([stepping(0.01, 0.06, 0.02, 0.04, 0.015, 0.05)], ("traction",))
    base = refit(problem)
    other = elsewhere(stepping(0.025, 0.01, 0.03, 0.06, 0.035, 0.02), base)
    assert other is not None
    tried = extended(Explanation(base, {}, base.chi2, other))
    step = next(e for e in tried if (law := e.laws.get("mu_over_creepage")) is not None and law.shape == "step")
    (place,) = step.laws["mu_over_creepage"].jumps
    levels = np.array([0.02, 0.025, 0.03, 0.035, 0.04])
    assert np.searchsorted(levels, place / 100.0) == np.searchsorted(levels, edge)
    assert other.density(step.fit)[0] > other.density(base)[0] + 10.0


@pytest.mark.parametrize("seed", one_of([3, 4, 5]))
def test_a_law_that_promises_little_is_tried_beside_another_over_the_same_covariate(seed: int) -> None:
    """A recorded temperature that is 2 K too high for a while: at the edges of bins heat over time promises more."""
    test = Instruments().record(Plant(history((0.01, 0.02, 0.015, 0.04, 0.03, 0.02), 3)), np.random.default_rng(seed))
    record = test.measured.temperature
    assert record is not None
    off = 2.0 * ((record.time > 430.0) & (record.time < 700.0))
    record = replace(record, temperature=record.temperature + off)
    base = refit(problem_of([replace(test, measured=replace(test.measured, temperature=record))]))
    best = max(extended(Explanation(base, {}, base.chi2)), key=lambda e: e.evidence)
    assert best.labels == {LawTerm("temperature", "time")}
    assert best.laws["temperature_over_time"].shape == "window"


def test_a_law_that_was_within_reach_is_tried_again_however_little_it_promises() -> None:
    base = Explanation.of_base(found_in("a dip about one creepage").base.fit)
    law, plain = LawTerm("traction_ratio", "time"), extended(base)
    assert law not in tried(plain)
    assert law in tried(extended(base, near=["traction_ratio_over_time"]))
    near, far = plain[0], plain[-1]
    assert _near(near, [near]) == {*near.terms}
    assert _near(near, [far]) == set()


def test_the_search_goes_on_while_nothing_is_given_in_a_channel_that_lacks_something() -> None:
    answer = found_in("running_in_friction").answer
    assert _nothing_left(answer, ())
    assert _nothing_left(answer, ("traction",))
    assert not _nothing_left(answer, ("traction", "temperature"))


def test_noise_alone_is_missing_nothing() -> None:
    nothing = np.full(len(TIME), 0.6)
    answers = [
        search(Problem([traction_case(nothing, seed)], ("traction",)), lambda stage: None).answer.terms
        for seed in range(8)
    ]
    assert sum(answer != () for answer in answers) <= 1


def test_a_stray_sample_is_no_finding() -> None:
    """The first sample of all is far off: friction that settles at once would explain it, and only it."""
    assert found_in("a outlier sample").answer.terms == ()


# ------------------------------------------------------------------------------------------------ what is offered


def tried(explanations: Iterable[Explanation]) -> set[Term]:
    return {label for e in explanations for label in e.labels}


def test_a_declared_effect_is_not_offered_again() -> None:
    case = traction_case(TRACTIONS["falling_friction"])
    declared = replace(case.test, effects={"sensor_drift": {"per_hour": 0.0}})
    problem = Problem([case_of(declared)], ("traction",))
    base = fit(problem)
    assert ("sensor_drift",) not in tried(extended(Explanation(base, {}, base.chi2)))
    assert "sensor_drift" not in searched(problem)
    assert "falling_friction" in searched(problem)


@cache
def recorded(*channels: str, displaced: float = 0.0) -> Case:
    plant = Plant(
        COURSE, mu=lambda t, creepage, n: 0.6 * (0.5 + 0.5 * np.exp(-3.0 * creepage * SPEED)), displaced=displaced
    )
    return case_of(Instruments(channels=channels).record(plant, np.random.default_rng(6)))


def with_terms(case: Case) -> Callable[..., Explanation]:
    """The explanation of traction and profile by terms."""
    base = Explanation.of_base(refit(Problem([case], ("traction", "profile"))))
    return lambda *terms: replace(base, fit=fit(base.fit.problem.with_terms(*terms)))


def test_a_term_is_tempered_by_what_was_explained_where_it_says_something() -> None:
    """A track that lies 0.4 mm beside the middle of the record: no formula errs by it in the traction."""
    of = with_terms(recorded("traction", "profile", displaced=0.4e-3))
    base, offset, friction = of(), of("lateral_offset"), of("falling_friction")
    both = of("lateral_offset", "falling_friction")
    assert offset.evidence_scale > 2.0
    assert offset.evidence_scale_for(both) < 1.1
    assert base.evidence_scale_for(offset) == base.evidence_scale == 1.0
    assert friction.evidence_scale_for(both) < 1.1 < friction.evidence_scale
    assert offset.evidence_scale_for(offset) == offset.evidence_scale, "what says nothing anywhere"


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("falling_friction", SEARCH.creep_curve_tempering),
        ("film_breakdown", SEARCH.creep_curve_tempering),
        ("running_in_friction", SEARCH.tempering),
    ],
)
def test_forms_of_the_creep_curve_err_more_than_others(name: str, error: float) -> None:
    base = Explanation.of_base(refit(Problem([traction_case(TRACTIONS[name])], ("traction",))))
    named = replace(base, fit=fit(base.fit.problem.with_terms(name)))
    fall = base.chi2 - named.chi2
    assert fall > 10.0
    assert named.tempering == pytest.approx(1.0 + error * np.sqrt(fall))
    assert named.evidence_scale_for(named) == pytest.approx(1.0 + SEARCH.tempering * np.sqrt(fall)), "beside more terms"


def test_a_form_of_the_creep_curve_errs_in_the_traction_alone() -> None:
    """Errors of formulas in two channels add by their squares."""
    of = with_terms(recorded("traction", "profile", displaced=0.4e-3))
    base, both = of(), of("lateral_offset", "falling_friction")
    traction, profile = (base.fit.power(c) - both.fit.power(c) for c in ("traction", "profile"))
    square = SEARCH.creep_curve_tempering**2 * traction + SEARCH.tempering**2 * profile
    assert both.tempering == pytest.approx(1.0 + np.sqrt(square), rel=1e-3)


def test_no_formula_errs_by_a_line_that_is_added_to_a_record() -> None:
    """A profile that is tilted by 20 um over its width: other terms are sought beside it as beside nothing."""
    test = recorded("traction", "profile").test
    profile = test.measured.profile
    assert profile is not None
    tilted = replace(profile, height=profile.height + 5e-3 * profile.y)
    of = with_terms(case_of(replace(test, measured=replace(test.measured, profile=tilted))))
    base, tilt, both = of(), of("profile_tilt"), of("profile_tilt", "falling_friction")
    assert base.chi2 - tilt.chi2 > 1e4
    assert tilt.fit.taken_exactly["profile"] == pytest.approx(base.chi2 - tilt.chi2, rel=0.05)
    assert tilt.evidence_scale < 1.5 < both.evidence_scale
    assert tilt.evidence_scale_for(both) < 1.1
    assert not tilt.can_err and both.can_err
    left = replace(unexplained_residual(tilt.fit, "profile"), length=10.0)
    assert left_over_explained(left, tilt.fit, base.fit) > 0.5, "though it is a small part of what the line takes"


def test_every_effect_that_the_channels_can_show_is_searched_and_no_other() -> None:
    one = searched(Problem([traction_case(TRACTIONS["sensor_drift"])], ("traction",)))
    assert set(one) <= {name for name, effect in catalogue().items() if effect.channel == "traction"}
    assert {"falling_friction", "torque_offset", "sensor_drift"} <= set(one)
    both = searched(Problem([recorded("traction", "temperature")], ("traction", "temperature")))
    shown = {n for n, effect in catalogue().items() if effect.channel in ("traction", "temperature")}
    assert set(both) == shown - {"misalignment"}, "no step declares a yaw"


def test_effects_that_need_stops_wait_for_stops() -> None:
    offered = set(searched(Problem([recorded("traction", "profile")], ("traction", "profile"))))
    needing = {name for name, effect in catalogue().items() if effect.needs_stops}
    assert offered
    assert needing
    assert not offered & needing


def test_effects_over_time_wait_for_samples_that_know_theirs() -> None:
    case = traction_case(TRACTIONS["sensor_drift"])
    samples = case.test.measured.traction
    assert samples is not None
    untimed = replace(case.test, measured=Measured(traction=replace(samples, time=np.full(len(TIME), np.nan))))
    offered = set(searched(Problem([case_of(untimed)], ("traction",))))
    needing = {name for name, effect in catalogue().items() if effect.needs_time}
    assert needing
    assert not offered & needing


# ------------------------------------------------------------------------------------------------ several channels


def test_one_cause_in_two_channels_is_named_once() -> None:
    """Friction that falls with the sliding speed warms the disc less, too: nothing else is missing."""
    problem = Problem([recorded("traction", "temperature")], ("traction", "temperature"))
    found = search(problem, lambda stage: None)
    assert found.answer.terms == ("falling_friction",)


def test_what_is_left_is_as_long_as_the_residual() -> None:
    """A fit that misses one creepage by far cannot leave white noise, however steep its other parameters are."""
    case = traction_case(0.6 - 0.06 * (AT == 0.03))
    problem = Problem([case], ("traction",), ("film_breakdown",))
    steep = {"film_breakdown.film_ratio": 0.965, "film_breakdown.critical_creepage_percent": 3.917}
    steep |= {"film_breakdown.width_percent": 0.065, "mu": 0.602}
    there = at(problem, np.array([p.inner(steep[p.name]) for p in problem.parameters]))
    assert there.chi2 > 5.0 * len(TIME)
    assert unexplained_residual(there, "traction").length > 0.5 * np.sqrt(there.chi2)


# ------------------------------------------------------------------------------------------------ two in place of one


@pytest.mark.long
def test_two_effects_take_the_place_of_a_curve_while_another_channel_lacks_more() -> None:
    """A parabola wider than disc 2 alone wears under an ellipse: another patch and a worn disc 1, each too little.

    The friction in nitrogen is not explained yet, takes far more of the misfit, and must neither crowd out the second
    effect nor be exchanged for one of the two.
    """
    first = refit(problem_of([shipped("cryogenic").experiment]))
    base = Explanation(first, {}, first.chi2)
    single = extended(base)
    law = chosen(base, single)
    assert law is not None and law.labels == {LawTerm("profile", "y_over_edge")}
    two = catalogued(law, base, single)[0]
    assert two.labels == {EffectTerm("half_space_contact"), EffectTerm("wear_partition")}
    kept, _ = swap_and_drop(two, base, single)
    assert two.labels <= kept.labels
    assert kept.fit.values("wear_partition")["disc1_share"] == pytest.approx(0.52, abs=0.02)


def test_two_effects_take_the_place_of_two_terms_of_a_channel() -> None:
    """The same profile, where a curve and a wander of the track have been found one by one."""
    test = shipped("cryogenic").experiment
    given = replace(test.options, friction_coefficient=0.3)
    first = refit(problem_of([replace(test, options=given, measured=replace(test.measured, traction=None))]))
    one = next(e for e in extended(Explanation(first, {}, first.chi2)) if e.labels == {EffectTerm("lateral_wander")})
    both = next(e for e in extended(one) if LawTerm("wear_across", "y_over_edge") in e.labels)
    kept, _ = without_two_terms(both, {})
    assert kept.labels == {EffectTerm("half_space_contact"), EffectTerm("wear_partition")}
    assert kept.evidence > both.evidence


# ------------------------------------------------------------------------------------------------ which temperature


def over_temperature(capacity: float) -> dict[Term, Explanation]:
    """What one more term explains where mu falls by 1 % a kelvin of a disc of this heat capacity [J/K]."""
    convection, step = 8.0, 0.25
    course = history((0.02, 0.04, 0.025, 0.06, 0.03, 0.05), 2)
    time = spread(course, 6)
    rise, ratio = [0.0], []
    for t in np.arange(step, course.end_time[-1] + step, step):
        sliding = course.creepage[min(np.searchsorted(course.end_time, t), len(course.step) - 1)] * SPEED
        ratio.append(0.6 * np.exp(-0.01 * rise[-1]))
        level = ratio[-1] * LOAD * sliding / convection
        rise.append(level + (rise[-1] - level) * np.exp(-convection * step / capacity))
    noisy = np.interp(time, step * np.arange(1, len(ratio) + 1), ratio)
    noisy = noisy + 0.003 * np.random.default_rng(4).standard_normal(len(time))
    measured = Measured(traction=traction_samples(course, time, noisy))
    case = case_of(experiment(course, thermal=Thermal(ROOM, capacity, ROOM, convection), measured=measured))
    fitted = fit(Problem([case], ("traction",)))
    return {next(iter(e.labels)): e for e in extended(Explanation(fitted, {}, fitted.chi2))}


DISC, FLASH = EffectTerm("temperature_dependent_friction"), LawTerm("mu", "flash_temperature")


def test_disc_and_flash_stand_together_where_the_disc_follows_at_once() -> None:
    found = over_temperature(capacity=0.5)
    assert (found[DISC].evidence - found[FLASH].evidence) / found[DISC].evidence_scale < SEARCH.equivalent
    assert np.all(np.diag(found[FLASH].fit.covariance) > 0.0)  # its size is not held where it starts


def test_a_disc_that_lags_is_told_from_the_flash() -> None:
    found = over_temperature(capacity=800.0)
    assert found[DISC].evidence == max(e.evidence for e in found.values())
    assert (found[DISC].evidence - found[FLASH].evidence) / found[DISC].evidence_scale > 3.0 * SEARCH.equivalent
