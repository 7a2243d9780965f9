"""Ties: what only the rounding of a processor separates keeps the order it has, and counts as equal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from twindisc_cli.model.experiment import Floats

Key = TypeVar("Key")
DIGITS = 6  # behind the point, of nats and of probabilities


def falling(value: float) -> float:
    """A key to sort by falling value."""
    return -round(float(value), DIGITS)


def by_falling_value(values: Mapping[Key, float]) -> list[Key]:
    """The keys by falling value, those that tie by name."""
    return sorted(values, key=lambda key: (falling(values[key]), str(key)))


def first_of_most(values: Floats) -> int:
    """The place of the largest value, the first of those that tie (n,)."""
    return int(np.argmax(np.round(values, DIGITS)))
