"""The model before the loop as the paper has it: the mu of each step as identified from T/N (Fig. 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.commands._base import friction_of_steps, wear_coefficient
from twindisc_cli.errors import TwindiscError
from twindisc_cli.identify.convection import identify_convection
from twindisc_cli.identify.wear import fit_wear_squares
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.diagnosis import ChannelError, Curve, Diagnosis
from twindisc_cli.loop.holdout import without
from twindisc_cli.loop.validate import rms
from twindisc_cli.model.base import MODEL_KEYS, BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel

ROUNDING = 1e-6
"""Of the noise: where each sample has a step of its own, its mu brings it back but for rounding."""


def with_step_friction(diagnosis: Diagnosis, tests: Sequence[Experiment]) -> Mapping[str, ChannelError]:
    """The errors of a diagnosis, each also with what the base model misses with the mu of each step.

    Every test has its own mu of each step, K and convection, found without the outliers that the errors leave out. An
    error stays NaN where a test has no traction, or steps of which no mu is known.
    """
    if not all("traction" in measured_channels(test) for test in tests):
        return diagnosis.errors
    try:
        predicted = {test.name: _predicted(test, _without_outliers(test, diagnosis.curves)) for test in tests}
    except TwindiscError:
        return diagnosis.errors
    misses: dict[str, list[Floats]] = {channel: [] for channel in diagnosis.errors if _is_of_the_model(channel)}
    for curve in diagnosis.curves:
        if curve.channel in misses:
            used = curve.kept & ~curve.held_out
            misses[curve.channel].append((curve.measured - predicted[curve.test][curve.channel])[used])
    known = {channel: channels()[channel].factor * rms(np.concatenate(each)) for channel, each in misses.items()}
    known = {c: error if error > ROUNDING * diagnosis.errors[c].noise else 0.0 for c, error in known.items()}
    return {c: replace(error, before_step_mu=known.get(c, np.nan)) for c, error in diagnosis.errors.items()}


def _is_of_the_model(channel: str) -> bool:
    """Whether a channel has no parameter of its own, which would have to be fitted first."""
    return all(parameter.key in MODEL_KEYS for parameter in channels()[channel].parameters)


def _wear_coefficient(model: ForwardModel, mu: Floats) -> float:
    """K as the model before has it: given, or that of the whole profile, or of the mass where there is no profile."""
    test = model.experiment
    if np.isnan(test.options.wear_coefficient) and test.measured.profile is not None:
        return fit_wear_squares(model, mu).value
    return wear_coefficient(model, mu)[0]


def _without_outliers(test: Experiment, curves: Sequence[Curve]) -> Experiment:
    """The test as if its outliers had never been measured."""
    outliers = {curve.channel: ~curve.kept for curve in curves if curve.test == test.name and not curve.kept.all()}
    return without(test, outliers) if outliers else test


def _predicted(test: Experiment, clean: Experiment) -> dict[str, Floats]:
    """Each measured channel (sample,) of a test by its base model with the mu of each step, found without outliers."""
    model = ForwardModel(test)
    source = model if clean is test else ForwardModel(clean)
    mu = friction_of_steps(source).mu
    base = replace(BaseParameters.declared(test, mu[None]), K=np.array([_wear_coefficient(source, mu)]))
    if "temperature" in measured_channels(test) and np.isnan(base.convection[0]):
        base = replace(base, convection=np.array([identify_convection(source, mu).value]))
    prediction = model.predict(base)
    return {c: channels()[c].predicted(model, prediction)[0] for c in measured_channels(test) if _is_of_the_model(c)}
