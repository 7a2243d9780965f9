"""The base parameters of a test: what the model needs beside rig, history and effects.

mu          coefficient of friction [1]
K           wear coefficient of W = K E / H, per dissipated energy [1]
convection  h S of the disc [W/K]

One rule for what is not known: it is NaN, and so is all that follows from it alone. Without K nothing is known of the
worn profile, and the contact is that of the unworn discs; without the convection nothing is known of the temperature,
and what depends on it acts as at the environment's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats

MODEL_KEYS: Mapping[str, str] = {
    "mu": "mu",
    "K": "K",
    "convection_W_K": "convection",
    "creepage_factor": "creepage_factor",
}
"""What the model reads: the keys of base parameters, and the names of their fields."""


def _unknown() -> Floats:
    return np.full(1, np.nan)


@dataclass(frozen=True)
class BaseParameters:
    """Parameter sets, each (set,), or (set, iteration) where a value is given for each iteration; NaN: not known.

    creepage_factor: true over nominal creepage [1]. own: parameters that only a channel reads, by key.
    """

    mu: Floats
    K: Floats = field(default_factory=_unknown)
    convection: Floats = field(default_factory=_unknown)
    creepage_factor: Floats = field(default_factory=lambda: np.ones(1))
    own: Mapping[str, Floats] = field(default_factory=dict)

    @classmethod
    def declared(cls, test: Experiment, mu: Floats) -> BaseParameters:
        """For mu (set, step): K and convection as the test's definition says."""
        convection = test.thermal.convection if test.thermal else np.nan
        return cls(
            mu=mu[:, test.history.step],
            K=np.full(len(mu), test.options.wear_coefficient),
            convection=np.full(len(mu), convection),
        )

    @classmethod
    def of(cls, base: BaseParameters | Mapping[str, Floats]) -> BaseParameters:
        """Take the record, or its values by the keys of MODEL_KEYS; any other key is a channel's own."""
        if isinstance(base, BaseParameters):
            return base
        known = {MODEL_KEYS[key]: value for key, value in base.items() if key in MODEL_KEYS}
        return cls(**known, own={key: value for key, value in base.items() if key not in MODEL_KEYS})

    @property
    def sets(self) -> int:
        """How many parameter sets these are."""
        every = [*(getattr(self, name) for name in MODEL_KEYS.values()), *self.own.values()]
        return max(len(np.atleast_1d(values)) for values in every)

    def columns(self, sets: int) -> BaseParameters:
        """Every value as (set, 1) or (set, iteration)."""
        own = {key: column(values, sets) for key, values in self.own.items()}
        return BaseParameters(**{n: column(getattr(self, n), sets) for n in MODEL_KEYS.values()}, own=own)


def column(values: Floats, sets: int) -> Floats:
    """A parameter as (set, 1), or (set, iteration) where it is given for each."""
    array = np.asarray(values, dtype=float)
    array = array[:, None] if array.ndim == 1 else np.atleast_2d(array)
    return array if len(array) == sets else np.broadcast_to(array, (sets, array.shape[1]))
