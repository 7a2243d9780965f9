"""Learning against integrals that can be written down, noise alone, and changes planted at a known place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rigs import Floats, Instruments, Plant, experiment, history, spread, traction_samples
from scipy.integrate import quad

from twindisc_cli.laws.law import Law
from twindisc_cli.loop import candidates
from twindisc_cli.loop.candidates import laws, proposals
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.extend import with_one_more
from twindisc_cli.loop.fit import Fit, fit, plain_fit, refit
from twindisc_cli.loop.holdout import without
from twindisc_cli.loop.learn import LENGTHS, LEVELS, Pair, confounded, pairs, passed_together, with_elsewhere
from twindisc_cli.loop.problem import Case, Problem, case_of
from twindisc_cli.loop.thresholds import SEARCH
from twindisc_cli.loop.validate import elsewhere
from twindisc_cli.model.experiment import History, Measured, TractionSamples

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015, 0.05, 0.025), 2)
TIME = spread(COURSE, 10)
AT = COURSE.creepage[np.searchsorted(COURSE.end_time, TIME)]
SIGMA = 0.004


def seen(change: Floats, seed: int = 0) -> list[Pair]:
    ratio = 0.6 * (1.0 + change) + SIGMA * np.random.default_rng(seed).standard_normal(len(TIME))
    samples = traction_samples(COURSE, TIME, ratio, SIGMA)
    test = experiment(COURSE, thermal=None, measured=Measured(traction=samples))
    return pairs(fit(Problem([case_of(test)], ("traction",))))


def test_a_covariate_that_runs_as_another_does_is_named() -> None:
    """At one creepage the dissipated power goes as the rolling speed; with a second creepage it does not."""
    for creepage, names in ((0.02, ["rolling_speed"]), (np.array([0.02, 0.02, 0.04, 0.04]), [])):
        course = history(creepage * np.ones(4), 1)
        course = replace(course, speed_factor=np.array([0.5, 1.0, 2.0, 1.0]))
        case = case_of(experiment(course, thermal=None, measured=Measured(traction=traction_samples(
            course, time := spread(course, 5), np.full(len(time), 0.6), SIGMA))))  # fmt: skip
        problem = Problem([case], ("traction",))
        predictions = problem.predict(fit(problem).theta[None])
        assert confounded(predictions, "wear", "power") == names
        assert confounded(predictions, "mu", "time") == []


@cache
def noise_alone() -> list[float]:
    return [seen(0.0 * TIME, seed)[0].log_evidence for seed in range(12)]


def of_means(creepage: Floats) -> Fit:
    """One mu for the mean T/N of each step of 84 s in full sliding, in which mu runs in over 500 s."""
    course = history(creepage, 1)
    end, tau = course.end_time, 500.0
    mean = 0.6 * (1.0 - 0.3 * tau / 84.0 * (np.exp(-(end - 84.0) / tau) - np.exp(-end / tau)))
    count = len(creepage)
    samples = TractionSamples(
        np.full(count, np.nan), np.arange(count), course.step_creepage, mean, np.full(count, SIGMA)
    )
    return fit(Problem([case_of(experiment(course, thermal=None, measured=Measured(traction=samples)))], ("traction",)))


def test_means_of_steps_show_a_law_over_time_where_the_order_of_steps_is_not_that_of_creepage() -> None:
    creepage = np.random.default_rng(5).permutation(np.linspace(0.02, 0.1, 16))
    running_in = of_means(creepage)
    best = next(law for law in laws(running_in) if law.name == "mu_over_time" and law.shape == "exponential")
    explained = refit(running_in.problem.with_terms(best.name, trial={best.name: best.effect}))
    assert explained.chi2 < 1e-3 * running_in.chi2
    assert explained.values(best.name)["scale_s"] == pytest.approx(500.0, rel=0.02)
    of_curve = {pair.covariate for pair in pairs(of_means(np.sort(creepage)))}
    assert "creepage" in of_curve
    assert not of_curve & {"time", "cycles", "energy"}


def test_friction_is_learnt_over_the_sliding_distance_where_loads_change() -> None:
    """Steps far slid carry little and steps hardly slid much, so that neither time nor energy goes with the distance.

    Under one load the energy does.
    """
    course = history((0.01, 0.09, 0.02, 0.1, 0.01, 0.08, 0.02, 0.09), 2)
    time, own = spread(course, 10), course.creepage * course.revolutions
    at = np.searchsorted(course.end_time, time)
    into = 1.0 - (course.end_time[at] - time) / course.duration[at]
    share = ((np.cumsum(own) - own)[at] + into * own[at]) / own.sum()
    ratio = 0.6 * (1.0 - 0.04 * np.exp(-share / 0.4)) + SIGMA * np.random.default_rng(3).standard_normal(len(time))

    def evidence(load: Floats) -> dict[str, float]:
        test = replace(course, load_factor=load)
        measured = Measured(traction=traction_samples(test, time, ratio, SIGMA))
        every = pairs(fit(Problem([case_of(experiment(test, thermal=None, measured=measured))], ("traction",))))
        return {pair.covariate: pair.log_evidence for pair in every if pair.quantity == "mu"}

    ones = np.ones(len(own))
    assert not {"sliding_distance", "power"} & set(evidence(ones))
    assert not {"sliding_distance", "power"} & set(evidence(2.0 * ones))
    apart = evidence(np.where(course.creepage > 0.05, 0.2, ones))
    assert max(apart, key=lambda name: apart[name]) == "sliding_distance"


@pytest.mark.parametrize(
    ("law", "tests", "others"),
    [
        (Law("mu", "time", "step", {"size": 0.1, "at_s": 300.0}), 1, ["energy", "sliding_distance"]),
        (
            Law("wear", "energy", "window", {"size": 0.1, "begin_kJ": 1.0, "end_kJ": 2.0}),
            1,
            ["time", "sliding_distance"],
        ),
        (Law("mu", "time", "step", {"size": 0.1, "at_s": 300.0}), 2, []),
        (Law("mu", "creepage", "step", {"size": 0.1, "at_percent": 3.0}), 1, []),
        (Law("mu", "time", "linear", {"size": 0.1, "begin_s": 0.0, "end_s": 300.0}), 1, []),
    ],
)
def test_a_jump_at_one_moment_may_be_one_over_all_that_grows(law: Law, tests: int, others: list[str]) -> None:
    assert passed_together(law, tests) == others


# ------------------------------------------------------------------------------------------------ another test


def recorded(change: Callable[[Floats, Floats], Floats], *creepage: float, seed: int) -> Case:
    """A test of full sliding in which mu changes by a share that is a function of creepage and time."""
    course = history(creepage, 2)
    time = spread(course, 10)
    at = course.creepage[np.searchsorted(course.end_time, time)]
    ratio = 0.6 * (1.0 + change(at, time)) + SIGMA * np.random.default_rng(seed).standard_normal(len(time))
    return case_of(experiment(course, thermal=None, measured=Measured(traction=traction_samples(course, time, ratio))))


RISING = (0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06, 0.09)


@pytest.mark.parametrize("true", ["creepage", "time"])
def test_another_history_tells_covariates_apart_that_run_alike_where_a_law_is_learnt(true: str) -> None:
    """On steps of rising creepage a change from the fifth on is one of creepage or of time; on falling ones, not."""

    def change(creepage: Floats, time: Floats) -> Floats:
        later = creepage > 0.035 if true == "creepage" else time > 504.0
        return np.where(later, -0.01, 0.0)

    base = fit(Problem([recorded(change, *RISING, seed=1)], ("traction",)))
    other = elsewhere(recorded(change, *RISING[::-1], seed=2), base)
    assert other is not None
    found = {pair.covariate: pair for pair in pairs(base) if pair.quantity == "mu"}
    there = other.to_first_order(base)
    both = {name: with_elsewhere(base, pair, there).log_evidence for name, pair in found.items()}
    wrong = "time" if true == "creepage" else "creepage"
    assert found["time"].log_evidence == pytest.approx(found["creepage"].log_evidence, abs=3.0)
    assert both[true] > found[true].log_evidence + 5.0
    assert both[wrong] < found[wrong].log_evidence
    first = max((p for p in laws(base, there=there) if p.name.startswith("mu_over")), key=lambda p: p.promise)
    assert first.name == f"mu_over_{true}"


# ------------------------------------------------------------------------------------------------ integrals


@pytest.mark.parametrize(("response", "along"), [(9.0, 2.0), (400.0, 55.0), (0.01, 0.1)])
def test_evidence_of_one_bin_is_its_integral(response: float, along: float) -> None:
    """Z = int N(f; 0, s^2) exp(g f - A f^2 / 2) df, averaged over the sizes s and the families.

    With two bins of which only the second is seen, a line, and a rise over the scale of each exponential, is that bin
    times a number; a curve has the variance of one bin.
    """
    pair = Pair("mu", "time", np.array([0.0, 1.0, 2.0]), np.array([0.5, 1.5]), np.diag([0.0, response]),
                np.array([0.0, along]), 0.3, 600)  # fmt: skip

    def marginal(height: float, level: float) -> float:
        def integrand(f: float) -> float:
            x = height * f
            return float(np.exp(along * x - 0.5 * response * x**2 - 0.5 * (f / level) ** 2 - peak))

        best = along * height / (response * height**2 + level**-2)
        peak = along * height * best - 0.5 * response * (height * best) ** 2 - 0.5 * (best / level) ** 2
        width = (response * height**2 + level**-2) ** -0.5
        area = quad(integrand, best - 12.0 * width, best + 12.0 * width)[0]
        return float(np.exp(peak) * area / (level * np.sqrt(2.0 * np.pi)))

    families = []
    for _, _, columns in pair.members:
        families.append(np.mean([marginal(float(h), s * 0.3) for h in columns[1] for s in LEVELS]))
    families.append(np.mean([marginal(1.0, s * 0.3) for s in LEVELS for _ in LENGTHS]))
    assert {shape for shape, *_ in pair.members} == {"linear", "exponential"}
    assert pair.log_evidence == pytest.approx(np.log(np.mean(families)), abs=1e-4)


# ------------------------------------------------------------------------------------------------ noise alone


def test_noise_alone_teaches_nothing() -> None:
    """Evidence is a ratio to nothing: over noise the mean of exp is one for each pair, and large values are rare."""
    best = np.array(noise_alone())
    assert best.max() < 4.0
    assert np.median(best) < 1.0


def test_the_best_of_noise_promises_less_than_it_costs() -> None:
    promised = [max(pair.proposals(len(TIME))[0][0] for pair in seen(0.0 * TIME, seed)) for seed in range(3)]
    assert max(promised) < 3.0


# ------------------------------------------------------------------------------------------------ planted

PLANTED: dict[str, tuple[Floats, str, str]] = {
    "step": (0.05 * (TIME > 700.0), "time", "step"),
    "window": (0.05 * ((TIME > 420.0) & (TIME < 672.0)), "time", "window"),
    "hump over time": (0.06 * np.exp(-0.5 * ((TIME - 800.0) / 110.0) ** 2), "time", "bump"),
    "hump over creepage": (0.06 * np.exp(-0.5 * ((AT - 0.045) / 0.012) ** 2), "creepage", "bump"),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_change_is_found_over_its_covariate_and_at_its_place(name: str) -> None:
    change, covariate, shape = PLANTED[name]
    found = seen(change)
    best = found[0]
    assert best.log_evidence > 30.0
    assert best.quantity in ("mu", "traction_ratio")
    alike = [pair for pair in found if best.log_evidence - pair.log_evidence < 3.0]
    assert covariate in {pair.covariate for pair in alike}
    (own,) = [pair for pair in found if (pair.quantity, pair.covariate) == ("mu", covariate)]
    starts = {shape: starts for shape, starts, _ in own.members}
    trial = next(trial for _, trial, _ in own.proposals(len(TIME)) if trial.shape == shape)
    values = {p.name: p.start for p in trial.params} | dict(trial.fixed)
    width = float(np.median(np.diff(own.edges)))
    if shape == "step":
        assert values["at_s"] == pytest.approx(700.0, abs=width)
    elif shape == "window":
        assert values["begin_s"] == pytest.approx(420.0, abs=width)
        assert values["end_s"] == pytest.approx(672.0, abs=width)
    else:
        key, place = ("at_s", 800.0) if covariate == "time" else ("at_percent", 4.5)
        centres = sorted({start["at"] for start in starts["bump"]})
        assert values[key] == pytest.approx(place, abs=1.5 * (centres[1] - centres[0]))


def test_a_slope_that_falls_far_is_seen_where_all_slides() -> None:
    """Vermeulen and Johnson's T / (mu N) = 1 - (1 - x / 3)^3, x = 3 at 1.2 % of creepage, at 3.6 % in the second half.

    A small change of the slope would show nothing: x is above 3 at all creepages of the first half.
    """
    slid = np.minimum(AT / 0.012 * np.where(TIME > 840.0, 1.0 / 3.0, 1.0), 1.0)
    found = {(pair.quantity, pair.covariate): pair for pair in seen(-((1.0 - slid) ** 3))}
    assert found["slope", "time"].log_evidence > 1000.0
    assert found["slope", "time"].log_evidence > found["mu", "energy"].log_evidence


def test_what_the_parameters_imitate_is_not_learnt() -> None:
    """A level of mu everywhere is mu itself: no pair sees it."""
    one, two = (seen(level + 0.0 * TIME, seed=3)[0] for level in (0.0, 0.1))
    assert one.log_evidence == pytest.approx(two.log_evidence, abs=0.3)


# ------------------------------------------------------------------------------------------------ curves


@pytest.mark.parametrize("scale", [0.2, 0.3])
def test_a_curve_follows_a_smooth_course(scale: float) -> None:
    """Exponentials, which lines between fifteen knots miss by half of (1 / 14 scale)^2 / 8, 0.8 % at the steepest."""
    edges = np.linspace(0.0, 1.0, 61)
    places = 0.5 * (edges[1:] + edges[:-1])
    course = np.exp(-places / scale)
    pair = Pair("mu", "time", edges, places, 1e8 * np.eye(60), 1e8 * course, 0.3, 600)
    (trial,) = (trial for _, trial, _ in pair.proposals(1000) if trial.is_curve)
    assert trial.mix is not None
    x = np.linspace(places[0], places[-1], 500)
    columns = np.array([np.ones_like(x), *(np.interp(x, trial.at, column) for column in trial.mix.T)]).T
    left = np.exp(-x / scale) - columns @ np.linalg.lstsq(columns, np.exp(-x / scale), rcond=None)[0]
    assert np.abs(left).max() < 2e-3


def test_a_curve_is_straight_where_nothing_was_measured_and_constant_beyond() -> None:
    edges = np.linspace(0.0, 1.0, 61)
    places = 0.5 * (edges[1:] + edges[:-1])
    sampled = ((places > 0.1) & (places < 0.4)) | ((places > 0.7) & (places < 0.9))
    response = np.diag(np.where(sampled, 1e4, 0.0))
    pair = Pair("mu", "time", edges, places, response, response @ np.sin(9.0 * places), 0.3, 600)
    (trial,) = (trial for _, trial, _ in pair.proposals(600) if trial.is_curve)
    assert trial.mix is not None
    x = np.array([0.02, places[sampled].min(), *np.linspace(0.395, 0.705, 7), places[sampled].max(), 0.98])
    heights = np.array([np.interp(x, trial.at, column) for column in trial.mix.T])
    assert heights[:, 0] == pytest.approx(heights[:, 1])
    assert heights[:, -1] == pytest.approx(heights[:, -2])
    assert np.diff(heights[:, 3:8], n=2, axis=1) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("size", "scale"), [(2.0, 0.1), (-0.7, 0.15)])
def test_a_curve_is_as_smooth_as_says_most_however_large_it_is(size: float, scale: float) -> None:
    """Of all lengths and sizes that a curve may have, each fitted, the one that is found has the most evidence.

    To first order, from mu as it was, others look better by up to 24 nats.
    """
    sigma = 0.25 * SIGMA
    ratio = 0.2 * (1.0 + size * np.exp(-TIME / TIME.max() / scale))
    ratio += sigma * np.random.default_rng(0).standard_normal(len(TIME))
    test = experiment(COURSE, thermal=None, measured=Measured(traction=traction_samples(COURSE, TIME, ratio, sigma)))
    base = Explanation.of_base(fit(Problem([case_of(test)], ("traction",))))
    curve = next(p for p in proposals(base.fit) if p.name == "mu_over_time" and p.shape is None)
    assert curve.pair is not None
    each = [
        fit(base.fit.problem.with_terms(curve.name, trial={curve.name: of_prior})).evidence
        for length in LENGTHS
        for level in LEVELS
        for of_prior in [curve.pair.curve(length, level * curve.pair.typical)]
    ]
    assert with_one_more(base, curve).fit.evidence == pytest.approx(max(each), abs=SEARCH.evidence_error)


def test_what_an_effect_of_several_sizes_promises_is_not_made_of_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    """Responses that differ in their tenth digit, as from one processor to the next, promise the same.

    Where an effect is slight, a size and its opposite do the opposite, and their difference is rounding.
    """
    ratio = 0.6 + SIGMA * np.random.default_rng(0).standard_normal(len(TIME))
    test = experiment(COURSE, thermal=None, measured=Measured(traction=traction_samples(COURSE, TIME, ratio, SIGMA)))
    base, moved, said = fit(Problem([case_of(test)], ("traction",))), candidates._moved, []
    for seed in range(4):
        off = 1.0 + 1e-10 * np.random.default_rng(seed).standard_normal(len(base.residual))
        monkeypatch.setattr(candidates, "_moved", lambda *asked, off=off: moved(*asked) * off)
        said.append(
            [candidates.effects(base, [name])[0].promise for name in ("two_stage_running_in", "two_slope_factors")]
        )
    assert np.ptp(said, axis=0) == pytest.approx(0.0, abs=SEARCH.evidence_error)


# ------------------------------------------------------------------------------------------------ steps that differ

LOADS = np.repeat([1.0, 2.0, 0.5, 1.0, 2.0, 0.5, 2.0, 1.0], 2)
SPEEDS = np.repeat([1.0, 0.5, 1.0, 2.0, 0.5, 2.0, 1.0, 0.5], 2)
TURNED = np.repeat([1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0], 2)
STEP = COURSE.step.astype(float)


@pytest.mark.parametrize(
    ("covariate", "course", "change"),
    [
        ("load", replace(COURSE, load_factor=LOADS), 0.1 * np.log(LOADS)),
        ("rolling_speed", replace(COURSE, speed_factor=SPEEDS), 0.1 * SPEEDS),
        ("direction", COURSE, 0.05 * TURNED),
        ("order", replace(COURSE, separate=True), 0.08 * np.sqrt(STEP)),
    ],
)
def test_what_friction_follows_from_step_to_step_is_the_pair_that_explains_most(
    covariate: str, course: History, change: Floats
) -> None:
    at = np.searchsorted(COURSE.end_time, TIME)
    ratio = 0.6 * (1.0 + change[at]) + SIGMA * np.random.default_rng(5).standard_normal(len(TIME))
    test = experiment(course, thermal=None, measured=Measured(traction=traction_samples(course, TIME, ratio, SIGMA)))
    found = sorted(pairs(fit(Problem([case_of(test)], ("traction",)))), key=lambda p: -p.log_evidence)
    same = {"load": {"load", "pressure"}}.get(covariate, {covariate})
    assert found[0].quantity == "mu"
    assert found[0].covariate in same
    rivals = [pair.log_evidence for pair in found if pair.quantity == "mu" and pair.covariate not in same]
    assert found[0].log_evidence > max(rivals) + 10.0


def test_what_is_the_same_in_all_steps_is_not_tried() -> None:
    covariates = {pair.covariate for pair in seen(0.1 * np.sin(TIME / 100.0))}
    assert not covariates & {"load", "pressure", "rolling_speed", "order"}


@pytest.mark.parametrize(("channels", "ends"), [(("traction", "profile"), [2.0, 6.0]), (("traction",), [1.5, 9.0])])
def test_where_wear_was_measured_a_law_of_friction_changes_only_where_traction_was(
    channels: tuple[str, ...], ends: list[float]
) -> None:
    """The slowest step and the fastest have no traction: what friction was there shows in the wear alone."""
    test = Instruments(each=4).record(Plant(COURSE), np.random.default_rng(1))
    test = replace(test, thermal=None, measured=replace(test.measured, temperature=None))
    assert test.measured.traction is not None
    creepage = test.measured.traction.creepage
    test = without(test, {"traction": (creepage < 0.016) | (creepage > 0.08)})
    every = pairs(plain_fit(Problem([case_of(test)], channels)))
    found = {pair.quantity: pair for pair in every if pair.covariate == "creepage"}
    assert found["mu"].edges[[0, -1]] == pytest.approx(ends), "the slowest step that counts, and the fastest [%]"


@pytest.mark.parametrize(("samples", "knots"), [(600, 20), (36, 12), (9, 3)])
def test_a_curve_has_no_more_knots_than_a_third_of_the_samples(samples: int, knots: int) -> None:
    edges = np.linspace(0.0, 1.0, 61)
    pair = Pair("mu", "time", edges, 0.5 * (edges[1:] + edges[:-1]), np.eye(60), np.ones(60), 0.3, samples)
    (trial,) = (trial for _, trial, _ in pair.proposals(samples) if trial.is_curve)
    assert trial.mix is not None
    assert trial.mix.shape[1] == knots


def test_eight_samples_are_too_few_for_a_curve() -> None:
    edges = np.linspace(0.0, 1.0, 9)
    pair = Pair("mu", "time", edges, 0.5 * (edges[1:] + edges[:-1]), np.eye(8), np.ones(8), 0.3, 8)
    assert not any(trial.is_curve for _, trial, _ in pair.proposals(8))
