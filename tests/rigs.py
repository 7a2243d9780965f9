"""Synthetic twin-disc tests for the model and the loop, made with closed forms and numpy alone.

In full sliding T = mu N, P = mu N v V; the disc follows C dT/dt = P - hS (T - T_env) step by step; what is worn off is
the segment that a chord cuts from the crowned disc, w^3 = 12 S R with S = K E / (2 pi R H). Nothing of the program is
used but its records, so that data and model share no shortcut.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from twindisc_cli.model.experiment import (
    Disc,
    Experiment,
    History,
    Measured,
    Options,
    ProfileSamples,
    Rig,
    TemperatureSamples,
    Thermal,
    TractionSamples,
)
from twindisc_cli.physics.half_space import rolling

Floats = NDArray[np.float64]
VICKERS = 9.80665e6
RADIUS = 0.03
LOAD = 72.0
SPEED = 9.42
HARDNESS = 700.0 * VICKERS
ROOM = 293.15


def one_of(values: Sequence[Any]) -> list[Any]:
    """Parameters of a test, of which all but the first are left to `make test-long`."""
    return [values[0], *(pytest.param(value, marks=pytest.mark.long) for value in values[1:])]


def rig(*, load: float = LOAD, speed: float = SPEED, radius: float = RADIUS, crown: float = RADIUS) -> Rig:
    """A straight disc on a crowned one, of the size of Chevalier et al. (2006), steel on steel."""
    steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": HARDNESS}
    return Rig(Disc(radius, np.inf, **steel), Disc(radius, crown, **steel), normal_load=load, rolling_speed=speed)


def solve_rolling(
    *,
    shear_modulus: float,
    poisson: float,
    creepage_x: float = 0.0,
    creepage_y: float = 0.0,
    spin: float = 0.0,
    **given: Any,
) -> rolling.Rolling:
    """The exact solver, with discs and creepage by their numbers."""
    unlike = {name: given.pop(name) for name in ("stiffness_difference", "layer_compliance") if name in given}
    discs, creepage = rolling.Discs(shear_modulus, poisson, **unlike), rolling.Creepage(creepage_x, creepage_y, spin)
    return rolling.solve(discs=discs, creepage=creepage, **given)


def history(creepage: Sequence[float], iterations: int | Sequence[int], *, duration: float = 84.0) -> History:
    """Steps of constant creepage, `duration` [s] and 4200 revolutions an iteration."""
    step = np.repeat(np.arange(len(creepage)), iterations)
    ones = np.ones(len(step))
    return History(step, np.asarray(creepage, dtype=float)[step], duration * ones, 4200.0 * ones, np.nan * ones)


def experiment(history: History, **changes: object) -> Experiment:
    """A test without measurements unless these are among the changes."""
    plain = Experiment("small", "", rig(), history, Options(), Thermal(ROOM, 100.0, ROOM))
    return replace(plain, **changes)  # type: ignore[arg-type]


def spread(history: History, each: int) -> Floats:
    """Sample times [s], `each` an iteration, none of them on its ends."""
    begin = history.end_time - history.duration
    return np.asarray((begin[:, None] + history.duration[:, None] * (np.arange(each) + 0.6) / each).ravel())


def running(history: History, time: Floats) -> NDArray[np.int64]:
    """The iteration that runs at each time."""
    return np.asarray(np.minimum(np.searchsorted(history.end_time, time), len(history.step) - 1), dtype=np.int64)


def autoregressive(rng: np.random.Generator, count: int, correlation: float) -> Floats:
    """Noise of unit variance in which each sample is correlated with the one before it."""
    fresh, found = rng.standard_normal(count), np.empty(count)
    found[0] = fresh[0]
    for i in range(1, count):
        found[i] = correlation * found[i - 1] + np.sqrt(1.0 - correlation**2) * fresh[i]
    return found


def flickering(rng: np.random.Generator, samples: int) -> Floats:
    """1/f noise of unit variance, made of waves: as much power in every octave."""
    frequency = np.fft.rfftfreq(samples)[1:]
    waves = (rng.standard_normal(len(frequency)) + 1j * rng.standard_normal(len(frequency))) / np.sqrt(frequency)
    values = np.fft.irfft(np.concatenate([[0.0], waves]), samples)
    return np.asarray(values / values.std())


def traction_samples(history: History, time: Floats, ratio: Floats, uncertainty: float = np.nan) -> TractionSamples:
    """Samples at the history's own creepage."""
    at = running(history, time)
    return TractionSamples(time, history.step[at], history.creepage[at], ratio, np.full(len(time), uncertainty))


