"""check: do the definition, the data and the numbers stated elsewhere agree with each other?

General rules, for any test; each compares a value with the range that geometry or a balance allows.

    chord and depth     a facet of width w on a relative curvature k is w^2 k / 8 deep; the elastic patch adds at most
                        its own width 2b, so a depth d allows w between sqrt(8 d / k) and sqrt(8 d / k + 4 b^2)
    weighings           a disc gains no mass: losses count from the beginning of the test
    mass and profile    m = rho W, of the same disc at the same stop
    volume and energy   K = W H / E with the dissipated energy E = sum (T/N) N V creepage duration by then (Eq. 13)
    heat                a rise is at most P / (h S), and at most E / C (Eq. 18 without and with only storage)
    start temperature   the first readings are those of the disc as it is said to start
    elastic limit       T/N is at most G a b C11 creepage / N (Eq. 9) under the load of the step, whatever mu is
    pressure            Hertz's p0 stays below the hardness, under the greatest load
    shakedown           p0 / k stays below the limit at load and T/N of each iteration, k = H / (3 sqrt 3)
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.definition import Test
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import NEGATIVE_FINDING, MeasurementError
from twindisc_cli.identify.energy import ratio_and_power, wear_factor
from twindisc_cli.identify.steps import against_creepage, friction_in_use
from twindisc_cli.identify.track import Track, last_profile, worn_track
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.noise import scatter
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, Rig
from twindisc_cli.model.forward import ForwardModel, Prediction, acts_at
from twindisc_cli.model.traction_law import slip_of_pressure
from twindisc_cli.physics import kalker, shakedown
from twindisc_cli.physics.archard import allowed_coefficient, worn_volume
from twindisc_cli.quantities import CELSIUS, for_reading
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WEIGHED = {1: "weighed mass of disc 1", 2: "weighed mass of disc 2"}
GEOMETRY_MARGIN = 1.15  # of a width or depth: where the worn zone ends is a matter of reading
MASS_MARGIN = 1.2  # of a mass: the profile is of one place around the disc
GAIN_MARGIN = 0.05  # of the mass lost, by which a disc may gain where no uncertainty was stated: oil, debris
GAIN_ERRORS = 5.0  # standard errors by which it may where one was: less than one weighing in a million by chance
ENERGY_MARGIN = 1.5  # of W H / E: a volume and an energy enter, each with its own error
LIMIT_MARGIN = 1.05  # of what nothing can exceed, for the values that it is computed from
NOISES, FEWEST_READINGS = 3.0, 12
"""Standard deviations of the noise by which the coldest reading may lie below the disc, and readings that show it."""
STICKS = 0.8  # of linear theory's T/N: below it so much of a patch slips that the discs wear
START, AT_START = 0.02, 3
"""Share of the test within which readings are of its start, and how many of these at the most are taken."""
STARTS = 5.0
"""[K] by which the disc may start off what the definition says: zeros of thermometers, heat of a running-up."""
FAHRENHEIT = 3.0  # [K] within which a reading is the declared temperature in degrees Fahrenheit
COLDER = 2.0  # [K]; thermocouples err by 1.5 (class 1) to 2.5 (class 2), IEC 60584-1


@dataclass(frozen=True)
class Finding:
    """A value held against the range that the physics allows, in the unit given; ok: whether it lies inside.

    hint: what to look at where it does not; sentence: said instead of the value and its range, where it is given.
    """

    rule: str
    subject: str
    value: float
    low: float
    high: float
    unit: str
    why: str
    hint: str = ""
    sentence: str = ""

    @property
    def ok(self) -> bool:
        """Whether the value lies in its range."""
        return bool(self.low <= self.value <= self.high)

    @property
    def strain(self) -> float:
        """How far the value uses up its range: above 1 it is outside."""
        upper = self.value / self.high if self.high > 0.0 else np.inf * np.sign(self.value)
        lower = self.low / self.value if self.low > 0.0 and self.value > 0.0 else 0.0
        return float(max(upper, lower))

    @property
    def message(self) -> str:
        """What was found, in one line."""
        limits = f"{_number(self.low)} to {_number(self.high)}" if np.isfinite(self.high) else f"≥ {_number(self.low)}"
        if self.low <= 0.0:
            limits = f"at most {_number(self.high)}"
        unit = f" {self.unit}" if self.unit != "1" else ""
        hint = f"; {self.hint}" if self.hint and not self.ok else ""
        said = self.sentence or f"{self.subject} is {_number(self.value)}{unit}, {self.why} allows {limits}{unit}"
        return said + hint

    def json(self) -> dict[str, Any]:
        """The finding for scripts."""
        keys = ("rule", "subject", "value", "low", "high", "unit", "message")
        return or_null({key: getattr(self, key) for key in keys})  # type: ignore[no-any-return]


def _number(value: float) -> str:
    return f"{value:.3g}"


@dataclass(frozen=True)
class Facts:
    """What the rules draw on, computed once."""

    test: Experiment

    @cached_property
    def _ratio_and_power(self) -> tuple[Floats, Floats]:
        return ratio_and_power(self.test)

    @property
    def ratio(self) -> Floats:
        """T/N along the creepage of each iteration: measured, else by the model; NaN: not known. (iteration,)."""
        return self._ratio_and_power[0]

    @property
    def power(self) -> Floats:
        """Dissipated power of each iteration [W], (iteration,); NaN: not known."""
        return self._ratio_and_power[1]

    @cached_property
    def energy(self) -> float:
        """Energy dissipated over the test [J]."""
        return float(np.sum(self.power * self.test.history.duration))

    def energy_by(self, stop: int) -> float:
        """Energy dissipated by the end of an entry of the history, from 1, since its test began [J]."""
        begin, spent = self.test.history.begin_time[:stop], self.power * self.test.history.duration
        return float(np.sum(spent[:stop][begin == begin[-1]]))

    @cached_property
    def load(self) -> Floats:
        """Normal load of each iteration [N], (iteration,)."""
        return self.test.rig.normal_load * self.test.history.load_factor

    @cached_property
    def heaviest(self) -> Rig:
        """The rig under the greatest load at which the discs turn."""
        load = np.max(self.load, where=self.test.history.driven, initial=0.0)
        return replace(self.test.rig, normal_load=float(load) or self.test.rig.normal_load)

    @cached_property
    def model(self) -> ForwardModel:
        """The test, ready to be predicted."""
        return ForwardModel(self.test)

    @cached_property
    def prediction(self) -> Prediction:
        """What the model makes of the test with the mu of each step, 1 where none is known."""
        try:
            mu = np.nan_to_num(friction_in_use(self.model).mu, nan=1.0)
        except MeasurementError:
            mu = np.ones(len(self.test.history.step_creepage))
        return self.model.predict(BaseParameters.declared(self.test, mu[None]), profiled=False)

    def part(self, disc: int, stop: int) -> float:
        """Part of the worn depth that a disc bears by the end of an entry of the history, from 1; 1: it wears alone."""
        if np.isnan(self.test.options.disc1_wear_coefficient) and not acts_at(self.test, "wear"):
            return 1.0
        state = self.prediction.state
        first = np.broadcast_to(state.disc1_share, state.energy.shape)[0, self.model.points.of_iteration[stop - 1]]
        return float(first if disc == 1 else 1.0 - first) or 1.0

    def wear_factor(self, stop: int) -> float:
        """K over its base value by the end of an entry of the history, from 1, as declared: its mean by the energy."""
        return wear_factor(self.model, self.prediction.state, stop) if acts_at(self.test, "wear") else 1.0

    @cached_property
    def track(self) -> Track | None:
        """The track in the last measured profile."""
        profile = self.test.measured.profile
        if profile is None:
            return None
        last = last_profile(profile)
        return worn_track(profile.y[last], profile.height[last], smooth=True)

    @cached_property
    def of_profile(self) -> tuple[int, int]:
        """Disc of the last measured profile, and the entry of the history, from 1, at whose end it was taken."""
        profile = self.test.measured.profile
        assert profile is not None
        last = last_profile(profile)
        return int(profile.disc[last][0]), int(profile.iteration[last][0])

    @cached_property
    def volume(self) -> float:
        """Volume missing in the last measured profile [m3]; NaN without one."""
        profile = self.test.measured.profile
        if profile is None:
            return np.nan
        last, radius = last_profile(profile), self.test.rig.track_radius(self.of_profile[0])
        return float(worn_volume(y=profile.y[last], depth=-profile.height[last], rolling_radius=radius))


def chord_and_depth(facts: Facts) -> Iterator[Finding]:
    """A depth and a width, of the profile or as reported, must belong to the same facet."""
    pairs: list[tuple[str, float, float, tuple[int, int]]] = []
    if facts.track:
        pairs.append((facts.test.measured.provenance, facts.track.depth, facts.track.width, facts.of_profile))
    if {"depth", "width"} <= set(facts.test.reported):
        at_end = 2, len(facts.test.history.step)
        pairs.append(("reported", facts.test.reported["depth"], facts.test.reported["width"], at_end))
    for kind, depth, width, (disc, stop) in pairs:
        if facts.test.rig.is_line:
            yield _over_the_width(facts, kind, width)
        elif _cuts_a_facet(facts):
            yield _of_a_facet(facts, kind, depth, width, facts.part(disc, stop))


def _cuts_a_facet(facts: Facts) -> bool:
    """Whether the contact stays where it is and K is the same all across it, by what is declared."""
    test = facts.test
    local = any(catalogue()[name].local for name in test.effects) or any(law.local for law in test.laws.values())
    unknown = np.isfinite(test.options.disc1_wear_coefficient) and np.isnan(test.options.wear_coefficient)
    wanders = acts_at(test, "contact") and bool(np.any(facts.prediction.state.wander))
    return not (local or unknown or wanders or acts_at(test, "surface"))


def _of_a_facet(facts: Facts, kind: str, depth: float, width: float, part: float) -> Finding:
    """The width of a facet by the depth of a disc, which is so large a part of both discs' depth."""
    curvature, patch = facts.test.rig.curvature_y, facts.heaviest.patch
    facet = 8.0 * depth / part / curvature
    needed = part * facet_depth(width, curvature)
    return Finding(
        rule="chord and depth",
        subject=f"the {kind} width",
        value=width * 1e3,
        low=np.sqrt(facet) / GEOMETRY_MARGIN * 1e3,
        high=np.sqrt(facet + (2.0 * float(patch.b)) ** 2) * GEOMETRY_MARGIN * 1e3,
        unit="mm",
        why=f"the {kind} depth of {_number(depth * 1e6)} µm on one disc"
        + (f", {_number(100.0 * part)} % of the wear," if part < 1.0 else ""),
        hint=f"a facet of this width is {_number(needed * 1e6)} µm deep; or both discs wore, or the track wandered",
    )


