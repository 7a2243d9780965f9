"""Ties: what only rounding separates keeps its order."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from twindisc_cli.loop.ties import falling, first_of_most


@given(st.lists(st.integers(-1000, 1000), min_size=1, max_size=12), st.integers(0, 2**32 - 1))
def test_rounding_changes_no_order(values: list[int], seed: int) -> None:
    """Errors as large as those of sums of thousands of samples, on values some of which are equal."""
    exact = 0.1 * np.array(values)
    rounded = exact + np.random.default_rng(seed).uniform(-1e-9, 1e-9, len(exact))
    order = sorted(range(len(exact)), key=lambda i: falling(exact[i]))
    assert sorted(range(len(exact)), key=lambda i: falling(rounded[i])) == order
    assert first_of_most(rounded) == int(np.argmax(exact)) == order[0]
