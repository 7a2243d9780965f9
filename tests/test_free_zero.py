"""What mu is with the zero of the torque left free: against a zero that was put into the record."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from rigs import Floats, experiment, history, spread, traction_samples

from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.fit import Fit, fit
from twindisc_cli.loop.free_zero import notes, with_free_zero
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.model.experiment import Experiment, Measured, TorqueZero
from twindisc_cli.model.forward import ForwardModel

COURSE = history((0.0005, 0.001, 0.0015, 0.002, 0.003, 0.005, 0.01, 0.02), 2)
TIME = spread(COURSE, 6)
MU, SIGMA = 0.45, 0.002


def recorded(ratio: Floats, zero: TorqueZero | None = None) -> Experiment:
    samples = traction_samples(COURSE, TIME, ratio, SIGMA)
    return experiment(COURSE, thermal=None, measured=Measured(traction=samples, torque_zero=zero))


def read(offset: float, *, noise: float = SIGMA) -> Floats:
    """T/N of the model, with a zero that no one took off."""
    plain = ForwardModel(recorded(0.0 * TIME)).predict({"mu": np.array([MU])}).traction[0]
    return np.asarray(plain + offset + noise * np.random.default_rng(0).standard_normal(len(TIME)))


def fitted(test: Experiment, *terms: str) -> Fit:
    return fit(Problem([case_of(test)], ("traction",)).with_terms(*terms))


@pytest.mark.parametrize("offset", [-0.01, 0.01])
def test_mu_with_a_free_zero_is_the_true_one_where_that_with_none_is_not(offset: float) -> None:
    without = fitted(recorded(read(offset)))
    left_free = with_free_zero(without)
    assert left_free is not None
    (note,) = notes(without, left_free)
    given, wrong, zero, error, free, loose = map(float, re.findall(r"-?\d+\.\d+", note))
    assert abs(given - MU) > 2.0 * wrong
    assert abs(free - MU) < 2.0 * loose
    assert abs(zero - offset) < 2.0 * error


def test_nothing_is_said_of_a_torque_that_reads_zero_at_rest() -> None:
    assert with_free_zero(fitted(recorded(read(0.0, noise=0.0)))) is None


def test_nothing_is_said_where_the_zero_is_known_declared_or_fitted() -> None:
    ratio = read(0.01)
    for error in (0.001, np.nan):
        known = TorqueZero(0.0, error, 0.0, taken_off=True, unit=1.0, of_step=np.full(8, error))
        assert with_free_zero(fitted(recorded(ratio, known))) is None
    declared = replace(recorded(ratio), effects={"torque_offset": {"offset": 0.01}})
    assert with_free_zero(fitted(declared)) is None
    assert with_free_zero(fitted(recorded(ratio), "torque_offset")) is None


def test_nothing_is_said_where_mu_is_given_and_not_fitted() -> None:
    test = recorded(read(0.01))
    given = replace(test, options=replace(test.options, friction_coefficient=MU))
    assert with_free_zero(fitted(given)) is None


def test_the_interval_of_mu_holds_the_true_one_where_the_zero_is_not_known() -> None:
    mu = diagnose([recorded(read(0.004))], validate=None, progress=lambda what, part: None, quick=True).base["mu"]
    assert mu.low < MU < mu.high
    assert not MU - 0.002 < mu.value < MU + 0.002
