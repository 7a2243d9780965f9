"""The noise of a channel: how large, how long remembered, and what makes it white.

    e_i = rho^(gap_i) e_(i-1) + noise,   white_i = (e_i - rho^(gap_i) e_(i-1)) / (s sqrt(1 - rho^(2 gap_i)))

    rho   correlation of neighbouring samples [1], gap_i distance to the sample before, in median distances
    s     standard deviation of a sample, in the channel's unit

or, of a sensor that wanders, a slow part beside white noise,

    corr(e_i, e_j) = (f / n) sum_k exp(-|x_i - x_j| / m_k),   k = 1 ... n

    f     share of the slow part in the variance [1], x_i place of a sample in median distances
    m_k   memories: one, or all octaves from a sample to the whole record, which is flicker noise (1/f)

Sources: F. N. Hooge, P. A. Bobbert, Physica B 239 (1997) 223-230 (1/f as a sum of relaxations); A. V. Vecchia, J. R.
Stat. Soc. B 50 (1988) 297-312.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from twindisc_cli.model.experiment import Floats, Ints

Mask = NDArray[np.bool_]

_PAST = np.unique([*range(1, 17), *np.round(2.0 ** np.arange(4.0, 20.0, 0.25)).astype(int)])
"""Which of the samples before it a sample is predicted from: the nearest, and those by quarters of octaves."""
_SAME = 6
"""Decimals of a distance, in median distances, that count as different."""


@dataclass(frozen=True)
class Slow:
    """A slow part beside white noise: its share in the variance [1], and its memories in median distances.

    Each memory is twice the one before it.
    """

    share: float
    memories: tuple[float, ...]

    def correlation(self, distance: float) -> float:
        """Correlation of two samples that are so many median distances apart."""
        return self.share * float(np.mean(np.exp(-distance / np.array(self.memories))))


@dataclass(frozen=True)
class Whitening:
    """Matrix (sample, sample) that whitens, and half the logarithm of the correlations' determinant."""

    matrix: csr_array
    size: float


class Past:
    """Samples in the order of their series (sample,), and those before each, chosen by octaves, of its series."""

    def __init__(self, position: Floats, series: Ints) -> None:
        """Position and series of the samples (sample,)."""
        here = np.arange(len(position))[:, None]
        before = here - _PAST[len(position) > _PAST]
        self.known = (before >= 0) & (series[np.maximum(before, 0)] == series[:, None])
        self.before = np.where(self.known, before, here)
        apart = np.where(self.known, position[:, None] - position[self.before], np.inf)
        _, first, self._kind = np.unique(np.round(apart, _SAME), axis=0, return_index=True, return_inverse=True)
        self._apart = np.where(self.known, apart, np.nan)[first]
        self._falls: dict[tuple[float, ...], tuple[Floats, Floats]] = {}

    def _fall(self, memories: tuple[float, ...]) -> tuple[Floats, Floats]:
        """Mean correlation with those before (kind, other), and between these (kind, other, other).

        Samples of one kind are as far from those before them. Each of the memories is twice the one before it: what
        falls in the shorter time is the square.
        """
        if memories not in self._falls:
            between = np.abs(self._apart[:, :, None] - self._apart[:, None, :])
            falls = [np.nan_to_num(np.exp(-distance / memories[-1])) for distance in (self._apart, between)]
            sums = [np.zeros_like(fall) for fall in falls]
            for _ in memories:
                for total, fall in zip(sums, falls, strict=True):
                    total += fall / len(memories)
                    fall *= fall
            self._falls[memories] = sums[0], sums[1]
        return self._falls[memories]

    def whitening(self, slow: Slow) -> Whitening:
        """What makes white noise of unit variance: each sample less what those before it let expect."""
        near, between = (slow.share * part for part in self._fall(slow.memories))
        diagonal = np.arange(between.shape[1])
        between[:, diagonal, diagonal] = 1.0
        link = np.linalg.solve(between, near[..., None])[..., 0]
        scale = np.sqrt(1.0 - np.sum(link * near, axis=1))[self._kind]
        here = np.arange(len(scale))
        rows = np.concatenate([here, np.repeat(here, self.known.sum(axis=1))])
        columns = np.concatenate([here, self.before[self.known]])
        values = np.concatenate([1.0 / scale, (-link[self._kind] / scale[:, None])[self.known]])
        return Whitening(csr_array((values, (rows, columns)), shape=(len(here), len(here))), float(np.log(scale).sum()))


