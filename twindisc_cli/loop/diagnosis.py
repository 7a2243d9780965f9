"""What the closed loop concludes, as records for the report: verdict, effects, leftovers, errors, and the curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.effects._effect import Channel
from twindisc_cli.model.experiment import Floats, Ints

Verdict = Literal["effects_found", "no_missing_effect", "unexplained"]
UNITS: Mapping[Channel, tuple[str, float]] = {"traction": ("1", 1.0), "profile": ("um", 1e6), "temperature": ("K", 1.0)}
"""Unit of each channel's error, and the factor from SI to it."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its standard deviation and 90 % interval, in `unit`."""

    value: float
    std: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was added: parameters by key, the effects it cannot be told from, its probability in that set."""

    name: str
    channel: Channel
    parameters: Mapping[str, Estimate]
    alternatives: tuple[str, ...]
    probability: float


@dataclass(frozen=True)
class Unexplained:
    """Something left in a channel, and a covariate it depends on."""

    channel: Channel
    covariate: str
    kind: str
    share_of_variance: float
    p_value: float


@dataclass(frozen=True)
class ChannelError:
    """Root mean square of measured minus predicted, and the noise, all in `unit`; NaN where nothing is held out."""

    unit: str
    noise: float
    correlation: float
    before: float
    after: float
    held_out_before: float
    held_out_after: float


@dataclass(frozen=True)
class Tried:
    """One explanation that was tried for a channel."""

    channel: Channel
    effects: tuple[str, ...]
    gain: float
    evidence: float
    probability: float
    left_p_value: float
    left_length: float
    at_bound: tuple[str, ...]
    passed: bool


@dataclass(frozen=True)
class Curve:
    """One channel of one test in SI units, each (sample,): measured, predicted before and after, what was held out.

    unseen_before and unseen_after are of the answer found without what was held out; covariates by name (creepage,
    time, y, ...); kept is False for outliers.
    """

    test: str
    channel: Channel
    measured: Floats
    before: Floats
    after: Floats
    unseen_before: Floats
    unseen_after: Floats
    held_out: NDArray[np.bool_]
    kept: NDArray[np.bool_]
    covariates: Mapping[str, Floats | Ints]
    provenance: str


@dataclass(frozen=True)
class NextExperiment:
    """The history that would separate the models still alive best: steps for the definition and expected distances."""

    why: str
    steps: Sequence[Mapping[str, float]]
    rivals: tuple[str, ...]
    separation: float
    separation_now: float
    channel_wanted: str | None


@dataclass(frozen=True)
class Validation:
    """A test that was only predicted: its name, and the error of each channel before and after."""

    test: str
    errors: Mapping[Channel, ChannelError]


@dataclass(frozen=True)
class Diagnosis:
    """All that the closed loop found out."""

    verdict: Verdict
    effects: Sequence[FoundEffect]
    unexplained: Sequence[Unexplained]
    errors: Mapping[Channel, ChannelError]
    base: Mapping[str, Estimate]
    tried: Sequence[Tried]
    curves: Sequence[Curve]
    p_values: Mapping[Channel, float]
    held_out_steps: Mapping[str, tuple[int, ...]]
    notes: Sequence[str]
    next_experiment: NextExperiment | None
    validation: Validation | None
    seconds: float
