"""A test that was not fitted: where a law goes beyond what it was learnt on, and where it cannot be carried over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import Instruments, Plant, history

from twindisc_cli.laws.law import Law, warnings
from twindisc_cli.model.forward import ForwardModel, Prediction

COURSE = history((0.01, 0.02, 0.05, 0.08), 1)
LAW = Law("mu", "creepage", "linear", {"size": 0.1, "begin_percent": 0.0, "end_percent": 9.0}, valid=(0.5, 9.0))


@pytest.fixture(scope="module")
def foretold() -> Prediction:
    test = Instruments(channels=("traction",)).record(Plant(COURSE), np.random.default_rng(0))
    base = {"mu": np.array([0.6]), "K": np.array([0.0]), "convection_W_K": np.array([1.6])}
    return ForwardModel(test).predict(base)


def test_a_law_inside_its_range_is_used_without_a_word(foretold: Prediction) -> None:
    assert warnings({"friction": LAW}, foretold.state, "other") == []
    slightly = replace(LAW, valid=(1.1, 9.0))
    assert warnings({"friction": slightly}, foretold.state, "other") == [], "by less than a fiftieth of the range"


@pytest.mark.parametrize(("valid", "share"), [((0.5, 4.0), 50), ((1.5, 6.0), 50), ((6.0, 9.0), 75)])
def test_a_law_beyond_its_range_is_told_with_the_share_of_the_time(
    valid: tuple[float, float], share: int, foretold: Prediction
) -> None:
    (told,) = warnings({"friction": replace(LAW, valid=valid)}, foretold.state, "other")
    assert "friction" in told
    assert "other" in told
    assert f"{share} %" in told
    assert f"{valid[0]:g} to {valid[1]:g}" in told


def test_a_law_of_its_own_history_is_not_carried_over_in_silence(foretold: Prediction) -> None:
    law = Law("mu", "time", "linear", {"size": 0.1, "begin_s": 0.0, "end_s": 99.0}, transfer="same_history")
    (told,) = warnings({"settling": law}, foretold.state, "other")
    assert "cannot be carried over" in told
    assert "time" in told
