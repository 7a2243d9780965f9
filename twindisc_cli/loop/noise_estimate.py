"""The noise of each channel, estimated from its samples and not from any physical model.

A smooth trend inside every step (in a profile: inside every unworn flank), no richer than the samples ask for, is taken
out, with what comes back in every step after the change of creepage. rho and s are those of most evidence with that
trend or a simpler one: the restricted likelihood (REML), in which the trend's own parameters are paid for, and a prior
1 - rho. A rich trend alone would take out what a memory does. Outliers beyond five robust standard deviations, or as
far from what their neighbours let expect, are dropped unless they come in runs.
Source: D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320-338.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dtrtrs
from scipy.ndimage import median_filter
from scipy.sparse import csr_array
from scipy.special import chdtri, logsumexp, ndtri, stdtrit

from twindisc_cli.identify.span import span_of
from twindisc_cli.loop.noise import Mask, Noise, Past, Slow, Whitening, neighbour_correlation
from twindisc_cli.loop.ties import first_of_most
from twindisc_cli.loop.trends import FEWEST_FREE, relaxations
from twindisc_cli.model.experiment import Floats, Ints

CORRELATIONS = np.concatenate([[0.0], np.linspace(0.05, 0.9, 18), [0.93, 0.96]])
ASSUMED_SHARE = 0.01  # of the typical size, where samples are too few or without scatter
STILL = 1e-4  # of the typical size: a record with less scatter is computed, not measured
NEAR = 2.0  # nats of likelihood that a longer memory may be behind the best
LONGER = 2.5  # standard errors of a correlation
LONGEST_OUTLIER = 3  # samples in a row: a longer run is a change, not an outlier
FAR = 5.0  # standard deviations: one in two million of normal noise
PASSES = 3  # of outliers and trend in turn
MOST_OUTLIERS = 0.05  # of the samples: more are no outliers
WILD, WILD_BY_CHANCE, LEAST_FREE = 2.5, 0.02, 0.5
"""How many times the power of most groups makes a group wild, the probability at most of so much by chance, and the
degrees of freedom beyond which a group shows its power."""
SURE = 0.999
"""Probability at which a normal deviate and Student's t with as many degrees of freedom are made equal: a standard
deviation from few samples is uncertain itself."""
GROWS = 8.0
"""Gain in log likelihood [nats] from which a noise is taken to grow: one record of even noise in 16,000 shows it."""
LOUDER, FEWEST_BENDS, FEWEST_GROUPS = 2.0, 8, 4
"""How many times as much a step scatters that has a noise of its own, second differences that show it, and steps of so
many."""
NEAR_BY = 3.0  # standard deviations of its own beyond which a difference is cut off
GROWTHS = np.linspace(-3.0, 3.0, 61)
ONE_MEMORY = np.linspace(0.0, 0.9, 10)  # correlations of neighbours that a slow part is held against
FLICKER_SHARES = (0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99)  # of flicker noise in the variance
SLOW_SHARES = (0.2, 0.5, 0.8)  # of a part with one memory
MEMORIES = (4.0, 16.0, 64.0, 256.0)  # of such a part, in median distances
SMALLER = 1.2
"""How many times as large as the noise about its trend alone a noise is that has this as a rival: of 400 tests with
known noise it is in three without a slow part, in one of which it is 1.67 times the true one."""
LIKELIER = 3.0
"""Nats of evidence by which noise with a slow part is likelier, where it is taken: odds of twenty to one (Jeffreys)."""
_ALIKE = 2.0 / 3.0
"""Squares of differences of neighbours that count as one on their own: each shares a sample with the next."""
_BENT_ALIKE = 0.5
"""The same of second differences: of white noise 1 / (1 + 2 (16 + 1) / 36)."""


def growth(noise: Noise, left: Floats, over: Iterable[Floats]) -> Floats | None:
    """Standard deviation of each sample over their mean (sample,), where they show that the noise grows.

    It goes as exp(b x) with one of some covariates x (sample,). left: what is left of the samples beside their trend
    (sample,). It is seen in the differences of neighbours, cut off where they are far: what changes slowly, or jumps,
    is no noise.
    """
    best, sizes = GROWS, None
    order = np.lexsort((noise.position, noise.series))
    steps = np.diff(left[order])
    used = np.clip(steps, -FAR * scatter(steps), FAR * scatter(steps)) if len(steps) else steps
    for covariate in over:
        low, high = float(covariate.min()), float(covariate.max())
        if not noise.estimated or not high > low or not np.any(used):
            continue
        x = (covariate - low) / (high - low)
        between = 0.5 * (x[order][1:] + x[order][:-1])
        middle = float(between.mean())
        powers = np.mean((used * np.exp(-GROWTHS[:, None] * (between - middle))) ** 2, axis=1)
        gain = -0.5 * _ALIKE * len(used) * np.log(powers / np.mean(used**2))
        if gain.max() > best:
            grown = np.exp(GROWTHS[first_of_most(gain)] * (x - middle))
            best, sizes = float(gain.max()), grown / np.sqrt(np.mean(grown[noise.kept] ** 2))
    return sizes


def louder(noise: Noise, values: Floats, group: Ints) -> Floats | None:
    """Standard deviation of each sample over their mean (sample,), where single groups (sample,) scatter far more.

    By the second differences of the values (sample,), in which a slope does not count: their median, in which a jump or
    a burst hardly does, says which groups these are; their mean square, cut off where they are far, by how much.
    """
    order = np.lexsort((noise.position, noise.series))
    here = group[order]
    inside = (here[2:] == here[1:-1]) & (here[1:-1] == here[:-2])
    bends, where = np.diff(values[order], 2)[inside], here[2:][inside]
    numbers, counts = np.unique(where, return_counts=True)
    numbers, counts = numbers[counts >= FEWEST_BENDS], counts[counts >= FEWEST_BENDS]
    if not noise.estimated or len(numbers) < FEWEST_GROUPS:
        return None
    of_each = [bends[where == number] for number in numbers]
    by_median = np.array([scatter(each) for each in of_each])
    loud = by_median > LOUDER * np.median(by_median)
    if not loud.any() or 2 * loud.sum() > len(numbers) or not np.median(by_median) > 0.0:
        return None
    cut = [np.clip(each, -NEAR_BY * own, NEAR_BY * own) for each, own in zip(of_each, by_median, strict=True)]
    power = np.array([np.mean(each**2) for each in cut])
    quiet = np.sum((counts * power)[~loud]) / np.sum(counts[~loud])
    ratio = np.sqrt(power[loud] / max(float(quiet), 1e-300))
    gain = _BENT_ALIKE * np.sum(counts[loud] * (0.5 * (ratio**2 - 1.0) - np.log(ratio)))
    if gain < GROWS + len(ratio) * np.log(len(numbers)):
        return None
    sizes = np.ones(len(values))
    for number, times in zip(numbers[loud], ratio, strict=True):
        sizes[group == number] = times
    return np.asarray(sizes / np.sqrt(np.mean(sizes[noise.kept] ** 2)))


def likelier(grown: Noise, even: Noise, left: Floats, by: float = GROWS) -> bool:
    """Whether what is left of samples beside their trend (sample,) is likelier by so many nats with a noise that grows.

    One that is far off costs the logarithm of how many it may be: jumps are rare outliers of an even noise, and what
    an even noise takes for outliers of a growing one is many. Correlation is left out of both.
    """
    costs = []
    for noise in (even, grown):
        std = noise.std * (np.ones_like(left) if noise.sizes is None else noise.sizes)
        far = np.minimum(0.5 * (left / std) ** 2, np.log(len(left)))
        costs.append(float(np.sum(np.log(std / even.std) + far)))
    return costs[0] - costs[1] > by


def estimate(
    values: Floats,
    trends: Sequence[Floats],
    at: Floats,
    series: Ints,
    size: float,
    *,
    correlated: bool,
    wanders: bool = False,
) -> Noise:
    """REML estimate of standard deviation and correlation about the best of the trends (sample, column), richest last.

    wanders: the noise may have a slow part, and simpler trends and a course over the record are weighed against its
    memory; the first trend is then a level in each step. Where too few samples scatter, or none does, a share of the
    channel's size is assumed.
    """
    order = np.lexsort((at, series))
    values, trend, at, series = values[order], trends[-1][order], at[order], series[order]
    spacing = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
    position = at / spacing if spacing > 0.0 else np.arange(len(at), dtype=float)
    kept, back = np.ones(len(values), dtype=bool), np.argsort(order)
    free = len(values) - trend.shape[1]
    size = size or float(np.sqrt(np.mean(values**2))) or 1.0
    assumed = Noise(ASSUMED_SHARE * size, 0.0, kept, position[back], series[back], estimated=False)
    if free < FEWEST_FREE:
        return assumed
    record = _Record(values, position, series, correlated)
    trend, kept = _asked_for(record, [t[order] for t in trends])
    homogeneous = kept & _homogeneous(detrended(values, trend, kept), trend, kept)
    weighed = [trend]
    if wanders:
        level, line = (t[order] for t in trends[:2])
        course = np.concatenate([level, relaxations(at, np.zeros_like(series), 5, 4)], axis=1)
        weighed = [level, line, course, trend]
    (std, correlation), cautious = _most_evident(record.only(homogeneous), [t[homogeneous] for t in weighed])
    if std <= STILL * size:
        return assumed
    alone = kept | in_a_run(~kept)
    found = Noise(std, correlation, alone[back], position[back], series[back], estimated=True, cautious=cautious)
    return _with_rivals(found, record, homogeneous, (level, course, trend), STILL * size) if wanders else found


@dataclass(frozen=True)
class _Record:
    """Values (sample,) at their positions in uninterrupted series, and whether neighbours may be correlated."""

    values: Floats
    position: Floats
    series: Ints
    correlated: bool

    def only(self, mask: Mask) -> _Record:
        """Some of the samples."""
        return _Record(self.values[mask], self.position[mask], self.series[mask], self.correlated)

    @property
    def grid(self) -> Floats:
        """The correlations that are tried."""
        return CORRELATIONS if self.correlated else CORRELATIONS[:1]

    @cached_property
    def links(self) -> Floats:
        """Correlation of each sample with the one before it (correlation, sample), for each that is tried."""
        return neighbour_correlation(self.position, self.series, self.grid)


def _asked_for(record: _Record, trends: Sequence[Floats]) -> tuple[Floats, Mask]:
    """The trend (sample, column) that the samples ask for, richest last, and which of them are no outliers from it."""
    starts = np.ones(len(record.values), dtype=bool), _without_spikes(record.values, record.series)
    kept = max((_near_trend(record.values, trends[-1], start) for start in starts), key=np.sum)
    tried = [(trend, _without_outliers(record, trend, kept)) for trend in trends]
    return min(tried, key=lambda t: _criterion(record, *t))


def _with_rivals(
    noise: Noise, record: _Record, homogeneous: Mask, trends: tuple[Floats, Floats, Floats], least: float
) -> Noise:
    """The noise, or one with a slow part if that is likelier and no less than `least`, and what the samples leave open.

    trends: a level in each step, that with a course over the record, and the trend that the samples ask for.
    """
    level, _, trend = trends
    still = homogeneous & _homogeneous(detrended(record.values, level, homogeneous), level, homogeneous)
    if np.sum(still) - trend.shape[1] < FEWEST_FREE:
        return noise
    slow = _wandering(noise, record.only(still), [t[still] for t in trends])
    chosen = slow if slow.std > least else noise
    return chosen if chosen.rivals else _with_smaller(chosen, record.only(homogeneous), trend[homogeneous])


def _with_smaller(noise: Noise, record: _Record, trend: Floats) -> Noise:
    """The noise, with that about a trend alone (sample, column) as its rival where this is much smaller."""
    (std, correlation), cautious = _most_evident(record, [trend])
    if SMALLER * std > noise.std:
        return noise
    return replace(noise, rivals=(replace(noise, std=std, correlation=correlation, cautious=cautious),))


def _wandering(noise: Noise, record: _Record, trends: Sequence[Floats]) -> Noise:
    """The noise with a slow part where that is likelier; the first of the trends is a level in each step.

    What a trend takes out and what a memory does are separated by trying every noise with all of them. Where a slow
    part is likelier at all, what is not chosen of both are rivals: slow noises about levels, which leave it the most.
    """
    span = max(float(np.ptp(record.position)), 2.0)
    octaves = tuple(float(memory) for memory in 2.0 ** np.arange(np.ceil(np.log2(span)) + 1.0))
    families = [
        [Slow(share, octaves) for share in FLICKER_SHARES],
        [Slow(share, (memory,)) for share in SLOW_SHARES for memory in MEMORIES if memory < 0.5 * span],
    ]
    tried = [_Evidence.of(record.values, trends[0], trend) for trend in trends]
    links = [_one_memory(neighbour_correlation(record.position, record.series, rho)) for rho in ONE_MEMORY]
    with_one = np.array([[found.after(white)[0] for white in links] for found in tried])
    if first_of_most(with_one[0]) == 0:
        return noise  # nothing is slow about levels without memory
    one = logmeanexp(with_one.ravel())
    past = Past(record.position, record.series)
    best, chosen, rivals = one, noise, list[Noise]()

    def wandering(std: float, slow: Slow) -> Noise:
        return replace(noise, std=std, correlation=slow.correlation(1.0), cautious=None, slow=slow)

    for family in filter(None, families):
        results = []
        for slow in family:
            white = past.whitening(slow)
            about = [found.after(white) for found in tried]
            results += [(*each, slow) for each in about]
            rivals.append(wandering(about[0][1], slow))
        evidence = logmeanexp([result[0] for result in results])
        if evidence > best:
            _, std, slow = max(results, key=lambda result: result[0])
            best, chosen = evidence, wandering(std, slow)
    if chosen is noise:
        return noise
    return replace(chosen, rivals=(noise, *rivals)) if best > one + LIKELIER else replace(noise, rivals=tuple(rivals))


def logmeanexp(values: Sequence[float] | Floats) -> float:
    """Logarithm of the mean of exponentials."""
    return float(logsumexp(values) - np.log(len(values)))


def _one_memory(link: Floats) -> Whitening:
    """Whitening of samples (sample,) by their correlation with the sample before each."""
    scale = np.sqrt(1.0 - link**2)
    here = np.arange(len(link))
    places = np.concatenate([here, here[1:]]), np.concatenate([here, here[:-1]])
    matrix = csr_array((np.concatenate([1.0 / scale, -link[1:] / scale[1:]]), places), shape=(len(link), len(link)))
    return Whitening(matrix, float(np.log(scale).sum()))


@dataclass(frozen=True)
class _Evidence:
    """Samples with a trend: basis (sample, column), of which `levels` columns may be any.

    The others are as large as the scatter about the levels at the most, `prior` being the standard deviation of their
    coefficients: a trend that is not asked for pays for its columns, under every noise the same.
    """

    values: Floats
    basis: Floats
    levels: int
    prior: float

    @classmethod
    def of(cls, values: Floats, levels: Floats, trend: Floats) -> _Evidence:
        """Of values (sample,), levels and a trend that holds them, (sample, column)."""
        first, left = _apart(values, levels)
        beyond = trend - first @ (first.T @ trend)
        beyond = beyond[:, np.linalg.norm(beyond, axis=0) > 1e-9]
        basis = np.concatenate([first, span_of(beyond)], axis=1) if beyond.size else first
        return cls(values, basis, first.shape[1], float(np.sqrt(left @ left / first.shape[1])))

    def after(self, white: Whitening) -> tuple[float, float]:
        """Logarithm of the evidence of a noise by what whitens it, and the standard deviation."""
        rows = white.matrix @ np.concatenate([self.basis, self.values[:, None]], axis=1)
        _, root = np.linalg.qr(rows)
        free, extra = len(rows) - self.basis.shape[1], self.basis.shape[1] - self.levels
        variance = max(float(root[-1, -1] ** 2) / free, 1e-300)
        volume = white.size + float(np.log(np.abs(np.diag(root)[:-1])).sum())
        evidence = -0.5 * free * (np.log(2.0 * np.pi * variance) + 1.0) - volume
        paid = extra * (np.log(max(self.prior, 1e-300)) + 0.5 * np.log(2.0 * np.pi))
        return evidence - paid, float(np.sqrt(variance))


def _criterion(record: _Record, trend: Floats, kept: Mask) -> float:
    """Akaike's criterion for few samples: the least belongs to the trend that the samples ask for.

    A sample that lies far from a trend is a column of its own, which leaves of the others what leaving it out would: a
    rich trend hides outliers, a poor one makes some.

    Source: C. M. Hurvich, C.-L. Tsai, Biometrika 76 (1989) 297-307.
    """
    near = record.only(kept)
    basis, left = _apart(near.values, trend[kept])
    samples, columns = len(kept), int(basis.shape[1] + np.sum(~kept))
    likely = []
    for link, every in zip(near.links, record.links, strict=True):
        _, std = _likelihood(left, basis, link, restricted=False)
        power = max(std**2 * len(left), 1e-300)
        likely.append(-0.5 * samples * np.log(power / samples) - 0.5 * np.sum(np.log1p(-(every**2))))
    return float(2.0 * columns * samples / max(samples - columns - 1, 1) - 2.0 * max(likely))


def _apart(values: Floats, trend: Floats) -> tuple[Floats, Floats]:
    """Orthonormal columns of a trend (sample, column), and values (sample,) without what these reach."""
    basis = span_of(trend)
    return basis, values - basis @ (basis.T @ values)


def scatter(values: Floats) -> float:
    """Robust standard deviation about zero."""
    return 1.4826 * float(np.median(np.abs(values)))


def detrended(values: Floats, trend: Floats, kept: Mask) -> Floats:
    """Values without the trend (sample, column) that fits those that are kept."""
    return np.asarray(values - trend @ np.linalg.lstsq(trend[kept], values[kept], rcond=None)[0])


def _near_trend(values: Floats, trend: Floats, kept: Mask) -> Mask:
    """The samples that are not far from the trend (sample, column) of those that are kept, in a few passes."""
    for _ in range(PASSES):
        left, shown = detrended(values, trend, kept), kept & ~_alone(trend, kept)
        paid = np.sqrt(shown.sum() / max(kept.sum() - trend.shape[1], 1))
        kept = np.abs(left) <= FAR * max(paid * scatter(left[shown]), 1e-300)
    return kept


def _alone(trend: Floats, kept: Mask) -> Mask:
    """Samples that are kept as the only one of a column of the trend (sample, column), which goes through them."""
    used = (trend != 0.0) & kept[:, None]
    return np.asarray(np.any(used & (used.sum(axis=0) == 1), axis=1))


def _without_spikes(values: Floats, series: Ints) -> Mask:
    """The samples near the running median, which a few in a row do not move: a rich trend would bend to spikes.

    It follows jumps and whatever rises or falls; far is what is far for a change from sample to sample. Many such
    samples are no spikes. Quick turns look like spikes here, and a trend without them leaves out more than with them.
    """
    width = 2 * LONGEST_OUTLIER + 3
    medians = [median_filter(values[series == one], size=width, mode="nearest") for one in np.unique(series)]
    off = values - np.concatenate(medians)
    near = np.abs(off) <= FAR * scatter(np.diff(values))
    return near if np.mean(near) >= 1.0 - MOST_OUTLIERS else np.ones(len(values), dtype=bool)


def _without_outliers(record: _Record, trend: Floats, kept: Mask) -> Mask:
    """The samples that are kept without those that outlier from a trend (sample, column); many are no outliers."""
    near = kept
    for _ in range(PASSES):
        left = detrended(record.values, trend, near)
        homogeneous = near & _homogeneous(left, trend, near)
        correlation = _reml(record.only(homogeneous), trend[homogeneous])
        outlier = _outlier(left, near, ~_alone(trend, near), record, correlation)
        if not outlier.any():
            break
        near = near & ~outlier
    return near if near.sum() >= (1.0 - MOST_OUTLIERS) * kept.sum() else kept


def _outlier(left: Floats, kept: Mask, shown: Mask, record: _Record, correlation: float) -> Mask:
    """Samples far from what both their neighbours let expect: in correlated noise a spike is small against the noise.

    A spike makes its neighbours look far off too, in the other direction; only the farthest of neighbours is one.
    shown: samples whose scatter says how far that is.
    """
    here = np.flatnonzero(kept)
    e, before = left[here], neighbour_correlation(record.position[here], record.series[here], correlation)
    after = np.append(before[1:], 0.0)
    share = 1.0 - (before * after) ** 2
    expected = before * (1.0 - after**2) * np.append(0.0, e[:-1]) + after * (1.0 - before**2) * np.append(e[1:], 0.0)
    far = np.abs(e - expected / share) / np.sqrt((1.0 - before**2) * (1.0 - after**2) / share)
    highest = (far >= np.append(0.0, far[:-1])) & (far >= np.append(far[1:], 0.0))
    outlier = np.zeros(len(left), dtype=bool)
    outlier[here] = highest & (far > FAR * scatter(far[shown[here]]))
    return outlier


def in_a_run(far: Mask) -> Mask:
    """Samples in a run of neighbours that are all far off: those are no outliers, something happened."""
    runs = np.cumsum(np.diff(far, prepend=False))
    return np.asarray(far & (np.bincount(runs)[runs] > LONGEST_OUTLIER))


def _homogeneous(left: Floats, trend: Floats, kept: Mask) -> Mask:
    """Samples of the groups whose trend fits as well as that of most groups: a jump inside a group is no noise.

    All of them where these are most groups, or too few samples are in the others. How far the power of a group lies
    above that of most by chance follows from its degrees of freedom.
    """
    numbers, place = np.unique(np.argmax(trend != 0.0, axis=1), return_inverse=True)
    reached = np.sum(span_of(trend * kept[:, None]) ** 2, axis=1)
    free = np.bincount(place, kept - reached)
    shown = free > LEAST_FREE
    if not shown.any():
        return np.ones(len(left), dtype=bool)
    power, middle = np.bincount(place, kept * left**2)[shown], chdtri(free[shown], 0.5)
    by_chance = np.maximum(WILD, chdtri(free[shown], WILD_BY_CHANCE) / middle)
    wild = np.zeros(len(numbers), dtype=bool)
    wild[shown] = power / middle > by_chance * max(float(np.median(power / middle)), 1e-300)
    even = np.asarray(~wild[place])
    beyond = np.sum(kept & even) - np.sum(np.any(trend[kept & even] != 0.0, axis=0))
    enough = np.sum(wild) < np.sum(shown) // 2 and beyond >= FEWEST_FREE
    return even if enough else np.ones(len(left), dtype=bool)


def _reml(record: _Record, trend: Floats) -> float:
    """Correlation of greatest posterior with a trend (sample, column)."""
    basis, left = _apart(record.values, trend)
    likely = np.array([_likelihood(left, basis, link)[0] for link in record.links]) + np.log1p(-record.grid)
    return float(record.grid[first_of_most(likely)])


def _most_evident(record: _Record, trends: Sequence[Floats]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Standard deviation and correlation of most evidence, and of the longest correlation near it.

    With any of the trends (sample, column), of which the first is a level in each step. Near is LONGER standard errors
    of a correlation, root of (1 - rho^2) / samples, and NEAR in the logarithm.
    """
    grid = record.grid
    whites = [_one_memory(link) for link in record.links]
    tried = [_Evidence.of(record.values, trends[0], trend) for trend in trends]
    results = np.array([[found.after(white) for white in whites] for found in tried])
    likely, std = results[..., 0] + np.log1p(-grid), results[..., 1]
    its, best = np.unravel_index(first_of_most(likely.ravel()), likely.shape)
    free = len(record.values) - tried[its].basis.shape[1]
    reach = grid[best] + LONGER * np.sqrt((1.0 - grid[best] ** 2) / free)
    longest = int(np.flatnonzero((likely[its] >= likely.max() - NEAR) & (grid <= reach))[-1])
    larger = float(stdtrit(free, SURE) / ndtri(SURE))
    return (float(std[its, best]), float(grid[best])), (larger * float(std[its, longest]), float(grid[longest]))


def _likelihood(values: Floats, basis: Floats, link: Floats, *, restricted: bool = True) -> tuple[float, float]:
    """Logarithm of the (restricted) likelihood, and the standard deviation, for given links between neighbours.

    basis: orthonormal columns of the trend (sample, column), values: without it (sample,).
    """
    scale = np.sqrt(1.0 - link**2)
    both = np.concatenate([basis, values[:, None]], axis=1)
    white = (both - link[:, None] * np.concatenate([np.zeros((1, both.shape[1])), both[:-1]])) / scale[:, None]
    products = white.T @ white
    root = np.linalg.cholesky(products[:-1, :-1])
    along, _ = dtrtrs(root, products[:-1, -1], lower=True)
    free = len(values) - (basis.shape[1] if restricted else 0)
    variance = max(float(products[-1, -1] - along @ along) / free, 1e-300)
    volume = float(np.log(np.diag(root)).sum()) if restricted else 0.0
    size = volume + float(np.log(scale).sum())
    return -0.5 * free * float(np.log(variance)) - size, float(np.sqrt(variance))
