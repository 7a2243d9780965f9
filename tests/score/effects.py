"""Hidden effects of the catalogue, written from the literature and not from the program.

Each function draws the shape of an effect for one rig and returns how it acts at a `size` from 0 (nothing) to its
largest plausible value. `rng` seeded generator; `base` the march of the rig with nothing hidden.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import erf, exp, log

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from .hidden import Hidden
from .rig import Rig, Trace

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Drawn:
    """One effect whose shape is drawn: `at(size)`, sizes up to `largest`; a `fixed` effect is there or not."""

    at: Callable[[float], Hidden]
    largest: float
    fixed: bool = False


def _either(rng: Generator, negative: float = 0.5) -> float:
    """-1 with probability `negative`, otherwise 1."""
    return -1.0 if rng.random() < negative else 1.0


def _between(rng: Generator, low: float, high: float) -> float:
    """Drawn uniformly in the logarithm."""
    return float(np.exp(rng.uniform(log(low), log(high))))


# ---------------------------------------------------------------------------------------------- traction


def falling_friction(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """O. Polach, Wear 258 (2005) 992: mu falls from its value at rest to A mu as the sliding speed grows."""
    decay = _between(rng, 1.0, 5.0) / (max(rig.creepage) * rig.speed)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: (1.0 - size) + size * exp(-decay * m.sliding_speed))

    return Drawn(at, 0.8)


def film_breakdown(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A film carries the load until a critical creepage, scattered normally about its mean (scuffing tests)."""
    levels = np.unique(rig.creepage)
    critical = float(np.exp(np.interp(rng.uniform(0.25, 0.75), np.linspace(0, 1, levels.size), np.log(levels))))
    width = critical * rng.uniform(0.08, 0.25)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 - size * 0.5 * (1.0 - erf((m.creepage - critical) / (width * 2**0.5))))

    return Drawn(at, 0.9)


def temperature_dependent_friction(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Linear in the disc's temperature between limits (as CONTACT has it, with the disc for the flash)."""
    sign = _either(rng, 0.7)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: max(1.0 + sign * size * m.rise / 10.0, 0.2))

    return Drawn(at, 0.3)


def running_in_friction(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """P. J. Blau, Tribology International 38 (2005) 1007: exponential approach over the cycles."""
    sign = _either(rng, 0.6)
    scale = rng.uniform(0.08, 0.4) * rig.revolutions * sum(rig.iterations)

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 + sign * size * exp(-m.cycles / scale))

    return Drawn(at, 0.6)