def _over_the_width(facts: Facts, kind: str, width: float) -> Finding:
    """Straight discs wear over the width of the narrower one."""
    rim = facts.test.rig.width * 1e3
    return Finding(
        rule="chord and depth",
        subject=f"the {kind} width",
        value=width * 1e3,
        low=rim / GEOMETRY_MARGIN,
        high=rim * GEOMETRY_MARGIN,
        unit="mm",
        why="the width of the narrower disc",
        hint="straight discs wear evenly over it; are they straight and aligned?",
    )


def facet_depth(width: float, curvature: float) -> float:
    """The depth [m] of a facet of a given width [m] on a relative curvature [1/m]: the chord's sagitta."""
    half = 0.5 * width * curvature
    return (1.0 - np.sqrt(1.0 - half**2)) / curvature if half < 1.0 else np.inf


def stated_depth(facts: Facts) -> Iterator[Finding]:
    """A reported depth and the measured profile's are the same depth."""
    if facts.track and "depth" in facts.test.reported:
        measured = facts.track.depth * 1e6
        yield Finding(
            rule="reported and measured",
            subject="the reported depth",
            value=facts.test.reported["depth"] * 1e6,
            low=measured / GEOMETRY_MARGIN,
            high=measured * GEOMETRY_MARGIN,
            unit="µm",
            why=f"the {facts.test.measured.provenance} profile",
        )


