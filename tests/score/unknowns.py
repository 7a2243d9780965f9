"""Hidden effects that are in no catalogue, each with the channel it shows in and what the leftover depends on."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, log, pi, sin

import numpy as np
from numpy.random import Generator

from .effects import Drawn
from .hidden import Hidden
from .rig import Rig, Trace


def _window(rng: Generator, rig: Rig, base: Trace) -> tuple[float, float]:
    """Two times that lie inside steps, one to three steps apart."""
    ends = np.concatenate([[0.0], np.cumsum(rig.iterations)]) * rig.duration
    first = int(rng.integers(1, max(len(ends) - 3, 2)))
    last = min(first + int(rng.integers(0, 3)), len(ends) - 2)
    begin = ends[first] + rng.uniform(0.2, 0.6) * (ends[first + 1] - ends[first])
    end = ends[last] + rng.uniform(0.3, 0.8) * (ends[last + 1] - ends[last])
    return float(begin), float(max(end, begin + 1.2 * rig.duration))


def friction_burst(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Friction is higher (or lower) between two times, whatever the creepage."""
    (begin, end), sign = _window(rng, rig, base), 1.0 if rng.random() < 0.7 else -1.0
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 + sign * size * (begin < m.time < end)), 0.6)


def friction_oscillation(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Friction swings with time."""
    period, phase = rig.duration * rng.uniform(2.3, 9.0), rng.uniform(0.0, 2.0 * pi)
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 + size * sin(2.0 * pi * m.time / period + phase)), 0.5)


def friction_dip(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Friction is lower about one creepage, as in a resonance of the rig."""
    levels = np.unique(rig.creepage)
    middle = log(levels[int(rng.integers(levels.size // 3, levels.size - 1))])
    width = rng.uniform(0.15, 0.35)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 - size * exp(-0.5 * ((log(max(m.creepage, 1e-9)) - middle) / width) ** 2))

    return Drawn(at, 0.7)


def wear_taper(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K grows from one side of the track to the other, as in a disc hardened unevenly."""
    sign, half = 1.0 if rng.random() < 0.5 else -1.0, rig.half_width()

    def at(size: float) -> Hidden:
        return Hidden(wear_across=lambda y: np.clip(1.0 + sign * size * y / half, 0.02, None))

    return Drawn(at, 0.95)


def profile_groove(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A scratch runs around the track."""
    half = rig.half_width()
    place, width = rng.uniform(-0.7, 0.7) * half, rng.uniform(0.03, 0.1) * half

    def at(size: float) -> Hidden:
        return Hidden(read_profile=lambda y, h: h - size * np.exp(-0.5 * ((y - place) / width) ** 2))

    return Drawn(at, 10e-6)


def profile_waves(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The track carries waves across it, as a ground disc does."""
    half = rig.half_width()
    length, phase = half * rng.uniform(0.25, 0.6), rng.uniform(0.0, 2.0 * pi)

    def at(size: float) -> Hidden:
        def waves(y: np.ndarray, h: np.ndarray) -> np.ndarray:
            inside = np.clip(1.0 - (y / (0.95 * half)) ** 2, 0.0, None) ** 0.5
            return np.asarray(h + size * inside * np.cos(2.0 * pi * y / length + phase))

        return Hidden(read_profile=waves)

    return Drawn(at, 5e-6)


def wear_window(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K is higher between two times and returns to what it was, as when dust got in."""
    begin, end = rng.uniform(0.3, 0.5) * base.time[-1], rng.uniform(0.6, 0.8) * base.time[-1]
    return Drawn(lambda size: Hidden(wear=lambda m: 1.0 + size * (begin < m.time < end)), 12.0)


def ambient_cycle(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The room's air conditioning swings."""
    period, phase = rng.uniform(400.0, 1500.0), rng.uniform(0.0, 2.0 * pi)
    return Drawn(lambda size: Hidden(environment=lambda t: size * sin(2.0 * pi * t / period + phase)), 15.0)


def heat_burst(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Something beside the contact heats the disc between two times."""
    begin, end = _window(rng, rig, base)
    return Drawn(lambda size: Hidden(heat=lambda t: size * (begin < t < end)), 20.0)


def friction_step(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Friction jumps at one moment inside a step and stays, as when a wear particle lodges."""
    begin, sign = _window(rng, rig, base)[0], 1.0 if rng.random() < 0.5 else -1.0
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 + sign * size * (m.time > begin)), 0.6)


Draw = Callable[[Generator, Rig, Trace], Drawn]
UNKNOWN: dict[str, tuple[str, tuple[str, ...], Draw]] = {
    "friction_burst": ("traction", ("time", "cycles"), friction_burst),
    "friction_oscillation": ("traction", ("time", "cycles"), friction_oscillation),
    "friction_step": ("traction", ("time", "cycles"), friction_step),
    "friction_dip": ("traction", ("creepage",), friction_dip),
    "wear_taper": ("profile", ("y",), wear_taper),
    "profile_groove": ("profile", ("y",), profile_groove),
    "profile_waves": ("profile", ("y",), profile_waves),
    "wear_window": ("profile", ("time", "cycles", "energy"), wear_window),
    "ambient_cycle": ("temperature", ("time", "cycles"), ambient_cycle),
    "heat_burst": ("temperature", ("time", "cycles"), heat_burst),
}
"""Channel, covariates, draw. At constant speed time and cycles are one; the stops of a profile are few for either."""
NEEDS_STOPS = {"wear_window"}
