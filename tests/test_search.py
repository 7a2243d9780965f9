"""The search: what is weighed against what, when the gate opens, and what is never offered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import ROOM, SPEED, Floats, Instruments, Plant, experiment, history, spread, traction_samples

import twindisc_cli.loop.search as search_module
from twindisc_cli.effects import catalogue
from twindisc_cli.loop.fit import Fit, at, fit
from twindisc_cli.loop.problem import Case, Problem, case_of
from twindisc_cli.loop.screen import Leftover, leftover
from twindisc_cli.loop.search import (
    SHARP,
    Candidate,
    Finding,
    free_friction,
    given,
    search,
    search_channel,
    weigh,
)
from twindisc_cli.model.experiment import History, Measured, Thermal

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 2)
TIME = spread(COURSE, 6)
AT = COURSE.creepage[np.searchsorted(COURSE.end_time, TIME)]
SIGMA = 0.004


def traction_case(ratio: Floats, seed: int = 0, time: Floats = TIME) -> Case:
    noisy = ratio + SIGMA * np.random.default_rng(seed).standard_normal(len(time))
    samples = traction_samples(COURSE, time, noisy)
    return case_of(experiment(COURSE, thermal=None, measured=Measured(traction=samples)))


def found_in(ratio: Floats, seed: int = 0, declared: frozenset[str] = frozenset()) -> Finding:
    return search_channel(Problem([traction_case(ratio, seed)], ("traction",)), "traction", declared)


# ------------------------------------------------------------------------------------------------ weights

ANY_FIT: Fit = fit(Problem([traction_case(np.full(len(TIME), 0.6))], ("traction",)))


def candidate(name: str, evidence: float, gain: float = 1e-6, passed: bool = True) -> Candidate:
    return Candidate((name,), ANY_FIT, gain, evidence, Leftover("traction", [], 1.0, 0.0), passed)


def test_probabilities_are_sharpened_bayes_factors_among_those_that_passed() -> None:
    weighed = {c.names[0]: c.probability for c in weigh([
        candidate("a", 4.0), candidate("b", 3.0), candidate("c", 90.0, passed=False), candidate("d", 1.0),
    ])}  # fmt: skip
    assert sum(weighed.values()) == pytest.approx(1.0)
    assert weighed["c"] == 0.0
    assert weighed["b"] / weighed["a"] == pytest.approx(np.exp(-1.0 / SHARP), rel=1e-3)
    assert weighed["d"] / weighed["a"] == pytest.approx(np.exp(-3.0 / SHARP), rel=1e-3)


def test_what_a_large_effect_leaves_through_its_form_cools_the_odds() -> None:
    cold, warm = (
        {c.names[0]: c.probability for c in weigh([candidate("a", 4.0, gain), candidate("b", 1.0, gain)])}
        for gain in (1e-6, 1e6)
    )
    assert warm["a"] > warm["b"] > cold["b"]


def test_nothing_passed_weighs_nothing() -> None:
    assert [c.probability for c in weigh([candidate("a", 4.0, passed=False)])] == [0.0]
    assert weigh([]) == []


def test_the_set_holds_ninety_five_percent_and_no_more_than_needed() -> None:
    candidates = weigh([candidate("a", 3.0), candidate("b", 2.5), candidate("c", 0.0), candidate("d", -9.0)])
    finding = Finding("traction", True, ANY_FIT, Leftover("traction", [], 0.0, 9.0), 0.0, candidates, candidates[0])
    others = [c.names[0] for c in finding.alternatives]
    kept = [c.probability for c in candidates if c.names[0] in ("a", *others)]
    assert others == ["b", "c"] if sum(kept[:2]) < 0.95 else others == ["b"]
    assert sum(kept) >= 0.95
    assert sum(kept[:-1]) < 0.95


# ------------------------------------------------------------------------------------------------ one channel

LAWS: dict[str, Floats] = {
    "falling_friction": 0.6 * (0.5 + 0.5 * np.exp(-3.0 * AT * SPEED)),
    "film_breakdown": 0.6 * (0.4 + 0.6 / (1.0 + np.exp(-(AT - 0.035) / 0.005))),
    "running_in_friction": 0.6 * (1.0 - 0.3 * np.exp(-50.0 * TIME / 12000.0)),
    "sensor_drift": 0.6 - 0.04 * TIME / 1000.0,
}


@pytest.mark.parametrize("name", LAWS)
def test_a_law_written_down_by_hand_is_named(name: str) -> None:
    finding = found_in(LAWS[name])
    assert finding.missing
    assert finding.chosen is not None
    named = finding.chosen.names + tuple(n for c in finding.alternatives for n in c.names)
    assert name in named
    assert len(named) <= 3
    assert finding.chosen.passed
    assert not finding.chosen.fit.at_bound


def test_every_effect_of_the_channel_is_tried_and_no_other() -> None:
    finding = found_in(LAWS["falling_friction"])
    tried = {c.names[0] for c in finding.candidates if len(c.names) == 1}
    assert tried == {name for name, effect in catalogue().items() if effect.channel == "traction"}


def test_a_declared_effect_is_not_offered_again() -> None:
    finding = found_in(LAWS["falling_friction"], declared=frozenset({"falling_friction"}))
    assert all("falling_friction" not in c.names for c in finding.candidates)


def test_effects_that_need_stops_wait_for_stops() -> None:
    case = case_of(Instruments(channels=("traction", "profile")).record(Plant(COURSE), np.random.default_rng(0)))
    finding = search_channel(Problem([case], ("traction", "profile")), "profile", frozenset())
    tried = {name for c in finding.candidates for name in c.names}
    needing = {name for name, effect in catalogue().items() if effect.needs_stops}
    assert tried
    assert needing
    assert not tried & needing


UNKNOWN = {
    "a burst between two times": 0.06 * ((TIME > 250.0) & (TIME < 480.0)),
    "a dip about one creepage": -0.06 * (AT == 0.03),
    "a swing": 0.03 * np.sin(TIME / 60.0),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_no_effect_can_be_passes_no_gate(name: str) -> None:
    """Nothing in the catalogue has such a law."""
    finding = found_in(0.6 + UNKNOWN[name])
    assert finding.missing
    assert finding.chosen is None
    assert all(not c.passed and c.probability == 0.0 for c in finding.candidates)


def test_what_is_left_is_as_long_as_the_residual() -> None:
    """A fit that misses one creepage by far cannot leave white noise, however steep its other parameters are."""
    case = traction_case(0.6 - 0.06 * (AT == 0.03))
    problem = Problem([case], ("traction",), ("film_breakdown",))
    steep = {"film_breakdown.film_ratio": 0.965, "film_breakdown.critical_creepage_percent": 3.917}
    steep |= {"film_breakdown.width_percent": 0.065, "mu": 0.602}
    there = at(problem, np.array([p.inner(steep[p.name]) for p in problem.parameters]))
    assert there.chi2 > 5.0 * len(TIME)
    assert leftover(there, "traction").length > 0.5 * np.sqrt(there.chi2)


def test_a_stray_sample_is_no_effect() -> None:
    """The first sample of all is far off: friction that settles at once would explain it, and only it."""
    found = found_in(0.6 + 0.03 * (TIME[0] == TIME))
    assert found.chosen is None
    alone = {c.names[0]: c for c in found.candidates}["running_in_friction"]
    assert found.base.chi2 - alone.fit.chi2 > 20.0
    assert alone.gain < 15.0


@pytest.mark.parametrize(("left", "unknown", "passes"), [(0.03, 9.0, True), (0.03, 11.0, False), (0.3, 11.0, True)])
def test_where_a_generic_function_says_more_a_doubtful_leftover_is_too_much(
    monkeypatch: pytest.MonkeyPatch, left: float, unknown: float, passes: bool
) -> None:
    monkeypatch.setattr(search_module, "leftover", lambda fitted, channel: Leftover(channel, [], left, 9.0))
    explained = candidate("falling_friction", evidence=10.0, gain=30.0)
    assert search_module._gated(explained, "traction", unknown=unknown).passed == passes


def test_noise_alone_is_not_missing_anything() -> None:
    findings = [found_in(np.full(len(TIME), 0.6), seed) for seed in range(8)]
    assert sum(finding.missing for finding in findings) <= 1
    assert all(finding.chosen is None for finding in findings if not finding.missing)


# ------------------------------------------------------------------------------------------------ several channels


def test_friction_as_measured_takes_the_place_of_a_law() -> None:
    """In full sliding mu is T/N: one value an iteration, whatever its course; iterations unseen lie between."""
    course = 0.6 + 0.1 * np.sin(TIME / 150.0)
    seen = (TIME < 5 * 84.0) | (TIME > 6 * 84.0)
    case = free_friction(traction_case(course[seen], time=TIME[seen]))
    assert case.free_mu is not None
    iteration = np.searchsorted(COURSE.end_time, TIME)
    means = np.array([course[iteration == i].mean() for i in range(len(COURSE.step))])
    known = np.arange(len(means)) != 5
    mu, spread = case.free_mu
    assert mu[known] == pytest.approx(means[known], abs=4.0 * SIGMA / np.sqrt(6))
    assert np.all((0.8 * SIGMA / np.sqrt(6) < spread[known]) & (spread[known] < 1.2 * SIGMA))
    assert mu[5] == pytest.approx(0.5 * (mu[4] + mu[6]), abs=1e-9)
    assert [p.name for p in Problem([case], ("traction",)).parameters] == []


def test_friction_as_measured_keeps_the_heat_right() -> None:
    """With mu free the temperature follows from the measured power, law or no law."""
    plant = Plant(COURSE, mu=lambda time, creepage, cycles: 0.6 + 0.1 * np.sin(time / 150.0))
    case = case_of(Instruments(channels=("traction", "temperature")).record(plant, np.random.default_rng(5)))
    problem = replace(Problem([free_friction(case)], ("traction", "temperature")), channels=("temperature",))
    found = fit(problem)
    count = len(found.residual)
    assert found.value(problem.parameters[0])[0] == pytest.approx(1.6, rel=0.01)
    assert found.chi2 / count < 1.6


def test_each_channel_is_searched_given_those_before_it() -> None:
    plant = Plant(COURSE, mu=lambda time, creepage, cycles: 0.6 * (0.5 + 0.5 * np.exp(-3.0 * creepage * SPEED)))
    case = case_of(Instruments(channels=("traction", "temperature")).record(plant, np.random.default_rng(6)))
    seen: list[str] = []
    findings = search(Problem([case], ("traction", "temperature")), seen.append)
    assert [f.channel for f in findings] == ["traction", "temperature"]
    assert seen[:2] == ["traction", "temperature"]
    assert findings[0].chosen is not None
    assert findings[0].chosen.names == ("falling_friction",)
    assert not findings[1].missing, "what warmed the disc less is known by then"


def warming_of_uncertain_friction(course: History) -> tuple[Case, Problem, Floats, float, float]:
    """A test whose mu is settled by noisy traction: case, problem of the temperature, its last nuisance, mu, std."""
    rods = Instruments(channels=("traction", "temperature"), traction=0.05)
    thermal = Thermal(ROOM, 100.0, ROOM, convection=1.6)
    case = case_of(rods.record(Plant(course), np.random.default_rng(4), thermal=thermal))
    whole = Problem([case], ("traction", "temperature"))
    friction = fit(replace(whole, channels=("traction",)))
    later = replace(given(whole, friction), channels=("temperature",))
    moved = later.with_nuisance(later.start(), np.empty((len(later.measured), 0))).nuisance
    assert moved is not None
    return case, later, moved[:, -1], *friction.value(friction.problem.parameters[0])


def test_what_an_earlier_channel_leaves_uncertain_is_a_nuisance_of_the_next() -> None:
    """mu is known to its standard deviation from the traction; the warming is as uncertain as mu, all of it at once."""
    _, later, moved, mu, spread = warming_of_uncertain_friction(COURSE)
    assert spread > 0.003
    warming = later.white([replace(p, temperature=p.temperature - ROOM) for p in later.predict(later.start()[None])])[0]
    assert moved == pytest.approx(warming * spread / mu, rel=0.03, abs=1e-3)


def test_friction_given_in_some_steps_is_uncertain_only_in_the_others() -> None:
    """What mu is not known by moves the warming of the first step alone; in the others the definition says mu."""
    course = replace(COURSE, given_mu=np.where(COURSE.step == 0, np.nan, 0.6))
    case, _, moved, mu, spread = warming_of_uncertain_friction(course)
    sets = np.where(course.step == 0, [[mu], [mu + spread]], 0.6)
    found = case.model.predict({"mu": sets, "K": np.zeros(2), "convection_W_K": np.full(2, 1.6)}).temperature
    change = case.noise["temperature"].whiten(found[1] - found[0])
    assert moved == pytest.approx(change, rel=0.03, abs=1e-3 * np.abs(change).max())


def test_friction_as_measured_is_as_uncertain_as_its_samples() -> None:
    case = free_friction(traction_case(np.full(len(TIME), 0.6)))
    problem = Problem([case], ("traction",))
    columns = problem.with_nuisance(problem.start(), np.empty((len(TIME), 0))).nuisance
    assert columns is not None
    own = columns[:, -len(COURSE.step) :]
    size = np.sum(own**2, axis=0)
    assert np.all((size > 0.7) & (size < 1.8)), "so many samples, each with the noise over their root"
