"""What an effect may change: the state of a test at its operating points.

Arrays broadcast to (set, point): `set` counts parameter sets evaluated together, `point` the operating points in
order of time. A parameter reaches an effect as an array of shape (set, 1). What a later stage fills is NaN before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def _not_yet() -> Floats:
    return np.full((1, 1), np.nan)


def _zero() -> Floats:
    return np.zeros((1, 1))


def _one() -> Floats:
    return np.ones((1, 1))


def _first() -> Floats:
    return np.ones(1)


def summed(values: Floats, begins: Floats) -> Floats:
    """Sums of values (..., point) from the beginning of each test on, where `begins` (point,) is 1, otherwise 0."""
    sums = np.cumsum(values, axis=-1)
    if np.count_nonzero(begins) == 1:
        return np.asarray(sums)
    before = np.concatenate([np.zeros_like(sums[..., :1]), sums[..., :-1]], axis=-1)
    first = np.flatnonzero(begins)
    return np.asarray(sums - before[..., first[np.cumsum(begins > 0.0) - 1]])


def _chosen(values: Floats, sets: NDArray[np.int64]) -> Floats:
    """Some sets of values (set, ...); those that are the same for all of several as they are."""
    return values if len(values) == 1 and sets.any() else values[sets]


@dataclass(frozen=True)
class Surface:
    """The worn surfaces as the profilometer records them: height (set, stop, strip) [m] over y (strip,) [m].

    edge (set, stop, 1) is the half-width of the worn zone [m], depth (set, stop, 1) its greatest depth [m]. give (set,
    stop, 1) is 2 p / E* [1], how far the discs give way under the mean pressure p; infinite where the pressure does not
    follow the worn shape.
    """

    y: Floats
    height: Floats
    edge: Floats
    depth: Floats
    give: Floats = field(default_factory=lambda: np.full((1, 1, 1), np.inf))

    def eased(self, deviation: Floats) -> Floats:
        """What is left of a deviation of the worn height (set, stop, strip) [m] where the pressure follows the shape.

            d'(z) = k - 1 - d q E* / (2 p),   so that   d(z) = (k - 1) l (1 - exp(-z / l)),   l = 2 p / (E* q)

        A wave of wavelength 2 pi / q that stands proud by d bears d q E* / 2 more pressure (K. L. Johnson, Contact
        Mechanics (1985), Eq. 13.4) and wears faster by as much: d grows with the depth z no further than to l (k - 1).
        """
        if np.all(np.isinf(self.give)):
            return deviation
        wave = 2.0 * np.pi * np.fft.rfftfreq(len(self.y), self.y[1] - self.y[0])
        x = np.maximum(self.depth * wave / self.give, 1e-9)
        eased = np.fft.irfft(np.fft.rfft(deviation, axis=-1) * (-np.expm1(-x) / x), n=len(self.y), axis=-1)
        return np.where(self.height < 0.0, eased, 0.0)


@dataclass(frozen=True)
class State:
    """The operating points of one test, and what the stages have made of them so far.

    Given: time [s] at the end of each point, duration [s], cycles (revolutions so far), time_in_step [s] since the
    creepage last changed, time_since_pause [s] since the test began or went on after a pause, greatest_creepage of
    the history so far [1], order, the number of the step from 1, direction of the last change of the creepage (1
    up, -1 down, 0 before all), begins, 1 where a test begins and otherwise 0 (steps may be tests of their own),
    declared columns of the file by name, all (point,); rolling_radius [m] of disc 2; nominal_load [N] of the rig,
    recorded_load [N] by which the traction is divided;
    initial_temperature [K] of disc and sensor.

    operation  creepage, lateral_creepage [1], spin [1/m], normal_load [N], rolling_speed [m/s], crown, transverse
               radius over the declared one [1]
    friction   mu, the local coefficient of friction [1]
    traction   slope, factor on the initial slope of the traction curve [1]; slip_slope, slope in the area of slip over
               that in the area of adhesion [1]; exactness, from 0 (the declared law) to 1 (the exact theory)
    contact    half_space, from 0 (the updated Hertz ellipse) to 1 (the half-space patch); wander, standard deviation
               of the contact's lateral position [m]
    wear       wear_factor, K over its base value [1]; disc1_share, part of the worn depth that disc 1 bears [1]
    heat       heat [W] into the disc, convection h S [W/K], environment [K], shaft_conductance [W/K] to a shaft of
               heat capacity shaft_capacity [J/K]
    sensor     traction_ratio [1] and disc_temperature [K] as recorded, surface as recorded

    From the pass before, since the stages feed each other: temperature [K] of the disc, energy [J] dissipated so far,
    wear_index = T gamma / A, the energy dissipated per length rolled and area of the patch [N/m2], power_before [W];
    normalised_creepage, linear force over mu N [1]; flash [K], how much hotter than the disc the patch is on its mean.

    Following from these: total_creepage [1], sliding_speed [m/s], sliding_distance [m] so far, pressure [Pa],
    flash [K], warming [K].

    Known where K of strips across the track is asked for, each (set, strip), with their wear_index: place [m] of the
    strip, passes of the contact over it so far [1].
    """

    time: Floats
    duration: Floats
    cycles: Floats
    time_in_step: Floats
    time_since_pause: Floats
    greatest_creepage: Floats
    rolling_radius: float
    nominal_load: float
    recorded_load: Floats
    initial_temperature: float

    creepage: Floats
    normal_load: Floats
    rolling_speed: Floats
    temperature: Floats
    energy: Floats
    wear_index: Floats
    power_before: Floats
    normalised_creepage: Floats
    environment: Floats

    mu: Floats = field(default_factory=_not_yet)
    lateral_creepage: Floats = field(default_factory=_zero)
    spin: Floats = field(default_factory=_zero)
    slope: Floats = field(default_factory=_one)
    slip_slope: Floats = field(default_factory=_one)
    exactness: Floats = field(default_factory=_zero)
    half_space: Floats = field(default_factory=_zero)
    wander: Floats = field(default_factory=_zero)
    crown: Floats = field(default_factory=_one)
    wear_factor: Floats = field(default_factory=_one)
    disc1_share: Floats = field(default_factory=_zero)
    begins: Floats = field(default_factory=_first)
    order: Floats = field(default_factory=_first)
    direction: Floats = field(default_factory=_zero)
    power: Floats = field(default_factory=_not_yet)
    heat: Floats = field(default_factory=_not_yet)
    convection: Floats = field(default_factory=_not_yet)
    shaft_conductance: Floats = field(default_factory=_zero)
    shaft_capacity: Floats = field(default_factory=_one)
    columns: Mapping[str, Floats] = field(default_factory=dict)
    traction_ratio: Floats = field(default_factory=_not_yet)
    disc_temperature: Floats = field(default_factory=_not_yet)
    place: Floats = field(default_factory=_not_yet)
    passes: Floats = field(default_factory=_not_yet)
    surface: Surface | None = None
    flash_before: Callable[[], Floats] = _zero

    @property
    def total_creepage(self) -> Floats:
        """Size of longitudinal and lateral creepage together [1], (set, point)."""
        return np.hypot(self.creepage, self.lateral_creepage)

    @property
    def sliding_speed(self) -> Floats:
        """Rigid sliding speed [m/s], lateral creepage included."""
        return np.asarray(self.rolling_speed * self.total_creepage)

    @property
    def sliding_distance(self) -> Floats:
        """Distance slid so far [m], the integral of the rigid sliding speed over time; a pause adds nothing."""
        return summed(np.atleast_2d(self.sliding_speed) * self.duration, self.begins)

    @property
    def pressure(self) -> Floats:
        """Mean pressure of the patch [Pa], N over the area that wear index and power tell; NaN where nothing slides."""
        slides = self.power_before > 0.0
        rolled = self.normal_load * self.rolling_speed * self.wear_index
        return np.asarray(np.where(slides, rolled / np.where(slides, self.power_before, 1.0), np.nan))

    @property
    def creepage_size(self) -> Floats:
        """Longitudinal creepage without its sign [1]."""
        return np.abs(self.creepage)

    @property
    def y_over_edge(self) -> Floats:
        """Place across the track over the half-width of the worn zone [1] (set, stop, strip); of a recorded surface."""
        assert self.surface is not None
        return np.asarray(self.surface.y / self.surface.edge)

    @property
    def flash(self) -> Floats:
        """Mean flash temperature of the patch [K], computed when asked for; NaN where the test says nothing of heat."""
        return self.flash_before()

    @property
    def warming(self) -> Floats:
        """Disc temperature above the environment [K]; zero where the test says nothing of heat."""
        return np.nan_to_num(self.temperature - self.environment)

    def replace(self, **changes: Any) -> State:
        """Return this state with some quantities changed: `dataclasses.replace`, in a tenth of its time."""
        if not changes.keys() <= vars(self).keys():
            raise TypeError(f"a state has no {', '.join(sorted(changes.keys() - vars(self).keys()))}")
        changed = object.__new__(type(self))
        vars(changed).update(vars(self), **changes)
        return changed

    def of_sets(self, chosen: NDArray[np.int64]) -> State:
        """Return this state for some of the parameter sets, in any order and number (set,)."""
        before, surface = self.flash_before, self.surface
        own: dict[str, Any] = {
            name: _chosen(v, chosen) for name, v in vars(self).items() if isinstance(v, np.ndarray) and v.ndim > 1
        }
        if surface is not None:
            rows = (surface.height, surface.edge, surface.depth, surface.give)
            own["surface"] = Surface(surface.y, *(_chosen(values, chosen) for values in rows))
        return self.replace(**own, flash_before=lambda: _chosen(before(), chosen))

    def on_surface(self, height: Floats) -> State:
        """Return this state with another recorded surface height (set, stop, strip) [m]."""
        if self.surface is None:
            return self
        return replace(self, surface=replace(self.surface, height=height))
