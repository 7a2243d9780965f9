"""A test that was not fitted, predicted by what was found elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.laws.law import Law
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Case, case_of, stated
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import Prediction

BEYOND = 0.02
"""A covariate counts as outside a law's range from this share of the range on."""


@dataclass(frozen=True)
class Foretold:
    """A test with its prediction by a fit of other tests: root mean square errors by channel, in SI units."""

    case: Case
    prediction: Prediction

    def misses(self, channel: str) -> Floats:
        """Measured minus predicted in the order of the record (sample,); NaN where it cannot be predicted."""
        miss = self.case.values(channel) - channels()[channel].predicted(self.prediction)[0]
        return np.asarray(miss[self.case.noise[channel].order])

    def error(self, channel: str) -> float:
        """Root mean square of measured minus predicted; NaN where the channel cannot be predicted."""
        return float(np.sqrt(np.mean(self.misses(channel) ** 2)))


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


def warnings(laws: Mapping[str, Law], prediction: Prediction, test: str) -> list[str]:
    """Where laws are used outside of the range they were learnt on, or cannot be carried over to another history."""
    found = []
    for name, law in laws.items():
        if law.transfer == "same_history":
            found.append(
                f"{test}: {name} was learnt on another history and cannot be carried over with certainty: there "
                f"{law.over.label} could not be told from what changed with it"
            )
        outside = _outside(law, prediction)
        if outside > 0.0:
            low, high = law.valid or (np.nan, np.nan)
            found.append(
                f"{test}: {name} is used outside of the range it was learnt on ({low:.4g} to {high:.4g} "
                f"{law.over.unit}) in {100.0 * outside:.0f} % of the test"
            )
    return found


def _outside(law: Law, prediction: Prediction) -> float:
    """Share of a test in which the covariate of a law is beyond its range."""
    if law.valid is None or law.covariate == "y_over_edge":
        return 0.0
    x: Floats = np.broadcast_to(law.over.of(prediction.state), prediction.section.shape)[0]
    slack = BEYOND * (law.valid[1] - law.valid[0])
    beyond = (x < law.valid[0] - slack) | (x > law.valid[1] + slack)
    weight = prediction.state.duration
    return float(np.sum(weight[beyond]) / max(float(np.sum(weight)), 1e-300))
