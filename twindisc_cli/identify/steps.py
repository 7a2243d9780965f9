"""The coefficient of friction of each step of a test, with all declared effects and laws acting.

What is found is the base coefficient: where no friction effect is declared, it is the friction in the contact itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.identify.coupled_steps import CoupledSteps
from twindisc_cli.identify.friction import (
    AGAINST_CREEPAGE,
    HIGHEST,
    HIGHEST_THAT_WEARS,
    LIGHT_LINE,
    LOWEST,
    NO_CREEPAGE,
    NO_LONGITUDINAL,
    half_interval,
    mean_and_interval,
    mu_from_traction,
    states,
)
from twindisc_cli.identify.law import unworn_law
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, Traction, TractionSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.traction_law import share_of_full_slip

FAR_BEYOND = 2.0
"""A step slides all over, whatever the contact's softness, at so many times the creepage of full slip."""
REVERSED = 0.9
"""Share of the samples against the creepage from which the sign of T/N is not the program's."""
Explanation = tuple[Callable[..., Floats], Callable[[Floats], Floats]]


@dataclass(frozen=True)
class StepFriction:
    """What the measured traction of each step says, each (step,); NaN where nothing was measured.

    creepage and ratio T/N, means of the samples [1], with their signs; scatter, half the 90 % interval of ratio by the
    scatter of the samples; zero, of_creepage: standard errors of ratio by the torque's zero, and by that of the mean
    creepage with the slope of the creep curve; mu and its interval low ... high [1], inf above the elastic limit;
    share, T/(mu N) at mu; state, None where nothing was measured. approximate: by how much mu is higher by the exact
    law, where FASTSIM is declared on two cylinders; it is in the interval.
    """

    creepage: Floats
    ratio: Floats
    scatter: Floats
    zero: Floats
    of_creepage: Floats
    mu: Floats
    low: Floats
    high: Floats
    share: Floats
    state: list[str | None]
    approximate: Floats

    @property
    def half(self) -> Floats:
        """Half the 90 % interval of ratio (step,), from the samples' scatter and the error of the torque's zero."""
        return np.hypot(self.scatter, half_interval(self.zero))


class FrictionInUse(NamedTuple):
    """The mu of each step, and what the error of its T/N means for the energy; each (step,).

    mu [1], NaN where it is unknown; source: given, identified, constant or unknown; own, of_zero: standard errors of
    T/N over T/N [1], by the samples of the step and by the zero of the torque, which errs in all steps together; zero
    where mu was not identified.
    """

    mu: Floats
    source: list[str]
    own: Floats
    of_zero: Floats

    def error_of(self, energy: Floats) -> float:
        """Standard error of the energy that the steps dissipate (step,) [J] together, over that energy; 0 of none."""
        error = np.hypot(np.linalg.norm(energy * self.own), energy @ self.of_zero)
        return float(error / np.sum(energy)) if np.any(energy > 0.0) else 0.0


def identify_friction(model: ForwardModel) -> StepFriction:
    """Invert the measured traction of every step."""
    model = model.unbounded
    samples = model.experiment.measured.traction
    if samples is None:
        raise MeasurementError("no traction was measured; name its file under [measured]")
    refuse_reversed(model.experiment)
    steps = len(model.experiment.history.step_creepage)
    ratio, scatter = mean_and_interval(samples.ratio, samples.uncertainty, samples.step, steps)
    zero, of_creepage = zero_error(model.experiment), np.zeros(steps)
    creepage, _ = mean_and_interval(samples.creepage, samples.uncertainty, samples.step, steps)
    sense = np.where(creepage < 0.0, -1.0, 1.0)
    plain = model.experiment.is_plain and model.experiment.history.is_constant and not _wears(model.experiment)
    traction, share_at = _in_closed_form(model.experiment, samples) if plain else _through_model(model, samples)
    highest = HIGHEST_THAT_WEARS if _wears(model.experiment) else HIGHEST
    inverted: Callable[[Floats], Floats]
    if plain:
        inverted = partial(mu_from_traction, traction=lambda mu: sense * traction(mu), highest_mu=highest)
    else:
        mean = _mean_of_steps(model.experiment, samples)
        inverted = CoupledSteps(model, lambda values: sense * mean(values), highest).mu_of
    if np.any(error := creepage_error(model.experiment)):
        mu = np.clip(np.nan_to_num(inverted((sense * ratio)[None]), nan=1.0), LOWEST, highest)
        off = traction(mu, error) - traction(mu, -error)
        of_creepage = 0.5 * np.nan_to_num(off[0])
    half = np.hypot(scatter, half_interval(np.hypot(zero, of_creepage)))
    mu, low, high = inverted(np.stack([sense * ratio, sense * ratio - half, sense * ratio + half]))
    apart = model_error(model.experiment, samples, sense, sense * ratio)
    low, high = low + np.minimum(apart, 0.0), high + np.maximum(apart, 0.0)
    share = share_at(np.where(np.isfinite(mu) & (mu > 0.0), mu, 1.0))
    idle = model.experiment.history.step_creepage == 0.0
    mu, low, high, share = (np.where(idle, np.nan, values) for values in (mu, low, high, share))
    unslipped = np.where(model.slips, NO_LONGITUDINAL, NO_CREEPAGE)
    unseen = [str(name) if np.isfinite(r) else None for r, name in zip(ratio, unslipped, strict=True)]
    known = states(mu, high, share)
    against = np.array([state == AGAINST_CREEPAGE for state in known])
    mu, low, high, share = (np.where(against, np.nan, values) for values in (mu, low, high, share))
    state = [none if no_slip else s for s, no_slip, none in zip(known, idle, unseen, strict=True)]
    return StepFriction(creepage, ratio, scatter, zero, of_creepage, mu, low, high, share, state, approximate=apart)


