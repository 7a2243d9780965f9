"""The closed loop from measured tests to a verdict, on seeded data made by formulas that are not the program's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from rigs import SPEED, Floats, Instruments, Plant, history, one_of, rig, running
from scipy.stats import linregress

from twindisc_cli.identify.hierarchy import wander
from twindisc_cli.loop import explanation
from twindisc_cli.loop.diagnose import _strongest, diagnose, not_over_others
from twindisc_cli.loop.diagnosis import ChannelError, Diagnosis, FoundEffect, PredictedErrors, PredictedLevel
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import at
from twindisc_cli.loop.levels import Levels, apart_from_others, differing_between, followed
from twindisc_cli.loop.notes import average_errs, few_stops, of_missed
from twindisc_cli.loop.prediction_errors import contradicted_by, missed_by, predicted_badly
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.terms import LawTerm
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.model.experiment import Experiment, History, Options, RecordedColumn, TemperatureSamples
from twindisc_cli.report.sentences import sentences

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015), 3)
Law = Callable[[Floats, Floats, Floats], Floats]


def falling(time: Floats, creepage: Floats, cycles: Floats) -> Floats:
    return np.asarray(0.6 * (0.6 + 0.4 * np.exp(-3.0 * creepage * SPEED)))


def breaking(time: Floats, creepage: Floats, cycles: Floats) -> Floats:
    return np.asarray(0.6 * (0.5 + 0.5 / (1.0 + np.exp(-(creepage - 0.035) / 0.004))))


def settling(time: Floats, creepage: Floats, cycles: Floats) -> Floats:
    return np.asarray(0.6 * (1.0 - 0.2 * np.exp(-cycles / 15000.0)))


def burst(time: Floats, creepage: Floats, cycles: Floats) -> Floats:
    return np.asarray(0.6 * (1.0 + 0.1 * ((time > 300.0) & (time < 620.0))))


PLANTS: dict[str, Plant] = {
    "nothing": Plant(COURSE),
    "falling": Plant(COURSE, mu=falling),
    "film": Plant(COURSE, mu=breaking),
    "running in": Plant(COURSE, mu=settling),
    "burst": Plant(COURSE, mu=burst),
    "lag": Plant(COURSE, lag=60.0),
    "displaced": Plant(COURSE, displaced=0.08e-3),
    "falling, lag": Plant(COURSE, mu=falling, lag=60.0),
}
ALL = ("traction", "profile", "temperature")


def recorded(plant: str, *channels: str, seed: int = 1, **changes: object) -> Experiment:
    return Instruments(channels=channels or ALL).record(PLANTS[plant], np.random.default_rng(seed), **changes)


def run(*tests: Experiment, validate: Experiment | None = None) -> Diagnosis:
    return diagnose(tests, validate=validate, progress=lambda stage, part: None)


@cache
def of(plant: str, *channels: str) -> Diagnosis:
    return run(recorded(plant, *channels))


def named(found: Diagnosis) -> dict[str, FoundEffect]:
    return {effect.name: effect for effect in found.effects}


def value(effect: FoundEffect, key: str, truth: float) -> None:
    """The truth lies within three standard deviations of the estimate, and of the interval's size."""
    estimate = effect.parameters[key]
    assert estimate.low <= estimate.value <= estimate.high
    assert abs(estimate.value - truth) < 3.0 * max(estimate.std, 0.3 * (estimate.high - estimate.low)), key


# ------------------------------------------------------------------------------------------------ verdicts


def test_nothing_missing_is_said() -> None:
    found = of("nothing")
    assert found.verdict == "no_missing_effect"
    assert found.effects == []
    assert found.laws == []
    assert found.unexplained == []
    assert all(0.05 < other.probability < 0.5 for other in found.not_excluded)
    assert sum(other.probability for other in found.not_excluded) < 1.0
    assert found.base["mu"].low <= 0.6 <= found.base["mu"].high
    assert found.base["convection_W_K"].value == pytest.approx(1.6, rel=0.01)
    assert found.base["K"].value == pytest.approx(1e-3, rel=0.03)
    for error in found.errors.values():
        assert error.after == pytest.approx(error.before, rel=1e-6)
        assert error.before == pytest.approx(error.noise, rel=0.3)


def test_falling_friction_is_named_with_its_parameters() -> None:
    found = of("falling")
    assert found.verdict == "effects_found"
    assert list(named(found)) == ["falling_friction"]
    effect = named(found)["falling_friction"]
    assert found.not_excluded == []
    assert effect.channel == "traction"
    assert len(effect.alternatives) <= 2
    value(effect, "ratio", 0.6)
    value(effect, "decay_s_m", 3.0)
    assert found.unexplained == []


def test_of_two_tests_one_may_have_an_effect_of_its_own() -> None:
    air, film = recorded("nothing", "traction", name="air"), recorded("film", "traction", seed=2, name="film")
    found = run(air, film)
    (effect,) = found.effects
    assert (effect.name, effect.test, effect.key) == ("film_breakdown", "film", "film_breakdown in film")
    value(effect, "film_ratio", 0.5)
    value(effect, "critical_creepage_percent", 3.5)
    assert found.unexplained == []
    assert found.errors["traction"].after == pytest.approx(found.errors["traction"].noise, rel=0.3)


