"""Steps that differ by something that was not recorded, or not declared: a finding, not "nothing is missing"."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import Floats, experiment, history, spread, traction_samples

from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.loop.mu_scatter import SIZES, likeliest
from twindisc_cli.model.experiment import Experiment, History, Measured, Options, TractionSamples

EACH, NOISE = 12, 0.005
LEVEL = 0.4
STEPS = 11


def swept(course: History, levels: Floats, seed: int = 0) -> Experiment:
    """A record without time: so many samples of each step, about its own level."""
    step = np.repeat(np.arange(len(levels)), EACH)
    ratio = levels[step] + NOISE * np.random.default_rng(seed).standard_normal(len(step))
    unknown = np.full(len(step), np.nan)
    samples = TractionSamples(unknown, step, course.creepage[course.step.searchsorted(step)], ratio, unknown)
    measured = Measured(traction=samples)
    return replace(experiment(course, thermal=None, measured=measured, options=Options()), name="sweep")


def found(test: Experiment) -> Diagnosis:
    return diagnose([test], validate=None, progress=lambda stage, part: None)


def test_an_undeclared_sweep_of_the_yaw_is_a_scatter_between_steps() -> None:
    """Full slip turned by the yaw: T/N = mu xi / sqrt(xi^2 + yaw^2), the yaw from -20 to 20 mrad."""
    yaw = np.linspace(-0.02, 0.02, STEPS)
    answer = found(swept(history((0.02,) * STEPS, 1), 0.4 * 0.02 / np.hypot(0.02, yaw)))
    assert answer.verdict == "unexplained"
    (scatter,) = answer.step_scatter
    assert scatter.size > 5.0
    assert list(scatter.varied_with) == ["order"], "nothing else was recorded that differs"


def test_a_sweep_of_loads_names_the_load() -> None:
    """T/N that rises with the load and bends: no elastic layer and no offset does that."""
    load = np.array([1.0, 6.0, 2.0, 4.0, 0.5, 3.0, 5.0, 1.5, 7.0, 2.5, 0.7])
    course = history((0.02,) * STEPS, 1)
    answer = found(swept(replace(course, load_factor=load[course.step]), 0.2 + 0.3 * (load / 7.0) ** 2))
    assert answer.verdict != "no_missing_effect"
    if not answer.laws:
        (scatter,) = answer.step_scatter
        assert next(iter(scatter.varied_with)) == "load"
        assert scatter.varied_with["load"] == pytest.approx(1.0, abs=0.1)
    else:
        assert answer.laws[0].law.covariate in ("load", "pressure")


@pytest.mark.parametrize("seed", range(4))
def test_steps_that_differ_by_noise_alone_are_no_finding(seed: int) -> None:
    answer = found(swept(history((0.02,) * STEPS, 1), np.full(STEPS, 0.4), seed))
    assert answer.verdict == "no_missing_effect"
    assert answer.step_scatter == []


@pytest.mark.parametrize("true", [0.01, 0.05, 0.2])
def test_the_likeliest_scatter_is_that_of_the_closed_form(true: float) -> None:
    """Of k equal directions of length d the likelihood is greatest where 1 + s^2 d^2 is the mean square along them."""
    length = np.full(9, 40.0)
    along = np.sqrt(1.0 + (true * length) ** 2)
    nearest = SIZES[1:][np.argmin(np.abs(np.log(SIZES[1:] / true)))]
    assert likeliest(along, length) == nearest
    assert likeliest(np.ones(9), length) == 0.0


COURSE = history((0.01, 0.02, 0.04, 0.015, 0.03, 0.05, 0.02, 0.01, 0.04, 0.03, 0.05, 0.015), 2)


def in_one_run(of_step: Floats, of_time: Floats | float = 1.0, seed: int = 0) -> Experiment:
    """A record with times, in full sliding: a level times what changes from step to step and in time."""
    rng, time = np.random.default_rng(seed), spread(COURSE, EACH)
    step = COURSE.step[COURSE.iteration_at(time)]
    ratio = LEVEL * (of_step[step] * of_time + 0.01 * rng.standard_normal(len(time)))
    measured = Measured(traction=traction_samples(COURSE, time, ratio))
    return replace(experiment(COURSE, thermal=None, measured=measured, options=Options()), name="run")


@pytest.mark.parametrize("seed", range(3))
def test_mu_that_scatters_from_step_to_step_is_no_sum_of_laws(seed: int) -> None:
    of_step = 1.0 + 0.05 * np.random.default_rng(100 + seed).standard_normal(12)
    answer = found(in_one_run(of_step, seed=seed))
    assert answer.verdict == "unexplained"
    assert not answer.terms
    (scatter,) = answer.step_scatter
    assert 0.5 * of_step.std() < scatter.mu_scatter < 2.0 * of_step.std()


def test_a_course_in_time_is_not_taken_for_scatter_between_steps() -> None:
    """A friction that runs in crosses the steps: it explains what levels of the steps would, and what they cannot."""
    fall = 0.8 + 0.2 * np.exp(-spread(COURSE, EACH) / (0.2 * COURSE.end_time[-1]))
    answer = found(in_one_run(np.ones(12), fall))
    assert answer.terms
    assert answer.step_scatter == []