def against_creepage(test: Experiment, samples: TractionSamples) -> float:
    """Share of the samples of driven steps whose T/N has not the sign of the creepage [1]: the faster disc drives."""
    sense = np.sign(test.history.step_creepage[samples.step])
    driven = sense != 0.0
    return float(np.mean((samples.ratio * sense)[driven] < 0.0)) if np.any(driven) else 0.0


def refuse_reversed(test: Experiment) -> None:
    """MeasurementError where hardly any T/N has the sign of the creepage."""
    samples = test.measured.traction
    if samples is not None and (share := against_creepage(test, samples)) > REVERSED:
        what = (
            f"{100.0 * share:.0f} % of the T/N lie against the creepage, and the faster disc drives the other: is it "
            "counted the other way round? Then columns.traction_ratio = { sign = -1 } turns it, or .torque of a log"
        )
        raise MeasurementError(Problem(what, key="measured"))


def zero_error(test: Experiment) -> Floats:
    """Standard error of T/N in each step from the zero of the torque (step,); 0 where none was taken off."""
    zero = test.measured.torque_zero
    if zero is None or not zero.taken_off:
        return np.zeros(len(test.history.step_creepage))
    return np.asarray(np.nan_to_num(zero.of_step))


def creepage_error(test: Experiment) -> Floats:
    """Standard error [1] of the mean creepage of each step, by the noise that was taken off it (step,)."""
    steps = len(test.history.step_creepage)
    if test.measured.traction is None:
        return np.zeros(steps)
    count = np.bincount(test.measured.traction.step, minlength=steps)
    return np.asarray(test.measured.creepage_noise / np.sqrt(np.maximum(count, 1)))


def softness(test: Experiment, friction: StepFriction) -> Floats:
    """The slope that steps below full sliding ask for, over the theory's, if mu is as in full sliding; (step,).

    NaN of other steps and of those under yaw, of all where none slides all over or declared effects act. Below 1 the
    contact is softer than smooth discs, as rough or covered ones are, or friction is lower there: T/N alone does not
    show which.
    """
    first = test.history.step_begin
    known = np.isfinite(friction.mu) & (friction.mu > 0.0) & (test.history.yaw[first] == 0.0)
    result = np.full(len(first), np.nan)
    if not (test.is_plain and np.any(known)):
        return result
    law, creepage, ratio = unworn_law(test), np.abs(friction.creepage), np.abs(friction.ratio)
    load_factor = test.history.load_factor[first]
    slope = law.slope * test.rig.area_ratio(load_factor) / load_factor
    slides = known & (creepage > FAR_BEYOND * friction.mu / slope * law.full_slip)
    if not np.any(slides):
        return result
    mu = float(np.mean(friction.mu[slides]))
    below = known & (creepage < mu / slope * law.full_slip) & (ratio < LIGHT_LINE * mu)
    result[below] = law.unsaturation(ratio[below] / mu) * mu / (slope * creepage)[below]
    return result