def test_what_both_tests_lack_is_one_effect_of_both() -> None:
    found = run(*(recorded("film", "traction", seed=seed, name=f"test {seed}") for seed in (1, 2)))
    assert [(effect.name, effect.test) for effect in found.effects] == [("film_breakdown", "")]
    assert found.laws == []


def test_the_error_falls_to_the_noise_where_nothing_was_fitted() -> None:
    error = of("falling").errors["traction"]
    assert error.before > 8.0 * error.noise
    assert error.held_out_before > 8.0 * error.noise
    assert error.after == pytest.approx(error.noise, rel=0.25)
    held_out = next(curve.held_out.sum() for curve in of("falling").curves if curve.channel == "traction")
    assert error.held_out_after == pytest.approx(error.noise, rel=3.0 / np.sqrt(2.0 * held_out)), "three sigma"


@pytest.mark.parametrize(
    ("plant", "name", "key", "truth"),
    [
        ("film", "film_breakdown", "film_ratio", 0.5),
        ("film", "film_breakdown", "critical_creepage_percent", 3.5),
        ("running in", "running_in_friction", "excess", -0.2),
        ("running in", "running_in_friction", "settling_cycles", 15000.0),
    ],
)
def test_one_channel_is_enough_where_it_shows(plant: str, name: str, key: str, truth: float) -> None:
    found = of(plant, "traction")
    assert list(named(found)) == [name]
    value(named(found)[name], key, truth)
    assert any("temperature and profile not measured" in note for note in found.notes)


def test_a_running_in_of_few_revolutions_is_named() -> None:
    """A disc of 43 turns a minute runs in within 180 of them."""
    slow = replace(COURSE, revolutions=COURSE.revolutions / 70.0)
    plant = Plant(slow, mu=lambda time, creepage, cycles: 0.6 * (1.0 - 0.2 * np.exp(-time / 250.0)))
    found = run(Instruments(channels=("traction",)).record(plant, np.random.default_rng(1)))
    value(named(found)["running_in_friction"], "settling_cycles", 250.0 * 60.0 / 84.0)


def test_a_lag_of_the_thermocouple_is_named() -> None:
    found = of("lag", "traction", "temperature")
    assert list(named(found)) == ["thermocouple_lag"]
    assert named(found)["thermocouple_lag"].parameters["time_constant_s"].value == pytest.approx(60.0, rel=0.05)
    assert found.errors["traction"].before == pytest.approx(found.errors["traction"].after, rel=0.02)


def test_a_lag_leaves_nothing_in_any_channel() -> None:
    found = of("lag", "traction", "temperature")
    assert found.unexplained == []
    assert found.errors["temperature"].after == pytest.approx(found.errors["temperature"].noise, rel=0.15)


def test_a_displaced_track_is_named() -> None:
    found = of("displaced", "traction", "profile")
    assert list(named(found)) == ["lateral_offset"]
    assert named(found)["lateral_offset"].parameters["offset_mm"].value == pytest.approx(0.08, abs=0.01)


def test_two_effects_in_two_channels_are_both_named() -> None:
    found = of("falling, lag", "traction", "temperature")
    assert sorted(named(found)) == ["falling_friction", "thermocouple_lag"]
    assert named(found)["falling_friction"].channel == "traction"
    assert named(found)["thermocouple_lag"].channel == "temperature"
    value(named(found)["falling_friction"], "ratio", 0.6)


def test_a_burst_is_nobodys_and_is_learnt_over_time() -> None:
    """One law of the friction or of its record: the channels that it drives are not blamed."""
    found = of("burst", "traction", "temperature")
    assert found.verdict == "law_learned"
    assert found.effects == []
    (law,) = found.laws
    others = {alternative.term for alternative in law.alternatives}
    named = LawTerm(law.law.quantity, law.law.covariate)
    assert LawTerm("mu", "time") in {named, *others} or named == LawTerm("mu", "energy")
    assert law.law.valid is not None
    middle, outside = np.median(law.curve.value[law.curve.value > law.curve.value.mean()]), np.min(law.curve.value)
    assert middle / outside == pytest.approx(1.1, abs=0.02), "a window over time or over what rises with it"
    assert np.all((law.curve.low <= law.curve.value + 1e-9) & (law.curve.value <= law.curve.high + 1e-9))
    error = found.errors["traction"]
    assert error.after == pytest.approx(error.noise, rel=0.3)
    assert error.after < 0.4 * error.before


class Geared(Plant):
    """A plant whose rolling speed is another in each step."""

    @property
    def factor(self) -> Floats:
        """The speed over the rig's at the instants."""
        return np.asarray(self.history.speed_factor[running(self.history, self.instants)])

    @property
    def power(self) -> Floats:
        """P [W] at the instants."""
        return np.asarray(super().power * self.factor)


