"""What a twin-disc test is, in SI units: the rig, the history, and what was measured.

These frozen records carry a test from the files' edge to the physics. Lengths in m, loads in N,
speeds in m/s, times in s, temperatures in K, creepages and friction coefficients as ratios.
A quantity that is not known is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.laws.law import Law
from twindisc_cli.physics import hertz, line_contact
from twindisc_cli.physics.half_space import OutOfRangeError

START_PARTS = 8
"""Places in a strip at which the shape of the new discs is asked."""
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Contact = Literal["hertz", "half_space"]
Traction = Literal["fastsim", "fastrip", "exact"]
Provenance = Literal["measured", "digitised", "reconstructed", "synthetic"]
LARGEST_PATCH = 1.0
"""Semi-axis times curvature, the slope of the surfaces at the patch's edge, beyond which nothing is computed."""


@dataclass(frozen=True)
class Disc:
    """One disc. A radius of inf is straight; a negative transverse radius is concave. Density [kg/m3] for its mass.

    width of its rim [m], inf where it is not stated.
    """

    rolling_radius: float
    transverse_radius: float
    youngs_modulus: float
    poisson_ratio: float
    hardness: float
    density: float = np.nan
    width: float = np.inf

    def __eq__(self, other: object) -> bool:
        """Whether two discs agree in all that is known: NaN, an unknown quantity, is like NaN."""
        if not isinstance(other, Disc):
            return NotImplemented
        pairs = ((getattr(self, item.name), getattr(other, item.name)) for item in fields(self))
        return all(one == two or (one != one and two != two) for one, two in pairs)

    def __hash__(self) -> int:
        """Of what is always known."""
        return hash((self.rolling_radius, self.transverse_radius, self.youngs_modulus, self.poisson_ratio))

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


def mean_radius(*discs: Disc) -> float:
    """Rolling speed over mean angular speed [m]; of the disc that turns where the other is flat."""
    finite = [1.0 / disc.rolling_radius for disc in discs if np.isfinite(disc.rolling_radius)]
    return len(finite) / sum(finite)


