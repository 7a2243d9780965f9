"""Real records as tests: those of the project's data, and those of ../shared/measured where that is there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.definition import load
from twindisc_cli.model.experiment import (
    Disc,
    Experiment,
    History,
    Measured,
    Options,
    Rig,
    TemperatureSamples,
    Thermal,
    TractionSamples,
)

Floats = NDArray[np.float64]
PROJECT = Path(__file__).parents[2]
SHARED = PROJECT.parent / "shared" / "measured"
SWEEPS = PROJECT / "tests" / "reference" / "etm_sweeps.csv"
LATER_SWEEPS = SHARED / "etm_sweeps_21-25_101-105.csv"
STEEL: Mapping[str, float] = MappingProxyType(
    {"youngs_modulus": 207e9, "poisson_ratio": 0.29, "hardness": 760 * 9.80665e6}
)
MEAN_OF = 10
"""Seconds over which records of one sample a second are averaged."""
HELD = 2.0
"""Creepage of a pin that is held fast on a disc that turns; the rolling speed is half of the disc's."""


def shipped(name: str) -> Experiment:
    """A test as it is shipped."""
    return load(PROJECT / "configs" / f"{name}.toml").experiment


@cache
def sweeps() -> list[Experiment]:
    """Twenty traction sweeps of a lubricated ball on a flat disc; creepages in steps of equal ratio."""
    return _sweeps(np.loadtxt(SWEEPS, delimiter=",", comments="#", skiprows=4))


@cache
def later_sweeps() -> list[Experiment]:
    """Ten later sweeps of the same record."""
    table = np.loadtxt(LATER_SWEEPS, delimiter=",", comments="#", skiprows=2)
    return _sweeps(np.stack([table[:, 0], table[:, 3], table[:, 4] / table[:, 5]], axis=1))


def _sweeps(table: Floats) -> list[Experiment]:
    """Tests of a table of sweep, creepage [%] and T/N (sample, 3)."""
    number, creepage, ratio = table.T
    rig = Rig(Disc(9.525e-3, 9.525e-3, **STEEL), Disc(np.inf, np.inf, **STEEL), normal_load=1647.0, rolling_speed=0.025)
    tests = []
    for sweep in np.unique(number):
        inside = (number == sweep) & (creepage > 0.02)
        x, y = creepage[inside] / 100.0, ratio[inside]
        levels = np.geomspace(2e-4, 0.2, 25)
        near = np.argmin(np.abs(np.log(x[:, None] / levels)), axis=1)
        used, step = np.unique(near, return_inverse=True)
        unknown, ones = np.full(len(x), np.nan), np.ones(len(used))
        course = History(np.arange(len(used)), levels[used], 84.0 * ones, 4200.0 * ones, np.nan * ones)
        measured = Measured(traction=TractionSamples(unknown, step, x, y, unknown))
        tests.append(Experiment(f"sweep {sweep:.0f}", "", rig, course, Options(), None, measured=measured))
    return tests


@cache
def repeat(number: int) -> Experiment:
    """One of two repeats of a dry pin on a disc (TE67): friction, and the temperature of the specimen.

    Rows in which the disc runs up or down are left out. The heat capacity is assumed; convection and share of the heat
    are found.
    """
    table = np.loadtxt(SHARED / f"te67_PPS30PTFE_60N_{number}.csv", delimiter=",", comments="#", skiprows=2)
    time, ratio, warmth, speed = table[:, 0], table[:, 3], table[:, 5] + 273.15, table[:, 7]
    full = float(np.median(speed))
    running = np.flatnonzero(speed > 0.95 * full)
    inside = slice(running[0], running[-1] + 1)
    rows = _averaged(np.stack([time, ratio, warmth], axis=1)[inside])
    thermal = Thermal(warmth[0], 100.0, float(rows[0, 2]))
    return _pin_on_disc(f"te67-{number}", rows[:, 0] - time[inside][0], rows[:, 1], (full, 60.0), (thermal, rows[:, 2]))


@cache
def long_pin() -> Experiment:
    """A pin on a disc (MTM) of 7,500 s."""
    table = np.loadtxt(SHARED / "mtm_pod_timed_7500s_a.csv", delimiter=",", comments="#", skiprows=2)
    rows = _averaged(table[:, [0, 3]])
    return _pin_on_disc("mtm-pin", rows[:, 0], rows[:, 1], (0.2, 11.75), None)


def _averaged(rows: Floats) -> Floats:
    """Means over MEAN_OF rows (row, column)."""
    whole = len(rows) // MEAN_OF * MEAN_OF
    return np.asarray(rows[:whole].reshape(-1, MEAN_OF, rows.shape[1]).mean(axis=1))


def _pin_on_disc(
    name: str,
    time: Floats,
    ratio: Floats,
    drive: tuple[float, float],
    warmth: tuple[Thermal, Floats] | None,
) -> Experiment:
    """A test of a pin on a disc: sliding speed [m/s] and load [N] in `drive`; in iterations of a minute."""
    speed, load_ = drive
    rig = Rig(Disc(np.inf, np.inf, **STEEL), Disc(9.525e-3, 9.525e-3, **STEEL), load_, 0.5 * speed)
    count = int(np.ceil((time[-1] + 1.0) / 60.0))
    ones, unknown = np.ones(count), np.full(len(time), np.nan)
    turned = 60.0 * rig.rolling_speed / (2.0 * np.pi * rig.disc2.rolling_radius)
    course = History(np.zeros(count, dtype=np.int64), HELD * ones, 60.0 * ones, turned * ones, np.nan * ones)
    step = np.zeros(len(time), dtype=np.int64)
    measured = Measured(
        traction=TractionSamples(time, step, np.full(len(time), HELD), ratio, unknown),
        temperature=None if warmth is None else TemperatureSamples(time, warmth[1]),
    )
    return Experiment(name, "", rig, course, Options(), None if warmth is None else warmth[0], measured=measured)


@dataclass(frozen=True)
class Group:
    """Tests of one rig: on which of them (numbers from 0) something is learnt, to be predicted on the others."""

    tests: tuple[Experiment, ...]
    learnt: tuple[tuple[int, ...], ...]


@cache
def records() -> Mapping[str, Callable[[], Experiment]]:
    """Every single record that is there, by its name."""
    found: dict[str, Callable[[], Experiment]] = {
        name: partial(shipped, name) for name in ("eurosprinter", "lewis2004", "mtm_running_in")
    }
    found |= {f"etm-sweep-{number}": partial(_sweep, number) for number in (1, 10, 20)}
    if SHARED.is_dir():
        found |= {"te67-1": partial(repeat, 1), "te67-2": partial(repeat, 2), "mtm-pin": long_pin}
    return MappingProxyType(found)


def _sweep(number: int) -> Experiment:
    return sweeps()[number - 1]


def groups() -> dict[str, Callable[[], Group]]:
    """Every group of tests that is there, by its name."""
    found: dict[str, Callable[[], Group]] = {"etm-sweeps": _sweeps_by_five}
    if SHARED.is_dir():
        found |= {
            "etm-later": lambda: Group((*sweeps(), *later_sweeps()), (tuple(range(20)),)),
            "te67": lambda: Group((repeat(1), repeat(2)), ((0,), (1,))),
        }
    return found


def _sweeps_by_five() -> Group:
    """The first five, the last five, and every fourth of the twenty sweeps."""
    return Group(tuple(sweeps()), (tuple(range(5)), tuple(range(15, 20)), tuple(range(0, 20, 4))))
