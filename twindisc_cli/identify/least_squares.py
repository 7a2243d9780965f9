"""Weighted least squares for one positive number that a model takes: K from a profile, convection from a temperature.

    minimise sum_i w_i (z_i - m_i(p))^2
    std(p)^2 = s^2 tau / sum_i w_i (dm_i/dp)^2,    s^2 = sum_i w_i r_i^2 / (n - 1)
    tau      = 1 + 2 sum_k rho_k up to the first rho_k below zero

    rho_k   autocorrelation of the residuals r at lag k: neighbours that miss together count as fewer samples

A grid over decades finds the valley, Gauss-Newton steps in log p its floor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twindisc_cli.model.experiment import Floats

_GRID = np.geomspace(1.0 / 64.0, 64.0, 49)
_STEPS = 12  # of Gauss and Newton; it ends earlier where nothing changes
_DIFFERENCE = 1e-4  # of a logarithm, for the derivative

NINETY = 1.645
"""Half a 90 % interval in standard deviations."""


@dataclass(frozen=True)
class Fit:
    """The value found and its standard error, the model there (sample,), and the weighted rms of what it misses."""

    value: float
    std: float
    predicted: Floats
    rms: float


def fit_positive(
    model: Callable[[Floats], Floats],
    *,
    measured: Floats,
    weights: Floats,
    start: float,
    rough: Callable[[Floats], Floats] | None = None,
) -> Fit:
    """Fit p > 0 in model(p), (set,) -> (set, sample), to `measured` with `weights`, each (sample,).

    rough: nearly the same model, for the grid, where that takes long.
    """
    weights = weights / weights.mean()

    def misfit(predicted: Floats) -> Floats:
        return np.asarray(((measured - predicted) ** 2 * weights).sum(axis=-1))

    grid = start * _GRID
    value = float(grid[np.argmin(misfit((rough or model)(grid)))])
    factor = float(_GRID[1] / _GRID[0])
    for _ in range(_STEPS):
        here, beyond = model(value * np.exp([0.0, _DIFFERENCE]))
        slope = (beyond - here) / _DIFFERENCE
        stiffness = float((weights * slope**2).sum())
        step = float((weights * slope * (measured - here)).sum()) / stiffness if stiffness > 0.0 else 0.0
        value *= np.exp(np.clip(step, -np.log(factor), np.log(factor)))
        if abs(step) < 1e-10:
            break
    residual = measured - here
    variance = float(misfit(here)) / max(len(measured) - 1, 1)
    std = (
        value * np.sqrt(variance * _correlation_time(residual * np.sqrt(weights)) / stiffness) if stiffness else np.nan
    )
    return Fit(value=value, std=float(std), predicted=here, rms=float(np.sqrt(misfit(here) / len(measured))))


def _correlation_time(residual: Floats) -> float:
    """Samples that count as one: 1 plus twice the autocorrelations up to the first that is not positive."""
    centred = residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2
    correlation = np.fft.irfft(spectrum)[: len(centred)]
    if not correlation[0] > 0.0:
        return 1.0
    correlation = correlation / correlation[0]
    negative = np.flatnonzero(correlation <= 0.0)
    end = int(negative[0]) if len(negative) else len(correlation)
    return float(1.0 + 2.0 * correlation[1:end].sum())
