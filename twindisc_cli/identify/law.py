"""The traction law of a test on its unworn discs, and its initial slope, where no declared effect changes them.

T/N = mu f(slope v / mu)      slope = G a b C11 / N
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.traction_law import creep_stiffness, traction_law


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
    ratio = rig.patch.a / rig.patch.b
    slope = float(creep_stiffness(rig, rig.patch.a, rig.patch.b)[0]) / rig.normal_load
    law = traction_law(rig, test.options.traction)
    return Law(
        slope=slope,
        saturation=lambda xi: law.saturation(xi, ratio),
        unsaturation=lambda share: law.unsaturation(share, ratio),
        full_slip=float(law.unsaturation(np.asarray(law.full), ratio)),
    )
