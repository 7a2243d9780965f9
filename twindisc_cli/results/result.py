"""What a command returns: a summary, numbers for scripts, arrays for the HDF5 file, and a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Axis:
    """A coordinate: values of shape (n,), with the unit's symbol (1 where dimensionless)."""

    name: str
    values: NDArray[Any]
    unit: str
    long_name: str


@dataclass(frozen=True)
class Array:
    """Values over named axes; dims name one axis for each dimension of values, in order."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    unit: str
    long_name: str


@dataclass(frozen=True)
class Dataset:
    """Axes, arrays on them, and attributes of the whole (str, int or float)."""

    axes: tuple[Axis, ...]
    arrays: tuple[Array, ...]
    attrs: Mapping[str, str | int | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit their axes, before anything is written."""
        length = {axis.name: np.shape(axis.values) for axis in self.axes}
        names = [axis.name for axis in self.axes] + [array.name for array in self.arrays]
        if len(set(names)) != len(names):
            raise ValueError(f"a name occurs twice among {names}")
        for array in self.arrays:
            expected = sum((length[dim] for dim in array.dims), ())
            if np.shape(array.values) != expected:
                raise ValueError(f"{array.name} has shape {np.shape(array.values)}, its axes say {expected}")


@dataclass(frozen=True)
class Result:
    """The outcome of one command on one test.

    summary: lines for the terminal. json: the object of --json, in the units its keys name. figure: draws the PNG when
    called. exit_code 5 is a negative finding. extra_files: further files beside the HDF5 file, text or bytes by name.
    """

    command: str
    summary: tuple[str, ...]
    json: dict[str, Any]
    dataset: Dataset
    figure: Callable[[], Figure] | None
    exit_code: int = 0
    extra_files: Mapping[str, str | bytes] = field(default_factory=dict)
