"""The next experiment: distances that can be written down, the rig's range kept, honest about what is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from rigs import ROOM, SPEED, experiment, history, spread, traction_samples

from twindisc_cli.laws.trial import formula
from twindisc_cli.loop.design import SAMPLES, next_experiment, next_for_set, up_and_down
from twindisc_cli.loop.diagnosis import NextExperiment
from twindisc_cli.loop.fit import Fit, at
from twindisc_cli.loop.problem import Case, Problem, case_of
from twindisc_cli.model.experiment import Measured, RecordedColumn, Thermal

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06), (2, 3, 2, 4, 2))
TIME = spread(COURSE, 6)
SIGMA = 0.004


def constant_case(thermal: Thermal | None = None) -> Case:
    """Traction alone, of constant mu, with its uncertainty."""
    samples = traction_samples(COURSE, TIME, np.full(len(TIME), 0.6), SIGMA)
    test = experiment(COURSE, thermal=thermal, measured=Measured(traction=samples))
    return case_of(test)


def model_of(case: Case, mu: float, effect: str, **parameters: float) -> Fit:
    """A model at given parameters."""
    problem = Problem([case], ("traction",), (effect,))
    values = {f"{effect}.{key}": value for key, value in parameters.items()} | {"mu": mu}
    return at(problem, np.array([p.inner(values[p.name]) for p in problem.parameters]))


def planned(case: Case, *models: Fit) -> NextExperiment:
    return next_experiment([(m, 1.0 / len(models)) for m in models], [m.terms[0] for m in models])


def per_iteration(steps: list[Mapping[str, float]]) -> np.ndarray:
    return np.repeat([s["creepage_percent"] / 100.0 for s in steps], [int(s["iterations"]) for s in steps])


def test_the_separation_of_two_laws_is_their_distance_in_noise_units() -> None:
    """Full sliding: mu (A + (1 - A) e^(-B w)) against mu_2, the second's level refitted: n var / s^2 in closed form."""
    case = constant_case()
    falling = model_of(case, 0.7, "falling_friction", ratio=0.98, decay_s_m=3.0)
    offset = model_of(case, 0.5, "torque_offset", offset=0.05)
    found = planned(case, falling, offset)

    def separation(creepage: np.ndarray) -> float:
        law = 0.7 * (0.98 + 0.02 * np.exp(-3.0 * SPEED * creepage))
        return float(np.sqrt(SAMPLES * np.sum((law - law.mean()) ** 2)) / SIGMA)

    assert found.separation_now == pytest.approx(separation(COURSE.creepage), rel=1e-4)
    assert found.separation == pytest.approx(separation(per_iteration(list(found.steps))), rel=1e-4)
    assert set(found.rivals) == {"falling_friction", "torque_offset"}


def test_what_this_history_sets_apart_clearly_and_does_not_decide_is_no_next_experiment() -> None:
    """Twenty times the change: no history separates them twice as well as the one at hand, which did not decide."""
    case = constant_case()
    falling = model_of(case, 0.7, "falling_friction", ratio=0.6, decay_s_m=3.0)
    found = planned(case, falling, model_of(case, 0.5, "torque_offset", offset=0.05))
    assert found.separation_now > 50.0
    assert found.why.startswith("no history of these creepages separates falling_friction from torque_offset much bet")
    assert "expected" not in found.why
    assert found.steps == ()


def test_a_declared_column_runs_over_time_as_it_did() -> None:
    """A column that is the time: a law over it and one over the time do the same, on every history."""
    samples = traction_samples(COURSE, TIME, np.full(len(TIME), 0.6), SIGMA)
    clock = RecordedColumn(TIME, COURSE.step[COURSE.iteration_at(TIME)], TIME)
    case = case_of(experiment(COURSE, thermal=None, measured=Measured(traction=samples, columns={"clock": clock})))
    end = float(TIME[-1])
    fits = []
    for covariate, suffix in (("time", "_s"), ("clock", "")):
        start = {f"begin{suffix}": 0.0, f"end{suffix}": end, "size": 0.1}
        law = formula("mu", covariate, "linear", start, (0.0, end), 1.0)
        problem = Problem([case], ("traction",)).with_terms("law", trial={"law": law})
        values = {"law.size": 0.1, "mu": 0.6}
        fits.append(at(problem, np.array([p.inner(values[p.name]) for p in problem.parameters])))
    found = next_experiment([(fitted, 0.5) for fitted in fits], ("mu over time", "mu over clock"))
    assert found.separation < 0.1
    assert found.separation_now < 0.1


def test_the_history_chosen_stays_within_the_rigs_range() -> None:
    case = constant_case()
    falling = model_of(case, 0.7, "falling_friction", ratio=0.98, decay_s_m=3.0)
    drifting = model_of(case, 0.6, "sensor_drift", per_hour=0.01)
    found = planned(case, falling, drifting)
    creepage = per_iteration(list(found.steps))
    assert COURSE.creepage.min() <= creepage.min() <= creepage.max() <= COURSE.creepage.max()
    assert 0.7 * len(COURSE.step) <= len(creepage) <= 1.3 * len(COURSE.step)
    assert all(float(s["iterations"]).is_integer() and s["iterations"] >= 1 for s in found.steps)
    assert found.separation >= found.separation_now - 1e-9