def test_bearings_that_warm_with_the_speed_are_a_law_of_it() -> None:
    """They give 8 W at the rig's speed and as its square. In full sliding a creepage over the speed does the same."""
    course = replace(COURSE, speed_factor=np.array([1.0, 0.6, 1.4, 1.8, 0.5, 1.2])[COURSE.step])
    factor = Geared(course).factor
    test = Instruments(channels=("traction", "temperature")).record(
        Geared(course, heat=lambda time: 8.0 * factor**2), np.random.default_rng(3)
    )
    found = run(test)
    (law,) = found.laws
    others = {alternative.term for alternative in law.alternatives}
    assert LawTerm("bearing_heat", "rolling_speed") in {LawTerm(law.law.quantity, law.law.covariate), *others}
    error = found.errors["temperature"]
    assert error.held_out_after < 1.2 * error.noise < 0.2 * error.held_out_before


@pytest.mark.long
def test_empty_tests_with_correlated_noise_raise_no_alarm() -> None:
    plant, rods = PLANTS["nothing"], Instruments(channels=("traction", "temperature"), correlation=0.5)
    verdicts = [run(rods.record(plant, np.random.default_rng(seed))).verdict for seed in range(8)]
    assert sum(verdict != "no_missing_effect" for verdict in verdicts) <= 1


# ------------------------------------------------------------------------------------------------ bookkeeping


def test_the_same_data_give_the_same_diagnosis() -> None:
    one, two = of("film", "traction"), run(recorded("film", "traction"))
    assert one.effects == two.effects
    assert one.base == two.base
    assert one.errors == two.errors
    assert one.tried == two.tried
    assert one.next_experiment == two.next_experiment


def test_everything_tried_is_told() -> None:
    found = of("falling", "traction")
    (chosen,) = [t for t in found.tried if t.chosen]
    assert (str(chosen.term), chosen.evidence, chosen.refused) == ("falling_friction", 0.0, None)
    assert sum(t.probability for t in found.tried) <= 1.0 + 1e-9
    for t in found.tried:
        told = t.term in {a.term for a in named(found)["falling_friction"].alternatives}
        assert t.refused or t.chosen or t.evidence > -100.0 or told
    assert len(found.tried) >= 5
    assert any(isinstance(t.term, LawTerm) for t in found.tried)


def test_curves_carry_what_the_errors_are_made_of() -> None:
    found = of("falling")
    for curve in found.curves:
        error, factor = found.errors[curve.channel], 1e6 if curve.channel == "profile" else 1.0
        for side, curve_of, held in (
            (error.before, curve.before, False), (error.after, curve.after, False),
            (error.held_out_before, curve.unseen_before, True), (error.held_out_after, curve.unseen_after, True),
        ):  # fmt: skip
            miss = (curve.measured - curve_of)[(curve.held_out == held) & curve.kept]
            assert factor * np.sqrt(np.mean(miss**2)) == pytest.approx(side, rel=1e-9)
        for covariate in curve.covariates.values():
            assert len(covariate) == len(curve.measured)


def test_progress_goes_forward_to_its_end() -> None:
    seen: list[float] = []
    diagnose([recorded("nothing", "traction")], validate=None, progress=lambda stage, part: seen.append(part))
    assert seen == sorted(seen)
    assert 0.0 <= seen[0] < seen[-1] <= 1.0


# ------------------------------------------------------------------------------------------------ validation


def other_test(seed: int = 7) -> Experiment:
    """Another load, another speed, another order of creepages; the same physics."""
    course = history((0.05, 0.02, 0.08), 3)
    plant = Plant(course, mu=lambda t, c, n: 0.6 * (0.6 + 0.4 * np.exp(-3.0 * c * 6.0)), load=110.0, speed=6.0)
    return replace(
        Instruments(channels=("traction", "temperature")).record(plant, np.random.default_rng(seed)), name="other"
    )


def test_a_test_that_was_never_fitted_is_predicted() -> None:
    test = recorded("falling", "traction", "temperature")
    found = run(test, validate=other_test())
    assert found.validation is not None
    assert found.validation.test == "other"
    traction, temperature = (found.validation.errors[channel] for channel in ("traction", "temperature"))
    assert traction.held_out_before > 4.0 * traction.noise
    assert traction.held_out_after == pytest.approx(traction.noise, rel=0.3)
    assert temperature.held_out_after < 2.0 * temperature.noise
    effect, samples = named(found)["falling_friction"].parameters, other_test().measured.traction
    assert samples is not None
    ratio, decay = effect["ratio"].value, effect["decay_s_m"].value
    predicted = found.base["mu"].value * (ratio + (1.0 - ratio) * np.exp(-decay * samples.creepage * 6.0))
    assert traction.held_out_after == pytest.approx(np.sqrt(np.mean((samples.ratio - predicted) ** 2)), rel=0.02)


