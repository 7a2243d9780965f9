"""Readings at the limit of an instrument: what repeats the largest number is no measurement, a round number is one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import history, rig

from twindisc_cli.measurement.channels import read_traction
from twindisc_cli.measurement.limit import LIMIT, at_limit
from twindisc_cli.model.experiment import Floats

COURSE = history((0.01, 0.02, 0.03, 0.005), 4)


def scattered(count: int, seed: int, step: float = 0.1, size: float = 0.004) -> Floats:
    """Readings of two levels, the second higher by a step."""
    level = 0.3 + step * (np.arange(count) >= count // 2)
    return np.asarray(np.round(level + size * np.random.default_rng(seed).standard_normal(count), 6))


@given(seed=st.integers(0, 199), limit=st.floats(0.35, 0.38), count=st.integers(40, 300), sign=st.sampled_from([1, -1]))
def test_all_readings_beyond_the_range_are_left_out(seed: int, limit: float, count: int, sign: int) -> None:
    true = scattered(count, seed)
    np.testing.assert_array_equal(at_limit(sign * np.minimum(true, limit)), true > limit)


@given(seed=st.integers(0, 199), limit=st.floats(0.398, 0.402))
def test_what_is_read_between_readings_at_the_limit_is_one_sided(seed: int, limit: float) -> None:
    true = scattered(200, seed)
    found = at_limit(np.minimum(true, limit))
    assert np.all(found[true >= limit])
    assert not found[:100].any()
    assert np.mean(found[100:]) >= np.mean(true[100:] >= limit)


@given(
    seed=st.integers(0, 199), digits=st.sampled_from([2, 3, 4, 6]), size=st.sampled_from([0.0, 1e-4, 0.004, 0.01]),
    step=st.sampled_from([0.0, 0.1]), count=st.integers(12, 300),
)  # fmt: skip
def test_readings_within_the_range_are_kept(seed: int, digits: int, size: float, step: float, count: int) -> None:
    """Round numbers, readings without scatter and those of one level too, and a zero that is read again and again."""
    readings = np.round(scattered(count, seed, step, size), digits)
    assert not at_limit(readings).any()
    assert not at_limit(np.concatenate([np.zeros(20), readings])).any()


@given(seed=st.integers(0, 199), count=st.sampled_from([300, 3000, 30000]), sign=st.sampled_from([1, -1]))
def test_a_long_record_of_four_digits_has_the_limit_that_a_short_one_has(seed: int, count: int, sign: int) -> None:
    """Every number of it is there many times."""
    true = sign * np.round(scattered(count, seed), 4)
    assert not at_limit(true).any()
    np.testing.assert_array_equal(at_limit(sign * np.minimum(sign * true, 0.36)), sign * true > 0.36)


@given(seed=st.integers(0, 199), quiet=st.sampled_from([0.02, -0.02, 0.001]), count=st.sampled_from([60, 300, 3000]))
def test_a_torque_of_rolling_that_hardly_changes_is_at_no_limit(seed: int, quiet: float, count: int) -> None:
    sliding = np.round(1.0 + 0.05 * np.random.default_rng(seed).standard_normal(count), 2)
    assert not at_limit(np.concatenate([np.full(count, quiet), sliding])).any()


def test_a_room_that_is_read_before_the_disc_warms_is_kept() -> None:
    warming = 293.15 + 30.0 * (1.0 - np.exp(-np.linspace(0.0, 3.0, 100)))
    assert not at_limit(np.round(np.concatenate([np.full(30, 293.15), warming]), 2)).any()


def test_an_empty_record_has_no_limit() -> None:
    assert not at_limit(np.empty(0)).any()


@pytest.mark.parametrize("limit", [0.36, 1.0])
def test_what_is_left_out_of_a_table_is_counted(limit: float) -> None:
    true = scattered(160, 1)
    time = COURSE.end_time[-1] * (np.arange(160) + 0.5) / 160
    creepage = 100.0 * COURSE.creepage[np.searchsorted(COURSE.end_time, time)]
    rows = zip(time, creepage, np.minimum(true, limit), strict=True)
    text = "time [s],creepage [%],traction ratio [1]\n" + "\n".join(f"{t},{c},{v}" for t, c, v in rows)
    samples, _, _, counted = read_traction(text.encode(), "t.csv", rig=rig(), history=COURSE)
    beyond = int(np.sum(true > limit))
    assert counted.left_out == ({LIMIT: beyond} if beyond else {})
    np.testing.assert_array_equal(samples.ratio, true[true <= limit])
