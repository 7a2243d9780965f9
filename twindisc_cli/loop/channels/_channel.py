"""What a channel is: its samples, their noise, what is predicted for them, and the base parameter they fix."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.loop.noise import Noise
from twindisc_cli.model.experiment import Experiment, Floats, History, Ints
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
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
    """A base parameter that a channel fixes, which is positive: key, unit and bounds in the definition's unit.

    The model reads mu, K and the convection; any other reaches the channel's own `predicted` as `prediction.own[key]`,
    of shape (set, 1). `given` reads it from a definition (NaN: not known); `guess` estimates it from the measurements
    alone, NaN where they cannot; `shared`: one for all tests, as a material's constant is. `place`: table and key of a
    definition that give it, where that is not `[channels.NAME]` and its own key.
    """

    key: str
    unit: str
    lower: float
    upper: float
    guess: Callable[[ForwardModel], float]
    given: Callable[[Experiment], float] | None = None
    shared: bool = False
    meaning: str = ""
    place: tuple[str, str] | None = None

    def of(self, test: Experiment) -> float:
        """Its value in a definition, NaN where that gives none."""
        if self.given is not None:
            return self.given(test)
        return test.own_parameters.get(self.key, np.nan)


def wear_coefficient(guess: Callable[[ForwardModel], float]) -> Base:
    """K of the base model, for a channel that estimates it in its own way."""
    return Base(
        "K", "1", 1e-9, 1.0, guess, lambda test: test.options.wear_coefficient,
        shared=True, meaning="wear coefficient of the base model", place=("model", "wear_coefficient"),
    )  # fmt: skip


@dataclass(frozen=True)
class FileColumn:
    """A column of a channel's file: its name, a unit (all units of the same kind are understood), and its range [SI].

    A column called `time` holds times of the history, which rise.
    """

    name: str
    unit: str
    required: bool = True
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class File:
    """How the file of a channel is read, which a definition names under [measured] by the channel's name.

    samples: makes the channel's samples of the columns in SI units, by name (row,), and the history.
    """

    columns: tuple[FileColumn, ...]
    samples: Callable[[Mapping[str, Floats], History], Any]
    fewest: int = 3


@dataclass(frozen=True, eq=False)
class Channel:
    """A measured channel. Samples are a record of arrays (sample,); the functions take and give SI units.

    label      what it is called
    quantity   what is measured, with the units that are read and drawn
    order      place among the channels, those first that drive the others
    assumed_noise standard deviation of what is measured [SI] where no samples show it, as of a planned channel
    samples    the samples of a test, None where the channel was not measured
    values     the measured values of the samples (sample,)
    parameters the base parameters that it fixes
    file       how its file is read; None: the program's own reader knows
    predicted  the same of a prediction (set, sample)
    noise      the noise of a test's samples
    together   the same of several tests, which may tell of each other's; None: one by one
    noise_about the same, as what a model leaves of the samples (sample,) says; None: the model is not asked
    generic    generic functions over the samples, for what nobody has catalogued
    withheld   samples in the steps (index from 0) and parts that are held out (sample,)
    covariates what a residual may be drawn over, by name (sample,)
    steps      the step of each sample (sample,); None where they are not of single steps
    planned    samples that a planned history would bring
    look_at    where to look, in words, for the cause of a residual that runs with a covariate, by its name
    stands_for stages whose effects it shows where the channel they show in first was not measured
    over       quantities of its covariates that `quantities` does not know, by name
    """

    name: str
    label: str
    quantity: Quantity
    order: int
    assumed_noise: float
    samples: Callable[[Experiment], Any]
    values: Callable[[Any], Floats]
    predicted: Callable[[ForwardModel, Prediction], Floats]
    noise: Callable[[Experiment], Noise]
    generic: Callable[[ForwardModel, Prediction], Iterator[Generic]]
    withheld: Callable[[Experiment, tuple[int, ...]], Mask]
    covariates: Callable[[ForwardModel, Prediction], dict[str, Floats | Ints]]
    planned: Callable[[Experiment, Floats, float], Any]
    parameters: tuple[Base, ...] = ()
    file: File | None = None
    steps: Callable[[Experiment], Ints] | None = None
    together: Callable[[Sequence[Experiment]], Sequence[Noise]] | None = None
    noise_about: Callable[[Experiment, Floats], Noise] | None = None
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
        return self.over.get(name) or QUANTITIES.get(name) or covariate_of(name).quantity
