"""The traction law of a test on its unworn discs, and its initial slope, where no declared effect changes them.

T/N = mu f(slope v / mu)      slope = G a b C11 / N
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.physics import exact, fastrip, fastsim, kalker

NEARLY_FULL = 0.999
"""Share of mu N that counts as full slip in the exact theory, whose traction never points along rolling everywhere."""


@dataclass(frozen=True)
class Law:
    """T/N per creepage of linear theory [1], T/(mu N) over the normalised creepage, its inverse; full slip begins."""

    slope: float
    saturation: Callable[[Floats], Floats]
    unsaturation: Callable[[Floats], Floats]
    full_slip: float

    def apparent(self, mu: Floats, creepage: Floats) -> Floats:
        """Apparent friction T/N [1] at mu and creepage [1], which broadcast."""
        return np.asarray(mu * self.saturation(self.slope * np.abs(creepage) / mu) * np.sign(creepage))


def unworn_law(test: Experiment) -> Law:
    """The law of the declared traction theory on the unworn patch."""
    rig = test.rig
    patch = rig.patch
    ratio, nu = patch.a / patch.b, rig.poisson_ratio
    c11 = float(kalker.coefficients(ratio, nu).c11)
    slope = rig.shear_modulus * float(patch.a * patch.b) * c11 / rig.normal_load
    if test.options.traction == "exact":
        inverse = partial(exact.unsaturation, a_over_b=ratio, poisson=nu)
        forward = partial(exact.saturation, a_over_b=ratio, poisson=nu)
        return Law(slope, forward, inverse, float(inverse(np.asarray(NEARLY_FULL))))
    module = fastrip if test.options.traction == "fastrip" else fastsim
    return Law(slope, module.saturation, module.unsaturation, module.FULL_SLIP)
