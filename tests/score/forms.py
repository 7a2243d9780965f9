"""Near-misses: mechanisms of the catalogue under another formula than the one of `effects.py`.

Each says what the mechanism is as a law (quantity, covariate), so that a loop that learns the law instead of naming
the effect is right, too; None where it is no law of one covariate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, log, tanh

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from .effects import Draw, Drawn, index_at
from .heat import thermocouple
from .hidden import Hidden
from .rig import Rig, Trace

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Form:
    """One other formula of an effect, and the law that it amounts to."""

    draw: Draw
    law: tuple[str, ...] | None  # the quantities that it may be said of, and the covariate


def _sign(rng: Generator, negative: float = 0.5) -> float:
    return -1.0 if rng.random() < negative else 1.0


def _cycles(rig: Rig) -> float:
    """Revolutions of the whole test."""
    return float(rig.revolutions * sum(rig.iterations))


def _middle_creepage(rng: Generator, rig: Rig) -> float:
    """A creepage between the quarters of the levels."""
    levels = np.unique(rig.creepage)
    return float(np.exp(np.interp(rng.uniform(0.25, 0.75), np.linspace(0, 1, levels.size), np.log(levels))))


# ---------------------------------------------------------------------------------------------- traction


def falling_hyperbola(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """mu falls as 1 / (1 + v / v0), the Stribeck curve's tail; no limit below."""
    scale = max(rig.creepage) * rig.speed

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 / (1.0 + size * m.sliding_speed / scale))

    return Drawn(at, 3.0)


def falling_power(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """mu falls as a power of the sliding speed beyond a small one."""
    first = rng.uniform(0.05, 0.3) * max(rig.creepage) * rig.speed
    return Drawn(lambda size: Hidden(friction=lambda m: (1.0 + m.sliding_speed / first) ** -size), 0.8)


def film_power(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The film gives way as a power of the creepage: c^n / (c^n + c0^n)."""
    critical, exponent = _middle_creepage(rng, rig), rng.uniform(2.0, 5.0)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 - size / (1.0 + (max(m.creepage, 1e-9) / critical) ** exponent))

    return Drawn(at, 0.9)


def film_tanh(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The film gives way over the logarithm of the creepage."""
    critical, width = _middle_creepage(rng, rig), rng.uniform(0.15, 0.5)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 - 0.5 * size * (1.0 - tanh(log(max(m.creepage, 1e-9) / critical) / width)))

    return Drawn(at, 0.9)


def heated_friction_square(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """mu falls (or grows) with the square of the warming."""
    sign, top = _sign(rng, 0.7), float(base.rise.max())
    return Drawn(lambda size: Hidden(friction=lambda m: max(1.0 + sign * size * (m.rise / top) ** 2, 0.2)), 0.6)


def heated_friction_knee(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """mu falls from a temperature on, as an additive that starts to work."""
    knee, top = rng.uniform(0.2, 0.5) * float(base.rise.max()), float(base.rise.max())

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: max(1.0 - size * max(m.rise - knee, 0.0) / (top - knee), 0.2))

    return Drawn(at, 0.7)


def running_in_power(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """mu approaches its end as a power of the cycles."""
    sign, first, exponent = _sign(rng, 0.6), rng.uniform(0.03, 0.2) * _cycles(rig), rng.uniform(0.7, 2.0)
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 + sign * size * (1.0 + m.cycles / first) ** -exponent), 0.6)


def _two_exponentials(x: float, short: float, long: float) -> float:
    return 0.5 * exp(-x / short) + 0.5 * exp(-x / long)


def running_in_twice(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Two exponentials, as asperities and then a film run in."""
    sign, long = _sign(rng, 0.6), rng.uniform(0.2, 0.6) * _cycles(rig)
    short = rng.uniform(0.1, 0.3) * long
    return Drawn(
        lambda size: Hidden(friction=lambda m: 1.0 + sign * size * _two_exponentials(m.cycles, short, long)), 0.6
    )


def running_in_energy(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """mu runs in with the energy dissipated instead of the cycles."""
    sign, scale = _sign(rng, 0.6), rng.uniform(0.05, 0.35) * base.energy
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 + sign * size * exp(-m.energy / scale)), 0.6)


def film_of_limiting_stress(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A film with a limiting shear stress: 1 - exp(-w / w0) (S. Bair, W. O. Winer, J. Lubrication Tech. 101 (1979))."""
    first = rng.uniform(0.1, 0.4) * max(rig.creepage) * rig.speed
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 - size * exp(-m.sliding_speed / first)), 0.9)