@dataclass(frozen=True)
class Plant:
    """What is true of a synthetic test in full sliding.

    mu over (time [s], creepage, cycles), each (instant,); heat into the disc beside the contact [W] over time; lag of
    the thermocouple [s]; offset of the recorded T/N; displaced: where the middle of the track lies [m].
    """

    history: History
    mu: Callable[[Floats, Floats, Floats], Floats] = field(default=lambda time, creepage, cycles: 0.6 + 0.0 * time)
    heat: Callable[[Floats], Floats] = field(default=lambda time: 0.0 * time)
    wear_coefficient: float = 1e-3
    capacity: float = 100.0
    convection: float = 1.6
    lag: float = 0.0
    offset: float = 0.0
    displaced: float = 0.0
    load: float = LOAD
    speed: float = SPEED

    @property
    def instants(self) -> Floats:
        """Middles of half-second intervals [s]."""
        return np.asarray(np.arange(0.25, self.history.end_time[-1], 0.5))

    def traction(self, time: Floats) -> Floats:
        """T/N."""
        at = running(self.history, time)
        return self.mu(time, self.history.creepage[at], 50.0 * time) + self.offset

    @property
    def power(self) -> Floats:
        """P [W] at the instants."""
        at = running(self.history, self.instants)
        sliding = self.history.creepage[at] * self.speed
        return (self.traction(self.instants) - self.offset) * self.load * sliding

    def temperature(self, time: Floats) -> Floats:
        """Recorded disc temperature [K]: each half second is an exponential, the thermocouple follows likewise."""
        level = ROOM + (self.power + self.heat(self.instants)) / self.convection
        kept = np.exp(-0.5 * self.convection / self.capacity)
        follows = -np.expm1(-0.5 / self.lag) if self.lag else 1.0
        disc, shown = np.empty(len(level) + 1), np.empty(len(level) + 1)
        disc[0] = shown[0] = ROOM
        for i, target in enumerate(level):
            disc[i + 1] = target + (disc[i] - target) * kept
            mean = 0.5 * (disc[i] + disc[i + 1]) if self.lag else disc[i + 1]
            shown[i + 1] = shown[i] + (mean - shown[i]) * follows
        return np.interp(time, np.concatenate([[0.0], self.instants + 0.25]), shown)

    def section(self, time: float) -> float:
        """Worn section [m2]."""
        energy = float(np.sum(self.power[self.instants < time]) * 0.5)
        return self.wear_coefficient * energy / (2.0 * np.pi * RADIUS * HARDNESS)

    def height(self, y: Floats, time: float) -> Floats:
        """Height of the segment cut off [m]."""
        half = 0.5 * np.cbrt(12.0 * self.section(time) * RADIUS)
        return np.asarray(np.minimum((y - self.displaced) ** 2 - half**2, 0.0) / (2.0 * RADIUS))


@dataclass(frozen=True)
class Instruments:
    """How a test is measured: samples an iteration, noise of each channel (1, m, K) and its correlation in time."""

    each: int = 6
    traction: float = 0.004
    profile: float = 0.4e-6
    temperature: float = 0.15
    correlation: float = 0.0
    channels: tuple[str, ...] = ("traction", "profile", "temperature")

    def record(self, plant: Plant, rng: np.random.Generator, **changes: object) -> Experiment:
        """Measure a plant."""
        time = spread(plant.history, self.each)
        y = np.linspace(-2.2e-3, 2.2e-3, 221)
        end = float(plant.history.end_time[-1])

        def noisy(values: Floats, size: float) -> Floats:
            return np.asarray(values + size * autoregressive(rng, len(values), self.correlation))

        measured = Measured(
            traction=traction_samples(plant.history, time, noisy(plant.traction(time), self.traction)),
            profile=ProfileSamples(
                y,
                plant.height(y, end) + self.profile * rng.standard_normal(len(y)),
                np.full(len(y), 2),
                np.full(len(y), len(plant.history.step)),
            ),
            temperature=TemperatureSamples(time, noisy(plant.temperature(time), self.temperature)),
            provenance="synthetic",
        )
        kept = {c: getattr(measured, c) if c in self.channels else None for c in ("traction", "profile", "temperature")}
        plain = {"rig": rig(load=plant.load, speed=plant.speed), "options": Options(contact="half_space")}
        return experiment(plant.history, measured=replace(measured, **kept), **{**plain, **changes})