def test_validation_moves_no_parameter() -> None:
    test = recorded("falling", "traction")
    alone, beside = of("falling", "traction"), run(test, validate=other_test(8))
    assert {key: e.value for key, e in alone.base.items()} == {key: e.value for key, e in beside.base.items()}
    parameters = [{e.name: e.parameters for e in found.effects} for found in (alone, beside)]
    assert parameters[0] == parameters[1]
    one, two = alone.errors["traction"], beside.errors["traction"]
    assert replace(one, held_out_after=0.0) == replace(two, held_out_after=0.0)
    assert one.held_out_after == pytest.approx(two.held_out_after, rel=1e-3), "the average's weights may move"
    assert alone.validation is None


def test_an_error_of_the_rig_is_not_called_valid() -> None:
    """Data that follow another law leave a validation error beyond the noise."""
    plant = Plant(history((0.05, 0.02, 0.08), 3), mu=lambda t, c, n: 0.9 + 0.0 * t)
    stranger = Instruments(channels=("traction",)).record(plant, np.random.default_rng(3))
    found = run(recorded("falling", "traction"), validate=stranger)
    assert found.validation is not None
    assert found.validation.errors["traction"].held_out_after > 20.0 * found.validation.errors["traction"].noise


def test_another_history_that_is_predicted_worse_is_said() -> None:
    """Friction falls in the test that is fitted, and does not in the other."""
    plant = Plant(history((0.05, 0.02, 0.08), 3), mu=lambda t, c, n: 0.5 + 0.0 * t)
    other = replace(Instruments(channels=("traction",)).record(plant, np.random.default_rng(3)), name="other")
    test = recorded("falling", "traction")
    found = diagnose([test], validate=None, progress=lambda stage, part: None, quick=True, predict=[other])
    error = found.predictions[0].errors["traction"]
    times = error.held_out_after / error.held_out_before
    assert times > 1.05
    said = f"on this other history the traction is predicted worse than by the base model, {times:.2f} times its error"
    assert f"other: {said}" in found.notes


def test_what_misses_held_out_samples_by_far_is_possible_at_most() -> None:
    missed = {"traction": 6.3, "temperature": 1.7}
    assert _strongest({*missed, "profile"}, missed, set()) == {
        "traction": "possible",
        "temperature": "probable",
        "profile": "probable",
    }
    many = _strongest({*missed, "profile"}, missed, {"temperature", "profile"})
    assert many["temperature"] == "possible"
    assert many["profile"] == "probable"
    far, near = of_missed(missed)
    assert "missed by 6.3 times its noise: nothing in it is more than possible" in far
    assert "missed by 1.7 times its noise: nothing in it is established" in near


@pytest.mark.parametrize(
    ("as_predicted", "own_level", "said"),
    [(3.0, 2.0, "missed by 2.0 times its noise"), (9.0, 1.2, ""), (1.4, 1.4, ""), (9.9, 9.9, "missed by 9.9 times")],
)
def test_another_history_that_is_missed_is_said(as_predicted: float, own_level: float, said: str) -> None:
    """Not where only its level differs, and by more than noise alone makes."""

    def error(after: float) -> ChannelError:
        return ChannelError("1", 0.01, 0.0, np.nan, np.nan, 0.1, 0.01 * after)

    missed = PredictedErrors("other", {"traction": error(as_predicted)}, {"traction": error(own_level)}, {}, {})
    notes = predicted_badly([missed])
    assert len(notes) == bool(said)
    assert all(f"other: on this other history the traction is {said}" in note for note in notes)
    assert all("what was found does not hold" in note for note in notes)
    nothing_found = predicted_badly([missed], given=False)
    assert all(note.endswith("noise: something is missing there") for note in nothing_found)
    assert len(nothing_found) == len(notes)


def test_the_text_of_a_law_has_the_numbers_of_its_table() -> None:
    (law,) = of("burst").laws
    assert {key: law.law.parameters[key] for key in law.parameters} == pytest.approx(
        {key: estimate.value for key, estimate in law.parameters.items()}, rel=1e-9
    )


@pytest.mark.parametrize(("times", "said"), [(1.4, False), (3.0, True)])
def test_nothing_is_missing_in_what_was_fitted_and_another_test_is_missed(times: float, said: bool) -> None:
    error = ChannelError("1", 0.01, 0.0, np.nan, np.nan, 0.1, 0.01 * times)
    other = PredictedErrors("other", {"traction": error}, {"traction": error}, {}, {})
    first = sentences(replace(of("nothing"), validation=other))[0]
    assert first.startswith("Nothing is missing in what was fitted:") is said
    assert ("other, only predicted, is missed in the traction by 3.0 times its noise" in first) is said


@pytest.mark.parametrize(
    ("average", "alone", "said"), [(0.53, 0.32, True), (0.33, 0.32, False), (0.34, 0.2, False), (np.nan, np.nan, False)]
)
def test_an_average_that_errs_where_the_answer_does_not_is_said(average: float, alone: float, said: bool) -> None:
    """Beyond what chance allows of noise of 0.3 K; not where no samples are held out."""
    problem = SimpleNamespace(channels=("temperature",))
    judged = SimpleNamespace(
        before=SimpleNamespace(problem=problem), error=lambda *_, **__: alone, held_out_noise=lambda channel: 0.3
    )
    notes = average_errs(judged, SimpleNamespace(error=lambda *_, **__: average))  # type: ignore[arg-type]
    assert len(notes) == said
    assert all("disc temperature" in note and "0.53 K" in note and "0.32 K" in note for note in notes)