def layer_of_two_slopes(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A layer that is softer where the patch slides than where it sticks."""
    middle, least = _middle_creepage(rng, rig), rng.uniform(0.3, 0.7)

    def at(size: float) -> Hidden:
        return Hidden(slope=lambda m: 1.0 / (1.0 + size * (least + (1.0 - least) * m.creepage / (m.creepage + middle))))

    return Drawn(at, 6.0)


def creeping_offset(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The offset of the creepage grows as the drive is loaded."""
    sign, top = _sign(rng, 0.3), max(rig.creepage)
    largest = 0.6 * min(rig.creepage) if sign < 0 else 4e-3
    return Drawn(lambda size: Hidden(slip=lambda m: sign * size * (0.7 + 0.3 * (m.creepage / top) ** 0.5)), largest)


def drift_that_settles(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The zero of the torque meter creeps towards its end as an exponential."""
    sign, scale = _sign(rng), rng.uniform(0.15, 0.5) * float(base.time[-1])
    return Drawn(lambda size: Hidden(read_traction=lambda t, r: r - sign * size * np.expm1(-t / scale)), 0.2)


def drift_of_a_root(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The zero of the torque meter moves as a power of time."""
    sign, end, exponent = _sign(rng), float(base.time[-1]), float(rng.choice([0.5, 1.6]))
    return Drawn(lambda size: Hidden(read_traction=lambda t, r: r + sign * size * (t / end) ** exponent), 0.2)


# ---------------------------------------------------------------------------------------------- profile


def even_wander(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Each of the two discs wanders evenly between two ends."""
    return Drawn(lambda size: Hidden(wander=size, wanders_evenly=True), 1.2 * rig.ellipse().b)


def severe_smeared(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K grows about a T gamma / A over a decade or so instead of jumping."""
    critical, width = index_at(base, rng.uniform(0.25, 0.7)), rng.uniform(0.25, 0.7)

    def at(size: float) -> Hidden:
        return Hidden(wear=lambda m: 1.0 + 0.5 * size * (1.0 + tanh(log(max(m.wear_index, 1e-3) / critical) / width)))

    return Drawn(at, 8.0)


def severe_of_the_whole(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """All of the patch passes to severe wear at once, at a T gamma / A of the whole."""
    critical = index_at(base, rng.uniform(0.25, 0.7))
    return Drawn(lambda size: Hidden(wear=lambda m: 1.0 + size if m.wear_index > critical else 1.0), 8.0)


def threshold_as_power(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Wear grows with a power of T gamma / A instead of beyond a threshold."""
    reference = index_at(base, 0.6)
    return Drawn(lambda size: Hidden(wear=lambda m: (max(m.wear_index, 1e-3) / reference) ** size), 2.0)


def worn_in_power(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K falls to its steady value as a power of the cycles."""
    first, exponent = rng.uniform(0.05, 0.2) * _cycles(rig), rng.uniform(0.8, 2.0)
    return Drawn(lambda size: Hidden(wear=lambda m: 1.0 + size * (1.0 + m.cycles / first) ** -exponent), 12.0)


def worn_in_twice(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K falls by two exponentials."""
    long = rng.uniform(0.25, 0.6) * _cycles(rig)
    short = rng.uniform(0.1, 0.3) * long
    return Drawn(lambda size: Hidden(wear=lambda m: 1.0 + size * _two_exponentials(m.cycles, short, long)), 12.0)


def worn_in_energy(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K falls with the energy dissipated."""
    scale = rng.uniform(0.1, 0.4) * base.energy
    return Drawn(lambda size: Hidden(wear=lambda m: 1.0 + size * exp(-m.energy / scale)), 12.0)


def heated_wear_linear(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K grows (or falls) linearly with the temperature, and not below a tenth."""
    sign, top = _sign(rng, 0.4), float(base.rise.max())
    return Drawn(lambda size: Hidden(wear=lambda m: max(1.0 + sign * size * m.rise / top, 0.1)), 8.0)


def _beside(ridge: Callable[[Floats], Floats], width: float) -> Draw:
    """A pile-up of `ridge`, a function of the distance outwards from the edge over `width` of the half track."""

    def drawn(rng: Generator, rig: Rig, base: Trace) -> Drawn:
        scale = width * rng.uniform(0.8, 1.25) * rig.edge

        def read(size: float) -> Callable[[Floats, Floats], Floats]:
            def ridges(y: Floats, h: Floats) -> Floats:
                depth = float(-h.min())
                inside = y[h < -0.05 * depth] if depth > 0.0 else np.zeros(0)
                if not inside.size:
                    return h
                return np.asarray(h + size * depth * (ridge((y - inside[-1]) / scale) + ridge((inside[0] - y) / scale)))

            return ridges

        return Drawn(lambda size: Hidden(read_profile=read(size)), 0.6)

    return drawn


def moving_average(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A moving average instead of the Gaussian filter."""

    def read(size: float) -> Callable[[Floats, Floats], Floats]:
        def smooth(y: Floats, h: Floats) -> Floats:
            width = size / (y[1] - y[0])
            low = max(int(width), 1)
            less, more = (uniform_filter1d(h, n, mode="nearest") for n in (low, low + 1))
            return np.asarray(less + (width - low) * (more - less) if width > 1.0 else h)

        return smooth

    return Drawn(lambda size: Hidden(read_profile=read(size)), 1e-3)


# ---------------------------------------------------------------------------------------------- temperature


def lag_of_two(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A thermocouple in a well: two first-order lags one after the other."""
    second = rng.uniform(0.3, 1.0)
    return Drawn(
        lambda size: Hidden(read_temperature=lambda t, r: thermocouple(t, thermocouple(t, r, size), second * size)),
        300.0,
    )


def lag_that_stretches(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A part of the thermocouple follows fast, the rest slowly."""
    share, ratio = rng.uniform(0.4, 0.6), rng.uniform(4.0, 8.0)

    def at(size: float) -> Hidden:
        return Hidden(
            read_temperature=lambda t, r: (
                share * thermocouple(t, r, size) + (1.0 - share) * thermocouple(t, r, ratio * size)
            )
        )

    return Drawn(at, 150.0)


def room_that_settles(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The environment approaches another temperature."""
    sign, scale = _sign(rng), rng.uniform(0.15, 0.5) * float(base.time[-1])
    return Drawn(lambda size: Hidden(environment=lambda t: -sign * size * float(np.expm1(-t / scale))), 15.0)


def room_of_a_day(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The environment warms faster and faster."""
    sign, end = _sign(rng), float(base.time[-1])
    return Drawn(lambda size: Hidden(environment=lambda t: sign * size * (t / end) ** 1.7), 15.0)


def bearings_that_warm(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The drag of the bearings falls to its steady value as their grease warms."""
    scale, more = rng.uniform(0.1, 0.4) * float(base.time[-1]), rng.uniform(0.3, 0.8)
    return Drawn(lambda size: Hidden(heat=lambda t: size * (1.0 + more * exp(-t / scale))), 15.0)


def partition_by_power(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The share of the heat that the disc takes falls as the power grows."""
    top = float(base.power.max())
    return Drawn(lambda size: Hidden(warming=lambda m: 1.0 - size * (0.6 + 0.4 * m.power / top)), 0.6)


def convection_square(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Conductance that grows with the square of the warming."""
    top = float(base.rise.max())
    return Drawn(lambda size: Hidden(conductance=lambda over: 1.0 + size * (over / top) ** 2), 6.0)


def convection_from_boiling(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Conductance that grows from where bubbles begin."""
    top = float(base.rise.max())
    first = rng.uniform(0.15, 0.4) * top
    return Drawn(lambda size: Hidden(conductance=lambda over: 1.0 + size * max(over - first, 0.0) / (top - first)), 6.0)


FORMS: dict[str, dict[str, Form]] = {
    "falling_friction": {
        "hyperbola": Form(falling_hyperbola, ("mu", "creepage")), "power": Form(falling_power, ("mu", "creepage")),
    },
    "film_breakdown": {"power": Form(film_power, ("mu", "creepage")), "tanh": Form(film_tanh, ("mu", "creepage"))},
    "temperature_dependent_friction": {
        "square": Form(heated_friction_square, ("mu", "temperature")),
        "knee": Form(heated_friction_knee, ("mu", "temperature")),
    },
    "running_in_friction": {
        "power": Form(running_in_power, ("mu", "cycles")), "twice": Form(running_in_twice, ("mu", "cycles")),
        "energy": Form(running_in_energy, ("mu", "energy")),
    },
    "two_slope_factors": {"layer": Form(layer_of_two_slopes, ("slope", "creepage"))},
    "lubricated_film": {"limiting": Form(film_of_limiting_stress, ("mu", "creepage"))},
    "creepage_offset": {"loaded": Form(creeping_offset, ("creepage", "creepage"))},
    "sensor_drift": {
        "settles": Form(drift_that_settles, ("traction_ratio", "time")),
        "root": Form(drift_of_a_root, ("traction_ratio", "time")),
    },
    "lateral_wander": {"even": Form(even_wander, None)},
    "severe_wear_transition": {
        "smeared": Form(severe_smeared, ("wear", "wear_index")),
        "whole": Form(severe_of_the_whole, ("wear", "wear_index")),
    },
    "wear_threshold": {"power": Form(threshold_as_power, ("wear", "wear_index"))},
    "running_in_wear": {
        "power": Form(worn_in_power, ("wear", "cycles")), "twice": Form(worn_in_twice, ("wear", "cycles")),
        "energy": Form(worn_in_energy, ("wear", "energy")),
    },
    "temperature_dependent_wear": {"linear": Form(heated_wear_linear, ("wear", "temperature"))},
    "shoulder_pileup": {
        "triangle": Form(_beside(lambda d: np.clip(1.0 - np.abs(d - 1.0), 0.0, 1.0), 0.12), ("profile", "y_over_edge")),
        "tail": Form(
            _beside(lambda d: np.where(d > 0.0, np.exp(-np.maximum(d, 0.0)), 0.0), 0.2), ("profile", "y_over_edge")
        ),
    },
    "stylus_smoothing": {"average": Form(moving_average, None)},
    "thermocouple_lag": {"two": Form(lag_of_two, None), "stretched": Form(lag_that_stretches, None)},
    "ambient_drift": {
        "settles": Form(room_that_settles, ("environment", "time")),
        "power": Form(room_of_a_day, ("environment", "time")),
    },
    "parasitic_heat": {"warm_bearings": Form(bearings_that_warm, ("heat", "environment", "time"))},
    "heat_partition": {"power": Form(partition_by_power, ("heat", "power"))},
    "nonlinear_convection": {
        "square": Form(convection_square, ("convection", "temperature")),
        "boiling": Form(convection_from_boiling, ("convection", "temperature")),
    },
}  # fmt: skip
