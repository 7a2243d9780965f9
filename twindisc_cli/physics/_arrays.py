"""What every function of the theory takes and gives: real arrays."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def arrays(*values: ArrayLike) -> tuple[Floats, ...]:
    """Each value as an array of floats."""
    return tuple(np.asarray(value, dtype=float) for value in values)


def stored(package: str, name: str) -> dict[str, Floats]:
    """The arrays of a table beside the modules of a package, by name."""
    with (files(package) / name).open("rb") as stream, np.load(stream) as data:
        return {key: np.asarray(data[key], dtype=float) for key in data.files}


def together(*values: ArrayLike) -> tuple[Floats, ...]:
    """The values as arrays of floats of one shape."""
    return np.broadcast_arrays(*arrays(*values))
