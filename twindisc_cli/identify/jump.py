"""What a jump of friction from step to step may come from: creepage, temperature of the disc, flash temperature.

Friction heats the contact, so that a high friction and a high temperature always come together. A temperature can only
be a cause as it was before the jump: of the disc at the beginning of the step, and the flash that the step's creepage
makes with the friction of the step before,

    flash before = flash mu_before / mu

How well friction is a rising function of a covariate says the best rising curve through the steps (pool adjacent
violators: M. Ayer et al., Annals of Mathematical Statistics 26 (1955) 641-647) by what it leaves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from twindisc_cli.model.experiment import Floats

FACTOR, FEWEST = 2.0, 6
"""A rise of friction from one step to the next by this factor is a jump; steps below which nothing is said."""


@dataclass(frozen=True)
class Cause:
    """A covariate as it was before each step, and its best curve, (step,); the root mean square that it leaves [1]."""

    name: str
    unit: str
    values: Floats
    curve: Floats
    left: float


@dataclass(frozen=True)
class Jump:
    """The largest rise of friction: into which step (from 0), friction before and after [1]; and what may cause it."""

    step: int
    before: float
    after: float
    mu: Floats
    causes: tuple[Cause, ...]

    @property
    def best(self) -> Cause:
        """What leaves least."""
        return min(self.causes, key=lambda cause: cause.left)


def largest_jump(*, creepage: Floats, mu: Floats, disc: Floats, flash: Floats) -> Jump | None:
    """The largest rise of friction from step to step and its possible causes; None where none is that large.

    creepage, mu: of each step [1]; disc: its temperature when the step begins [K]; flash: greatest flash temperature of
    the step with its own friction [K]; each (step,).
    """
    if len(mu) < FEWEST or not np.all(np.isfinite(mu) & (mu > 0.0)):
        return None
    rise = mu[1:] / mu[:-1]
    step = int(np.argmax(rise)) + 1
    if rise[step - 1] < FACTOR:
        return None
    earlier = np.append(mu[0], mu[:-1])
    candidates = (
        ("creepage", "1", np.abs(creepage)),
        ("temperature of the disc", "K", disc),
        ("flash temperature", "K", flash * earlier / mu),
    )
    causes = tuple(_cause(name, unit, values, mu) for name, unit, values in candidates)
    return Jump(step, float(mu[step - 1]), float(mu[step]), mu, causes)


def _cause(name: str, unit: str, values: Floats, mu: Floats) -> Cause:
    curve = rising_curve(values, mu)
    return Cause(name, unit, values, curve, float(np.sqrt(np.mean((mu - curve) ** 2))))


def rising_curve(x: Floats, y: Floats) -> Floats:
    """The best curve through y (point,) that never falls with x (point,), at the points.

    Points of one x have one value. Least squares, by pooling neighbours that fall.

    >>> print(rising_curve(np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.1, 0.3, 0.2, 0.6])))
    [0.1  0.25 0.25 0.6 ]
    """
    _, place, number = np.unique(x, return_inverse=True, return_counts=True)
    return np.asarray(isotonic_regression(np.bincount(place, y) / number, weights=number).x[place])
