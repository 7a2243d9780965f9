"""Steps that differ by something that was not recorded, or not declared: a finding, not "nothing is missing"."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import Floats, experiment, history

from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.model.experiment import Experiment, History, Measured, Options, TractionSamples

EACH, NOISE = 12, 0.005
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