@dataclass(frozen=True)
class Rig:
    """Two discs pressed together; disc 2 is the one whose profile wears unless said otherwise."""

    disc1: Disc
    disc2: Disc
    normal_load: float
    rolling_speed: float

    @property
    def curvature_x(self) -> float:
        """Relative curvature along rolling, 1/R1 + 1/R2 [1/m]."""
        return 1.0 / self.disc1.rolling_radius + 1.0 / self.disc2.rolling_radius

    @property
    def curvature_y(self) -> float:
        """Relative transverse curvature of the unworn discs [1/m]."""
        return 1.0 / self.disc1.transverse_radius + 1.0 / self.disc2.transverse_radius

    @property
    def shear_modulus(self) -> float:
        """Combined shear modulus of Eq. 7, 1/G = 1/(2 G1) + 1/(2 G2) [Pa]."""
        return 2.0 / (1.0 / self.disc1.shear_modulus + 1.0 / self.disc2.shear_modulus)

    @property
    def poisson_ratio(self) -> float:
        """Combined Poisson ratio of Eq. 7, nu/G = nu1/(2 G1) + nu2/(2 G2)."""
        return (
            0.5
            * self.shear_modulus
            * (
                self.disc1.poisson_ratio / self.disc1.shear_modulus
                + self.disc2.poisson_ratio / self.disc2.shear_modulus
            )
        )

    @property
    def effective_modulus(self) -> float:
        """E*, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 [Pa]."""
        return 1.0 / sum((1.0 - disc.poisson_ratio**2) / disc.youngs_modulus for disc in (self.disc1, self.disc2))

    def density_of(self, disc: Ints) -> Floats:
        """Density [kg/m3] of each disc by its number, 1 or 2; NaN where it is not stated."""
        return np.where(disc == 1, self.disc1.density, self.disc2.density)

    def track_radius(self, disc: int | Ints) -> Floats:
        """Radius of the track on each disc by its number, 1 or 2 [m]: where it is flat, that of the other disc."""
        one, two = self.disc1.rolling_radius, self.disc2.rolling_radius
        own, other = np.where(disc == 1, one, two), np.where(disc == 1, two, one)
        return np.where(np.isfinite(own), own, other)

    @property
    def is_line(self) -> bool:
        """Whether the discs touch along a line: both straight, or one as hollow as the other is round."""
        return self.curvature_y == 0.0

    @property
    def width(self) -> float:
        """Width over which both discs can touch [m], inf where none is stated."""
        return min(self.disc1.width, self.disc2.width)

    @property
    def mismatch(self) -> float:
        """(1 - 2 nu1)/G1 - (1 - 2 nu2)/G2 [1/Pa]: 0 where pressure alone makes no disc slip on the other."""
        one, two = ((1.0 - 2.0 * d.poisson_ratio) / d.shear_modulus for d in (self.disc1, self.disc2))
        return one - two

    @property
    def dundurs(self) -> float:
        """Dundurs' second constant."""
        return 0.25 * self.effective_modulus * self.mismatch

    def with_discs(self, name: str, factor: float) -> Rig:
        """The rig with a quantity of both discs changed by a factor."""
        one, two = (replace(disc, **{name: getattr(disc, name) * factor}) for disc in (self.disc1, self.disc2))
        return replace(self, disc1=one, disc2=two)

    @cached_property
    def patch(self) -> hertz.Ellipse | line_contact.Strip:
        """Hertz's patch of the unworn discs: an ellipse, or a strip as wide as the narrower disc.

        Raises OutOfRangeError where it would be larger than the radii: such discs are no half-spaces to each other.
        """
        result = self._hertz()
        size = max(float(result.a) * self.curvature_x, float(result.b) * self.curvature_y)
        if size > LARGEST_PATCH:
            raise OutOfRangeError(
                f"the patch would be {size:.2g} times as large as the discs' radii, and the theory takes one that is "
                "small against them: is the load too high, or the modulus too low?"
            )
        return result

    def area_ratio(self, load_factor: Floats) -> Floats:
        """Area of the unworn patch under so many times the load, over that under the load, both (...) [1]."""
        return np.asarray(load_factor ** (0.5 if self.is_line else 2.0 / 3.0))

    def _hertz(self) -> hertz.Ellipse | line_contact.Strip:
        if self.is_line:
            return line_contact.line_contact(
                curvature=self.curvature_x,
                normal_load=self.normal_load,
                width=self.width,
                effective_modulus=self.effective_modulus,
            )
        return hertz.contact_ellipse(
            curvature_x=self.curvature_x,
            curvature_y=self.curvature_y,
            normal_load=self.normal_load,
            effective_modulus=self.effective_modulus,
        )


@dataclass(frozen=True)
class Thermal:
    """The disc as one heat capacity (Eq. 19). convection is h S [W/K], NaN where it is to be found.

    conductivity [W/(m K)], density [kg/m3] and specific_heat [J/(kg K)] are the disc material's, for the flash
    temperature; they default to hardened AISI 440C.
    """

    environment_temperature: float
    heat_capacity: float
    initial_temperature: float
    convection: float = np.nan
    conductivity: float = 24.2
    density: float = 7650.0
    specific_heat: float = 460.0