@pytest.mark.parametrize(
    ("mu", "apart"),
    [((0.44, 0.45, 0.225), [2]), ((0.42, 0.45, 0.48), []), ((0.44, 0.225), []), ((0.9, 0.45, 0.46), [0])],
)
def test_a_level_apart_from_those_that_agree_is_found(mu: tuple[float, ...], apart: list[int]) -> None:
    place = np.arange(len(mu))
    levels = Levels("mu", "1", place, wander(np.log(mu), np.full(len(mu), 1e-3), place))
    found = apart_from_others(levels)
    assert [number for number, _ in found] == apart
    assert all(times == pytest.approx(mu[i] / np.sqrt(np.prod(np.delete(mu, i)))) for i, times in found)


def levels_of_mu(mu: np.ndarray, s: np.ndarray | float) -> Levels:
    place = np.arange(len(mu))
    return Levels("mu", "1", place, wander(np.log(mu), np.broadcast_to(s, mu.shape), place))


def test_levels_that_scatter_about_a_power_law_have_the_p_of_its_regression() -> None:
    """As scipy's regression has it, times the number of what differs; the scatter counts alike in all tests."""
    load, other = np.array([900.0, 1500.0, 2400.0, 3600.0, 5000.0]), np.array([3.0, 9.0, 4.0, 5.0, 8.0])
    mu = 0.5 * (load / 1500.0) ** -0.2 * np.exp([0.02, -0.01, 0.01, -0.02, 0.0])
    found = followed(levels_of_mu(mu, 1e-5), {"load": load, "humidity [%]": other})
    line = linregress(np.log(load), np.log(mu))
    assert found is not None
    assert (found.covariate, found.power, found.proven, found.others) == ("load", True, True, ())
    assert found.slope == pytest.approx(line.slope, rel=1e-6)
    assert found.std == pytest.approx(line.stderr, rel=1e-6)
    assert found.p_value == pytest.approx(2.0 * line.pvalue, rel=1e-5)
    assert found.share == pytest.approx(line.rvalue**2, rel=1e-6)


def test_levels_that_scatter_within_their_errors_weigh_by_these() -> None:
    """Over a temperature, whose zero is a convention: a relative change a degree, with the error of known variances."""
    oil, s = np.array([20.0, 30.0, 40.0, 60.0]), np.array([0.01, 0.02, 0.01, 0.03])
    found = followed(levels_of_mu(0.4 * np.exp(-0.01 * oil), s), {"oil temperature [degC]": oil})
    centre = np.average(oil, weights=s**-2)
    assert found is not None
    assert not found.power
    assert found.slope == pytest.approx(-0.01, rel=1e-6)
    assert found.std == pytest.approx(np.sum(((oil - centre) / s) ** 2) ** -0.5, rel=1e-9)


@pytest.mark.parametrize(
    ("mu", "proven"), [((0.4, 0.34, 0.30), False), ((0.4, 0.41, 0.30), None), ((0.40, 0.397, 0.395), None)]
)
def test_three_levels_on_a_line_prove_nothing(mu: tuple[float, ...], proven: bool | None) -> None:
    """On a line, off it, and on one within what repeats of a test scatter."""
    speed = np.array([0.4, 0.8, 1.6])
    found = followed(levels_of_mu(np.array(mu), 1e-3), {"rolling_speed": speed, "load": speed[[1, 2, 0]]})
    assert (None if found is None else found.proven) is proven


def test_levels_of_tests_that_are_alike_go_with_nothing() -> None:
    """Of four tests three have a level, and these had one load; and levels that are all the same."""
    load, mu = np.array([900.0, 900.0, 900.0, 1500.0]), np.array([0.4, 0.5, 0.6])
    assert followed(levels_of_mu(mu, 1e-3), {"load": load}) is None
    assert followed(levels_of_mu(np.full(4, 0.4), 1e-3), {"load": load}) is None


def test_levels_that_go_with_nothing_are_seldom_said_to() -> None:
    """In one of twenty at the most, however many differ."""
    rng = np.random.default_rng(2)
    differing = {"load": np.arange(1.0, 6.0), "rolling_speed": np.array([2.0, 1.0, 5.0, 3.0, 1.0])}
    drawn = [followed(levels_of_mu(0.4 * np.exp(0.03 * rng.normal(size=5)), 0.01), differing) for _ in range(300)]
    assert np.mean([found is not None for found in drawn]) < 0.08


