"""What a command returns: a summary, numbers for scripts, arrays for the HDF5 file, and a figure.

A number that is not finite is an error, unless it is declared: an Array is `optional` where it may be unknown or
unbounded, and a key of the JSON where its value went through `or_null`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
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
    """Values over named axes; dims name one axis for each dimension of values, in order.

    optional: whether values may be NaN or infinite.
    """

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    unit: str
    long_name: str
    optional: bool = False


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
    called; figures draws further ones, by the name of their file without its end; drawn: those of all these that stand
    on a page too, as PNG of the usual size. exit_code 5 is a negative finding. extra_files: further files beside the
    HDF5 file, text or bytes by name.
    """

    command: str
    summary: tuple[str, ...]
    json: dict[str, Any]
    dataset: Dataset
    figure: Callable[[], Figure] | None
    exit_code: int = 0
    extra_files: Mapping[str, str | bytes] = field(default_factory=dict)
    figures: Mapping[str, Callable[[], Figure]] = field(default_factory=dict)
    drawn: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def undefined(self) -> list[str]:
        """Names of what is not finite and must be."""
        return [
            *(axis.name for axis in self.dataset.axes if not _finite(axis.values)),
            *(array.name for array in self.dataset.arrays if not (array.optional or _finite(array.values))),
            *_undefined({**self.json, **self.dataset.attrs}, ""),
        ]


def _finite(values: Any) -> bool:
    array = np.asarray(values)
    return array.dtype.kind != "f" or bool(np.all(np.isfinite(array)))


def _undefined(value: Any, name: str) -> Iterator[str]:
    """Names of the numbers in a JSON value that are not finite, each once."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _undefined(item, str(key))
    elif isinstance(value, (list, tuple)):
        yield from dict.fromkeys(result for item in value for result in _undefined(item, name))
    elif not isinstance(value, str) and value is not None and not _finite(value):
        yield name


def or_null(value: Any) -> Any:
    """A value of the JSON that may be unknown or unbounded: null in place of each number that is not finite."""
    if isinstance(value, Mapping):
        return {key: or_null(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return or_null(value.tolist())
    if isinstance(value, (list, tuple)):
        return [or_null(item) for item in value]
    return value if _finite(value) else None