def friction_in_use(model: ForwardModel, identified: StepFriction | None = None) -> FrictionInUse:
    """The mu of each step, and where it is from; identified: that of the measured traction, where it is known."""
    test = model.experiment
    first = test.history.step_begin
    given, constant = test.history.given_mu[first], test.options.friction_coefficient
    own, of_zero, result = np.zeros(len(first)), np.zeros(len(first)), np.full(len(first), np.nan)
    if test.measured.traction is not None:
        friction = identified or identify_friction(model)
        result, ratio = friction.mu, np.where(friction.mu > 0.0, friction.ratio, np.nan)
        own, of_zero = np.hypot(friction.scatter / NINETY, friction.of_creepage) / ratio, friction.zero / ratio
    choices = [("given", given), ("identified", np.where(result > 0.0, result, np.nan)), ("constant", constant)]
    mu, source = np.full(len(first), np.nan), np.full(len(first), "unknown", dtype=object)
    for name, values in reversed(choices):
        known = np.isfinite(np.broadcast_to(values, mu.shape))
        mu, source = np.where(known, values, mu), np.where(known, name, source)
    own, of_zero = (np.where((source == "identified") & np.isfinite(error), error, 0.0) for error in (own, of_zero))
    return FrictionInUse(mu, [str(name) for name in source], own, of_zero)


def energy_of_steps(model: ForwardModel, mu: Floats) -> Floats:
    """Energy that each step dissipates with mu (step,) in the contact [J], (step,)."""
    state = model.predict(BaseParameters.declared(model.experiment, mu[None]), profiled=False).state
    step, spent = model.experiment.history.step[model.points.iteration], state.power * state.duration
    return np.asarray(np.bincount(step, np.broadcast_to(spent, (1, len(step)))[0], minlength=len(mu)))


def _wears(test: Experiment) -> bool:
    """Whether a wear coefficient is declared, so that the worn patch is known at each step."""
    return bool(test.options.wear_coefficient > 0.0)


def model_error(test: Experiment, samples: TractionSamples, sense: Floats, ratio: Floats) -> Floats:
    """By how much mu lies higher by the exact law where FASTSIM is declared on two cylinders (step,); else 0.

    sense, ratio: sign of the creepage, and T/N in its direction (step,). Both mu are of the unworn discs.
    """
    if not test.approximates_a_line:
        return np.zeros(len(ratio))

    def mu_by(theory: Traction) -> Floats:
        law, _ = _in_closed_form(replace(test, options=replace(test.options, traction=theory)), samples)
        return mu_from_traction(ratio, traction=lambda mu: sense * law(mu))

    declared, exact = mu_by("fastsim"), mu_by("exact")
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(exact - declared, nan=0.0, posinf=np.inf, neginf=0.0)


def _in_closed_form(test: Experiment, samples: TractionSamples) -> Explanation:
    """T/N (..., step) over mu (..., step), and T/(mu N) (step,), by the declared law on the unworn patch.

    T/N is that at creepages that are larger by `more` [1] (step,), where it is given.
    """
    law, mean = unworn_law(test), _mean_of_steps(test, samples)

    def traction(mu: Floats, more: Floats | None = None) -> Floats:
        creepage = samples.creepage if more is None else samples.creepage + more[samples.step]
        return mean(law.apparent(mu[..., samples.step], creepage))

    def share(mu: Floats) -> Floats:
        return mean(law.saturation(law.slope * np.abs(samples.creepage) / mu[samples.step]))

    return traction, share


def _through_model(model: ForwardModel, samples: TractionSamples) -> Explanation:
    """The same with the declared effects and wear acting, mu (set, step)."""
    mean, history = _mean_of_steps(model.experiment, samples), model.experiment.history

    def traction(mu: Floats, more: Floats | None = None) -> Floats:
        base = BaseParameters.declared(model.experiment, mu)
        if more is not None:
            creepage = np.where(history.creepage == 0.0, np.inf, history.creepage)
            base = replace(base, creepage_factor=(1.0 + more[history.step] / creepage)[None])
        return mean(model.predict(base, profiled=False).traction)

    def share(mu: Floats) -> Floats:
        state = model.predict(BaseParameters.declared(model.experiment, mu[None]), profiled=False).state
        return mean(model.points.traction(share_of_full_slip(model.experiment.rig, state))[0])

    return traction, share


def _mean_of_steps(test: Experiment, samples: TractionSamples) -> Callable[[Floats], Floats]:
    """The mean of values (..., sample) over the samples of each step, (..., step); NaN where a step has none."""
    count = np.bincount(samples.step, minlength=len(test.history.step_creepage))
    seen, order = np.flatnonzero(count), np.argsort(samples.step, kind="stable")
    first = (np.cumsum(count) - count)[seen]

    def mean(values: Floats) -> Floats:
        result = np.full((*values.shape[:-1], len(count)), np.nan)
        result[..., seen] = np.add.reduceat(values[..., order], first, axis=-1) / count[seen]
        return result

    return mean
