"""Tolerances of the inputs are relative to what is declared, and an answer that raises an error is never given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rigs import Floats, Instruments, Plant, experiment, history, rig, spread, traction_samples

from twindisc_cli.loop.explain import Outcome, explain
from twindisc_cli.loop.fit import Fit, refit
from twindisc_cli.loop.judge import rises
from twindisc_cli.loop.notes import inputs_off
from twindisc_cli.loop.problem import problem_of
from twindisc_cli.loop.thresholds import ACCEPTANCE, TOLERANCES
from twindisc_cli.model.experiment import Disc, Experiment, Measured, Options, ProfilePlace, ProfileSamples
from twindisc_cli.model.forward import ForwardModel

COURSE = history((0.001, 0.0015, 0.002, 0.0012, 0.02, 0.04), 2)
TIME = spread(COURSE, 6)
SIGMA = 0.002
DECLARED: dict[str, dict[str, float]] = {
    "third_body_layer": {"slope_ratio": 0.75},
    "load_error": {"error_percent": -12.0},
}


def recorded(effects: Mapping[str, Mapping[str, float]]) -> Experiment:
    """Partial slip and full sliding, made with these effects and declared with them."""
    nothing = traction_samples(COURSE, TIME, np.zeros(len(TIME)))
    test = experiment(COURSE, thermal=None, measured=Measured(traction=nothing), effects=effects)
    base = {"mu": np.array([0.5]), "K": np.array([0.0]), "convection_W_K": np.array([np.nan])}
    ratio = ForwardModel(test).predict(base).traction[0]
    noisy = ratio + SIGMA * np.random.default_rng(0).standard_normal(len(TIME))
    measured = Measured(traction=traction_samples(COURSE, TIME, noisy, SIGMA))
    return experiment(COURSE, thermal=None, measured=measured, effects=effects)


@cache
def fitted(name: str) -> Fit:
    return refit(problem_of([recorded({name: DECLARED[name]} if name else {})]))


@pytest.mark.parametrize("name", DECLARED)
def test_the_tolerance_of_a_declared_effect_is_as_small_as_of_one_that_is_not(name: str) -> None:
    """A few noise units for a standard deviation: what is declared is moved a little, and not replaced."""
    declared, plain = (f.problem.nuisance for f in (fitted(name), fitted("")))
    assert declared is not None
    assert plain is not None
    lengths, without = (np.linalg.norm(n.columns, axis=0) for n in (declared, plain))
    assert len(lengths) == len(without)
    assert lengths[: len(DECLARED)].max() < 8.0
    assert np.all(lengths[: len(DECLARED)] < 1.5 * without[: len(DECLARED)] + 0.1)


@cache
def explained(name: str) -> Outcome:
    return explain([recorded({name: DECLARED[name]})], validate=None, quick=True, progress=lambda stage, part: None)


@pytest.mark.parametrize("name", DECLARED)
def test_nothing_is_found_beside_a_declared_effect_that_is_all_there_is(name: str) -> None:
    found = explained(name)
    assert found.answer.terms == ()
    for held_out in (False, True):
        before, after = ("unseen_before", "unseen_after") if held_out else ("before", "after")
        first, last = (found.judged.error("traction", kind, held_out=held_out) for kind in (before, after))
        assert last <= first * (1.0 + 1e-9)
    assert found.judged.error("traction", "after", held_out=False) == pytest.approx(SIGMA, rel=0.3)


def test_what_a_worn_track_transmits_is_known_less_well_than_what_a_fresh_one_does() -> None:
    """At small creepages after deep wear; on the ellipse of the best circle a worn track is as known as a fresh one."""
    course = history((0.03, 0.05, 0.001, 0.0015), 2)
    nothing = traction_samples(course, spread(course, 6), np.zeros(len(spread(course, 6))), SIGMA)
    known = {}
    for contact, wear in (("half_space", 1e-4), ("half_space", 1e-9), ("hertz", 1e-4)):
        options = Options(contact=contact, wear_coefficient=wear)
        test = experiment(course, thermal=None, measured=Measured(traction=nothing), options=options)
        base = {"mu": np.array([0.5]), "K": np.array([wear]), "convection_W_K": np.array([np.nan])}
        ratio = ForwardModel(test).predict(base).traction[0]
        seen = Measured(traction=traction_samples(course, spread(course, 6), ratio, SIGMA))
        nuisance = refit(problem_of([replace(test, measured=seen)])).problem.nuisance
        assert nuisance is not None
        of_the_track = -1 - 4 - 2  # before those of four steps' creepages, of the crown and the modulus
        known[contact, wear] = np.linalg.norm(nuisance.columns[:, of_the_track])
    assert known["hertz", 1e-4] == pytest.approx(0.0, abs=1e-9)
    assert known["half_space", 1e-9] < 0.2 * known["half_space", 1e-4]
    assert 0.5 < known["half_space", 1e-4] < 5.0


# ------------------------------------------------------------------------------------------------ levelled profiles


def test_profiles_are_levelled_each_for_itself() -> None:
    """Stops that are off by their own standard errors, one up, one down, are nothing that has to be explained."""
    plant, rng = Plant(history((0.005, 0.01, 0.02, 0.04), 3)), np.random.default_rng(5)
    record = Instruments(each=4, profile=0.1e-6).record(plant, rng)
    y, stops = np.linspace(-2.2e-3, 2.2e-3, 221), np.repeat([4, 8, 12], 221)
    height = np.concatenate([plant.height(y, float(plant.history.end_time[stop - 1])) for stop in (4, 8, 12)])
    height = height + 0.1e-6 * rng.standard_normal(len(height))
    profile = ProfileSamples(np.tile(y, 3), height, np.full(len(stops), 2), stops)
    step = np.repeat([2.0, -2.0, 1.0], 221)
    place = ProfilePlace(slope=1e-5, offset=5e-8, centre=1e-6)
    shifted = replace(profile, height=height + place.offset * step)
    tests = [
        replace(record, measured=replace(record.measured, profile=samples, profile_place=place))
        for samples in (profile, shifted)
    ]
    as_it_is, off = (refit(problem_of([test])) for test in tests)
    apart = refit(problem_of([replace(tests[1], measured=replace(tests[1].measured, profile_place=None))]))
    assert off.chi2 - as_it_is.chi2 < 2.0 * (4.0 + 4.0 + 1.0)
    assert apart.chi2 - as_it_is.chi2 > 100.0


# ------------------------------------------------------------------------------------------------ errors that rise

NOISE: Floats = np.random.default_rng(1).standard_normal(240)
FEW = ACCEPTANCE.fewest_judged - 1
HALF: Floats = np.repeat([0.0, 1.0], 120)
CASES: dict[str, tuple[Floats, Floats, bool]] = {
    "the same": (NOISE, NOISE, False),
    "smaller": (NOISE, 0.5 * NOISE, False),
    "five times as large": (NOISE, 5.0 * NOISE, True),
    "larger everywhere by five per cent": (NOISE, 1.05 * NOISE, True),
    "smaller in one half, much larger in the other": (NOISE, NOISE * (0.9 + 0.9 * HALF), True),
    "other noise of the same size": (NOISE, np.roll(NOISE, 7), False),
    "few, nine times as large": (NOISE[:FEW], 9.0 * NOISE[:FEW], True),
    "few, larger by fifteen per cent": (NOISE[:FEW], 1.15 * NOISE[:FEW], False),
    "none": (NOISE[:0], NOISE[:0], False),
}


@pytest.mark.parametrize("name", CASES)
def test_an_error_rises_where_it_grew_beyond_chance(name: str) -> None:
    before, after, risen = CASES[name]
    assert rises(before, after) == risen


def test_discs_are_alike_where_what_is_not_known_of_both_is_the_same() -> None:
    """A dataclass compares field by field from Python 3.13 on, and NaN is not NaN."""
    disc = Disc(0.03, np.inf, 206e9, 0.3, 6.9e9)
    same = Disc(0.03, np.inf, 206e9, 0.3, 6.9e9, density=float("nan"))
    assert (disc, hash(disc)) == (same, hash(same))
    assert disc != replace(disc, density=7800.0)
    assert disc != "disc"


@pytest.mark.parametrize(("off", "said"), [(0.0, False), (0.5, False), (6.0, True)])
def test_an_input_further_off_than_its_tolerance_is_said(off: float, said: bool) -> None:
    """The creepage of one of four steps in partial slip, off by so many of its tolerances."""
    relative, error = TOLERANCES.step_creepage
    history_ = replace(
        COURSE, creepage=COURSE.creepage * (1.0 + off * np.hypot(relative, error / 0.002) * (COURSE.step == 2))
    )
    made = ForwardModel(
        experiment(
            history_, thermal=None, measured=Measured(traction=traction_samples(history_, TIME, np.zeros(len(TIME))))
        )
    ).predict({"mu": np.array([0.5]), "K": np.array([0.0]), "convection_W_K": np.array([np.nan])})
    noisy = made.traction[0] + 2e-4 * np.random.default_rng(0).standard_normal(len(TIME))
    seen = Measured(traction=traction_samples(COURSE, TIME, noisy, 2e-4))
    found = inputs_off(refit(problem_of([experiment(COURSE, thermal=None, measured=seen)])))
    assert ["creepage of step 3" in note for note in found] == [True] * said


@pytest.mark.parametrize("off", [-1.0, 1.0])
def test_a_crown_that_is_off_by_its_tolerance_costs_next_to_nothing(off: float) -> None:
    """In half-space contact, where the updated ellipse leaves a track of another shape, which cost 19 and 46."""
    crown, tolerance, course = 0.01, 0.02, history((0.01, 0.02, 0.04), 40)
    y, noise = np.linspace(-1.5e-3, 1.5e-3, 301), np.random.default_rng(3).normal(scale=5e-8, size=301)
    unworn = ProfileSamples(y, np.zeros(len(y)), np.full(len(y), 2), np.full(len(y), len(course.step)))
    costs = []
    for true in (crown, crown * (1.0 + off * tolerance)):
        options = Options(contact="half_space", friction_coefficient=0.6)
        known = replace(options, wear_coefficient=1e-4)
        worn = experiment(course, rig=rig(crown=true), options=known, thermal=None, measured=Measured(profile=unworn))
        base = {"mu": np.array([0.6]), "K": np.array([1e-4]), "convection_W_K": np.array([np.nan])}
        seen = Measured(profile=replace(unworn, height=ForwardModel(worn).predict(base).profile[0] + noise))
        test = replace(worn, rig=rig(crown=crown), options=options, measured=seen)
        costs.append(refit(problem_of([replace(test, tolerances={"transverse_radius": tolerance})])).chi2)
    assert costs[1] - costs[0] < 8.0
