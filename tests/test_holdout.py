"""What is held out: whole steps, last iterations and bands, the same every time, and nothing of it is ever fitted."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from rigs import Floats, Instruments, Plant, experiment, history, one_of, running, spread, traction_samples

from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import fit, plain_fit
from twindisc_cli.loop.holdout import held_out_steps, steps_withheld, withheld, without
from twindisc_cli.loop.judge import Judged, Kind, judge
from twindisc_cli.loop.problem import problem_of
from twindisc_cli.model.experiment import Experiment, Measured, TemperatureSamples

CREEPAGES = (0.01, 0.02, 0.015, 0.04, 0.03, 0.06, 0.05, 0.09, 0.07)
COURSE = history(CREEPAGES, 3)
FALLING = Plant(COURSE, mu=lambda time, creepage, cycles: 0.6 * (0.5 + 0.5 * np.exp(-30.0 * creepage)), lag=40.0)


def recorded(seed: int = 0) -> Experiment:
    return Instruments(each=4).record(FALLING, np.random.default_rng(seed))


def masks_of(test: Experiment) -> dict[str, np.ndarray]:
    return dict(withheld(test))


@pytest.mark.parametrize("count", [8, 9, 12, 20, 24, 50])
def test_the_lowest_and_the_highest_creepages_are_held_out(count: int) -> None:
    """Both ends, where a model extrapolates, and from 24 steps on the middle: a 24th of the steps each."""
    creepage = np.random.default_rng(count).permutation(np.geomspace(0.002, 0.09, count))
    chosen = held_out_steps(history(creepage, 2))
    rank = np.sort(np.argsort(np.argsort(creepage))[list(chosen)])
    size = max(count // 24, 1)
    assert list(rank[:size]) == list(range(size))
    assert list(rank[-size:]) == list(range(count - size, count))
    middle = rank[size:-size]
    assert len(middle) == (size if count >= 24 else 0)
    assert all(0.4 * count < place < 0.6 * count for place in middle)


@pytest.mark.parametrize(("count", "expected"), [(1, 0), (2, 0), (4, 0), (5, 1), (7, 1)])
def test_few_steps_hold_out_few(count: int, expected: int) -> None:
    creepage = np.geomspace(0.01, 0.09, count)
    chosen = held_out_steps(history(creepage, 2))
    assert len(chosen) == expected
    assert not set(chosen) & {0, count - 1}


def test_the_choice_is_the_same_whatever_was_measured() -> None:
    one, two = recorded(0), recorded(1)
    for channel, mask in masks_of(one).items():
        assert np.array_equal(mask, masks_of(two)[channel])
        assert np.array_equal(mask, masks_of(recorded(0))[channel])


def test_whole_steps_and_the_last_iteration_are_held_out() -> None:
    test = recorded()
    assert test.measured.traction is not None
    assert test.measured.temperature is not None
    steps = held_out_steps(COURSE)
    for channel, time in (("traction", test.measured.traction.time), ("temperature", test.measured.temperature.time)):
        held = masks_of(test)[channel]
        iteration = running(COURSE, time)
        assert max(steps) < 8, "the last step is not held out whole"
        assert np.array_equal(held, np.isin(COURSE.step[iteration], steps) | (iteration == len(COURSE.step) - 1))
        by_iteration = [set(held[iteration == i]) for i in np.unique(iteration)]
        assert all(len(kinds) == 1 for kinds in by_iteration), "an iteration is held out whole or not at all"


def test_profiles_are_held_out_in_bands() -> None:
    test = recorded()
    assert test.measured.profile is not None
    held = masks_of(test)["profile"]
    assert 0.15 < held.mean() < 0.25
    edges = np.flatnonzero(np.diff(held.astype(int)))
    assert len(edges) == 16, "eight bands"
    assert not held[[0, -1]].any(), "none of them at an end"
    assert np.diff(edges)[::2].min() >= 4, "a band is several samples wide"
    inside = np.abs(test.measured.profile.y) < 0.7e-3
    assert held[inside].any()
    assert held[~inside].any()


def test_steps_asked_for_are_held_out_in_their_place() -> None:
    asked = replace(recorded(), hold_out_steps=(1, 4))
    only = replace(asked.measured, profile=None, temperature=None)
    found = diagnose([replace(asked, measured=only)], validate=None, progress=ignored)
    assert found.held_out_steps == {"small": (1, 4)}
    (curve,) = found.curves
    at = COURSE.step[running(COURSE, np.asarray(curve.covariates["time"]))]
    assert np.array_equal(curve.held_out, np.isin(at, (1, 4))), "these and no others"


def test_nothing_is_held_out_where_none_is_asked_for() -> None:
    assert not any(mask.any() for mask in withheld(replace(recorded(), hold_out_steps=())).values())


def test_a_test_without_samples_keeps_the_others_as_they_are() -> None:
    test = recorded()
    masks = masks_of(test)
    rest = without(test, masks).measured
    assert test.measured.temperature is not None
    assert rest.temperature is not None
    assert rest.profile is not None
    assert np.array_equal(rest.temperature.time, test.measured.temperature.time[~masks["temperature"]])
    assert np.array_equal(rest.temperature.temperature, test.measured.temperature.temperature[~masks["temperature"]])
    assert len(rest.profile.y) == len(rest.profile.height) == len(rest.profile.disc) == np.sum(~masks["profile"])
    assert without(test, {}) == test


def test_without_times_only_whole_steps_are_held_out() -> None:
    test = recorded()
    samples = test.measured.traction
    assert samples is not None
    untimed = replace(samples, time=np.full(len(samples.time), np.nan))
    held = masks_of(replace(test, measured=replace(test.measured, traction=untimed)))["traction"]
    assert np.array_equal(held, np.isin(samples.step, steps_withheld(test)))


def test_a_short_record_holds_nothing_out() -> None:
    course = history((0.02, 0.05), 1)
    time = spread(course, 3)
    test = experiment(
        course, measured=Measured(
            traction=traction_samples(course, time, np.full(6, 0.6)),
            temperature=TemperatureSamples(time, np.full(6, 300.0)),
        ),
    )  # fmt: skip
    assert all(not mask.any() for mask in masks_of(test).values())


def ignored(stage: str, part: float) -> None:
    """Progress that nobody watches."""


def shaken(test: Experiment) -> Experiment:
    """The test with every held-out sample replaced by nonsense that has the same scatter."""
    measured, masks = test.measured, masks_of(test)
    assert measured.traction is not None
    assert measured.profile is not None
    assert measured.temperature is not None
    return replace(
        test,
        measured=replace(
            measured,
            traction=replace(measured.traction, ratio=measured.traction.ratio - 0.2 * masks["traction"]),
            profile=replace(measured.profile, height=measured.profile.height + 9e-6 * masks["profile"]),
            temperature=replace(
                measured.temperature, temperature=measured.temperature.temperature + 5.0 * masks["temperature"]
            ),
        ),
    )


def judged(measured: Experiment) -> Judged:
    """Falling friction, judged by what is held out."""
    masks = [masks_of(measured)]
    before = plain_fit(problem_of([measured]))
    seen_before = plain_fit(problem_of([without(measured, masks[0])]))
    problem = seen_before.problem.with_terms("falling_friction")
    return judge(Explanation(fit(problem), {}, 0.0), before, seen_before, masks)


@pytest.fixture(scope="module")
def both() -> tuple[Judged, Judged]:
    """The same test as it was measured, and with nonsense in all that is held out."""
    course = history((0.03, 0.09, 0.015, 0.06, 0.02), 3)
    test = Instruments(each=4).record(replace(FALLING, history=course), np.random.default_rng(3))
    return judged(test), judged(shaken(test))


def test_held_out_samples_do_not_move_what_they_judge(both: tuple[Judged, Judged]) -> None:
    """Whatever is held out may be anything: the base model it judges is the same to the last bit, the revised one
    but for where its fit began."""
    one, two = both
    assert "falling_friction" in one.unseen_after.problem.cases[0].test.effects
    assert np.array_equal(one.unseen_before.theta, two.unseen_before.theta)
    assert np.array_equal(one.unseen_before.residual, two.unseen_before.residual)
    assert one.unseen_after.chi2 == pytest.approx(two.unseen_after.chi2, rel=1e-3)
    assert one.unseen_after.theta == pytest.approx(two.unseen_after.theta, abs=1e-3)


def test_held_out_errors_are_of_a_fit_without_them(both: tuple[Judged, Judged]) -> None:
    """Nonsense in the held-out samples shows in their error, and not in the other's; what is an outlier is left out."""
    one, two = both
    assert one.error("traction", "unseen_after", held_out=True) < 0.05 * two.error(
        "traction", "unseen_after", held_out=True
    )
    assert two.error("traction", "unseen_after", held_out=True) == pytest.approx(0.2, rel=0.05)
    assert one.error("temperature", "unseen_after", held_out=True) < 0.3 * two.error(
        "temperature", "unseen_after", held_out=True
    )


