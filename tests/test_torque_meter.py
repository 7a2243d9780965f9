"""Faults of the torque meter are torques: what they make of T/N falls with the load of the step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import LOAD, RADIUS, experiment, history

from twindisc_cli.model.forward import ForwardModel

LOADS = np.array([0.5, 1.0, 2.0])
ZERO_NM, DRIFT_NM_H = 0.03, -0.2


@pytest.mark.parametrize(
    ("declared", "torque"),
    [
        ({"torque_offset": {"offset": ZERO_NM / (LOAD * RADIUS)}}, lambda t: ZERO_NM),
        ({"sensor_drift": {"per_hour": DRIFT_NM_H / (LOAD * RADIUS)}}, lambda t: DRIFT_NM_H * t / 3600.0),
    ],
)
def test_a_zero_in_newton_metres_counts_by_the_load(declared: dict, torque: object) -> None:
    course = replace(history((0.05, 0.05, 0.05), 2), load_factor=np.repeat(LOADS, 2))
    base = {"mu": np.array([0.4])}
    faulty, clean = (
        ForwardModel(experiment(course, effects=effects)).predict(base).state for effects in (declared, {})
    )
    at_load = LOAD * course.load_factor[ForwardModel(experiment(course)).points.iteration]
    added = (faulty.traction_ratio - clean.traction_ratio)[0] * at_load * RADIUS
    assert added == pytest.approx(np.broadcast_to(torque(clean.time), added.shape), rel=1e-9)
