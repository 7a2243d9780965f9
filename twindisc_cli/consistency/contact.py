"""Contact: what no traction and no pressure can exceed, and where the theory ends.

elastic limit       T/N is at most G a b C11 creepage / N (Eq. 9) under the load of the step, whatever mu is
pressure            Hertz's p0 stays below the hardness, under the greatest load
shakedown           p0 / k stays below the limit at load and T/N of each iteration, k = H / (3 sqrt 3)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import LIMIT_MARGIN, Finding, number
from twindisc_cli.identify.steps import against_creepage
from twindisc_cli.model.experiment import Floats, Rig, TractionSamples
from twindisc_cli.model.traction_law import slip_of_pressure
from twindisc_cli.physics import kalker, shakedown

MOSTLY = 0.5
"""Share of the samples against the creepage above which it is their sign that is asked about, and not single steps."""
STICKS = 0.8  # of linear theory's T/N: below it so much of a patch slips that the discs wear


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
        mean, error = _mean(samples.ratio[mine] * np.sign(creepage))
        limit = abs(float(np.mean(by_creepage[mine]))) + float(np.mean(by_pressure[mine]))
        finding = Finding(
            rule="elastic limit",
            subject=f"T/N of step {step + 1}",
            value=mean,
            low=0.0,
            high=limit * LIMIT_MARGIN + 2.0 * error,
            unit="1",
            why=f"linear theory at {number(abs(creepage) * 100.0)} %",
            hint="no mu explains more: are the zero of creepage, the stiffness and the load right?",
        )
        if limit < 1.0 and (finding.ok or not worn):
            yield finding
        worn |= wears and finding.value < STICKS * limit


def _mean(ratio: Floats) -> tuple[float, float]:
    """Mean of T/N (sample,) and its standard error."""
    return float(np.mean(ratio)), float(np.std(ratio)) / np.sqrt(len(ratio))


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
    """The faster disc drives: T/N has the sign of the creepage, in all samples and in each step."""
    samples = facts.test.measured.traction
    if samples is None:
        return
    share = against_creepage(facts.test, samples)
    yield Finding(
        rule="sign",
        subject="the share of samples with T/N opposed to the creepage",
        value=share,
        low=0.0,
        high=MOSTLY,
        unit="1",
        why="the faster disc, which drives the other,",
        sentence=f"{number(100.0 * share)} % of the samples have T/N opposed to the creepage",
        hint="the faster disc drives the other: does one of the two count the other way round?",
    )
    if share <= MOSTLY:
        yield from _steps_against_creepage(samples, facts.test.history.step_creepage)


def _steps_against_creepage(samples: TractionSamples, creepage: Floats) -> Iterator[Finding]:
    """The steps in which it has not, by their creepage (step,)."""
    for step in np.intersect1d(np.flatnonzero(creepage), samples.step):
        mean, error = _mean(samples.ratio[samples.step == step] * np.sign(creepage[step]))
        if mean < -2.0 * error:
            yield Finding(
                rule="sign",
                subject=f"T/N of step {step + 1}",
                value=mean,
                low=0.0,
                high=np.inf,
                unit="1",
                why="the faster disc, which drives the other,",
                sentence=f"T/N of step {step + 1} is {number(abs(mean))} against the creepage",
                hint="are the sign and the zero of the torque right there, and which disc is the faster one?",
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
        subject=f"p0 / k of the softer disc at T/N = {number(ratio)}",
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
