"""The friction chart (Figs. 6, 7): apparent friction T/N over creepage for a family of mu, declared effects acting.

light line   where T/N is 98 % of mu: to its right the apparent friction is the friction
full slip    the smallest creepage at which nothing of the patch sticks, T = mu N
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.friction import LIGHT_LINE
from twindisc_cli.identify.law import unworn_law
from twindisc_cli.identify.roots import bracketed_root
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, History, Ints, Measured
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.model.traction_law import share_of_full_slip, traction_law

_FULL = 1.0 - 1e-13  # full slip is reached asymptotically: where rounding ends
_MOMENT = 1e-9  # s; long enough for a traction, too short to wear or to warm
_SMALLEST, _LARGEST = 1e-9, 2.0


@dataclass(frozen=True)
class Chart:
    """Apparent friction (mu, creepage) [1] over mu (mu,) and creepage (creepage,) [1], and where its lines are.

    light_line, full_slip: creepage [1] of each mu (mu,), inf where it is not reached below 200 %.
    """

    mu: Floats
    creepage: Floats
    apparent: Floats
    light_line: Floats
    full_slip: Floats


def friction_chart(test: Experiment, *, mu: Floats, creepage: Floats) -> Chart:
    """The chart of a test's unworn discs for mu (mu,) at creepages (creepage,) [1], what only changes wear left out."""
    effects = {name: own for name, own in test.effects.items() if catalogue()[name].stage != "wear"}
    laws = {name: law for name, law in test.laws.items() if QUANTITIES[law.quantity].stage != "wear"}
    test = replace(test, effects=effects, laws=laws)
    if not test.is_plain:
        return _with_effects(test, mu, creepage)
    law = unworn_law(test)
    return Chart(
        mu=mu,
        creepage=creepage,
        apparent=law.apparent(mu[:, None], creepage),
        light_line=mu / law.slope * law.unsaturation(np.asarray(LIGHT_LINE)),
        full_slip=mu / law.slope * law.full_slip,
    )


def _with_effects(test: Experiment, mu: Floats, creepage: Floats) -> Chart:
    """The chart through the forward model."""
    prediction, last = _at(test, mu=mu, creepage=creepage)
    ratio = np.broadcast_to(prediction.state.traction_ratio, prediction.section.shape)
    return Chart(
        mu=mu,
        creepage=creepage,
        apparent=np.asarray(ratio[:, last]),
        light_line=_reached(test, mu, LIGHT_LINE),
        full_slip=_reached(test, mu, min(traction_law(test.rig, test.options.traction).full, _FULL)),
    )


def at_creepages(test: Experiment, creepage: Floats) -> Experiment:
    """The test with its discs unworn and cold at each creepage (creepage,) [1] for a moment, nothing measured."""
    moments = np.full(len(creepage), _MOMENT)
    history = History(
        step=np.arange(len(creepage)),
        creepage=creepage,
        duration=moments,
        revolutions=moments,
        given_mu=np.full(len(creepage), np.nan),
    )
    return replace(test, history=history, measured=Measured())


def _at(test: Experiment, *, mu: Floats, creepage: Floats) -> tuple[Prediction, Ints]:
    """The contact for each mu at each creepage, and the operating points that hold the creepages."""
    model = ForwardModel(at_creepages(test, creepage))
    return model.predict(BaseParameters(mu)), model.points.of_iteration


def _reached(test: Experiment, mu: Floats, share: float) -> Floats:
    """The creepage at which T/(mu N) reaches a share, for each mu (mu,)."""

    def missing(log_creepage: Floats) -> Floats:
        prediction, last = _at(test, mu=mu, creepage=np.exp(log_creepage))
        result = share_of_full_slip(test.rig, prediction.state)
        return np.asarray(np.diagonal(result[:, last])) - share

    low, high = (np.full(len(mu), np.log(end)) for end in (_SMALLEST, _LARGEST))
    creepage = np.exp(bracketed_root(missing, low, high))
    return np.where(missing(high) >= 0.0, creepage, np.inf)
