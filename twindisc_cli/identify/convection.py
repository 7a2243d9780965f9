"""The convection h S [W/K] of a test from its measured temperature (Eq. 18)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.least_squares import Fit, fit_positive
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import ForwardModel, IntegratedSets


def identify_convection(model: ForwardModel, mu: Floats) -> Fit:
    """Fit the convection to the measured temperature with mu (step,) in the contact; the test must have [thermal]."""
    test = model.experiment
    samples = test.measured.temperature
    if samples is None or test.thermal is None:
        raise DefinitionError(
            "no convection is known: give convection_W_K under [thermal], or a measured temperature to find it from"
        )

    def temperatures(convection: Floats, integrated: IntegratedSets = "each") -> Floats:
        base = BaseParameters.declared(test, np.broadcast_to(mu, (len(convection), len(mu))))
        return model.predict(replace(base, convection=convection), integrated=integrated).temperature

    power = float(np.mean(model.predict(BaseParameters.declared(test, mu[None])).state.power))
    rise = float(np.ptp(samples.temperature)) or 1.0
    return fit_positive(
        temperatures,
        measured=samples.temperature,
        weights=np.ones_like(samples.temperature),
        start=max(power, 1e-6) / rise,
        rough=partial(temperatures, integrated="none"),
    )
