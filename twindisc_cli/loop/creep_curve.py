"""Noise of a swept curve: T/N and creepage both err, and an error of the creepage shows where the curve is steep.

    T_i = T(v_i) + e_i,   s_i^2 = s_T^2 + (s_v T'(v_i))^2

    T(v)  trend: 1, q_2, q_6 and v, where q_p = v / (v^p + (2^p - 1) v_half^p)^(1/p) bends softly or sharply at its knee
          and is half where half of the traction is reached
    s_v   standard deviation of the creepage; 0 unless the samples show it
    s_T   standard deviation of T/N

e is Student-t of four degrees of freedom, so that a spike says little of s_v; trend and s_T are fitted by weighted
least squares, repeated, and s_v is taken from the restricted likelihood, which pays for a trend that runs through the
few samples of a steep part. s_v belongs to the rig: the logarithms of several curves are added.

Sources: W. A. Fuller, Measurement Error Models (1987); K. L. Lange et al., J. Am. Stat. Assoc. 84 (1989) 881-896;
D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320-338.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.noise_estimate import GROWS, estimate
from twindisc_cli.loop.ties import first_of_most
from twindisc_cli.model.experiment import Floats

ERRORS = np.concatenate([[0.0], np.geomspace(1e-5, 0.03, 30)])
"""Standard deviations of the creepage that are tried [1]."""
KNEES = (2.0, 6.0)  # powers of the bend: a soft and a sharp knee
FREEDOM = 4.0  # degrees of freedom of Student's t, as Lange et al. recommend
STEPS = 12  # of the reweighting, at the most
PASSES = 4  # of trend and sizes in turn
FEWEST = 12  # samples: three for each column of the trend


@dataclass(frozen=True)
class Curve:
    """Traction ratios (sample,) at the sizes of their creepages (sample,)."""

    creepage: Floats
    ratio: Floats

    @cached_property
    def _half(self) -> float:
        """Creepage at which the traction first reaches half of what nine of ten samples stay below."""
        order = np.argsort(self.creepage)
        size = np.abs(self.ratio)
        reached = np.maximum.accumulate(size[order])
        return max(float(np.interp(0.5 * np.quantile(size, 0.9), reached, self.creepage[order])), 1e-9)

    def _trend(self, creepage: Floats) -> Floats:
        """Columns of the trend (sample, column) at creepages (sample,)."""
        bent = [(creepage**p + (2.0**p - 1.0) * self._half**p) ** (1.0 / p) for p in KNEES]
        return np.stack([np.ones_like(creepage), *(creepage / b for b in bent), creepage / self.creepage.max()], axis=1)

    @cached_property
    def trend(self) -> Floats:
        """Columns of the trend at the samples (sample, column)."""
        return self._trend(self.creepage)

    @cached_property
    def _slopes(self) -> Floats:
        """Derivatives of the columns over the creepage (sample, column)."""
        low, high = np.maximum(self.creepage - 1e-3 * self._half, 0.0), self.creepage + 1e-3 * self._half
        return np.asarray((self._trend(high) - self._trend(low)) / (high - low)[:, None])

    @cached_property
    def _tried(self) -> list[tuple[float, Floats]]:
        """Restricted likelihood, and sizes s_i / s_T (sample,), for every standard deviation of the creepage."""
        results = []
        size = np.ones(len(self.ratio))
        beta, std, likelihood = _robust(self.trend, self.ratio, size)
        for error in ERRORS:
            for _ in range(PASSES if error > 0.0 else 0):
                size = np.hypot(1.0, error / std * (self._slopes @ beta))
                beta, std, likelihood = _robust(self.trend, self.ratio, size)
            results.append((likelihood, size))
        return results

    @property
    def likelihoods(self) -> Floats:
        """Logarithm of the restricted likelihood of every standard deviation of the creepage (error,)."""
        return np.array([likelihood for likelihood, _ in self._tried])

    def noise(self, number: int, position: Floats) -> Noise:
        """The noise under one of the standard deviations of the creepage; samples stand at `position` (sample,)."""
        size = self._tried[number][1]
        alone = np.zeros(len(size), dtype=np.int64)
        values, trend = self.ratio / size, self.trend / size[:, None]
        result = estimate(values, [trend], position, alone, float(np.sqrt(np.mean(values**2))), correlated=False)
        mean = float(np.sqrt(np.mean(size**2)))
        return replace(result, std=result.std * mean, cautious=None, sizes=size / mean)


def creepage_error(curves: Sequence[Curve]) -> int:
    """The number in ERRORS of the standard deviation that the creepage has in all curves of a rig; 0 for none."""
    informative = [curve.likelihoods for curve in curves if len(curve.ratio) >= FEWEST]
    gain = np.sum([t - t[0] for t in informative], axis=0) if informative else np.zeros(1)
    best = first_of_most(gain)
    return best if gain[best] > GROWS else 0


def _robust(trend: Floats, values: Floats, size: Floats) -> tuple[Floats, float, float]:
    """Coefficients (column,) of a trend under Student's density, scale of samples of size one, restricted likelihood.

    trend (sample, column), values and size (sample,).
    """
    columns, left = trend / size[:, None], values / size
    free, weight = columns.shape[0] - columns.shape[1], np.ones(len(left))
    for _ in range(STEPS):
        root = np.sqrt(weight)
        beta = np.linalg.lstsq(columns * root[:, None], left * root, rcond=None)[0]
        rest = left - columns @ beta
        variance = max(float(np.sum(weight * rest**2)) / free, 1e-30)
        weight = (FREEDOM + 1.0) / (FREEDOM + rest**2 / variance)
    tails = 0.5 * (FREEDOM + 1.0) * float(np.sum(np.log1p(rest**2 / variance / FREEDOM)))
    volume = 0.5 * float(np.linalg.slogdet((columns * weight[:, None]).T @ columns)[1])
    likelihood = -0.5 * free * float(np.log(variance)) - tails - volume - float(np.sum(np.log(size)))
    return np.asarray(beta), float(np.sqrt(variance)), likelihood