def weighings(facts: Facts) -> Iterator[Finding]:
    """No disc gains mass from one weighing to the next."""
    mass = facts.test.measured.mass
    if mass is None:
        return
    for which, own in mass.of_discs().items():
        if len(own) < 2:
            continue
        gained, error = -np.diff(mass.loss[own]), np.hypot(mass.uncertainty[own][1:], mass.uncertainty[own][:-1])
        allowed = np.where(np.isfinite(error), GAIN_ERRORS * error, GAIN_MARGIN * float(np.abs(mass.loss[own]).max()))
        worst = int(np.argmax(gained - allowed))
        begin, end = facts.test.history.completed(mass.iteration[own[worst : worst + 2]])
        yield Finding(
            rule="weighings",
            subject=f"what disc {which} gained from iteration {begin} to {end}",
            value=max(float(gained[worst]), 0.0) * 1e6,
            low=0.0,
            high=float(allowed[worst]) * 1e6,
            unit="mg",
            why="the error of weighing",
            hint="a mass loss counts from the beginning of the test, not from step to step; were discs exchanged?",
        )


def mass_and_profile(facts: Facts) -> Iterator[Finding]:
    """The mass that a disc lost is the volume missing in its profile, at the same stop."""
    mass, profile = facts.test.measured.mass, facts.test.measured.profile
    if mass is None or profile is None:
        return
    last = last_profile(profile)
    which, stop = profile.disc[last][0], profile.iteration[last][0]
    for weighed in np.flatnonzero((mass.disc == which) & (mass.iteration == stop)):
        disc = facts.test.rig.disc1 if which == 1 else facts.test.rig.disc2
        error = 2.0 * np.nan_to_num(mass.uncertainty[weighed])
        yield Finding(
            rule="mass and profile",
            subject=f"the mass loss of disc {which}",
            value=mass.loss[weighed] * 1e6,
            low=(facts.volume * disc.density / MASS_MARGIN - error) * 1e6,
            high=(facts.volume * disc.density * MASS_MARGIN + error) * 1e6,
            unit="mg",
            why=f"the {facts.test.measured.provenance} profile with {_number(disc.density)} kg/m³",
            hint="is the profile level, does it span the whole track, and is it of the same stop?",
        )