def test_the_tachometers_error_in_the_mean_of_a_step_counts_where_the_step_is_held_out() -> None:
    """Where T/N rises with the creepage in proportion, twice a relative error of it is as large an error of T/N."""
    course = history((0.03, 4e-5, 5e-5, 4.5e-5, 0.02), 3)
    test = Instruments(each=4).record(replace(FALLING, history=course), np.random.default_rng(3))
    logged = replace(test, measured=replace(test.measured, creepage_noise=5e-5))
    without_log, with_log = judged(test), judged(logged)
    assert without_log.held_out_noise("traction") == without_log.noise("traction")
    ratio = with_log.prediction("unseen_before")[0].traction[0][masks_of(test)["traction"]]
    of_step = ratio[ratio < 0.1]
    error = 2.0 * np.sqrt(np.sum(of_step**2) / len(ratio)) / np.sqrt(len(of_step))  # as large as the creepage
    expected = np.hypot(with_log.noise("traction"), error)
    assert with_log.held_out_noise("traction") == pytest.approx(expected, rel=0.1)
    assert expected > 1.5 * with_log.noise("traction")


class Missed(Judged):
    """A base and a revised model that miss held-out samples of known noise by so much."""

    sizes: dict[str, tuple[float, float]]
    samples = 240

    @classmethod
    def by(cls, **sizes: tuple[float, float]) -> Missed:
        """Errors of the two over the noise, by channel."""
        some = SimpleNamespace(problem=SimpleNamespace(channels=list(sizes)))
        missed = cls(*[some] * 4, masks=[])
        object.__setattr__(missed, "sizes", sizes)
        return missed

    def misses(self, channel: str, kind: Kind, *, held_out: bool, decided: bool = False) -> Floats:
        drawn = np.random.default_rng(len(channel)).standard_normal(self.samples)
        return self.sizes[channel][kind == "unseen_after"] * drawn / np.sqrt(np.mean(drawn**2))

    def noise(self, channel: str) -> float:
        return 1.0


