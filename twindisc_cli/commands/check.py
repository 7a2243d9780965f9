"""check: do the definition, the data and the numbers stated elsewhere agree with each other?

General rules, for any test; each compares a value with the range that geometry or a balance allows.

    chord and depth     a facet of width w on a relative curvature k is w^2 k / 8 deep; the elastic patch adds at most
                        its own width 2b, so a depth d allows w between sqrt(8 d / k) and sqrt(8 d / k + 4 b^2)
    weighings           a disc gains no mass: losses count from the beginning of the test
    mass and profile    m = rho W, of the same disc at the same stop
    volume and energy   K = W H / E with the dissipated energy E = sum (T/N) N V creepage duration (Eq. 13)
    heat                a rise is at most P / (h S), and at most E / C (Eq. 18 without and with only storage)
    elastic limit       T/N is at most G a b C11 creepage / N (Eq. 9), whatever mu is
    pressure            Hertz's p0 stays below the hardness
    shakedown           p0 / k stays below the limit at the greatest T/N, k = H / (3 sqrt 3)
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.definition import Test
from twindisc_cli.errors import NEGATIVE_FINDING
from twindisc_cli.identify.steps import against_creepage
from twindisc_cli.identify.track import Track, last_profile, worn_track
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.noise import scatter
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.traction_law import creep_stiffness, slip_of_pressure
from twindisc_cli.physics import kalker, shakedown
from twindisc_cli.physics.archard import allowed_coefficient, worn_volume
from twindisc_cli.quantities import for_reading
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GEOMETRY_MARGIN = 1.15  # of a width or depth: where the worn zone ends is a matter of reading
MASS_MARGIN = 1.2  # of a mass: the profile is of one place around the disc
GAIN_MARGIN = 0.05  # of the mass lost, by which a disc may gain where no uncertainty was stated: oil, debris
GAIN_ERRORS = 5.0  # standard errors by which it may where one was: less than one weighing in a million by chance
ENERGY_MARGIN = 1.5  # of W H / E: a volume and an energy enter, each with its own error
LIMIT_MARGIN = 1.05  # of what nothing can exceed, for the values that it is computed from
NOISES, FEWEST_READINGS = 3.0, 12
"""Standard deviations of the noise by which the coldest reading may lie below the disc, and readings that show it."""
COLDER = 2.0  # [K]; thermocouples err by 1.5 (class 1) to 2.5 (class 2), IEC 60584-1


@dataclass(frozen=True)
class Finding:
    """A value held against the range that the physics allows, in the unit given; ok: whether it lies inside."""

    rule: str
    subject: str
    value: float
    low: float
    high: float
    unit: str
    why: str
    hint: str = ""

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
        hint = f"; {self.hint}" if self.hint else ""
        return f"{self.subject} is {_number(self.value)}{unit}, {self.why} allows {limits}{unit}{hint}"

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
    def ratio(self) -> Floats:
        """T/N along the creepage of each iteration: measured, else given or declared; NaN: not known. (iteration,)."""
        history, samples = self.test.history, self.test.measured.traction
        ratio = np.where(np.isfinite(history.given_mu), history.given_mu, self.test.options.friction_coefficient)
        if samples is not None:
            for step in np.unique(samples.step):
                mean = np.mean(samples.ratio[samples.step == step]) * np.where(history.creepage < 0.0, -1.0, 1.0)
                ratio = np.where(history.step == step, mean, ratio)
        return np.where(history.creepage == 0.0, 0.0, ratio)

    @cached_property
    def power(self) -> Floats:
        """Dissipated power of each iteration [W], (iteration,)."""
        rig, history = self.test.rig, self.test.history
        load, speed = rig.normal_load * history.load_factor, rig.rolling_speed * history.speed_factor
        return self.ratio * load * speed * np.abs(history.creepage)

    @cached_property
    def energy(self) -> float:
        """Energy dissipated over the test [J]."""
        return float(np.sum(self.power * self.test.history.duration))

    @cached_property
    def track(self) -> Track | None:
        """The track in the last measured profile."""
        profile = self.test.measured.profile
        if profile is None:
            return None
        last = last_profile(profile)
        return worn_track(profile.y[last], profile.height[last], smooth=True)

    @cached_property
    def volume(self) -> float:
        """Volume missing in the last measured profile [m3]; NaN without one."""
        profile = self.test.measured.profile
        if profile is None:
            return np.nan
        last = last_profile(profile)
        disc = self.test.rig.disc1 if profile.disc[last][0] == 1 else self.test.rig.disc2
        return float(worn_volume(y=profile.y[last], depth=-profile.height[last], rolling_radius=disc.rolling_radius))


def chord_and_depth(facts: Facts) -> Iterator[Finding]:
    """A depth and a width, of the profile or as reported, must belong to the same facet."""
    pairs: list[tuple[str, float, float]] = []
    if facts.track:
        pairs.append((facts.test.measured.provenance, facts.track.depth, facts.track.width))
    if {"depth", "width"} <= set(facts.test.reported):
        pairs.append(("reported", facts.test.reported["depth"], facts.test.reported["width"]))
    for kind, depth, width in pairs:
        curvature = facts.test.rig.curvature_y
        if facts.test.rig.is_line:
            yield _over_the_width(facts, kind, width)
            continue
        facet = 8.0 * depth / curvature
        needed = facet_depth(width, curvature)
        yield Finding(
            rule="chord and depth",
            subject=f"the {kind} width",
            value=width * 1e3,
            low=np.sqrt(facet) / GEOMETRY_MARGIN * 1e3,
            high=np.sqrt(facet + (2.0 * float(facts.test.rig.patch.b)) ** 2) * GEOMETRY_MARGIN * 1e3,
            unit="mm",
            why=f"the {kind} depth of {_number(depth * 1e6)} µm on one disc",
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
        yield Finding(
            rule="weighings",
            subject=f"what disc {which} gained from iteration {mass.iteration[own[worst]]} to "
            f"{mass.iteration[own[worst + 1]]}",
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


def volume_and_energy(facts: Facts) -> Iterator[Finding]:
    """A wear coefficient must join the worn volume and the dissipated energy."""
    volumes = _volumes(facts)
    if not volumes or not facts.energy > 0.0:
        return
    hardness = facts.test.rig.disc2.hardness
    allowed = [float(allowed_coefficient(volume=v, energy=facts.energy, hardness=hardness)) for v in volumes.values()]
    given = {
        "the reported wear coefficient K": facts.test.reported.get("wear_coefficient", np.nan),
        "the declared wear coefficient K": facts.test.options.wear_coefficient,
    }
    for subject, value in given.items():
        if np.isfinite(value):
            yield Finding(
                rule="volume and energy",
                subject=subject,
                value=value,
                low=min(allowed) / ENERGY_MARGIN,
                high=max(allowed) * ENERGY_MARGIN,
                unit="1",
                why=f"the worn volume ({' or '.join(volumes)}) with {_number(facts.energy * 1e-3)} kJ",
                hint=f"W H / E is {' or '.join(_number(k) for k in allowed)}, "
                f"and K is {' or '.join(_number(value / k if k else np.inf) for k in allowed)} times that",
            )


def _volumes(facts: Facts) -> dict[str, float]:
    """Worn volumes [m3] by what they come from: the profile, and the facet that a reported depth cuts."""
    volumes = {}
    mass = facts.test.measured.mass
    if mass is not None:
        last = mass.iteration == mass.iteration.max()
        density = np.where(mass.disc == 1, facts.test.rig.disc1.density, facts.test.rig.disc2.density)
        volumes["weighed mass"] = float(np.sum((mass.loss / density)[last]))
    if facts.volume > 0.0:
        volumes[f"{facts.test.measured.provenance} profile"] = facts.volume
    depth = facts.test.reported.get("depth")
    radius = facts.test.rig.disc2.rolling_radius
    if depth and np.isfinite(radius):
        rig = facts.test.rig
        section = depth * (rig.width if rig.is_line else 2.0 / 3.0 * np.sqrt(8.0 * depth / rig.curvature_y))
        volumes["facet of the reported depth"] = 2.0 * np.pi * radius * section
    return volumes


def heat_and_temperature(facts: Facts) -> Iterator[Finding]:
    """A temperature rise must be paid for by the dissipated heat."""
    thermal, samples = facts.test.thermal, facts.test.measured.temperature
    if thermal is None or not facts.energy > 0.0:
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


def _noise(readings: Floats) -> float:
    """Standard deviation of what readings (sample,) scatter from one to the next; 0 where they are too few."""
    return scatter(np.diff(readings, 2)) / np.sqrt(6.0) if len(readings) >= FEWEST_READINGS else 0.0


def elastic_limit(facts: Facts) -> Iterator[Finding]:
    """No coefficient of friction makes T/N larger than linear theory does at that creepage."""
    samples, rig = facts.test.measured.traction, facts.test.rig
    if samples is None:
        return
    try:
        slope = float(creep_stiffness(rig, rig.patch.a, rig.patch.b)[0]) / rig.normal_load
    except ValueError:
        return
    of_pressure = abs(float(slip_of_pressure(rig, rig.patch.a, rig.patch.b, np.asarray(rig.normal_load))))
    for step in np.unique(samples.step):
        mine = samples.step == step
        creepage = float(np.mean(samples.creepage[mine]))
        ratio = samples.ratio[mine] * np.sign(creepage)
        error = float(np.std(ratio)) / np.sqrt(len(ratio))
        creepage, nominal = abs(creepage) + of_pressure, facts.test.history.step_creepage[step]
        if nominal != 0.0 and slope * creepage < 1.0:
            yield Finding(
                rule="elastic limit",
                subject=f"T/N of step {step + 1}",
                value=float(np.mean(ratio)),
                low=0.0,
                high=slope * creepage * LIMIT_MARGIN + 2.0 * error,
                unit="1",
                why=f"linear theory at {_number(creepage * 100.0)} %",
                hint="no mu explains more: are the zero of creepage, the stiffness and the load right?",
            )


def traction_sign(facts: Facts) -> Iterator[Finding]:
    """The faster disc drives: T/N has the sign of the creepage."""
    samples = facts.test.measured.traction
    if samples is not None:
        share = against_creepage(facts.test, samples)
        why = "the faster disc, which drives the other,"
        yield Finding("sign", "the share of samples with T/N against the creepage", share, 0.0, 0.5, "1", why)


def pressure(facts: Facts) -> Iterator[Finding]:
    """The softer disc carries the peak pressure."""
    hardness = min(facts.test.rig.disc1.hardness, facts.test.rig.disc2.hardness)
    subject, why = "Hertz's peak pressure", "the hardness of the softer disc"
    yield Finding("pressure", subject, float(facts.test.rig.patch.p0) * 1e-6, 0.0, hardness * 1e-6, "MPa", why)


def shakes_down(facts: Facts) -> Iterator[Finding]:
    """Archard's law reads wear of surfaces that no longer flow."""
    rig, ratio = facts.test.rig, np.abs(facts.ratio)
    if not np.any(np.isfinite(ratio)):
        return
    k = float(shakedown.shear_yield(min(rig.disc1.hardness, rig.disc2.hardness)))
    patch, largest = rig.patch, float(np.nanmax(ratio))
    limit = float(shakedown.limits(largest, float(patch.a), np.inf if rig.is_line else float(patch.b))[1])
    yield Finding(
        rule="shakedown",
        subject=f"p0 / k of the softer disc at T/N = {_number(largest)}",
        value=float(patch.p0) / k,
        low=0.0,
        high=limit,
        unit="1",
        why="shakedown",
        hint="beyond it every pass leaves plastic strain, and Archard's law alone does not read the wear",
    )


def small_patch(facts: Facts) -> Iterator[Finding]:
    """Hertz's theory takes a patch that is small against the radii, Kalker's one that is not too slender."""
    rig, patch = facts.test.rig, facts.test.rig.patch
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
    elastic_limit,
    traction_sign,
    pressure,
    shakes_down,
    small_patch,
)


OF_DATA: tuple[Callable[[Facts], Iterator[Finding]], ...] = (weighings, mass_and_profile, heat_and_temperature)
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
    summary = [f"{len(result)} checks, {len(problems)} contradictions"]
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
