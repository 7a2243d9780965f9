"""What the sensors of the score's rig make of the truth: sampling, noise, drift, outliers, quantisation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import lfilter

from .heat import Plant, thermocouple
from .hidden import COVARIATES, Hidden
from .rig import Rig, Trace

Floats = NDArray[np.float64]
Channels = dict[str, Floats]
CHANNELS = ("traction", "profile", "temperature")
WEIGHED, LOGGED = 0.2, 0.2
"""Shares of the rigs whose discs are weighed beside the profile, and that give a log in place of T/N."""
DENSITY = 7800.0  # kg/m3


@dataclass(frozen=True)
class Plan:
    """When and where is measured, and with which noise.

    time: samples of traction and temperature [s]; y [m] and iterations completed of each profile stop, of `discs`.
    weighed: iterations completed at each weighing. tachometer: standard deviation of the speed of a disc in the rig's
    log, relative; none where no log is given. balance: of a weighing [kg].
    sigma: standard deviation per channel (1, m, K). rho: correlation of neighbours. drift: length of the slow
    drift in noise units. outliers: share of samples. quantum: of the last digit.
    """

    traction_time: Floats
    temperature_time: Floats
    y: Floats
    stops: tuple[int, ...]
    discs: tuple[int, ...]
    weighed: tuple[int, ...]
    balance: float
    tachometer: float
    sigma: dict[str, float]
    rho: dict[str, float]
    drift: dict[str, float]
    outliers: dict[str, float]
    quantum: dict[str, float]

    def time(self, channel: str) -> Floats:
        """Of the samples of `channel` [s]."""
        return self.traction_time if channel == "traction" else self.temperature_time


def draw_plan(rng: Generator, rig: Rig, *, correlated: bool, stops: bool, discs: tuple[int, ...]) -> Plan:
    """Draw how a test is measured; `correlated` noise in time, profiles at several `stops`."""
    iterations = sum(rig.iterations)
    samples = int(rng.integers(6, 11))
    half = 1.25 * max(rig.half_width(), rig.ellipse().b) + rng.uniform(0.3e-3, 0.6e-3)
    half, spacing = round(half, 4), 5e-6 * round(float(rng.choice([1, 1, 2])))
    last = rng.choice(np.arange(iterations // 6, iterations - 1), size=int(rng.integers(3, 6)), replace=False)
    weighed = rng.choice(np.arange(1, iterations), size=int(rng.integers(3, 8)), replace=False)
    return Plan(
        traction_time=_times(rng, rig, samples),
        temperature_time=_times(rng, rig, samples),
        y=np.asarray(np.arange(-round(half / spacing), round(half / spacing) + 1) * spacing, dtype=np.float64),
        stops=(*(sorted(int(i) for i in last) if stops else ()), iterations),
        discs=discs,
        weighed=(*sorted(int(i) for i in weighed), iterations) if rng.random() < WEIGHED else (),
        balance=rng.uniform(0.01, 0.1) * 1e-6,
        tachometer=rng.uniform(2e-5, 1.5e-4) if rng.random() < LOGGED else 0.0,
        sigma={
            "traction": rng.uniform(0.003, 0.01), "profile": rng.uniform(0.05e-6, 0.15e-6),
            "temperature": rng.uniform(0.08, 0.3),
        },
        rho={
            "traction": rng.uniform(0.3, 0.75) if correlated else 0.0,
            "profile": rng.uniform(0.2, 0.6) if rng.random() < 0.3 else 0.0,
            "temperature": rng.uniform(0.3, 0.75) if correlated else 0.0,
        },
        drift={name: float(rng.uniform(0.0, 1.0)) for name in CHANNELS},
        outliers={name: float(rng.uniform(0.0, 0.003 if name == "profile" else 0.008)) for name in CHANNELS},
        quantum={"traction": 5e-4, "profile": 5e-9, "temperature": float(rng.choice([0.01, 0.05, 0.1]))},
    )  # fmt: skip


def _times(rng: Generator, rig: Rig, samples: int) -> Floats:
    """Sample times [s]: even or jittered, a few missing, none on the border of an iteration."""
    every = np.repeat(np.diff(rig.ends, prepend=0.0), samples) / samples
    time = np.cumsum(every) - 0.4 * every
    time = time + rng.uniform(0.0, 0.3) * every * rng.uniform(-1.0, 1.0, time.size)
    return np.asarray(np.round(time[rng.random(time.size) > rng.uniform(0.0, 0.08)], 1))


def read(rig: Rig, trace: Trace, hidden: Sequence[Hidden], plan: Plan) -> Channels:
    """What noiseless sensors read: T/N (sample,), height [m] (profile * y,), rise [K] (sample,)."""
    ratio = trace.ratio[_within(trace, plan.traction_time)]
    load = rig.of_step(rig.loads, plan.traction_time)
    for h in hidden:
        ratio = h.read_traction(plan.traction_time, ratio * load) / load if h.read_traction else ratio
        if h.shift_traction:
            ratio = ratio + h.shift_traction(covariates(trace, plan.traction_time))
    rise = trace.rise
    if not any(h.marches for h in hidden):
        rise = Plant(capacity=rig.capacity, convection=rig.convection, hidden=hidden).run(trace.time, trace.power)
    rise = thermocouple(trace.time, rise, sum(h.lag for h in hidden))
    for h in hidden:
        rise = h.read_temperature(trace.time, rise) if h.read_temperature else rise
    shown = np.interp(plan.temperature_time, trace.time, rise)
    for h in hidden:
        if h.shift_temperature:
            shown = shown + h.shift_temperature(covariates(trace, plan.temperature_time))
    return {"traction": ratio, "profile": _heights(rig, trace, hidden, plan), "temperature": shown}


def _heights(rig: Rig, trace: Trace, hidden: Sequence[Hidden], plan: Plan) -> Floats:
    """Of every stop and disc, one after the other (profile * y,) [m]."""
    heights = []
    for stop in plan.stops:
        for disc in plan.discs:
            height = np.interp(plan.y, trace.y, -trace.profiles[stop][disc - 1], left=0.0, right=0.0)
            for h in hidden:
                height = h.read_profile(plan.y, height) if h.read_profile else height
                height = height + h.shift_profile(plan.y / rig.edge) if h.shift_profile else height
            heights.append(height)
    return np.concatenate(heights)


def weigh(rng: Generator, rig: Rig, trace: Trace, plan: Plan) -> Floats:
    """Loss of mass at every weighing of every disc, one after the other (weighing * disc,) [kg]."""
    width = float(trace.y[1] - trace.y[0]) * 2.0 * np.pi * rig.radius * DENSITY
    lost = [trace.profiles[stop][disc - 1].sum() * width for stop in plan.weighed for disc in plan.discs]
    return np.array(lost) + plan.balance * rng.standard_normal(len(lost))


def _within(trace: Trace, time: Floats) -> NDArray[np.intp]:
    """The small step in which each `time` [s] lies."""
    return np.searchsorted(trace.time, time, side="left") - 1


def covariates(trace: Trace, time: Floats) -> dict[str, Floats]:
    """Every covariate of a law at samples of some `time` [s]."""
    within = _within(trace, time)
    return {name: trace.moments[place][within] for name, place in COVARIATES.items()}


def _correlation(plan: Plan, channel: str, samples: int) -> tuple[Floats, Floats]:
    """Of each sample with the one before it, and where a new record begins, (sample,)."""
    first = np.zeros(samples, dtype=bool)
    first[0] = True
    rho = plan.rho[channel]
    if channel == "profile":
        first[:: plan.y.size] = True
        neighbour = np.full(samples, rho)
    else:
        gap = np.diff(plan.time(channel), prepend=0.0)
        neighbour = rho ** (gap / np.median(gap)) if rho else np.zeros(samples)
    return np.where(first, 0.0, neighbour), first.astype(float)


def whiten(plan: Plan, channel: str, signal: Floats) -> Floats:
    """`signal` in units of the independent part of the noise, (sample,)."""
    rho, _ = _correlation(plan, channel, signal.size)
    before = np.concatenate([[0.0], signal[:-1]])
    return np.asarray((signal - rho * before) / (plan.sigma[channel] * np.sqrt(1.0 - rho**2)))


def noise(rng: Generator, plan: Plan, channel: str, samples: int) -> Floats:
    """The noise of one channel, correlated as planned, with its slow drift and outliers."""
    rho, _ = _correlation(plan, channel, samples)
    fresh = rng.standard_normal(samples) * np.sqrt(1.0 - rho**2)
    if plan.rho[channel] and channel == "profile":
        parts = fresh.reshape(-1, plan.y.size)
        value = np.concatenate([lfilter([1.0], [1.0, -plan.rho[channel]], part) for part in parts])
    else:
        value = np.array(fresh)
        for i in range(1, samples if plan.rho[channel] else 0):
            value[i] += rho[i] * value[i - 1]
    value *= plan.sigma[channel]
    drift = np.cos(np.linspace(0.0, rng.uniform(2.0, 8.0), samples) + rng.uniform(0.0, 6.0))
    value += drift * plan.drift[channel] / np.linalg.norm(whiten(plan, channel, drift))
    struck = rng.random(samples) < plan.outliers[channel]
    size = rng.uniform(4.0, 8.0, samples) * rng.choice([-1.0, 1.0], samples)
    return np.asarray(value + struck * size * plan.sigma[channel])