@dataclass(frozen=True)
class Worn:
    """A volume [m3] worn off a disc by the end of an entry of the history, from 1, and what it comes from."""

    source: str
    disc: int
    stop: int
    volume: float


def volume_and_energy(facts: Facts) -> Iterator[Finding]:
    """A wear coefficient must join the worn volume and the dissipated energy."""
    options, reported = facts.test.options, facts.test.reported.get("wear_coefficient", np.nan)
    every = [worn for worn in _worn_volumes(facts) if facts.energy_by(worn.stop) > 0.0]
    one, two = ([worn for worn in every if worn.disc == disc] for disc in (1, 2))
    own = np.isfinite(options.disc1_wear_coefficient)
    yield from _joined(facts, "the reported wear coefficient K", reported, every)
    yield from _joined(facts, "the declared wear coefficient K", options.wear_coefficient, two if own else every)
    yield from _joined(facts, "the declared wear coefficient K of disc 1", options.disc1_wear_coefficient, one)


def _joined(facts: Facts, subject: str, value: float, volumes: list[Worn]) -> Iterator[Finding]:
    """A coefficient against W H / E of each of some volumes, and of both discs' weighed mass together."""
    if not volumes or not np.isfinite(value):
        return
    allowed = {worn.source: _allowed(facts, worn) for worn in volumes}
    energies = dict.fromkeys(_number(facts.energy_by(worn.stop) * 1e-3) for worn in volumes)
    if set(WEIGHED.values()) <= set(allowed) and all(facts.part(worn.disc, worn.stop) == 1.0 for worn in volumes):
        allowed["that of both"] = sum(allowed[source] for source in WEIGHED.values())
    yield Finding(
        rule="volume and energy",
        subject=subject,
        value=value,
        low=min(allowed.values()) / ENERGY_MARGIN,
        high=max(allowed.values()) * ENERGY_MARGIN,
        unit="1",
        why=f"the worn volume ({' or '.join(allowed)}) with {' or '.join(energies)} kJ",
        hint=f"W H / E is {' or '.join(_number(k) for k in allowed.values())}, "
        f"and K is {' or '.join(_number(value / k if k else np.inf) for k in allowed.values())} times that",
    )


