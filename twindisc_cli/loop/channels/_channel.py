"""What a channel is: its samples, their noise, what is predicted for them, and the base parameter they fix."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.loop.noise import Noise
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.model.forward import ForwardModel, Prediction
from twindisc_cli.quantities import QUANTITIES, Quantity

Mask = NDArray[np.bool_]
Samples = TypeVar("Samples")
Generic = tuple[str, str, Floats]
"""A covariate, the kind of function over it, and its columns (sample, column)."""


def known(samples: Samples | None) -> Samples:
    """Samples of a channel that was measured."""
    assert samples is not None
    return samples


@dataclass(frozen=True)
class Base:
    """A base parameter that a channel fixes: key, unit and bounds in the definition's unit.

    `given` reads it from a definition (NaN: not known); `guess` estimates it from the measurements alone, NaN where
    they cannot; `shared`: one for all tests, as a material's constant is.
    """

    key: str
    unit: str
    lower: float
    upper: float
    given: Callable[[Experiment], float]
    guess: Callable[[ForwardModel], float]
    shared: bool = False


@dataclass(frozen=True)
class Channel:
    """A measured channel. Samples are a record of arrays (sample,); the functions take and give SI units.

    label      what it is called
    quantity   what is measured, with the units that are read and drawn
    order      place among the channels, those first that drive the others
    samples    the samples of a test, None where the channel was not measured
    values     the measured values of the samples (sample,)
    base       the base parameter that it fixes, None where it fixes none
    predicted  the same of a prediction (set, sample)
    noise      the noise of a test's samples
    together   the same of several tests, which may tell of each other's; None: one by one
    generic    generic functions over the samples, for what nobody has catalogued
    withheld   samples in the steps (index from 0) and parts that are held out (sample,)
    covariates what a residual may be drawn over, by name (sample,)
    planned    samples that a planned history would bring
    stands_for stages whose effects it shows where the channel they show in first was not measured
    over       quantities of its covariates that `quantities` does not know, by name
    """

    name: str
    label: str
    quantity: Quantity
    order: int
    assumed_noise: float
    base: Base | None
    samples: Callable[[Experiment], Any]
    values: Callable[[Any], Floats]
    predicted: Callable[[ForwardModel, Prediction], Floats]
    noise: Callable[[Experiment], Noise]
    generic: Callable[[ForwardModel, Prediction], Iterator[Generic]]
    withheld: Callable[[Experiment, tuple[int, ...]], Mask]
    covariates: Callable[[ForwardModel, Prediction], dict[str, Floats | Ints]]
    planned: Callable[[Experiment, Floats, float], Any]
    together: Callable[[Sequence[Experiment]], Sequence[Noise]] | None = None
    look_at: Mapping[str, str] = field(default_factory=dict)
    stands_for: frozenset[str] = frozenset()
    over: Mapping[str, Quantity] = field(default_factory=dict)

    @property
    def unit(self) -> str:
        """Unit of its errors."""
        return self.quantity.difference.name

    @property
    def factor(self) -> float:
        """From SI to the unit of its errors."""
        return self.quantity.difference.per_si

    def covariate(self, name: str) -> Quantity:
        """What a covariate of its samples is."""
        return self.over.get(name) or QUANTITIES[name]
