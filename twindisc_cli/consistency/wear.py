"""Wear: the worn zone, weighings and the dissipated energy belong together.

chord and depth     a facet of width w on a relative curvature k is w^2 k / 8 deep; the elastic patch adds at most
                    its own width 2b, so a depth d allows w between sqrt(8 d / k) and sqrt(8 d / k + 4 b^2)
weighings           a disc gains no mass: losses count from the beginning of the test
mass and profile    m = rho W, of the same disc at the same stop
wears too fast      W H / E is 0.1 at the most
volume and energy   K = W H / E with the dissipated energy E = sum (T/N) N V creepage duration by then (Eq. 13)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import Finding, number
from twindisc_cli.consistency.profile import off_in_unit
from twindisc_cli.effects import catalogue
from twindisc_cli.identify.track import last_profile
from twindisc_cli.model.forward import acts_at
from twindisc_cli.physics.archard import allowed_coefficient

WEIGHED = {1: "weighed mass of disc 1", 2: "weighed mass of disc 2"}
GEOMETRY_MARGIN = 1.15  # of a width or depth: where the worn zone ends is a matter of reading
MASS_MARGIN = 1.2  # of a mass: the profile is of one place around the disc
GAIN_MARGIN = 0.05  # of the mass lost, by which a disc may gain where no uncertainty was stated: oil, debris
GAIN_ERRORS = 5.0  # standard errors by which it may where one was: less than one weighing in a million by chance
LARGEST_K = 0.1
"""W H / E: k = W H / (N s) is 7e-3 for mild steel on itself, the fastest (J. F. Archard and W. Hirst, Proc. R. Soc. A
236 (1956) 397-410), over a T/N of 0.07."""
ENERGY_MARGIN = 1.5  # of W H / E: a volume and an energy enter, each with its own error


def chord_and_depth(facts: Facts) -> Iterator[Finding]:
    """A depth and a width, of the profile or as reported, must belong to the same facet."""
    pairs: list[tuple[str, float, float, tuple[int, int]]] = []
    if facts.track and not off_in_unit(facts, facts.track):
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
        why=f"the {kind} depth of {number(depth * 1e6)} µm on one disc"
        + (f", {number(100.0 * part)} % of the wear," if part < 1.0 else ""),
        hint=f"a facet of this width is {number(needed * 1e6)} µm deep; or both discs wore, or the track wandered",
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
            why=f"the {facts.test.measured.provenance} profile with {number(disc.density)} kg/m³",
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


def wears_too_fast(facts: Facts) -> Iterator[Finding]:
    """No dry metal wears faster than Archard and Hirst found of like on like, far beyond the smallest friction."""
    for worn in _worn_volumes(facts):
        if facts.energy_by(worn.stop) > 0.0 and (k := _allowed(facts, worn)) > LARGEST_K:
            yield Finding(
                rule="wears too fast",
                subject=f"W H / E of the {worn.source}",
                value=k,
                low=0.0,
                high=LARGEST_K,
                unit="1",
                why="severe wear of metals",
                hint="are the load, mass or heights, hardness and revolutions in their units?",
            )


def _joined(facts: Facts, subject: str, value: float, volumes: list[Worn]) -> Iterator[Finding]:
    """A coefficient against W H / E of each of some volumes, and of both discs' weighed mass together."""
    if not volumes or not np.isfinite(value):
        return
    allowed = {worn.source: _allowed(facts, worn) for worn in volumes}
    energies = dict.fromkeys(number(facts.energy_by(worn.stop) * 1e-3) for worn in volumes)
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
        hint=f"W H / E is {' or '.join(number(k) for k in allowed.values())}, "
        f"and K is {' or '.join(number(value / k if k else np.inf) for k in allowed.values())} times that",
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