def _allowed(facts: Facts, worn: Worn) -> float:
    """W H / E of the disc concerned; where both discs share the wear of one K, that K, which goes with disc 2's H.

    What is declared to change K counts.
    """
    rig, own = facts.test.rig, np.isfinite(facts.test.options.disc1_wear_coefficient)
    part = 1.0 if own else facts.part(worn.disc, worn.stop)
    disc = rig.disc1 if worn.disc == 1 and part == 1.0 else rig.disc2
    volume, energy = worn.volume / part, facts.energy_by(worn.stop) * facts.wear_factor(worn.stop)
    return float(allowed_coefficient(volume=volume, energy=energy, hardness=disc.hardness))


def _worn_volumes(facts: Facts) -> list[Worn]:
    """The worn volumes by the last weighings, the last profile, and the facet that a reported depth cuts."""
    volumes, rig, mass = list[Worn](), facts.test.rig, facts.test.measured.mass
    if mass is not None:
        lost, last = mass.loss / rig.density_of(mass.disc), {disc: own[-1] for disc, own in mass.of_discs().items()}
        volumes = [Worn(WEIGHED[d], d, int(mass.iteration[i]), float(lost[i])) for d, i in last.items()]
    if facts.volume > 0.0:
        volumes.append(Worn(f"{facts.test.measured.provenance} profile", *facts.of_profile, facts.volume))
    if depth := facts.test.reported.get("depth"):
        stop = len(facts.test.history.step)
        wide = rig.width if rig.is_line else 2.0 / 3.0 * np.sqrt(8.0 * depth / facts.part(2, stop) / rig.curvature_y)
        volume = 2.0 * np.pi * float(rig.track_radius(2)) * depth * wide
        volumes.append(Worn("facet of the reported depth", 2, stop, volume))
    return volumes


def heat_and_temperature(facts: Facts) -> Iterator[Finding]:
    """A temperature rise must be paid for by the dissipated heat, where no other heat or cooling is declared."""
    test, thermal, samples = facts.test, facts.test.thermal, facts.test.measured.temperature
    other = acts_at(test, "heat") or any(law.of.channel == "temperature" for law in test.laws.values())
    if thermal is None or other or not facts.energy > 0.0:
        return
    rises = {"the reported temperature rise": facts.test.reported.get("temperature_rise", np.nan)}
    if samples is not None:
        rises[f"the {facts.test.measured.provenance} temperature rise"] = (
            float(samples.temperature.max()) - thermal.initial_temperature
        )
        coldest = min(thermal.environment_temperature, thermal.initial_temperature)
        yield Finding(
            rule="heat and temperature",
            subject="the disc below its environment",
            value=max(coldest - float(samples.temperature.min()), 0.0),
            low=0.0,
            high=COLDER + NOISES * _noise(samples.temperature),
            unit="K",
            why="friction, which only heats,",
        )
    drift = max(thermal.environment_temperature - thermal.initial_temperature, 0.0)
    limits = {
        f"storing {_number(facts.energy * 1e-3)} kJ without any loss": facts.energy / thermal.heat_capacity,
        f"losing {_number(facts.power.max())} W by the convection given": facts.power.max() / thermal.convection,
    }
    for subject, rise in rises.items():
        for why, limit in limits.items():
            if np.isfinite(rise) and np.isfinite(limit):
                yield Finding("heat and temperature", subject, rise, 0.0, (limit + drift) * LIMIT_MARGIN, "K", why)


