"""A test that was not fitted, predicted by what was found elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Case, case_of, stated
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import Prediction


@dataclass(frozen=True)
class Foretold:
    """A test with its prediction by a fit of other tests: root mean square errors by channel, in SI units."""

    case: Case
    prediction: Prediction

    def misses(self, channel: str) -> Floats:
        """Measured minus predicted in the order of the record (sample,); NaN where it cannot be predicted."""
        miss = self.case.values(channel) - channels()[channel].predicted(self.case.model, self.prediction)[0]
        return np.asarray(miss[self.case.noise[channel].order])

    def error(self, channel: str) -> float:
        """Root mean square of measured minus predicted; NaN where the channel cannot be predicted."""
        return rms(self.misses(channel))


def rms(misses: Floats) -> float:
    """Root mean square; NaN without samples."""
    return float(np.sqrt(np.mean(misses**2))) if len(misses) else float("nan")


def foretell(test: Experiment, fitted: Fit) -> Foretold:
    """Predict a test by a fit of others, with the effects and laws these declare.

    Base parameters are as fitted, those of a single test from the first; else as either test says.
    """
    first = fitted.problem.cases[0].test
    case = case_of(replace(test, effects=dict(first.effects), laws=dict(first.laws)))
    known = stated(first) | stated(test)
    known |= {p.key: fitted.value(p)[0] for p in reversed(fitted.problem.parameters) if p.term is None}
    keys = ("mu", "K", "convection_W_K")
    return Foretold(case, case.model.predict({key: np.array([known.get(key, np.nan)]) for key in keys}))
