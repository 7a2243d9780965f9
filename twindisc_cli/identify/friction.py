"""The coefficient of friction behind a measured traction: T/N = mu f(xi), inverted exactly.

    T/N = mu f(G a b C11 v / (mu N))      apparent friction; f the traction law, 1 in full sliding

Where steps wear or warm the contact of later ones, `coupled_steps` inverts them in passes.
T/N grows with mu from 0 to the elastic limit G a b C11 v / N of linear theory. Below it exactly one mu explains a
measurement; above it none does, and the cause is the creepage's zero, the contact's stiffness or the load.

    saturated            T/N is at least 98 % of mu (the light line of Fig. 7)
    partial_slip         part of the patch sticks, and mu is above T/N
    above_elastic_limit  T/N exceeds what linear theory allows at this creepage: no mu explains it
    against_creepage     T/N has the other sign than the creepage, beyond its interval: no mu explains it
    no_creepage          nothing slips, and T/N says nothing of mu
    no_longitudinal_creepage  the discs slip across rolling or spin alone, of which T/N along it says nothing
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import ndtri, stdtrit

from twindisc_cli.identify.roots import bracketed_root
from twindisc_cli.model.experiment import Floats, Ints

SATURATED, PARTIAL_SLIP = "saturated", "partial_slip"
ABOVE_LIMIT, AGAINST_CREEPAGE = "above_elastic_limit", "against_creepage"
NO_CREEPAGE, NO_LONGITUDINAL = "no_creepage", "no_longitudinal_creepage"
LIGHT_LINE = 0.98  # of saturation: from there T/N itself is mu within 2 %
CONFIDENCE = 0.90
"""What every interval that is printed holds: the level of every command."""
LOWEST, HIGHEST = 1e-9, 1e4
HIGHEST_THAT_WEARS = 10.0
"""Largest mu tried where a trial also wears the discs: what a mu of 1e4 would take off is no track any more."""


def mu_from_traction(ratio: Floats, *, traction: Callable[[Floats], Floats], highest_mu: float = HIGHEST) -> Floats:
    """The mu [1] at which `traction`, T/N over mu, is `ratio`, both (...); to rounding.

    traction must grow with mu, and each T/N depend on its own mu alone. 0 where even the smallest mu gives more, inf
    above the elastic limit (or highest_mu).
    """
    low, high = np.full(ratio.shape, np.log(LOWEST)), np.full(ratio.shape, np.log(highest_mu))
    lowest, highest = traction(np.exp(low)), traction(np.exp(high))
    ends = lowest - ratio, highest - ratio
    root = np.exp(bracketed_root(lambda log_mu: traction(np.exp(log_mu)) - ratio, low, high, ends))
    result = np.where(ratio >= highest, np.inf, np.where(ratio <= lowest, 0.0, root))
    return np.where(np.isnan(ratio), np.nan, result)


def states(mu: Floats, high: Floats, share: Floats) -> list[str | None]:
    """The state of each mu and the upper end of its interval from `share`, T/(mu N) at mu, each (n,).

    None where nothing was measured.
    """
    return [_state(*values) for values in zip(mu, high, share, strict=True)]


def _state(mu: float, high: float, share: float) -> str | None:
    if np.isnan(mu):
        return None
    if np.isinf(mu):
        return ABOVE_LIMIT
    if mu == 0.0 and not high > 0.0:
        return AGAINST_CREEPAGE
    return SATURATED if share >= LIGHT_LINE else PARTIAL_SLIP


def half_interval(std: Floats) -> Floats:
    """Half the 90 % interval of a normal error, from its standard deviation, both (...)."""
    return np.asarray(ndtri(0.5 + 0.5 * CONFIDENCE) * std)


def mean_and_interval(values: Floats, uncertainty: Floats, group: Ints, groups: int) -> tuple[Floats, Floats]:
    """Mean of each group of samples and half its 90 % interval, each (group,): Student's t of the samples' scatter.

    A single sample takes its stated uncertainty (one standard deviation). NaN where there is neither.
    """
    count = np.bincount(group, minlength=groups).astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.bincount(group, values, groups) / count
        variance = np.bincount(group, (values - mean[group]) ** 2, groups) / (count - 1.0)
        stated = half_interval(np.sqrt(np.bincount(group, uncertainty**2, groups)) / count)
        quantile = stdtrit(np.maximum(count - 1.0, 1.0), 0.5 + 0.5 * CONFIDENCE)
        half = np.where(count > 1.0, quantile * np.sqrt(variance / count), stated)
    return mean, half