def start_temperature(facts: Facts) -> Iterator[Finding]:
    """The first readings are of a disc as warm as it is said to start, beside what can have changed it by then.

    That is the friction's heat and, of readings that go on away from the declared temperature, twice what they change
    in as long again: a source of heat that is not known has done no more up to 0.7 of the time in which it settles.
    """
    thermal, samples, history = facts.test.thermal, facts.test.measured.temperature, facts.test.history
    if thermal is None or samples is None:
        return
    first = np.flatnonzero(samples.time <= START * history.end_time[-1])[:AT_START]
    if not len(first):
        return
    time, reading = float(np.median(samples.time[first])), float(np.median(samples.temperature[first]))
    declared = thermal.initial_temperature
    warming = float(np.max(facts.power[history.end_time - history.duration <= time])) * time / thermal.heat_capacity
    again = float(np.interp(2.0 * time, samples.time, samples.temperature)) - reading
    away = max(float(np.sign(reading - declared)) * again, 0.0)
    if not np.isfinite(warming):
        return
    shown, said = reading - CELSIUS, declared - CELSIUS
    in_fahrenheit = "; or are the readings in degF?" if abs(shown - (1.8 * said + 32.0)) < FAHRENHEIT else ""
    begin = f"the disc at the start is {_number(shown)} °C, the definition says {_number(said)} °C"
    yield Finding(
        rule="start temperature",
        subject=f"{begin}: the difference",
        value=abs(reading - declared),
        low=0.0,
        high=STARTS + NOISES * _noise(samples.temperature) + warming + 2.0 * away,
        unit="K",
        why="what can have changed it by then",
        hint=f"declare initial_temperature_C under [thermal]{in_fahrenheit}",
    )


def _noise(readings: Floats) -> float:
    """Standard deviation of what readings (sample,) scatter from one to the next; 0 where they are too few."""
    return scatter(np.diff(readings, 2)) / np.sqrt(6.0) if len(readings) >= FEWEST_READINGS else 0.0


def elastic_limit(facts: Facts) -> Iterator[Finding]:
    """No coefficient of friction makes T/N larger than linear theory does at that creepage.

    Discs that wore by an unknown K touch in a larger patch than the unworn one, which only allows more: no step after
    one that slides contradicts.
    """
    test, samples, history = facts.test, facts.test.measured.traction, facts.test.history
    if samples is None:
        return
    try:
        by_creepage, by_pressure = _linear_theory(facts)
    except ValueError:
        return
    worn, wears = False, np.isnan(test.options.wear_coefficient) and not (test.rig.is_line or history.separate)
    slides = (history.step_creepage != 0.0) | (history.yaw[history.step_begin] != 0.0)
    for step in np.flatnonzero(slides):
        mine = (samples.step == step) & (history.step_creepage[step] != 0.0)
        if not np.any(mine):
            worn = wears
            continue
        creepage = float(np.mean(samples.creepage[mine]))
        ratio = samples.ratio[mine] * np.sign(creepage)
        error = float(np.std(ratio)) / np.sqrt(len(ratio))
        limit = abs(float(np.mean(by_creepage[mine]))) + float(np.mean(by_pressure[mine]))
        finding = Finding(
            rule="elastic limit",
            subject=f"T/N of step {step + 1}",
            value=float(np.mean(ratio)),
            low=0.0,
            high=limit * LIMIT_MARGIN + 2.0 * error,
            unit="1",
            why=f"linear theory at {_number(abs(creepage) * 100.0)} %",
            hint="no mu explains more: are the zero of creepage, the stiffness and the load right?",
        )
        if limit < 1.0 and (finding.ok or not worn):
            yield finding
        worn |= wears and finding.value < STICKS * limit


