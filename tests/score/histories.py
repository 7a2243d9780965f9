"""Drawn rigs: geometries and sizes of twin-disc tests, and kinds of load history."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from .rig import Rig

TOLERANCE, WIDE_TOLERANCE = 0.01, 0.03
"""How far, relatively, the curvature across and the modulus may be off; a wide tolerance is told in the definition."""
KINDS = ("rising", "up_and_down", "repeated", "there_and_back")
"""Of the creepages: rising; then falling again or in any order, in full sliding; or all the way back."""
_ROUND: tuple[float, ...] = (
    0.01,
    0.015,
    0.02,
    0.03,
    0.04,
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


@dataclass(frozen=True)
class Geometry:
    """Radii [m] along rolling, crown of disc 1 and 2 across, and loads [N]: each the ends of a range.

    `heat`: power, heat capacity and convection over those of small discs.
    """

    radius: tuple[float, float]
    crown1: tuple[float, float]
    crown2: tuple[float, float]
    load: tuple[float, float]
    heat: float = 1.0


_STRAIGHT = (np.inf, np.inf)
GEOMETRIES = {
    "paper": Geometry((30e-3, 30e-3), _STRAIGHT, (30e-3, 30e-3), (50.0, 110.0)),
    "small": Geometry((20e-3, 50e-3), _STRAIGHT, (20e-3, 50e-3), (40.0, 150.0)),
    "two_crowns": Geometry((20e-3, 50e-3), (60e-3, 300e-3), (20e-3, 50e-3), (40.0, 150.0)),
    "ball": Geometry((9.5e-3, 12.7e-3), (10e-3, 12e-3), (10e-3, 12e-3), (15.0, 40.0)),
    "suros": Geometry((23.5e-3, 23.5e-3), _STRAIGHT, (60e-3, 150e-3), (250.0, 700.0), heat=2.0),
    "wheel": Geometry((100e-3, 180e-3), _STRAIGHT, (60e-3, 200e-3), (400.0, 1000.0), heat=4.0),
    "conformal": Geometry((25e-3, 40e-3), (-70e-3, -60e-3), (40e-3, 50e-3), (60.0, 200.0)),
}
"""Rigs of the field: the reference rig, small crowned pairs, ball on ball, SUROS with a crown, wheels, a groove."""
_SHARES = (0.2, 0.16, 0.08, 0.14, 0.14, 0.14, 0.14)
ELONGATED = ("suros", "wheel", "conformal")
"""Where a/b is far from 0.63, for which the exact traction curve is tabulated."""
LOADS, SPEEDS = (0.5, 1.0, 2.0), (0.6, 1.0, 1.5)
"""Of single steps, over those of the rig."""
_SLIDING = 4.4  # xi beyond which a patch slides all over


def draw_geometry(rng: Generator) -> str:
    """One of the geometries by its name."""
    return str(rng.choice([*GEOMETRIES], p=_SHARES))


def _levels(rng: Generator, count: int, scale: float) -> list[float]:
    """`count` rising creepages [%], roughly geometric, from partial slip (`scale`: of its end) to several per cent."""
    first, last = min(scale, 1.0) * rng.uniform(0.05, 0.35), rng.uniform(3.0, 9.0)
    wanted = np.exp(np.linspace(np.log(first), np.log(last), count) + rng.uniform(-0.15, 0.15, count))
    table = np.array(_ROUND)
    return sorted({float(table[np.argmin(np.abs(np.log(table / w)))]) for w in wanted})


def _percent(rng: Generator, kind: str, sliding: float) -> list[float]:
    """The creepages [%] of a history; those after the first rise stay above `sliding` [%] but on the way back."""
    count, scale = int(rng.integers(8, 15)), sliding / 1.0
    if kind == "rising":
        return _levels(rng, count, scale)
    rise = _levels(rng, max(6, round(0.6 * count)), scale)
    high = [level for level in rise if level > sliding]
    if kind == "there_and_back":
        return (rise + rise[-2::-1])[:16]
    if kind == "up_and_down":
        return (rise + high[-2::-1])[:14]
    again = [float(v) for v in rng.permutation(high)]
    return (rise + again + high)[: max(count, len(rise) + 2)]


def draw_rig(rng: Generator, *, geometry: str, kind: str, contact: str, law: str, declared_law: str) -> Rig:
    """A rig and its history: depth 1.5 to 8 um, 18 to 70 W at the most on small discs, K 2e-5 to 1.2e-4."""
    family, mu = GEOMETRIES[geometry], rng.uniform(0.3, 0.65)
    rig = Rig(
        load=round(rng.uniform(*family.load), 1), rpm=1.0, radius=round(rng.uniform(*family.radius), 4),
        crown=(_drawn(rng, family.crown1), _drawn(rng, family.crown2)),
        creepage=(0.01,), iterations=(1,), revolutions=1000,
        capacity=float(round(family.heat * rng.uniform(60.0, 200.0), 0)),
        environment=-196.0 if rng.random() < 0.3 else float(rng.choice([18.0, 20.0, 22.0, 25.0])),
        contact=contact, law=law, declared_law=declared_law, mu=mu, wear=1e-5,
        convection=family.heat * rng.uniform(1.2, 2.5),
        creepage_error=(0.0,), load_tolerance=float(1.0 + rng.uniform(-0.01, 0.01)),
    )  # fmt: skip
    percent = _percent(rng, kind, sliding=100.0 * _SLIDING * rig.creepage_scale)
    creepage = tuple(round(0.01 * p, 7) for p in percent)
    speed = float(np.clip(family.heat * rng.uniform(18.0, 70.0) / (mu * rig.load * max(creepage)), 1.0, 14.0))
    iterations = np.full(len(creepage), rng.integers(3, 7))
    if rng.random() < 0.3:
        iterations = rng.integers(3, 8, len(creepage))
    rig = replace(
        rig, rpm=float(round(speed / rig.radius * 30.0 / np.pi, -1)), creepage=creepage,
        iterations=tuple(int(n) for n in iterations), creepage_error=_creepage_error(rng, np.array(creepage)),
    )  # fmt: skip
    return _with_depth(rng, rig)


def driven_by_step(rng: Generator, rig: Rig) -> Rig:
    """The rig with a load, a speed or both for each of its steps, and no more heat at its hottest."""
    which = rng.choice(("loads", "speeds", "both"), p=(0.5, 0.25, 0.25))
    loads = _by_step(rng, rig, LOADS) if which != "speeds" else ()
    speeds = _by_step(rng, rig, SPEEDS) if which != "loads" else ()
    hottest = np.max(np.array(rig.creepage) * (loads or 1.0) * (speeds or 1.0)) / max(rig.creepage)
    slower = replace(rig, rpm=float(max(round(rig.rpm / hottest, -1), 20.0)), loads=loads, speeds=speeds)
    return _with_depth(rng, slower)


def _by_step(rng: Generator, rig: Rig, levels: tuple[float, ...]) -> tuple[float, ...]:
    """Of each step one of the levels: in three blocks, or drawn anew for each."""
    count = len(rig.creepage)
    blocks = np.arange(count) * len(levels) // count
    which = blocks if rng.random() < 0.7 else rng.integers(0, len(levels), count)
    return tuple(float(v) for v in rng.permutation(levels)[which])


def _drawn(rng: Generator, ends: tuple[float, float]) -> float:
    return float(ends[0] if np.isinf(ends[0]) else np.round(rng.uniform(*ends), 4))


def off_by_tolerance(rng: Generator, rig: Rig, *, wide: bool) -> Rig:
    """The rig with crowns and modulus that are not quite what the definition says; it tells a `wide` tolerance."""
    tolerance = WIDE_TOLERANCE if wide else TOLERANCE
    crown, modulus = 1.0 + tolerance * rng.uniform(-1.0, 1.0, 2)
    told = round(tolerance / 3.0**0.5, 4) if wide else 0.0
    return replace(rig, crown_tolerance=float(crown), modulus_tolerance=float(modulus), declared_std=told)


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
        loads=_again(rng, rig.loads, count), speeds=_again(rng, rig.speeds, count),
    )  # fmt: skip


def _again(rng: Generator, own: tuple[float, ...], count: int) -> tuple[float, ...]:
    """So many of a history's own loads or speeds."""
    return tuple(float(v) for v in rng.choice(own, count)) if own else ()


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
    revolutions = int(max(round(float(revolutions), -1), 20))
    return replace(rig, revolutions=revolutions, wear=float(np.clip(product / revolutions, 2e-5, 1.2e-4)))
