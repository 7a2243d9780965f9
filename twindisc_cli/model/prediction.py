"""What the forward model predicts at the measured points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from twindisc_cli.effects._state import State
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.patch import Paths


@dataclass(frozen=True)
class Prediction:
    """Predicted channels at the measured samples, (set, sample): T/N [1], height change [m], temperature [K].

    `state` holds the operating points after the last pass, `section` the worn section at them [m2], (set, point).
    The profile is NaN where K is not known (the section is then 0), the temperature where the convection is not.
    Contact and profile moved on `paths`. own: parameters that only a channel reads, (set, 1), by key.
    """

    traction: Floats
    profile: Floats
    temperature: Floats
    state: State
    section: Floats
    paths: Paths
    own: Mapping[str, Floats] = field(default_factory=dict)