def _linear_theory(facts: Facts) -> tuple[Floats, Floats]:
    """T/N at each sample of patches that stick all over: by their creepage, and by the pressure of unlike discs."""
    test, prediction = facts.test, facts.prediction
    state = prediction.state
    load = np.broadcast_to(state.normal_load / state.nominal_load, prediction.section.shape)
    patch = prediction.paths.patch(prediction.section, load)
    patch = patch.with_layer(test.options.layer_compliance, line=test.rig.is_line)
    slip = np.abs(slip_of_pressure(test.rig, patch.a, patch.b, state.normal_load))
    per_slip = patch.stiffness * state.slope / state.recorded_load
    by_creepage, by_pressure = (facts.model.points.traction(per_slip * s)[0] for s in (state.creepage, slip))
    return by_creepage, by_pressure


def traction_sign(facts: Facts) -> Iterator[Finding]:
    """The faster disc drives: T/N has the sign of the creepage."""
    samples = facts.test.measured.traction
    if samples is None:
        return
    share = against_creepage(facts.test, samples)
    yield Finding(
        rule="sign",
        subject="the share of samples with T/N opposed to the creepage",
        value=share,
        low=0.0,
        high=0.5,
        unit="1",
        why="the faster disc, which drives the other,",
        sentence=f"{_number(100.0 * share)} % of the samples have T/N opposed to the creepage",
        hint="the faster disc drives the other: does one of the two count the other way round?",
    )


def pressure(facts: Facts) -> Iterator[Finding]:
    """The softer disc carries the peak pressure, under the greatest load."""
    hardness = min(facts.test.rig.disc1.hardness, facts.test.rig.disc2.hardness)
    subject, why = "Hertz's peak pressure", "the hardness of the softer disc"
    yield Finding("pressure", subject, float(facts.heaviest.patch.p0) * 1e-6, 0.0, hardness * 1e-6, "MPa", why)


def shakes_down(facts: Facts) -> Iterator[Finding]:
    """Archard's law reads wear of surfaces that no longer flow: in the iteration that is nearest to flowing."""
    rig, ratio = facts.test.rig, np.abs(facts.ratio)
    k = float(shakedown.shear_yield(min(rig.disc1.hardness, rig.disc2.hardness)))
    known = np.flatnonzero(np.isfinite(ratio) & facts.test.history.driven)
    falling = known[np.lexsort((-ratio[known], -facts.load[known]))]
    above = np.diff(np.maximum.accumulate(ratio[falling]), prepend=-1.0) > 0.0
    worst = [_shakedown(replace(rig, normal_load=float(facts.load[i])), float(ratio[i]), k) for i in falling[above]]
    if worst:
        yield max(worst, key=lambda finding: finding.strain)


def _shakedown(rig: Rig, ratio: float, k: float) -> Finding:
    """p0 over the yield stress k [Pa] in shear, at T/N."""
    patch = rig.patch
    return Finding(
        rule="shakedown",
        subject=f"p0 / k of the softer disc at T/N = {_number(ratio)}",
        value=float(patch.p0) / k,
        low=0.0,
        high=float(shakedown.limits(ratio, float(patch.a), np.inf if rig.is_line else float(patch.b))[1]),
        unit="1",
        why="shakedown",
        hint="beyond it every pass leaves plastic strain, and Archard's law alone does not read the wear",
    )


def small_patch(facts: Facts) -> Iterator[Finding]:
    """Hertz's theory takes a patch that is small against the radii, Kalker's one that is not too slender."""
    rig, patch = facts.heaviest, facts.heaviest.patch
    largest = max(float(patch.a) * rig.curvature_x, float(patch.b) * rig.curvature_y)
    yield Finding("theory", "the patch over its radius", largest, 0.0, 0.3, "1", "a half-space")
    if rig.is_line:
        yield Finding("theory", "the line's half-length over its half-width", float(patch.a / patch.b), 0.0, 0.3, "1",
                      "a plane contact, whose ends do not count,")  # fmt: skip
        return
    ratio, longest = float(patch.a / patch.b), kalker.RATIO_RANGE[1]
    yield Finding("theory", "the axis ratio a/b", ratio, 0.0, longest, "1", "the range of Kalker's coefficients")