@dataclass(frozen=True)
class History:
    """The load history, one entry an iteration (a block of revolutions at constant creepage), or a pause.

    step [index from 0], creepage [1], duration [s], revolutions, given_mu [1] (NaN: not given), load_factor and
    speed_factor, normal load and rolling speed over the rig's [1], yaw [rad]; each (iteration,). A pause has no
    revolutions, no creepage and no speed. separate: every step is a test of its own, written down one after the other;
    nothing is carried over from one to the next. per_iteration: revolutions of what weighings and profiles count as an
    iteration, where the entries are finer than that; NaN where nobody said it, None where the entries are counted.
    """

    step: Ints
    creepage: Floats
    duration: Floats
    revolutions: Floats
    given_mu: Floats
    load_factor: Floats = field(default_factory=lambda: np.ones(1))
    speed_factor: Floats = field(default_factory=lambda: np.ones(1))
    yaw: Floats = field(default_factory=lambda: np.zeros(1))
    separate: bool = False
    per_iteration: float | None = None

    def __post_init__(self) -> None:
        """What is the same in all iterations may be given once."""
        for name in ("load_factor", "speed_factor", "yaw"):
            object.__setattr__(self, name, np.broadcast_to(getattr(self, name), self.step.shape))

    @property
    def driven(self) -> NDArray[np.bool_]:
        """Whether the discs turn, (iteration,): not in a pause."""
        return self.revolutions > 0.0

    @property
    def last_load(self) -> Floats:
        """load_factor; in a pause that of the entry before it, in which the discs turned last, (iteration,)."""
        driven = np.flatnonzero(self.driven)
        last = np.searchsorted(driven, np.arange(len(self.step)), side="right") - 1
        return self.load_factor[driven[np.maximum(last, 0)]] if len(driven) else self.load_factor

    @property
    def is_constant(self) -> bool:
        """Whether load, speed and yaw are the rig's wherever the discs turn."""
        steady = (self.load_factor == 1.0) & (self.speed_factor == 1.0) & (self.yaw == 0.0)
        return bool(np.all(steady | ~self.driven))

    @property
    def iterations(self) -> int:
        """How many iterations there are to be counted, without the pauses."""
        if self.per_iteration is None:
            return int(self.driven.sum())
        return max(1, round(float(self.revolutions.sum()) / self.per_iteration))

    def entry(self, iteration: Ints) -> Ints:
        """The entry, from 1, at whose end an iteration ends, counted from 1 without the pauses."""
        if self.per_iteration is None:
            return np.asarray(np.flatnonzero(self.driven)[iteration - 1] + 1, dtype=np.int64)
        return self.nearest_end(np.cumsum(self.revolutions), np.asarray(iteration * self.per_iteration, dtype=float))

    def completed(self, entry: Ints) -> Ints:
        """How many iterations are completed at the end of an entry (...); the entry itself where nobody counts them."""
        if self.per_iteration is None:
            return np.asarray(np.cumsum(self.driven)[entry - 1], dtype=np.int64)
        if np.isnan(self.per_iteration):
            return entry
        return np.asarray(np.rint(np.cumsum(self.revolutions)[entry - 1] / self.per_iteration), dtype=np.int64)

    def nearest_end(self, ends: Floats, place: Floats) -> Ints:
        """The driven entry, from 1, that ends nearest to each place (...); ends: of each entry, (iteration,)."""
        driven = np.flatnonzero(self.driven)
        apart = np.abs(ends[driven] - np.asarray(place)[..., None])
        return np.asarray(driven[np.argmin(apart, axis=-1)] + 1, dtype=np.int64)

    @property
    def end_time(self) -> Floats:
        """Time at the end of each iteration [s], (iteration,)."""
        return np.cumsum(self.duration)

    @property
    def slack(self) -> float:
        """By how much a time may lie behind an end and still be it [s]: less than any iteration lasts."""
        return float(min(1e-9 * self.end_time[-1], 0.5 * self.duration.min()))

    def iteration_at(self, times: Floats) -> Ints:
        """Iteration that runs at each time [s] (...); a time at an end belongs to the iteration that ends there."""
        ends = self.end_time
        return np.asarray(np.minimum(np.searchsorted(ends, times - self.slack), len(ends) - 1), dtype=np.int64)

    @property
    def begin_time(self) -> Floats:
        """Time at which the test of each iteration begins [s], (iteration,): 0 unless steps are separate."""
        if not self.separate:
            return np.zeros(len(self.step))
        first = np.searchsorted(self.step, self.step)
        return np.asarray((self.end_time - self.duration)[first])

    @property
    def step_begin(self) -> Ints:
        """The entry, from 0, with which each step begins, (step,)."""
        return np.asarray(np.unique(self.step, return_index=True)[1], dtype=np.int64)

    @property
    def step_conditions(self) -> Ints:
        """Number of the creepage, load, speed and yaw that each step has: repeats have the same, (step,)."""
        conditions = self.creepage, self.load_factor, self.speed_factor, self.yaw
        rows = np.stack(conditions, axis=1)[self.step_begin]
        return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1].ravel(), dtype=np.int64)

    @property
    def step_creepage(self) -> Floats:
        """Creepage of each step [1], (step,)."""
        return self.creepage[self.step_begin]

    @property
    def step_driven(self) -> NDArray[np.bool_]:
        """Whether each step drives the discs, (step,): not a pause."""
        return self.driven[self.step_begin]


