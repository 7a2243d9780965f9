"""Generic functions: what an effect that nobody has catalogued could look like, as functions of one covariate.

They stand beside the physical effects in the search: where one of them is still significant after an effect was added,
the cause is not in the catalogue. Which of them a channel has, its own file says.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.model.experiment import Floats, History, Ints

SMOOTH = 5  # cubic splines with so few knots follow trends, not noise
WAVES = 24  # sines across the track, down to a twelfth of its width
RIPPLES = 12  # cosines of one step


def smooth(covariate: Floats, degree: int) -> Floats:
    """Legendre polynomials of a covariate, without the constant (sample, degree)."""
    span = float(np.ptp(covariate))
    unit = 2.0 * (covariate - covariate.min()) / max(span, 1e-300) - 1.0
    distinct = len(np.unique(np.round(unit, 9)))
    return np.polynomial.legendre.legvander(unit, max(1, min(degree, distinct - 1)))[:, 1:]


def levels(number: Ints) -> Floats:
    """One indicator for every level (sample, level)."""
    return np.asarray(number[:, None] == np.unique(number), dtype=float)


def waves(time: Floats, count: int) -> Iterator[Floats]:
    """Pairs of cosine and sine of `count` periods and fewer over the test, each (sample, 2)."""
    phase = 2.0 * np.pi * (time - time.min()) / max(float(np.ptp(time)), 1e-300)
    for order in range(1, count + 1):
        yield np.stack([np.cos(order * phase), np.sin(order * phase)], axis=1)


def in_step(history: History, time: Floats, step: Ints) -> Floats:
    """Position in the running step, from -1 to 1, and the square and a decay at its start (sample, 3)."""
    ends = np.array([history.end_time[history.step == s][-1] for s in np.unique(history.step)])
    begins = np.concatenate([[0.0], ends[:-1]])
    part = np.clip((time - begins[step]) / (ends - begins)[step], 0.0, 1.0)
    return np.stack([2.0 * part - 1.0, 1.5 * (2.0 * part - 1.0) ** 2 - 0.5, np.exp(-12.0 * part)], axis=1)