def test_what_differs_between_tests_is_constant_within_each() -> None:
    """Not the creepage, a room that is the same, or a column that runs the same course in all."""
    plain = recorded("nothing", "traction")
    time, step = np.arange(3.0), np.zeros(3, dtype=np.int64)
    tests = []
    for load, humidity in ((1.0, 30.0), (2.0, 80.0), (4.0, 50.0)):
        columns = {"humidity [%]": 0.01 * (humidity + time), "oil temperature [degC]": 300.0 + 10.0 * time + load}
        own = replace(plain.history, load_factor=load * np.ones(1))
        measured = replace(plain.measured, columns={k: RecordedColumn(time, step, v) for k, v in columns.items()})
        tests.append(replace(plain, history=own, measured=measured))
    found = differing_between(tests)
    assert set(found) == {"load", "humidity [%]"}
    assert found["load"] == pytest.approx(plain.rig.normal_load * np.array([1.0, 2.0, 4.0]))
    assert found["humidity [%]"] == pytest.approx([31.0, 81.0, 51.0])


@pytest.mark.parametrize(("own", "said"), [(0.225, True), (0.46, False)])
def test_a_predicted_test_of_another_level_is_said(own: float, said: bool) -> None:
    predicted = PredictedErrors("other", {}, {}, {"mu": PredictedLevel(0.44, 0.419, 0.462, own)}, {})
    assert (
        any("other: its mu is 0.51 times that of the tests fitted" in note for note in predicted_badly([predicted]))
        is said
    )


# ------------------------------------------------------------------------------------------------ many times the noise


LONG = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015, 0.05, 0.025), 3)


def strong(mu: Law, seed: int = 1) -> Diagnosis:
    return run(Instruments(each=10, traction=0.003).record(Plant(LONG, mu=mu), np.random.default_rng(seed)))


@pytest.mark.parametrize("seed", one_of([2, 1, 3]))
def test_friction_that_is_halved_for_a_while_is_one_law_of_time(seed: int) -> None:
    """A hundred times the noise: an edge that is wrong by half a bin misses more than any smooth formula does."""
    found = strong(lambda time, v, n: 0.6 * (1.0 - 0.5 * ((time > 410.0) & (time < 765.0))), seed)
    (law,) = found.laws
    assert (found.effects, law.name, law.law.shape) == ([], "mu_over_time", "window")
    assert law.law.parameters["begin_s"] == pytest.approx(410.0, abs=10.0)
    assert law.law.parameters["end_s"] == pytest.approx(765.0, abs=10.0)
    assert law.law.parameters["size"] == pytest.approx(-0.5, abs=0.01)
    assert all(error.after < 1.2 * error.noise for error in found.errors.values())


@pytest.mark.parametrize(
    ("shape", "mu"),
    [
        ("bump", lambda time, v, n: 0.6 * (1.0 - 0.4 * np.exp(-0.5 * ((time - 900.0) / 50.0) ** 2))),
        ("logistic", lambda time, v, n: 0.6 * (1.0 - 0.4 / (1.0 + np.exp(-(time - 900.0) / 50.0)))),
    ],
)
def test_a_formula_many_times_the_noise_is_found_between_the_places_it_is_sought_at(shape: str, mu: Law) -> None:
    """A place and a width on a coarse grid promise less than a curve."""
    (law,) = strong(mu).laws
    assert (law.name, law.law.shape) == ("mu_over_time", shape)
    assert law.law.parameters["at_s"] == pytest.approx(900.0, abs=5.0)
    assert law.law.parameters["width_s"] == pytest.approx(50.0, rel=0.05)
    assert law.law.parameters["size"] == pytest.approx(-0.4, abs=0.01)


# ------------------------------------------------------------------------------------------------ declared effects


def test_what_is_declared_is_not_found_again() -> None:
    declared = {"falling_friction": {"ratio": 0.6, "decay_s_m": 3.0}}
    found = run(recorded("falling", effects=declared))
    assert found.verdict == "no_missing_effect"
    assert all(str(t.term) != "falling_friction" for t in found.tried)


def test_a_declared_effect_stays_beside_what_is_found() -> None:
    declared = {"falling_friction": {"ratio": 0.6, "decay_s_m": 3.0}}
    found = run(recorded("falling, lag", "traction", "temperature", effects=declared))
    assert list(named(found)) == ["thermocouple_lag"]
    assert found.errors["traction"].before == pytest.approx(found.errors["traction"].noise, rel=0.25)


CONTRADICTIONS = {
    "heat that is not there": {"heat_partition": {"share": 0.05}, "parasitic_heat": {"power_W": 100.0}},
    "friction that vanishes twice": {
        "falling_friction": {"ratio": 0.05, "decay_s_m": 30.0},
        "film_breakdown": {"film_ratio": 0.01, "critical_creepage_percent": 9.0, "width_percent": 0.03},
        "load_error": {"error_percent": -40.0},
    },
}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_contradictory_declarations_end_in_a_verdict(name: str) -> None:
    """Inside their bounds, and all wrong: a diagnosis comes back, and numbers are numbers."""
    plant, rods = Plant(history((0.02, 0.06, 0.04), 2)), Instruments(each=4, channels=("traction", "temperature"))
    found = run(rods.record(plant, np.random.default_rng(1), effects=CONTRADICTIONS[name]))
    assert found.verdict in ("effects_found", "law_learned", "unexplained")
    for error in found.errors.values():
        assert np.isfinite([error.before, error.after]).all()


