"""Faults of sensors, on a rig whose traction a FASTSIM of the score's makes: named, or noise, and no law in noise."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs import autoregressive, flickering, one_of
from score.contact import creepage_coefficients, hertz_ellipse
from score.traction import saturation

from twindisc_cli.definition import load
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis

Floats = NDArray[np.float64]
LOAD, RADIUS, YOUNG, POISSON = 72.0, 0.03, 206e9, 0.3
STEP_S = 300.0
SEEDS = one_of([1, 2, 3])
DEFINITION = """schema = 1
[test]
name = "sensor"
[rig]
normal_load_N = 72.0
mean_speed_rpm = {rpm}
disc1 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = inf }}
disc2 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }}
[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700
[history]
revolutions_per_iteration = {rpm}
steps = [
{steps}]
[measured]
log = "log.csv"
torque_zero = "as recorded"
torque_disc = 1
"""


@dataclass(frozen=True)
class Clean:
    """A log without any error: time [s], creepage [1], load [N] and T/N (sample,), and what is written of the steps."""

    time: Floats
    creepage: Floats
    load: Floats
    ratio: Floats
    steps: str


def clean(rng: np.random.Generator, percent: Floats, loads: Floats, every: float) -> Clean:
    """Steps of creepage [%] and load [N] (step,), sampled every so many seconds."""
    mu, time, rows = rng.uniform(0.3, 0.6), np.arange(every, STEP_S, every), []
    for i, (slip, load_) in enumerate(zip(percent / 100.0, loads, strict=True)):
        patch = hertz_ellipse(load_, YOUNG / (1.0 - POISSON**2) / 2.0, 2.0 / RADIUS, 1.0 / RADIUS)
        slope = YOUNG / 2.0 / (1.0 + POISSON) * patch.a * patch.b * creepage_coefficients(patch.a / patch.b)[0]
        ratio = mu * saturation(slope * slip / (mu * load_), "fastsim")
        rows.append(np.stack([i * STEP_S + time, *(np.full(len(time), v) for v in (slip, load_, ratio))]))
    steps = "".join(
        f"  {{ creepage_percent = {slip:.4f}, iterations = 5, normal_load_N = {load_} }},\n"
        for slip, load_ in zip(percent, loads, strict=True)
    )
    return Clean(*np.concatenate(rows, axis=1), steps)


def answer(folder: Path, log: Clean, ratio: Floats, *, rpm: float = 600.0, speeds: Floats | float = 0.0) -> Diagnosis:
    """What the loop says of a log with a recorded T/N (sample,); speeds: tachometers' errors (2, sample) [rpm]."""
    sign = np.array([[1.0], [-1.0]])
    turns = rpm * (1.0 + sign * log.creepage / 2.0) + speeds
    table = np.stack([log.time, *turns, ratio * log.load * RADIUS, log.load], axis=1)
    header = "time [s],speed 1 [rpm],speed 2 [rpm],torque [N m],normal load [N]"
    np.savetxt(folder / "log.csv", table, fmt="%.7g", delimiter=",", header=header, comments="")
    (folder / "test.toml").write_text(DEFINITION.format(rpm=rpm, steps=log.steps))
    test = load(folder / "test.toml").experiment
    return diagnose([test], validate=None, progress=lambda _what, _share: None)


def levels(rng: np.random.Generator) -> Floats:
    """Creepages [%] from partial slip to full sliding; of every second test there and back."""
    rising = np.round(np.geomspace(0.02, 6.0, 9) * np.exp(rng.uniform(-0.1, 0.1, 9)), 3)
    return np.concatenate([rising, rising[-2::-1]]) if rng.random() < 0.5 else rising


def names(found: Diagnosis) -> set[str]:
    """What is named, and what cannot be told from it."""
    every = [*found.effects, *found.laws]
    return {e.name for e in every} | {str(other.term) for e in every for other in e.alternatives}


@pytest.mark.parametrize("seed", SEEDS)
def test_a_zero_of_the_torque_is_named_under_loads_that_change(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    percent = levels(rng)
    log = clean(rng, percent, rng.permutation(np.resize([36.0, 72.0, 144.0], len(percent))), 5.0)
    zero = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.06) * LOAD / log.load
    found = answer(tmp_path, log, log.ratio + zero + 0.004 * rng.standard_normal(len(log.time)))
    assert [e.name for e in found.effects] == ["torque_offset"]
    assert not found.laws


@pytest.mark.parametrize("seed", SEEDS)
def test_a_gain_that_jumps_is_named(tmp_path: Path, seed: int) -> None:
    """Where the creepages go up and down; a coefficient of friction that jumps leaves partial slip as it was."""
    rng = np.random.default_rng(seed)
    rising = np.round(np.geomspace(0.02, 6.0, 9) * np.exp(rng.uniform(-0.1, 0.1, 9)), 3)
    log = clean(rng, np.concatenate([rising, rising[-2::-1]]), np.full(17, LOAD), 5.0)
    at, gain = rng.uniform(0.35, 0.65) * log.time[-1], rng.choice([-1.0, 1.0]) * rng.uniform(0.07, 0.15)
    recorded = log.ratio * np.where(log.time > at, 1.0 + gain, 1.0) + 0.004 * rng.standard_normal(len(log.time))
    found = answer(tmp_path, log, recorded)
    assert [law.law.quantity for law in found.laws] == ["torque_gain"]
    size = found.laws[0].parameters["size"]
    assert abs(size.value - gain) < 3.0 * size.std


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_of_the_tachometers_is_no_finding(tmp_path: Path, seed: int) -> None:
    """0.05 rpm of 400 on three exact steps."""
    rng = np.random.default_rng(seed)
    log = clean(rng, np.array([0.3, 1.0, 3.0]) * rng.uniform(0.7, 1.4), np.full(3, LOAD), 1.0)
    recorded = log.ratio + 0.004 * rng.standard_normal(len(log.time))
    found = answer(tmp_path, log, recorded, rpm=400.0, speeds=0.05 * rng.standard_normal((2, len(log.time))))
    assert names(found) == set()


@pytest.mark.parametrize("seed", one_of([5, 7, 8]))
def test_a_hump_of_the_friction_is_no_slow_noise(tmp_path: Path, seed: int) -> None:
    """Over the dissipated energy, under white noise: about trends in each step a slow part of the noise is likelier."""
    rng = np.random.default_rng(seed)
    percent = np.round(np.geomspace(0.05, 6.0, 9) * np.exp(rng.uniform(-0.1, 0.1, 9)), 3)
    log = clean(rng, percent, np.full(9, LOAD), 5.0)
    work = np.cumsum(log.ratio * log.creepage)
    place, width, size = rng.uniform(0.25, 0.7), rng.uniform(0.02, 0.08), rng.uniform(0.015, 0.05)
    hump = 1.0 + size * np.exp(-0.5 * ((work / work[-1] - place) / width) ** 2)
    found = answer(tmp_path, log, log.ratio * hump + 0.004 * rng.standard_normal(len(log.time)))
    assert [(law.law.quantity, law.law.covariate) for law in found.laws] == [("mu", "energy")]
    assert not found.effects


def slow(rng: np.random.Generator, samples: int, memory: float) -> Floats:
    """Noise of the torque over the load: 1/f, or a part with a memory of so many samples beside a white one."""
    if not memory:
        return 0.006 * flickering(rng, samples)
    wander = autoregressive(rng, samples, np.exp(-1.0 / memory))
    return np.asarray(0.006 * wander + 0.005 * rng.standard_normal(samples))


@pytest.mark.parametrize("draw", one_of([(0.0, 7, 1), (0.0, 12, 0), (150.0, 0, 1), (50.0, 15, 1)]), ids=str)
def test_slow_noise_is_no_law(tmp_path: Path, draw: tuple[float, int, int]) -> None:
    """A law was given in each, or an effect; that one is as likely is said in a note."""
    memory, seed, as_likely = draw
    rng = np.random.default_rng(seed)
    percent = levels(rng)
    log = clean(rng, percent, np.full(len(percent), LOAD), 5.0)
    found = answer(tmp_path, log, log.ratio + slow(rng, len(log.time), memory))
    assert names(found) == set()
    assert sum("explains as much as slow noise" in note for note in found.notes) == as_likely


@pytest.mark.long
@pytest.mark.parametrize("memory", [0.0, 50.0], ids=["1/f", "a slow part beside white"])
def test_noise_that_wanders_is_no_finding(tmp_path: Path, memory: float) -> None:
    """In one of thirty draws of 1/f noise a law was given, in two of twenty of a slow part an effect."""
    told, wandering = [], 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        percent = levels(rng)
        log = clean(rng, percent, np.full(len(percent), LOAD), 5.0)
        found = answer(tmp_path, log, log.ratio + slow(rng, len(log.time), memory))
        told += [e.strength for e in (*found.effects, *found.laws)]
        wandering += any("the noise of the traction wanders" in note for note in found.notes)
    assert len(told) <= 1
    assert "established" not in told
    assert wandering >= 3
