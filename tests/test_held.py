"""Readings that a recorder holds: rows that repeat them are no measurements, equal neighbours by few digits are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import history, rig

from twindisc_cli.measurement.channels import read_temperature, read_traction
from twindisc_cli.measurement.held import FEWEST_READINGS, HELD, frozen, repeated
from twindisc_cli.model.experiment import Floats

COURSE = history((0.01, 0.02, 0.03), 4)


def readings(count: int, seed: int = 0) -> Floats:
    return 0.3 + 0.004 * np.random.default_rng(seed).standard_normal(count)


def held(values: Floats, rows: float, count: int) -> Floats:
    """What a clock writes that ticks so many times from one reading to the next."""
    return np.asarray(np.round(values[(np.arange(count) / rows).astype(np.int64)], 9))


@given(rows=st.floats(2.0, 40.0), seed=st.integers(0, 99), count=st.integers(40, 200))
def test_the_first_row_of_each_reading_is_kept(rows: float, seed: int, count: int) -> None:
    values = held(readings(count, seed), rows, int(rows * count))
    kept = values[~repeated(values)]
    np.testing.assert_array_equal(kept, np.round(readings(count, seed), 9)[: len(kept)])


@given(
    digits=st.sampled_from([0, 1, 2]), noise=st.floats(0.0, 1.0), rise=st.floats(-30.0, 30.0), seed=st.integers(0, 99),
    end=st.sampled_from([1.0, 3.0]),
)  # fmt: skip
def test_a_number_of_few_digits_is_neither_held_nor_frozen(
    digits: int, noise: float, rise: float, seed: int, end: float
) -> None:
    """A thermometer that writes whole degrees, or tenths, repeats itself, most where the disc's temperature stands."""
    time = np.linspace(0.0, end, 400)
    kelvin = 300.0 + rise * (1.0 - np.exp(-3.0 * time)) + noise * np.random.default_rng(seed).standard_normal(400)
    assert not repeated(np.round(kelvin, digits)).any()
    assert not frozen(np.round(kelvin, digits)).any()


@given(seed=st.integers(0, 99), changes=st.sampled_from([0.2, 0.35, 0.5]))
def test_readings_that_last_as_chance_has_it_are_not_held(seed: int, changes: float) -> None:
    """Two or three rows as a rule, but any number: a coarse number that flickers, whatever lies between two of them."""
    random = np.random.default_rng(seed)
    level = np.cumsum((random.uniform(size=400) < changes) * random.choice([-2.0, -1.0, 1.0, 2.0], 400))
    assert not repeated(0.3 + 0.01 * level).any()


def test_few_readings_say_nothing_of_the_recorder() -> None:
    values = held(readings(40), 5, 5 * FEWEST_READINGS)
    assert not repeated(values).any()
    assert repeated(held(readings(40), 5, 5 * (FEWEST_READINGS + 3))).any()


@given(begin=st.integers(0, 150), rows=st.integers(5, 60), seed=st.integers(0, 99))
def test_what_a_dead_sensor_repeats_is_left_out(begin: int, rows: int, seed: int) -> None:
    """All but its first row, which was read before it died."""
    values = np.round(readings(220, seed), 9)
    values[begin : begin + rows] = values[begin]
    repeats = np.arange(220)[begin + 1 : begin + rows]
    np.testing.assert_array_equal(np.flatnonzero(frozen(values)), repeats)


def test_a_rig_at_rest_and_an_empty_record_are_not_frozen() -> None:
    assert not frozen(np.concatenate([readings(40, 1), np.zeros(20), readings(40, 2)])).any()
    assert not frozen(np.empty(0)).any()


@pytest.mark.parametrize("kind", ["traction", "temperature"])
def test_what_is_left_out_of_a_table_is_counted(kind: str) -> None:
    count = 240
    time = COURSE.end_time[-1] * (np.arange(count) + 0.5) / count
    values = held(readings(count), 4, count)
    if kind == "traction":
        creepage = 100.0 * COURSE.creepage[np.searchsorted(COURSE.end_time, time)]
        rows = zip(time, creepage, values, strict=True)
        text = "time [s],creepage [%],traction ratio [1]\n" + "\n".join(f"{t},{c},{v}" for t, c, v in rows)
        samples, _, _, counted = read_traction(text.encode(), "t.csv", rig=rig(), history=COURSE)
        taken = samples.ratio
    else:
        text = "time [s],temperature [K]\n" + "\n".join(f"{t},{1e3 * v}" for t, v in zip(time, values, strict=True))
        recorded, counted = read_temperature(text.encode(), "t.csv", history=COURSE)
        taken = 1e-3 * recorded.temperature
    assert counted.left_out == {HELD: count - count // 4}
    assert counted.used == len(taken) == count // 4
    np.testing.assert_allclose(taken, values[::4])