def two_stage_running_in(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """P. J. Blau, Wear 71 (1981) 29: friction rises to a peak and falls (or dips), as one stage ends and the other."""
    sign, whole = _either(rng), rig.revolutions * sum(rig.iterations)
    fast = rng.uniform(0.03, 0.08) * whole
    slow = rng.uniform(5.0, 10.0) * fast

    def at(size: float) -> Hidden:
        return Hidden(friction=lambda m: 1.0 + sign * size * (exp(-m.cycles / slow) - 1.5 * exp(-m.cycles / fast)))

    return Drawn(at, 0.5)


def third_body_layer(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A soft layer in series with the steel: flexibility L + h/G of the layer (E. Vollebregt, Wear 314 (2014) 87)."""
    return Drawn(lambda size: Hidden(flexibility=1.0 + size), 6.0)


def two_slope_factors(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """M. Spiryagin, O. Polach, C. Cole, VSD 51 (2013) 1642: FASTSIM with a stiffness that falls with the creepage."""
    softening = rng.uniform(0.5, 2.0) / rig.creepage_scale

    def at(size: float) -> Hidden:
        return Hidden(slope=lambda m: 1.0 - size + size / (1.0 + softening * m.creepage))

    return Drawn(at, 0.95)


def lubricated_film(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A shear-thinning oil (P. J. Carreau, Trans. Soc. Rheology 16 (1972) 99) beside boundary contact, on soft film."""
    thinning, exponent = rng.uniform(0.02, 0.3) * max(rig.creepage) * rig.speed, rng.uniform(0.05, 0.3)

    def carried(speed: float) -> float:
        return speed / thinning * (1.0 + (speed / thinning) ** 2) ** (0.5 * (exponent - 1.0))

    full = carried(max(rig.creepage) * rig.speed)

    def at(size: float) -> Hidden:
        return Hidden(
            friction=lambda m: 1.0 - size + size * carried(m.sliding_speed) / full, flexibility=1.0 + 0.5 * size
        )

    return Drawn(at, 0.9)


def saturating_friction(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """M. Burckhardt, Radschlupf-Regelsysteme (1993): one minus an exponential of the slip."""
    return Drawn(lambda size: Hidden(friction=lambda m: 1.0 - exp(-max(m.creepage, 1e-12) / max(size, 1e-15))),
                 2.0 * rig.creepage_scale)  # fmt: skip


def creepage_offset(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Rolling radii or speeds that are not what they are thought to be: a constant added to the creepage."""
    sign = _either(rng, 0.3)
    largest = 0.7 * min(rig.creepage) if sign < 0 else 4e-3
    return Drawn(lambda size: Hidden(creepage=sign * size), largest)


def torque_offset(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The torque meter does not read zero at zero."""
    sign = _either(rng)
    return Drawn(lambda size: Hidden(read_traction=lambda t, r: r + sign * size), 0.2)


def sensor_drift(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The zero of the torque meter moves steadily."""
    sign, end = _either(rng), float(base.time[-1])
    return Drawn(lambda size: Hidden(read_traction=lambda t, r: r + sign * size * t / end), 0.2)


def gain_drift(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The torque meter reads steadily more, or less, of the torque."""
    sign, end = _either(rng), float(base.time[-1])
    return Drawn(lambda size: Hidden(read_traction=lambda t, r: r * (1.0 + sign * size * t / end)), 0.4)


def misalignment(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The axes cross at a small angle: a lateral creepage as large as the angle."""
    return Drawn(lambda size: Hidden(lateral=size), 0.03)


def load_error(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The load is not the one set; T/N is still taken over the one set."""
    sign = _either(rng)
    return Drawn(lambda size: Hidden(load=1.0 + sign * size), 0.3 if sign < 0 else 0.4)


def exact_elasticity(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The exact curve where the definition says FASTSIM."""
    return Drawn(lambda size: Hidden(law="exact" if size else None), 1.0, fixed=True)


# ---------------------------------------------------------------------------------------------- profile


def half_space_contact(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The patch of the worn discs where the definition says Hertz."""
    return Drawn(lambda size: Hidden(contact="half_space" if size else None), 1.0, fixed=True)


def lateral_wander(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The contact wanders along the axis, normally distributed about its place."""
    return Drawn(lambda size: Hidden(wander=size), 1.2 * rig.ellipse().b)


def lateral_offset(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The track lies beside the origin of the profile's y."""
    sign = _either(rng)

    def at(size: float) -> Hidden:
        return Hidden(read_profile=lambda y, h: np.interp(y - sign * size, y, h))

    return Drawn(at, 0.3e-3)


def crown_error(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The crown was ground to another radius than the drawing's."""
    sign = _either(rng)
    return Drawn(lambda size: Hidden(crown=(1.0 + size) ** sign), 0.8)


def wear_partition(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Disc 1 takes a share of the wear, as in every pair of like steels."""
    return Drawn(lambda size: Hidden(other_disc=size), 0.6)


def index_at(base: Trace, share: float) -> float:
    """The wear index below which `share` of the energy was dissipated."""
    order = np.argsort(base.wear_index)
    energy = np.cumsum((base.power * np.diff(base.time))[order])
    return float(base.wear_index[order][np.searchsorted(energy, share * energy[-1])])


def severe_wear_transition(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """R. Lewis and U. Olofsson, Wear 257 (2004) 721: K of a strip jumps at its T gamma / A."""
    critical = index_at(base, rng.uniform(0.25, 0.7))

    def at(size: float) -> Hidden:
        return Hidden(wear_locally=lambda index: np.where(index > critical, 1.0 + size, 1.0))

    return Drawn(at, 8.0)


def wear_threshold(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A strip wears by the excess of its T gamma / A over a threshold (T. Pearce, N. Sherratt, Wear 144 (1991) 343)."""
    reference = index_at(base, 0.6)

    def at(size: float) -> Hidden:
        return Hidden(wear_locally=lambda index: np.maximum(1.0 - size * reference / np.maximum(index, 1e-9), 0.0))

    return Drawn(at, 0.8)


def running_in_wear(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """J. F. Archard and W. Hirst, Proc. R. Soc. A 236 (1956) 397: K falls to its steady value."""
    scale = rng.uniform(0.15, 0.5) * rig.revolutions * sum(rig.iterations)
    return Drawn(lambda size: Hidden(wear=lambda m: 1.0 + size * exp(-m.cycles / scale)), 12.0)


def temperature_dependent_wear(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """K grows (or falls) exponentially with the temperature of the disc."""
    sign, top = _either(rng, 0.4), float(base.rise.max())
    return Drawn(lambda size: Hidden(wear=lambda m: exp(sign * size * m.rise / top)), 3.0)


def shoulder_pileup(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Metal pushed out of the track stands beside it: a ridge at each edge."""
    width = rng.uniform(0.04, 0.08) * rig.half_width() * 2.0

    def read(size: float) -> Callable[[Floats, Floats], Floats]:
        def ridges(y: Floats, h: Floats) -> Floats:
            depth = float(-h.min())
            if depth <= 0.0:
                return h
            inside = y[h < -0.05 * depth]
            edges = (inside[0] - 1.2 * width, inside[-1] + 1.2 * width)
            return np.asarray(h + size * depth * sum(np.exp(-0.5 * ((y - e) / width) ** 2) for e in edges))

        return ridges

    return Drawn(lambda size: Hidden(read_profile=read(size)), 0.6)


def profile_tilt(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The profile was not levelled."""
    sign = _either(rng)
    return Drawn(lambda size: Hidden(read_profile=lambda y, h: h + sign * size * y), 5e-3)


def stylus_smoothing(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The Gaussian profile filter of ISO 16610-21, given by its cut-off wavelength."""

    def read(cutoff: float) -> Callable[[Floats, Floats], Floats]:
        def smooth(y: Floats, h: Floats) -> Floats:
            spacing = float(y[1] - y[0])
            x = np.arange(-int(1.5 * cutoff / spacing) - 1, int(1.5 * cutoff / spacing) + 2) * spacing
            weight = np.exp(-np.pi * (x / (0.4697 * max(cutoff, 1e-9))) ** 2)
            return np.asarray(correlate1d(h, weight / weight.sum(), mode="nearest"))

        return smooth

    return Drawn(lambda size: Hidden(read_profile=read(size)), 1.5e-3)


# ---------------------------------------------------------------------------------------------- temperature


def thermocouple_lag(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """A thermocouple of first order."""
    return Drawn(lambda size: Hidden(lag=size), 400.0)


def clock_offset(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The logger of the temperature has a clock of its own."""
    sign = _either(rng)

    def at(size: float) -> Hidden:
        return Hidden(read_temperature=lambda t, r: np.interp(t - sign * size, t, r))

    return Drawn(at, 400.0)


def ambient_drift(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The environment warms or cools steadily."""
    sign, end = _either(rng), float(base.time[-1])
    return Drawn(lambda size: Hidden(environment=lambda t: sign * size * t / end), 15.0)


def parasitic_heat(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Bearings and drag heat the disc steadily."""
    return Drawn(lambda size: Hidden(heat=lambda t: size), 15.0)


def heat_partition(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Only a share of the dissipated power enters the disc."""
    return Drawn(lambda size: Hidden(share=1.0 - size), 0.6)


def shaft_conduction(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """The shaft is a second capacity that the disc heats through its seat."""
    capacity, out = rig.capacity * rng.uniform(2.0, 8.0), rng.uniform(0.05, 0.3)
    return Drawn(lambda size: Hidden(shaft=(size, capacity, out)), 6.0)


def nonlinear_convection(rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Conductance that grows with a power of the rise: free convection to boiling."""
    top = 0.6 * float(base.rise.max())

    def at(size: float) -> Hidden:
        return Hidden(conductance=lambda over: (abs(over) / top + 1e-9) ** size)

    return Drawn(at, 2.0)


Draw = Callable[[Generator, Rig, Trace], Drawn]
CATALOGUE: dict[str, tuple[str, Draw]] = {
    draw.__name__: (channel, draw)
    for channel, draws in {
        "traction": (
            falling_friction, film_breakdown, temperature_dependent_friction, running_in_friction,
            two_stage_running_in, third_body_layer,
            two_slope_factors, lubricated_film, saturating_friction,
            creepage_offset, torque_offset, sensor_drift, gain_drift, misalignment, load_error,
            exact_elasticity,
        ),
        "profile": (
            half_space_contact, lateral_wander, lateral_offset, crown_error, wear_partition,
            severe_wear_transition, wear_threshold, running_in_wear, temperature_dependent_wear,
            shoulder_pileup, profile_tilt, stylus_smoothing,
        ),
        "temperature": (
            thermocouple_lag, clock_offset, ambient_drift, parasitic_heat, heat_partition, shaft_conduction,
            nonlinear_convection,
        ),
    }.items()
    for draw in draws
}  # fmt: skip
NEEDS_STOPS = {"severe_wear_transition", "wear_threshold", "running_in_wear", "temperature_dependent_wear"}
"""Effects that only profiles at several stops can show."""
COVARIATE = {
    "falling_friction": "sliding_speed", "film_breakdown": "creepage", "temperature_dependent_friction": "temperature",
    "running_in_friction": "cycles", "two_stage_running_in": "cycles", "two_slope_factors": "creepage",
    "lubricated_film": "sliding_speed", "saturating_friction": "creepage",
    "sensor_drift": "time", "gain_drift": "time", "severe_wear_transition": "wear_index",
    "wear_threshold": "wear_index", "running_in_wear": "cycles", "temperature_dependent_wear": "temperature",
    "ambient_drift": "time", "nonlinear_convection": "temperature",
}  # fmt: skip
"""What an effect depends on, where it is a law of something."""
