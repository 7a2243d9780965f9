"""The coefficient of friction of each step of a test, through the forward model, with all declared effects acting.

What is found is the base coefficient: where no friction effect is declared, it is the friction in the contact itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twindisc_cli.identify.friction import mean_and_interval, mu_from_traction, states
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel, Prediction

ISOTHERMAL = 1e6
"""Convection [W/K] where none is known: the disc stays at its environment's temperature."""


@dataclass(frozen=True)
class StepFriction:
    """What the measured traction of each step says, each (step,); NaN where nothing was measured.

    creepage and ratio T/N, means of the samples [1]; half, half the 95 % interval of ratio; mu and its interval
    low ... high [1], inf above the elastic limit; share, T/(mu N) at mu; state, None where nothing was measured.
    """

    creepage: Floats
    ratio: Floats
    half: Floats
    mu: Floats
    low: Floats
    high: Floats
    share: Floats
    state: list[str | None]


def base_parameters(test: Experiment, mu: Floats, *, wear_coefficient: float = np.nan) -> dict[str, Floats]:
    """What the forward model takes for mu (set, step): K as given here or declared, else no wear."""
    chosen = wear_coefficient if np.isfinite(wear_coefficient) else test.options.wear_coefficient
    declared = test.thermal.convection if test.thermal else np.nan
    return {
        "mu": mu[:, test.history.step],
        "K": np.full(len(mu), np.nan_to_num(chosen)),
        "convection_W_K": np.full(len(mu), declared if np.isfinite(declared) else ISOTHERMAL),
    }


def identify_friction(model: ForwardModel) -> StepFriction:
    """Invert the measured traction of every step; the test must have one."""
    samples = model.experiment.measured.traction
    if samples is None:
        raise ValueError("no traction was measured")
    steps = len(model.experiment.history.step_creepage)
    ratio, half = mean_and_interval(samples.ratio, samples.uncertainty, samples.step, steps)
    creepage = np.bincount(samples.step, samples.creepage, steps) / np.bincount(samples.step, minlength=steps)
    sense = np.where(creepage < 0.0, -1.0, 1.0)

    def traction(mu: Floats) -> Floats:
        return sense * _per_step(model, _predicted(model, mu).traction)

    targets = sense * ratio + np.outer([0.0, -1.0, 1.0], half)
    mu, low, high = mu_from_traction(targets, traction=traction)
    finite = np.where(np.isfinite(mu) & (mu > 0.0), mu, 1.0)[None]
    share = _share(model, _predicted(model, finite))
    return StepFriction(
        creepage=creepage, ratio=ratio, half=half, mu=mu, low=low, high=high, share=share, state=states(mu, share)
    )


def friction_in_use(model: ForwardModel) -> tuple[Floats, list[str]]:
    """The mu of each step (step,), and where it is from: given, identified, constant, or unknown (NaN)."""
    test = model.experiment
    first = np.unique(test.history.step, return_index=True)[1]
    given, constant = test.history.given_mu[first], test.options.friction_coefficient
    found = identify_friction(model).mu if test.measured.traction is not None else np.full(len(first), np.nan)
    choices = [("given", given), ("identified", np.where(found > 0.0, found, np.nan)), ("constant", constant)]
    mu, source = np.full(len(first), np.nan), np.full(len(first), "unknown", dtype=object)
    for name, values in reversed(choices):
        known = np.isfinite(np.broadcast_to(values, mu.shape))
        mu, source = np.where(known, values, mu), np.where(known, name, source)
    return mu, [str(name) for name in source]


def _predicted(model: ForwardModel, mu: Floats) -> Prediction:
    return model.predict(base_parameters(model.experiment, mu))


def _per_step(model: ForwardModel, values: Floats) -> Floats:
    """Mean over the samples of each step: (set, sample) to (set, step); NaN where a step has none."""
    samples = model.experiment.measured.traction
    steps = len(model.experiment.history.step_creepage)
    belongs = np.asarray(samples.step[:, None] == np.arange(steps), dtype=float) if samples else np.empty((0, steps))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(values @ belongs / belongs.sum(axis=0))


def _share(model: ForwardModel, prediction: Prediction) -> Floats:
    """T/(mu N) of each step (step,) in the contact, from the power; NaN without creepage."""
    state = prediction.state
    with np.errstate(invalid="ignore", divide="ignore"):
        share = state.power / (state.sliding_speed * state.mu * state.normal_load)
    at_samples = np.broadcast_to(share, prediction.section.shape)[:, model.points.of_traction]
    return np.asarray(_per_step(model, at_samples)[0])