RULES: tuple[Callable[[Facts], Iterator[Finding]], ...] = (
    chord_and_depth,
    stated_depth,
    volume_and_energy,
    weighings,
    mass_and_profile,
    heat_and_temperature,
    start_temperature,
    elastic_limit,
    traction_sign,
    pressure,
    shakes_down,
    small_patch,
)


OF_DATA: tuple[Callable[[Facts], Iterator[Finding]], ...] = (
    weighings,
    mass_and_profile,
    heat_and_temperature,
    start_temperature,
)
"""Rules by which data contradict each other or what was declared, whatever the model lacks."""


def contradictions(test: Experiment) -> list[str]:
    """What is wrong with the data of a test, for the commands that use them."""
    facts = Facts(test)
    return [f"contradiction: {f.message}" for rule in OF_DATA for f in rule(facts) if not f.ok]


def findings(test: Experiment) -> list[Finding]:
    """Every rule that can be applied to a test, with its outcome."""
    facts = Facts(test)
    return [finding for rule in RULES for finding in rule(facts)]


def measured(test: Experiment) -> dict[str, dict[str, Any]]:
    """What was measured, by channel: how many samples, and from where to where they reach in the unit shown."""
    results = {}
    for name in measured_channels(test):
        channel = channels()[name]
        values = channel.quantity.shown.of_si(channel.values(channel.samples(test)))
        low, high = (float(end) for end in (values.min(), values.max()))
        results[name] = {"samples": len(values), "range": {"low": low, "high": high, "unit": channel.quantity.unit}}
    return results


def _range(name: str, ends: dict[str, Any]) -> str:
    return f"{name} {_number(ends['low'])} to {_number(ends['high'])} {for_reading(ends['unit'])}".rstrip()


def run(test: Test) -> Result:
    """Check a test; exit code 5 where anything contradicts."""
    result = findings(test.experiment)
    problems = [finding for finding in result if not finding.ok]
    seen = measured(test.experiment)
    summary = [f"{len(result)} checks, {len(problems)} contradiction{'' if len(problems) == 1 else 's'}"]
    summary += [f"measured: {', '.join(_range(name, its['range']) for name, its in seen.items())}"] if seen else []
    summary += [f"  contradiction: {finding.message}" for finding in problems]
    summary += [f"  ok: {finding.message}" for finding in result if finding.ok]
    return Result(
        command="check",
        summary=tuple(summary),
        json={
            "problems": [finding.json() for finding in problems],
            "findings": [finding.json() for finding in result if finding.ok],
            "measured": seen,
        },
        dataset=_dataset(result),
        figure=lambda: _figure(test.experiment, result),
        exit_code=NEGATIVE_FINDING if problems else 0,
    )


def _figure(test: Experiment, result: list[Finding]) -> Figure:
    from twindisc_cli.figures.consistency import consistency

    several = Counter(finding.subject for finding in result)
    labels = [f"{f.subject}, {f.why.split()[0]}" if several[f.subject] > 1 else f.subject for f in result]
    strains = [finding.strain for finding in result]
    return consistency(labels, strains, title=f"{test.name}: consistency", note=test.measured.provenance)


def _dataset(result: list[Finding]) -> Dataset:
    strain = np.array([finding.strain for finding in result])
    return Dataset(
        axes=(Axis("finding", np.arange(1, len(result) + 1), "1", "number of the check"),),
        arrays=(
            Array("rule", ("finding",), np.array([f.rule for f in result], dtype=object), "1", "rule applied"),
            Array("message", ("finding",), np.array([f.message for f in result], dtype=object), "1", "what was found"),
            Array(
                "strain",
                ("finding",),
                strain,
                "1",
                "share of the allowed range that is used; above 1 contradicts",
                True,
            ),
        ),
    )