# ------------------------------------------------------------------------------------------------ little to go by


def test_two_steps_are_enough_for_a_verdict_and_a_warning() -> None:
    plant = Plant(history((0.02, 0.06), 3))
    found = run(Instruments(channels=("traction", "temperature")).record(plant, np.random.default_rng(2)))
    assert found.verdict == "no_missing_effect"
    assert any("fewer than three creepages" in note for note in found.notes)
    assert found.held_out_steps == {"small": ()}


def test_no_scatter_is_said() -> None:
    still = Instruments(traction=0.0, temperature=0.0, channels=("traction", "temperature"))
    found = run(still.record(PLANTS["nothing"], np.random.default_rng(0)))
    assert found.verdict == "no_missing_effect"
    assert any("no scatter" in note and "traction" in note for note in found.notes)
    assert found.errors["traction"].noise == pytest.approx(0.006, rel=1e-6), "one percent of its size"


def test_no_scatter_hides_no_large_effect() -> None:
    still = Instruments(traction=0.0, channels=("traction",))
    found = run(still.record(PLANTS["falling"], np.random.default_rng(0)))
    assert list(named(found)) == ["falling_friction"]


@pytest.mark.parametrize("level", [293.15, 301.0])
def test_a_constant_temperature_does_not_blind_the_rest(level: float) -> None:
    plant = Plant(history((0.02, 0.06, 0.04), 2), mu=falling)
    rods = Instruments(each=3, channels=("traction", "temperature"))
    test = rods.record(plant, np.random.default_rng(1))
    samples = test.measured.temperature
    assert samples is not None
    constant = TemperatureSamples(samples.time, np.full(len(samples.time), level))
    found = run(replace(test, measured=replace(test.measured, temperature=constant)))
    assert "falling_friction" in named(found)
    assert any("no scatter" in note and "temperature" in note for note in found.notes)


def test_nothing_measured_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing is measured"):
        run(replace(recorded("nothing"), measured=type(recorded("nothing").measured)()))


GIVEN = Options(contact="half_space", friction_coefficient=0.6)


def test_one_channel_with_its_friction_given() -> None:
    cold = run(recorded("lag", "temperature", options=GIVEN))
    assert list(named(cold)) == ["thermocouple_lag"]
    worn = run(recorded("displaced", "profile", options=GIVEN))
    assert list(named(worn)) == ["lateral_offset"]
    assert worn.base["K"].value == pytest.approx(1e-3, rel=0.03)


def test_friction_given_step_by_step_is_used() -> None:
    test = recorded("lag", "temperature")
    given = replace(test.history, given_mu=np.full(len(test.history.step), 0.6))
    assert list(named(run(replace(test, history=given)))) == ["thermocouple_lag"]


def test_nothing_that_fixes_the_friction_is_said() -> None:
    with pytest.raises(ValueError, match="friction"):
        run(recorded("lag", "temperature"))


# ------------------------------------------------------------------------------------------------ several tests


def worn(name: str, k: float, seed: int) -> Experiment:
    """A test in which nothing is missing, by its K."""
    return replace(Instruments().record(Plant(COURSE, wear_coefficient=k), np.random.default_rng(seed)), name=name)


@pytest.mark.parametrize("k", one_of([(1e-3, 1.6e-3), (1e-3, 1e-3, 0.6e-3)]))
def test_the_test_that_wears_faster_than_the_others_is_named(k: tuple[float, ...]) -> None:
    found = run(*(worn(name, each, seed) for seed, (name, each) in enumerate(zip("ABC", k, strict=False), 1)))
    (effect,) = found.effects
    assert (effect.name, effect.test) == ("wear_level", "ABC"[len(k) - 1])
    value(effect, "factor", k[-1] / k[0])
    assert found.laws == []
    levels = found.levels["K"]
    np.testing.assert_allclose(levels.value, k, rtol=0.05)
    assert any("its K is 0.6 times that of the other tests" in note for note in found.notes) is (len(k) > 2)


def test_what_k_scatters_between_repeats_is_nothing_missing() -> None:
    found = run(worn("A", 1e-3, 4), worn("B", 1.04e-3, 5))
    assert (found.verdict, found.effects, found.laws) == ("no_missing_effect", [], [])


def test_the_k_of_a_predicted_test_is_compared_with_that_of_the_tests_fitted() -> None:
    found = run(worn("A", 1e-3, 1), validate=worn("C", 1.6e-3, 3))
    assert found.validation is not None
    assert found.validation.level["K"].own == pytest.approx(1.6e-3, rel=0.05)
    assert (
        found.validation.at_own_level["profile"].held_out_after
        < 0.5 * found.validation.errors["profile"].held_out_after
    )
    assert any("C: its K is 1.6 times that of the tests fitted" in note for note in found.notes)


