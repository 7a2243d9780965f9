"""The base parameters of a test: what the model needs beside rig, history and effects.

mu          coefficient of friction [1]
K           Archard's wear coefficient [1]
convection  h S of the disc [W/K]

One rule for what is not known: it is NaN, and so is all that follows from it alone. Without K nothing is known of the
worn profile, and the contact is that of the unworn discs; without the convection nothing is known of the temperature,
and what depends on it acts as at the environment's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats


def _unknown() -> Floats:
    return np.full(1, np.nan)


def _nominal() -> Floats:
    return np.ones(1)


@dataclass(frozen=True)
class BaseParameters:
    """Parameter sets, each (set,), or (set, iteration) where a value is given for each iteration; NaN: not known.

    creepage_factor: true over nominal creepage [1].
    """

    mu: Floats
    K: Floats = field(default_factory=_unknown)
    convection: Floats = field(default_factory=_unknown)
    creepage_factor: Floats = field(default_factory=_nominal)

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
        """Take the record, or its values by the keys of a definition: mu, K, convection_W_K; creepage_factor."""
        if isinstance(base, BaseParameters):
            return base
        return cls(**{"convection" if key == "convection_W_K" else key: value for key, value in base.items()})

    @property
    def sets(self) -> int:
        """How many parameter sets these are."""
        return max(len(np.atleast_1d(getattr(self, f.name))) for f in fields(self))

    def columns(self, sets: int) -> BaseParameters:
        """Every value as (set, 1) or (set, iteration)."""
        return BaseParameters(**{f.name: column(getattr(self, f.name), sets) for f in fields(self)})


def column(values: Floats, sets: int) -> Floats:
    """A parameter as (set, 1), or (set, iteration) where it is given for each."""
    array = np.asarray(values, dtype=float)
    array = array[:, None] if array.ndim == 1 else np.atleast_2d(array)
    return np.broadcast_to(array, (sets, array.shape[1]))
