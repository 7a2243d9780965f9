"""Trends inside every step of a record, or every unworn flank of a profile, and what comes back in every step."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from twindisc_cli.identify.span import span_of
from twindisc_cli.model.experiment import Floats, Ints

KNOTS = 13
"""Of what comes back in every step after the change of creepage."""
DRIFT = 2
"""Degree of a drift over the record."""
FEWEST_FREE = 8
"""Samples beyond the trends, without which a variance is not estimated."""


def polynomials(at: Floats, group: Ints, degree: int, samples_each: int) -> Floats:
    """Legendre polynomials of `at` inside each group (sample, column), at most one for so many samples."""

    def block(unit: Floats) -> Floats:
        highest = min(degree, len(unit) // samples_each, len(np.unique(unit)) - 1)
        return np.asarray(np.polynomial.legendre.legvander(2.0 * unit - 1.0, highest), dtype=float)

    return _in_groups(at, group, block)


def relaxations(at: Floats, group: Ints, most: int, samples_each: int) -> Floats:
    """A level, then exponential approaches and a slope in each group (sample, column), one for so many samples."""

    def block(unit: Floats) -> Floats:
        shapes = [np.ones_like(unit), np.exp(-unit / 0.15), unit, np.exp(-unit / 0.05), np.exp(-unit / 0.4)]
        return np.stack(shapes[: min(most, 1 + len(unit) // samples_each)], axis=1)

    return _in_groups(at, group, block)


def _in_groups(at: Floats, group: Ints, block: Callable[[Floats], Floats]) -> Floats:
    """Columns of each group, zero in the others (sample, column), of places in it from 0 to 1 (sample of it,)."""
    columns = []
    for number in np.unique(group):
        here = group == number
        own = block((at[here] - at[here].min()) / max(float(np.ptp(at[here])), 1e-300))
        columns.append(np.zeros((len(at), own.shape[1])))
        columns[-1][here] = own
    return np.concatenate(columns, axis=1)


def with_drift(trends: Sequence[Floats], at: Floats) -> list[Floats]:
    """Trends (sample, column), richest last, and the richest with a drift over the record that all groups share.

    Repeats of one condition that follow such a drift scatter about it.
    """
    whole = np.zeros(len(at), dtype=np.int64)
    drifts = [polynomials(at, whole, degree, 1)[:, 1:] for degree in range(1, DRIFT + 1)]
    more = [np.concatenate([trends[-1], drift], axis=1) for drift in drifts]
    return [*trends, *(trend for trend in more if len(at) - trend.shape[1] >= FEWEST_FREE)]


def with_recurring(trends: Sequence[Floats], at: Floats, group: Ints) -> list[Floats]:
    """Trends (sample, column), richest last, and each with what is the same in every group, if samples are enough.

    In one group alone that is a course of its own.
    """
    if len(at) <= 3 * (trends[-1].shape[1] + KNOTS):
        return [*trends]
    return [*trends, *(recurring(at, group, trend, KNOTS) for trend in trends)]


def recurring(at: Floats, group: Ints, trend: Floats, knots: int) -> Floats:
    """A trend (sample, column), and what is the same in every group: lines between knots over the place in it.

    The knots stand where as many samples are between each pair of them.
    """
    place = at - np.array([at[group == g].min() for g in np.unique(group)])[np.unique(group, return_inverse=True)[1]]
    knot = np.unique(np.quantile(place, np.linspace(0.0, 1.0, knots)))
    hats = np.stack([np.interp(place, knot, row) for row in np.eye(len(knot))], axis=1)
    reached = span_of(trend)
    hats = hats - reached @ (reached.T @ hats)
    return np.concatenate([trend, span_of(hats[:, np.linalg.norm(hats, axis=0) > 1e-6])], axis=1)
