"""The friction of steps that wear and warm each other: mu of each from T/N, where the model takes one to the next.

    T/N of step i = f(mu_i; wear and warmth that steps 1 ... i have left)

A pass inverts every step by itself, with the wear and the warmth that the pass before has left. The power is T v V, and
T is measured: wear and warmth hardly move from pass to pass, and a few passes are enough. The forward model then has
to give the measured T/N with these mu; where it integrates the wear, passes go on along what it found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twindisc_cli.errors import ValidityError
from twindisc_cli.identify.friction import LOWEST, mu_from_traction
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import ForwardModel, IntegratedSets
from twindisc_cli.model.patch import Paths
from twindisc_cli.model.prediction import Prediction

MOST_PASSES, STANDING = 60, 1e-10
"""Passes at the most, and the change of T/N [1] in a pass at which they end."""
MOST_INTEGRATIONS, MET = 10, 1e-6
"""Predictions at the most, and the error of T/N [1] at which they end."""


@dataclass(frozen=True)
class CoupledSteps:
    """The inversion of a test's T/N: mu_of gives mu (set, step).

    of_steps: from T/N of the samples (set, sample) to that of the steps in the sense of the creepage (set, step), NaN
    where nothing was measured; highest_mu: the largest mu that is tried.
    """

    model: ForwardModel
    of_steps: Callable[[Floats], Floats]
    highest_mu: float

    def mu_of(self, ratio: Floats) -> Floats:
        """The mu [1] at which the model makes T/N in the sense of the creepage, ratio, both (set, step).

        0 where even the smallest mu gives more, inf above the elastic limit (or highest_mu), NaN where ratio is.
        Raises ValidityError where no mu is found with which the model makes it.
        """
        if np.all(np.isnan(ratio[0])):
            return np.full(ratio.shape, np.nan)
        wanted = np.where(np.isnan(ratio), ratio[0], ratio)
        paths: IntegratedSets | Paths = "none"
        begin = self._pass(np.abs(wanted), None, paths)
        for _ in range(MOST_INTEGRATIONS):
            mu, begin = self._in_passes(wanted, begin, paths)
            begin = self.model.predict(self._base(mu), profiled=False, near=begin.state)
            missed = self._missed(wanted, mu, begin)
            if missed < MET:
                return np.where(np.isnan(ratio), np.nan, mu)
            paths = begin.paths
        raise ValidityError(f"no friction of the steps was found with which the model makes T/N: {missed:.1g} is left")

    def _in_passes(self, wanted: Floats, last: Prediction, paths: IntegratedSets | Paths) -> tuple[Floats, Prediction]:
        """The mu with which a pass leaves the wear and the warmth with which it began, and that pass."""
        for _ in range(MOST_PASSES):
            mu = self._inverted(wanted, last, paths)
            last = self._pass(mu, last, paths)
            if self._missed(wanted, mu, self._pass(mu, last, paths)) < STANDING:
                break
        return mu, last

    def _inverted(self, wanted: Floats, last: Prediction, paths: IntegratedSets | Paths) -> Floats:
        """The mu (set, step) of T/N with the wear and the warmth that the last pass has left."""

        def traction(mu: Floats) -> Floats:
            return self.of_steps(self._pass(mu, last, paths).traction)

        return mu_from_traction(wanted, traction=traction, highest_mu=self.highest_mu)

    def _pass(self, mu: Floats, last: Prediction | None, paths: IntegratedSets | Paths) -> Prediction:
        """One pass of the model with mu (set, step), from the wear and the warmth of the last one."""
        near = last.state if last else None
        return self.model.predict(self._base(mu), integrated=paths, profiled=False, near=near, within=np.inf)

    def _base(self, mu: Floats) -> BaseParameters:
        """Mu (set, step) within what can be tried; where nothing was measured the declared one, or that before."""
        test = self.model.experiment
        known = np.flatnonzero(~np.isnan(mu[0]))
        before = known[np.maximum(np.searchsorted(known, np.arange(mu.shape[1]), side="right") - 1, 0)]
        given = test.history.given_mu[test.history.step_begin]
        declared = np.where(np.isnan(given), test.options.friction_coefficient, given)
        in_use = np.where(np.isnan(mu) & np.isfinite(declared), declared, mu[:, before])
        return BaseParameters.declared(test, np.clip(in_use, LOWEST, self.highest_mu))

    def _missed(self, wanted: Floats, mu: Floats, prediction: Prediction) -> float:
        """By how much a prediction misses T/N, (set, step), at most, where there is a mu [1]."""
        missed = np.abs(self.of_steps(prediction.traction) - wanted)
        return float(np.max(missed[np.isfinite(mu) & (mu > 0.0)], initial=0.0))