@dataclass(frozen=True)
class Options:
    """How the contact is computed, and the base parameters that are given (NaN: to be found).

    wear_coefficient is disc 2's; disc1_wear_coefficient NaN: disc 1 does not wear, unless an effect says so.
    layer_compliance: thickness over shear modulus of a third body between the discs [m/Pa]. initial_slope: of the creep
    curve, over Kalker's.
    """

    contact: Contact = "hertz"
    traction: Traction = "fastsim"
    wear_coefficient: float = np.nan
    disc1_wear_coefficient: float = np.nan
    friction_coefficient: float = np.nan
    layer_compliance: float = 0.0
    initial_slope: float = 1.0


@dataclass(frozen=True)
class TractionSamples:
    """Measured T/N, each (sample,). time [s] and uncertainty [1] are NaN where not recorded; step from 0."""

    time: Floats
    step: Ints
    creepage: Floats
    ratio: Floats
    uncertainty: Floats


@dataclass(frozen=True)
class RecordedColumn:
    """A column of the user's file in its SI unit, on the clock of the history [s], each (row,); step from 0."""

    time: Floats
    step: Ints
    values: Floats


@dataclass(frozen=True)
class ProfileSamples:
    """Height change of a worn disc [m] at y [m], negative where material is gone, each (sample,).

    disc is 1 or 2; iteration is the entry of the history, from 1, at whose end the profile was taken;
    `History.completed` says how many iterations that are.
    """

    y: Floats
    height: Floats
    disc: Ints
    iteration: Ints


@dataclass(frozen=True, eq=False)
class Start:
    """How far the new discs stand above their nominal shapes: height [m] of discs 1 and 2 (2, point), at rising y [m].

    It is itself only, so that what is computed from it can be remembered.
    """

    y: Floats
    height: Floats

    def on(self, y: Floats) -> Floats:
        """Height of both together, the mean over each of uniform strips about y (strip,) [m]; beyond as it ends."""
        parts = (np.arange(START_PARTS) + 0.5) / START_PARTS - 0.5
        inside = np.interp(y[:, None] + parts * (y[1] - y[0]), self.y, self.height.sum(axis=0))
        return np.asarray(inside.mean(axis=1))


@dataclass(frozen=True)
class TemperatureSamples:
    """Measured disc temperature [K] at time [s], each (sample,)."""

    time: Floats
    temperature: Floats


@dataclass(frozen=True)
class MassSamples:
    """Mass that a disc has lost since the start [kg], with its uncertainty (NaN: not stated), each (sample,).

    disc is 1 or 2; iteration is the entry of the history, from 1, at whose end it was weighed; `History.completed` says
    how many iterations that are.
    """

    iteration: Ints
    loss: Floats
    disc: Ints
    uncertainty: Floats

    def of_discs(self) -> dict[int, Ints]:
        """The weighings of each disc in their order (weighing of it,), by its number."""
        order = np.argsort(self.iteration, kind="stable")
        return {int(number): order[self.disc[order] == number] for number in np.unique(self.disc)}