def test_creepage_and_time_are_told_apart_by_going_up_and_down() -> None:
    """Friction falling with speed against friction running in: one on a rising ramp, two up and down."""
    ramp = history((0.02, 0.03, 0.04, 0.06, 0.09), 3)
    time = spread(ramp, 6)
    test = experiment(
        ramp, thermal=None, measured=Measured(traction=traction_samples(ramp, time, np.full(len(time), 0.6), SIGMA))
    )
    case = case_of(test)
    falling = model_of(case, 0.6, "falling_friction", ratio=0.97, decay_s_m=1.2)
    settling = model_of(case, 0.59, "running_in_friction", excess=0.012, settling_cycles=60000.0)
    found = planned(case, falling, settling)
    assert found.separation > 1.5 * found.separation_now
    creepage = per_iteration(list(found.steps))
    assert np.any(np.diff(creepage) < 0.0), "no longer a rising ramp"


def test_one_model_is_not_separated_from_itself() -> None:
    case = constant_case()
    one = model_of(case, 0.7, "falling_friction", ratio=0.7, decay_s_m=1.2)
    found = planned(case, one, one)
    assert found.separation == pytest.approx(0.0, abs=1e-6)
    assert found.channel_wanted is None


@pytest.mark.parametrize("thermal", [None, Thermal(ROOM, 100.0, ROOM)])
def test_what_the_measured_channels_cannot_tell_apart_has_no_separation(thermal: Thermal | None) -> None:
    """In full sliding a torque offset and a load error both only shift T/N, which mu makes up for, in any history."""
    case = constant_case(thermal)
    offset, load = (
        model_of(case, 0.5, "torque_offset", offset=0.1),
        model_of(case, 0.75, "load_error", error_percent=-20.0),
    )
    assert offset.chi2 == pytest.approx(load.chi2, abs=1e-6)
    found = planned(case, offset, load)
    assert found.separation == pytest.approx(0.0, abs=0.05)
    assert found.separation_now == pytest.approx(0.0, abs=0.05)


def test_the_channel_that_would_settle_it_is_named() -> None:
    """An offset of the torque meter heats nothing, more load does: the temperature tells."""
    case = constant_case(Thermal(ROOM, 100.0, ROOM, convection=1.6))
    offset = model_of(case, 0.5, "torque_offset", offset=0.1)
    load = model_of(case, 0.75, "load_error", error_percent=-20.0)
    found = planned(case, offset, load)
    assert found.channel_wanted == "temperature"
    assert "temperature" in found.why


def test_the_choice_is_the_same_every_time() -> None:
    case = constant_case()
    models = (
        model_of(case, 0.7, "falling_friction", ratio=0.7, decay_s_m=1.2),
        model_of(case, 0.6, "sensor_drift", per_hour=-0.2),
        model_of(case, 0.6, "film_breakdown", film_ratio=0.8, critical_creepage_percent=3.5, width_percent=0.4),
    )
    assert planned(case, *models) == planned(case, *models)


def test_a_set_of_tests_is_worth_the_mean_square_of_its_distances() -> None:
    case = constant_case()
    offset = model_of(case, 0.5, "torque_offset", offset=0.05)
    pairs = [
        ((model_of(case, 0.7, "falling_friction", ratio=ratio, decay_s_m=3.0), 0.5), (offset, 0.5))
        for ratio in (0.9, 0.6)
    ]
    names = ("falling_friction", "torque_offset")
    weak, strong = (next_for_set([pair], names).separation_now for pair in pairs)
    both = next_for_set(pairs, names)
    assert strong > 2.0 * weak > 0.0
    assert both.separation_now == pytest.approx(np.hypot(weak, strong) / np.sqrt(2.0), rel=1e-9)
    assert "in each of 2 tests" in both.why


def test_without_rivals_the_history_goes_up_and_down() -> None:
    found = up_and_down(COURSE, "because")
    creepage = [s["creepage_percent"] / 100.0 for s in found.steps]
    assert creepage == pytest.approx([*COURSE.step_creepage, *COURSE.step_creepage[::-1]])
    assert found.why == "because"
    assert found.rivals == ()


def test_what_acts_in_the_second_test_alone_is_planned_for_that_test() -> None:
    """In the first test neither term does anything: there no history separates them, and that says nothing."""
    case = constant_case()
    second = case_of(replace(case.test, name="second"))
    laws = [
        formula("mu", covariate, "linear", {begin: 0.0, end: most, "size": 0.1}, (0.0, most), 1.0)
        for covariate, begin, end, most in (
            ("time", "begin_s", "end_s", float(TIME[-1])),
            ("creepage", "begin_percent", "end_percent", 9.0),
        )
    ]

    def separation(cases: list[Case], test: str) -> NextExperiment:
        fits = []
        for law in laws:
            problem = Problem(cases, ("traction",)).with_terms("law", trial={"law": replace(law, test=test)})
            values = {p.name: 0.1 if p.name == "law.size" else 0.6 for p in problem.parameters}
            fits.append(at(problem, np.array([p.inner(values[p.name]) for p in problem.parameters])))
        return next_experiment([(fitted, 0.5) for fitted in fits], ("mu over time", "mu over creepage"))

    alone, both = separation([second], ""), separation([case, second], "second")
    assert both.test == "second"
    assert both.separation == pytest.approx(alone.separation, rel=1e-6)
    assert both.separation > 1.0