def test_what_is_predicted_within_its_noise_is_no_rise() -> None:
    assert Missed.by(traction=(1.0, 1.14)).rises(held_out=True) == []
    assert Missed.by(traction=(1.0, 1.14)).rises(held_out=False) == ["traction"]
    assert Missed.by(traction=(1.0, 1.17)).rises(held_out=True) == ["traction"]


class MissedWeighings(Missed):
    """Of three weighings held out."""

    samples = 3


def test_a_few_samples_held_out_speak_where_they_are_missed_by_far_more() -> None:
    assert MissedWeighings.by(mass=(11.0, 18.0)).rises(held_out=True) == ["mass"]
    assert MissedWeighings.by(mass=(1.0, 1.4)).rises(held_out=True) == []
    assert MissedWeighings.by(mass=(2.0, 2.2)).rises(held_out=True) == []


class FewMissed(Missed):
    """Of 14 weighings."""

    samples = 14


def test_a_rise_by_which_chi2_hardly_grows_is_chance_in_samples_that_were_fitted() -> None:
    """14 times 1.07^2 - 1 is 2.0; 14 times 1.3^2 - 1 is 9.7, and is none."""
    assert FewMissed.by(mass=(1.0, 1.07)).rises(held_out=False) == []
    assert FewMissed.by(mass=(1.0, 1.3)).rises(held_out=False) == ["mass"]
    assert Missed.by(mass=(1.0, 1.07)).rises(held_out=False) == ["mass"]


def test_a_small_rise_in_one_channel_is_chance_where_all_together_are_predicted_better() -> None:
    assert Missed.by(traction=(2.0, 1.2), temperature=(1.1, 1.2)).rises(held_out=True) == []
    assert Missed.by(traction=(1.2, 1.2), temperature=(1.1, 1.2)).rises(held_out=True) == ["temperature"]
    assert Missed.by(traction=(2.0, 1.2), temperature=(1.1, 1.4)).rises(held_out=True) == ["temperature"]


# ------------------------------------------------------------------------------------------------ blind


NONSENSE = {
    "zero": lambda values, rng: np.zeros_like(values),
    "noise a hundred times as large": lambda values, rng: (
        values + 100.0 * np.ptp(values) * rng.standard_normal(len(values))
    ),
    "turned and shifted": lambda values, rng: 5.0 * np.max(np.abs(values)) - 2.0 * values,
}


def with_nonsense(test: Experiment, kind: str) -> Experiment:
    """The test with every held-out sample of all channels replaced by nonsense."""
    measured, masks, rng = test.measured, masks_of(test), np.random.default_rng(7)
    assert measured.traction is not None
    assert measured.temperature is not None
    replaced = [
        np.where(masks[channel], NONSENSE[kind](values, rng), values)
        for channel, values in (
            ("traction", measured.traction.ratio),
            ("temperature", measured.temperature.temperature),
        )
    ]
    traction = replace(measured.traction, ratio=replaced[0])
    temperature = replace(measured.temperature, temperature=replaced[1])
    return replace(test, measured=replace(measured, traction=traction, temperature=temperature))


