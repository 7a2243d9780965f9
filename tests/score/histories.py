"""Drawn rigs: materials and sizes of twin-disc tests, and three kinds of load history."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from .rig import Rig

KINDS = ("rising", "up_and_down", "repeated", "there_and_back")
"""Of the creepages: rising; then falling again or in any order, in full sliding; or all the way back."""
_ROUND: tuple[float, ...] = (
    0.05,
    0.06,
    0.08,
    0.1,
    0.12,
    0.15,
    0.2,
    0.25,
    0.3,
    0.4,
    0.5,
    0.6,
    0.7,
    0.8,
    0.9,
    1.0,
    1.2,
    1.3,
    1.5,
    1.8,
)
_ROUND += (2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0, 7.5, 8.0, 8.5, 9.0)  # percent


def _levels(rng: Generator, count: int) -> list[float]:
    """`count` rising creepages [%], roughly geometric, from partial slip to several per cent."""
    first, last = rng.uniform(0.05, 0.35), rng.uniform(3.0, 9.0)
    wanted = np.exp(np.linspace(np.log(first), np.log(last), count) + rng.uniform(-0.15, 0.15, count))
    table = np.array(_ROUND)
    return sorted({float(table[np.argmin(np.abs(np.log(table / w)))]) for w in wanted})


def _percent(rng: Generator, kind: str, sliding: float) -> list[float]:
    """The creepages [%] of a history; those after the first rise stay above `sliding` [%]."""
    count = int(rng.integers(8, 15))
    if kind == "rising":
        return _levels(rng, count)
    rise = _levels(rng, max(6, round(0.6 * count)))
    high = [level for level in rise if level > sliding]
    if kind == "there_and_back":
        return (rise + rise[-2::-1])[:16]
    if kind == "up_and_down":
        return (rise + high[-2::-1])[:14]
    again = [float(v) for v in rng.permutation(high)]
    return (rise + again + high)[: max(count, len(rise) + 2)]


def draw_rig(rng: Generator, *, kind: str, contact: str, law: str, declared_law: str) -> Rig:
    """A rig and its history: depth 1.5 to 8 um, 18 to 70 W at the most, K 2e-5 to 1.2e-4."""
    mu, load, radius = rng.uniform(0.3, 0.65), rng.uniform(40.0, 150.0), rng.uniform(20e-3, 50e-3)
    # a patch slides fully from about 0.0175 mu on the reference rig; heavier loads and small discs later
    percent = _percent(rng, kind, sliding=2.2 * mu)
    creepage = tuple(round(0.01 * p, 7) for p in percent)
    crown = (np.inf, rng.uniform(20e-3, 50e-3))
    if rng.random() < 0.2:
        crown = (rng.uniform(60e-3, 300e-3), crown[1])
    speed = float(np.clip(rng.uniform(18.0, 70.0) / (mu * load * max(creepage)), 1.0, 14.0))
    rpm = round(speed / radius * 30.0 / np.pi, -1)
    count = len(creepage)
    iterations = tuple(int(n) for n in np.full(count, rng.integers(3, 7)))
    if rng.random() < 0.3:
        iterations = tuple(int(n) for n in rng.integers(3, 8, count))
    rig = Rig(
        load=float(round(load, 1)), rpm=float(rpm), radius=round(radius, 4),
        crown=(float(np.round(crown[0], 4)), float(np.round(crown[1], 4))),
        creepage=creepage, iterations=iterations, revolutions=1000, capacity=float(round(rng.uniform(60.0, 200.0), 0)),
        environment=-196.0 if rng.random() < 0.3 else float(rng.choice([18.0, 20.0, 22.0, 25.0])),
        contact=contact, law=law, declared_law=declared_law, mu=mu, wear=1e-5, convection=rng.uniform(1.2, 2.5),
        creepage_error=_creepage_error(rng, np.array(creepage)),
        load_tolerance=float(1.0 + rng.uniform(-0.01, 0.01)),
    )  # fmt: skip
    return _with_depth(rng, rig)


def other_history(rng: Generator, rig: Rig) -> Rig:
    """The same rig under another history: levels between its own or the same, in another order, shorter or longer."""
    own = np.array(rig.creepage)
    count = int(rng.integers(6, 12))
    drawn = np.exp(rng.uniform(np.log(own.min()), np.log(own.max()), count))
    levels = np.where(rng.random(count) < 0.5, rng.choice(own, count), np.round(drawn, 5))
    order = str(rng.choice(("falling", "shuffled", "up_and_down"), p=(0.25, 0.5, 0.25)))
    if order == "falling":
        levels = np.sort(levels)[::-1]
    elif order == "up_and_down":
        levels = np.concatenate([np.sort(levels[: count // 2]), np.sort(levels[count // 2 :])[::-1]])
    levels = np.clip(levels, own.min(), own.max())
    length = rng.uniform(1.0, 1.3) if rng.random() < 0.25 else rng.uniform(0.6, 1.0)
    iterations = np.maximum(np.round(length * sum(rig.iterations) / count * rng.uniform(0.7, 1.3, count)), 1.0)
    error = dict(zip(own, rig.creepage_error, strict=True))
    fresh = _creepage_error(rng, levels)
    return replace(
        rig, creepage=tuple(float(c) for c in levels), iterations=tuple(int(n) for n in iterations),
        creepage_error=tuple(error.get(c, e) for c, e in zip(levels, fresh, strict=True)),
    )  # fmt: skip


def _creepage_error(rng: Generator, creepage: NDArray[np.float64]) -> tuple[float, ...]:
    """Within 0.5 % of the creepage and 1e-5; one error for each creepage that is set, whenever it is set."""
    levels, which = np.unique(creepage, return_inverse=True)
    error = 0.005 * levels * rng.uniform(-1.0, 1.0, levels.size) + 1e-5 * rng.uniform(-1.0, 1.0, levels.size)
    return tuple(float(e) for e in error[which])


def _with_depth(rng: Generator, rig: Rig) -> Rig:
    """Set the revolutions and K so that the track becomes as deep as drawn and an iteration lasts 40 to 150 s."""
    depth = rng.uniform(1.5e-6, 8e-6)
    # segment of a circle: half width^2 = 2 d / curvature, area = 4/3 half width d
    area = 4.0 / 3.0 * depth * np.sqrt(2.0 * depth / rig.curvature_y)
    one = replace(rig, wear=1.0, revolutions=1).half_width() ** 3 * rig.curvature_y / 1.5
    product = area / one  # K times revolutions
    shortest, longest = rig.rpm / 60.0 * 40.0, rig.rpm / 60.0 * 150.0
    revolutions = np.clip(product / rng.uniform(3e-5, 1e-4), shortest, longest)
    revolutions = int(max(round(float(revolutions), -2), 100))
    return replace(rig, revolutions=revolutions, wear=float(np.clip(product / revolutions, 2e-5, 1.2e-4)))