@dataclass(frozen=True)
class TorqueZero:
    """The zero of the torque sensor, as T/N [1]: mean over the test, standard error, drift from before to after.

    std is NaN where the zero was stated, drift where only one end was recorded. taken_off: whether the samples are
    free of it. unit: torque of T/N = 1 [N m]. of_step: the standard error in each step, as T/N at its load (step,).
    """

    value: float
    std: float
    drift: float
    taken_off: bool
    unit: float
    of_step: Floats


@dataclass(frozen=True)
class ProfilePlace:
    """Standard errors of what profiles were levelled and centred by: slope [1], offset [m], centre [m]."""

    slope: float
    offset: float
    centre: float


@dataclass(frozen=True)
class Measured:
    """The measured channels of a test; None where a channel was not measured, or a zero or a place is not known.

    start: the new discs, where they were measured; what their profiles became is measured from there.
    creepage_noise: standard deviation [1] of the noise that was taken off the creepages of the traction's samples.
    others: samples of further channels by name. columns: what laws may run over besides, by how it is declared.
    """

    traction: TractionSamples | None = None
    profile: ProfileSamples | None = None
    temperature: TemperatureSamples | None = None
    mass: MassSamples | None = None
    provenance: Provenance = "measured"
    torque_zero: TorqueZero | None = None
    profile_place: ProfilePlace | None = None
    start: Start | None = None
    creepage_noise: float = 0.0
    others: Mapping[str, Any] = field(default_factory=dict)
    columns: Mapping[str, RecordedColumn] = field(default_factory=dict)

    def column_means(self, steps: Ints) -> dict[str, Floats]:
        """Mean over each of these steps (step,) of the declared columns that are known in all of them, by name."""
        return {
            name: np.array([np.mean(column.values[column.step == step]) for step in steps])
            for name, column in self.columns.items()
            if np.isin(steps, column.step).all()
        }

    def with_samples(self, name: str, samples: Any) -> Measured:
        """The same with other samples of a channel."""
        if name in {own.name for own in fields(self)}:
            return replace(self, **{name: samples})
        return replace(self, others={**self.others, name: samples})


@dataclass(frozen=True)
class Experiment:
    """One twin-disc test: rig, history, options, declared effects and laws, measured channels.

    reported holds numbers stated elsewhere (a paper, a report) that `check` compares with the physics: depth [m],
    width [m], wear_coefficient [1], temperature_rise [K], each only where stated. hold_out_steps count from 0;
    None: chosen by the program, (): nothing is held out.
    tolerances: relative standard deviations of quantities of the discs, by name. own_parameters: what the definition
    says of base parameters that only a channel reads, by key.
    """

    name: str
    description: str
    rig: Rig
    history: History
    options: Options
    thermal: Thermal | None = None
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    laws: Mapping[str, Law] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)
    measured: Measured = field(default_factory=Measured)
    hold_out_steps: tuple[int, ...] | None = None
    reported: Mapping[str, float] = field(default_factory=dict)
    own_parameters: Mapping[str, float] = field(default_factory=dict)

    @property
    def rolled(self) -> Floats:
        """Distance that the discs roll in each iteration [m], (iteration,); none in a pause."""
        history = self.history
        return np.asarray(self.rig.rolling_speed * history.speed_factor * history.duration * history.driven)

    @property
    def approximates_a_line(self) -> bool:
        """Whether FASTSIM is declared on two cylinders, whose exact law is known."""
        return self.rig.is_line and self.options.traction == "fastsim"

    @property
    def is_plain(self) -> bool:
        """Whether no effect, law, layer or slope is declared and the discs are equal, so that closed forms hold."""
        softened = self.options.layer_compliance > 0.0 or self.options.initial_slope != 1.0
        return not (self.effects or self.laws or self.rig.dundurs or softened)