def test_tests_of_different_rigs_are_fitted_with_a_note() -> None:
    one = recorded("falling", "traction")
    plant = Plant(history((0.05, 0.02, 0.08), 3), mu=falling)
    two = replace(
        Instruments(channels=("traction",)).record(plant, np.random.default_rng(9)), name="second", rig=rig(crown=0.06)
    )
    found = run(one, two)
    assert list(named(found)) == ["falling_friction"]
    assert any("different rigs" in note for note in found.notes)
    assert {curve.test for curve in found.curves} == {"small", "second"}
    assert {"mu (small)", "mu (second)"} == set(found.base)


def test_two_tests_say_more_than_one() -> None:
    one = recorded("falling", "traction")
    two = replace(recorded("falling", "traction", seed=2), name="again")
    both = run(one, two)
    alone, together = (named(f)["falling_friction"].parameters["ratio"] for f in (of("falling", "traction"), both))
    assert together.std < 0.85 * alone.std
    assert not any("different rigs" in note for note in both.notes)


# ------------------------------------------------------------------------------------------------ twins


def test_twins_across_channels_are_named_together() -> None:
    """In full sliding mu hides an offset of the torque, and the power is too high by it: so it is of a share."""
    offset = Plant(COURSE, offset=0.06)
    test = Instruments(channels=("traction", "temperature"), temperature=0.05).record(offset, np.random.default_rng(1))
    found = run(test)
    assert found.verdict == "effects_found"
    told = {e.name for e in found.effects} | {str(a.term) for e in found.effects for a in e.alternatives}
    assert {"torque_offset", "heat_partition"} <= told


@pytest.mark.parametrize(
    ("after", "own", "contradicted"),
    [(2.0, 2.0, {"traction"}), (1.1, 1.1, set()), (2.0, 0.9, set()), (0.5, 0.5, set())],
)
def test_what_is_predicted_worse_elsewhere_with_its_level_known_is_contradicted(
    after: float, own: float, contradicted: set[str]
) -> None:
    """Errors over the noise: a worse one, one within the noise, one with another level, a better one."""
    errors = [
        {"traction": ChannelError("1", 1.0, 0.0, 1.0, 1.0, 1.5 if error > 1.2 else 1.0, error)}
        for error in (after, own)
    ]
    assert contradicted_by(PredictedErrors("other", *errors, {}, {})) == contradicted


@pytest.mark.parametrize(("after", "own", "missed"), [(2.0, 1.6, {"traction"}), (2.0, 1.1, set()), (1.2, 1.2, set())])
def test_what_is_missed_elsewhere_is_missed_with_its_level_known(after: float, own: float, missed: set[str]) -> None:
    errors = [{"traction": ChannelError("1", 1.0, 0.0, 1.0, 1.0, 3.0, error)} for error in (after, own)]
    assert missed_by(PredictedErrors("other", *errors, {}, {})) == missed


@pytest.mark.parametrize(("own", "by_base", "contradicted"), [(1.6e-3, 1e-3, {"profile"}), (1.6e-3, 1.6e-3, set())])
def test_what_alone_puts_the_level_of_another_test_apart_is_contradicted(
    own: float, by_base: float, contradicted: set[str]
) -> None:
    """One final depth fits any K: an answer by which it is another than in the tests fitted, but for the base model."""
    far, near = (
        {"profile": ChannelError("um", 0.1, 0.0, np.nan, np.nan, before, after)}
        for before, after in ((0.5, 3.0), (0.1, 0.1))
    )
    after, before = ({"K": PredictedLevel(1e-3, 0.95e-3, 1.05e-3, k)} for k in (own, by_base))
    assert contradicted_by(PredictedErrors("other", far, near, after, before)) == contradicted


@pytest.mark.parametrize(("stops", "few"), [(3, True), (6, False)])
def test_few_stops_are_said_to_refuse_little(stops: int, few: bool) -> None:
    """K and two parameters take three profiles up; three more can refuse the law."""
    problem = Problem([case_of(recorded("nothing", "traction", "profile"))], ("profile",)).with_terms("running_in_wear")
    answer = Explanation(at(problem, problem.start()), {}, 0.0)
    notes = few_stops(answer, stops)
    assert any("little to refuse it" in note for note in notes) == few


@pytest.mark.parametrize(("course", "strength"), [(history((0.05,), 18), "probable"), (COURSE, "established")])
def test_an_effect_over_time_is_not_established_where_the_energy_runs_with_it(course: History, strength: str) -> None:
    """At one creepage and one friction it does; both settle alike."""
    test = Instruments(channels=("traction",)).record(Plant(course), np.random.default_rng(1))
    problem = Problem([case_of(test)], ("traction",))
    effect = FoundEffect("running_in_friction", "traction", {}, (), 0.95, "established", 0.0)
    found, notes = not_over_others([effect], problem.predict(problem.start()[None]))
    assert [of.strength for of in found] == [strength]
    said = "dissipated energy and sliding distance run with time on this history"
    assert any(said in note for note in notes) == (strength == "probable")


def test_a_search_that_is_too_long_ends_with_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explanation, "SEARCH", replace(SEARCH, most_effort=200))
    found = run(recorded("falling", "traction"))
    assert list(named(found)) == ["falling_friction"]
    assert named(found)["falling_friction"].strength != "established"
    assert any("the search was ended after" in note for note in found.notes)