@dataclass(frozen=True)
class Noise:
    """Noise of one channel.

    std in the channel's unit; correlation of neighbours [1]; kept (sample,): False for outliers; position (sample,) and
    series (sample,): where a sample stands in which uninterrupted series; estimated: False where it had to be assumed;
    cautious: standard deviation and correlation to whiten with, the longest correlation near the likeliest. What is
    taken for noise too long is missed only in the smallest effects, what is taken too short becomes an effect.
    sizes (sample,): standard deviation of each sample over std; None: they are equal. slow: a part of the noise with
    memories of its own, in place of the one correlation. rounded: step of the readings, in the channel's unit, where
    their rounding is most of the noise. rivals: other noises, which the samples alone cannot separate from it.
    """

    std: float
    correlation: float
    kept: Mask
    position: Floats
    series: Ints
    estimated: bool
    cautious: tuple[float, float] | None = None
    sizes: Floats | None = None
    slow: Slow | None = None
    rounded: float = 0.0
    rivals: tuple[Noise, ...] = ()

    def at(self, kept: Mask, position: Floats, series: Ints) -> Noise:
        """The same noise for other samples."""
        return replace(self, kept=kept, position=position, series=series)

    def grown(self, sizes: Floats) -> Noise:
        """The same noise of samples of which each has a standard deviation of its own, over their mean (sample,)."""
        return replace(self, sizes=sizes, rivals=tuple(rival.grown(sizes) for rival in self.rivals))

    @property
    def open(self) -> tuple[Noise, ...]:
        """The noises that the samples alone leave open, this one first."""
        return self, *self.rivals

    @property
    def volume(self) -> float:
        """Half the logarithm of the determinant of the covariance of the samples that are kept."""
        std, correlation = self.cautious or (self.std, self.correlation)
        sizes = np.ones_like(self.position) if self.sizes is None else self.sizes
        alone = float(np.log(std * sizes[self.order]).sum())
        if self.slow is not None:
            return alone + self._by_the_past.size
        return alone + (float(np.log(self._whitening[1]).sum()) if correlation > 0.0 else 0.0)

    @property
    def spreads(self) -> bool:
        """Whether an error of one sample may be one of its neighbours, too, once it is white."""
        alone = self.estimated and self.slow is None and (self.cautious or (self.std, self.correlation))[1] == 0.0
        return not alone

    @cached_property
    def order(self) -> Ints:
        """The samples that are kept, in order of their series and position (kept sample,)."""
        order = np.flatnonzero(self.kept)
        return np.asarray(order[np.lexsort((self.position[order], self.series[order]))])

    def whiten(self, values: Floats) -> Floats:
        """White noise of unit variance from values (..., sample), without the outliers: (..., kept sample)."""
        order = self.order
        std, correlation = self.cautious or (self.std, self.correlation)
        part = values[..., order] / (std if self.sizes is None else std * self.sizes[order])
        if self.slow is not None:
            rows = part.reshape(-1, len(order))
            return np.asarray((self._by_the_past.matrix @ rows.T).T.reshape(part.shape))
        if correlation == 0.0:
            return np.asarray(part)
        link, scale = self._whitening
        before = np.concatenate([np.zeros_like(part[..., :1]), part[..., :-1]], axis=-1)
        return np.asarray((part - link * before) / scale)

    @cached_property
    def _by_the_past(self) -> Whitening:
        assert self.slow is not None
        return Past(self.position[self.order], self.series[self.order]).whitening(self.slow)

    @cached_property
    def _whitening(self) -> tuple[Floats, Floats]:
        """Link of each kept sample with the one before it, and what is new in it [1]."""
        _, correlation = self.cautious or (self.std, self.correlation)
        link = neighbour_correlation(self.position[self.order], self.series[self.order], correlation)
        return link, np.sqrt(1.0 - link**2)


def neighbour_correlation(position: Floats, series: Ints, correlation: float | Floats) -> Floats:
    """Correlation of each sample with the one before it; zero at the start of a series.

    (..., sample) for correlations (...).
    """
    gap = np.diff(position, prepend=position[0])
    same = np.diff(series, prepend=series[0] - 1) == 0
    return np.asarray(np.where(same, np.asarray(correlation)[..., None] ** np.maximum(gap, 1e-6), 0.0))


def given(uncertainty: Floats, times: Floats) -> Noise:
    """Noise of samples whose standard deviation is known, each (sample,)."""
    kept, std = np.ones(len(times), dtype=bool), float(np.sqrt(np.mean(uncertainty**2)))
    return Noise(std, 0.0, kept, times, np.zeros(len(times), np.int64), True, sizes=uncertainty / std)