@cache
def terms(kind: str | None) -> tuple[list[str], list[tuple[str, str]], str]:
    """Effects, laws and verdict of a test with falling friction, a lag and a step of the environment."""
    short = replace(FALLING, history=history(CREEPAGES, 1))
    test = Instruments(channels=("traction", "temperature"), each=8).record(short, np.random.default_rng(3))
    found = diagnose([with_nonsense(test, kind) if kind else test], validate=None, progress=ignored)
    effects = [effect.name for effect in found.effects]
    return effects, [(law.law.quantity, law.law.covariate) for law in found.laws], found.verdict


@pytest.mark.parametrize("kind", one_of([*NONSENSE]))
def test_nonsense_in_held_out_samples_changes_no_term(kind: str) -> None:
    assert terms(None)[0] == ["falling_friction", "thermocouple_lag"]
    assert terms(kind) == terms(None)


def test_held_out_is_as_removed() -> None:
    """The same terms and the same error as where the samples were never recorded, and are predicted later."""
    whole = Instruments(channels=("traction",), each=4).record(FALLING, np.random.default_rng(4))
    asked = replace(whole, hold_out_steps=(3, 7))
    masks = withheld(asked)
    rest = {channel: ~mask for channel, mask in masks.items()}
    removed = replace(without(asked, masks), hold_out_steps=())
    held = replace(without(asked, rest), name="held out", hold_out_steps=())
    blind = diagnose([asked], validate=None, progress=ignored)
    apart = diagnose([removed], validate=None, progress=ignored, predict=[held])
    assert [e.name for e in blind.effects] == [e.name for e in apart.effects] == ["falling_friction"]
    errors = apart.predictions[0].errors["traction"]
    assert blind.errors["traction"].held_out_before == pytest.approx(errors.held_out_before, rel=0.01)
    assert blind.errors["traction"].held_out_after == pytest.approx(errors.held_out_after, rel=0.01)


def test_what_only_held_out_samples_show_is_searched_with_them() -> None:
    """Friction that drops in the step of the highest creepage, which is held out: no other sample knows of it."""
    drops = Plant(COURSE, mu=lambda time, creepage, cycles: 0.6 - 0.06 * (creepage > 0.08))
    test = Instruments(channels=("traction",), each=4).record(drops, np.random.default_rng(5))
    removed = replace(without(test, withheld(test)), hold_out_steps=())
    assert diagnose([removed], validate=None, progress=ignored, quick=True).verdict == "no_missing_effect"
    found = diagnose([test], validate=None, progress=ignored)
    assert [e.name for e in found.effects] or [law.law.quantity for law in found.laws]
    assert not found.blind
    assert {term.strength for term in (*found.effects, *found.laws)} <= {"probable", "possible"}
    assert any("all samples were searched" in note for note in found.notes)
    error = found.errors["traction"]
    assert error.after < 0.5 * error.before
    assert np.isnan(error.held_out_after)


def with_a_zero(fall: float) -> Experiment:
    """Friction that falls by a share, and a zero of the torque in steps held out, under an eighth of the load."""
    plain = history(CREEPAGES, 1)
    course = replace(plain, load_factor=np.where(np.isin(plain.step, held_out_steps(plain)), 0.25, 2.0))
    falling = Plant(course, mu=lambda time, creepage, cycles: 0.6 * (1.0 - fall + fall * np.exp(-30.0 * creepage)))
    test = Instruments(channels=("traction",), each=10).record(falling, np.random.default_rng(6))
    traction = test.measured.traction
    assert traction is not None
    zero = 0.005 / course.load_factor[running(course, spread(course, 10))]
    return replace(test, measured=replace(test.measured, traction=replace(traction, ratio=traction.ratio + zero)))


@pytest.mark.long
def test_what_only_held_out_samples_show_beside_an_effect_is_searched_with_them() -> None:
    """A zero that leaves as much as the friction explains; made in full sliding, which 1 % of creepage is almost."""
    found = diagnose([with_a_zero(0.03)], validate=None, progress=ignored, quick=True)
    assert {e.name for e in found.effects} == {"falling_friction", "torque_offset"}
    assert any("all samples were searched" in note for note in found.notes)
    assert not found.blind
    assert not found.unexplained
    offset = next(e for e in found.effects if e.name == "torque_offset").parameters["offset"]
    assert offset.value == pytest.approx(0.005, rel=0.25)


@pytest.mark.long
def test_what_held_out_samples_show_beside_a_large_effect_is_reported() -> None:
    """The same zero leaves little of what the friction explains: its formula could be another."""
    found = diagnose([with_a_zero(0.5)], validate=None, progress=ignored, quick=True)
    assert [e.name for e in found.effects] == ["falling_friction"]
    assert found.blind
    assert {each.channel for each in found.unexplained} == {"traction"}
