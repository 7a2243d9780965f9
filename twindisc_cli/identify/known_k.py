"""Every wear coefficient that is known of a test, the one to use first, each with the reason why it differs.

    K of depth      the simulated depth is the measured one              bisection, Eqs. 16, 17
    K of shape      the simulated profile is nearest to the measured     least squares
    K of volume     W H / E of the profile, or of the mass lost          Eq. 15 summed; no shape is in it

They are one number where the simulated track has the shape of the measured one. Where it is narrower, the K of depth
wears too little volume, by the factor K_depth / K_volume, and the K of volume too deep a track.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.identify.mass import MassFit
from twindisc_cli.identify.track import worn_track
from twindisc_cli.identify.wear import WearFit


@dataclass(frozen=True)
class KnownK:
    """A wear coefficient [1] with its standard error, NaN where it has none; use: the one that the commands take.

    from_data: found from this test's measurements, not stated by somebody. why: what it is, and why it differs.
    """

    name: str
    value: float
    std: float
    why: str
    use: bool = False
    from_data: bool = True

    @property
    def low(self) -> float:
        """Lower end of the 90 % interval, not below zero."""
        return max(self.value - NINETY * self.std, 0.0) if np.isfinite(self.std) else np.nan

    @property
    def high(self) -> float:
        """Upper end of the 90 % interval."""
        return self.value + NINETY * self.std

    @property
    def is_wide(self) -> bool:
        """Whether the 90 % interval is as wide as the value."""
        return 2.0 * NINETY * self.std > self.value


KEYS: Mapping[int, str] = {1: "disc1_wear_coefficient", 2: "wear_coefficient"}
"""Where a definition takes the K of each disc."""
STATED: Mapping[str, str] = {
    "declared": "stands in the definition, so that the other commands take it in place of one found from the data",
    "reported": "was published with the test; nothing takes it",
}


def known_from_profile(fit: WearFit, mass: MassFit | None, stated: Mapping[str, float]) -> list[KnownK]:
    """What depth, shape and volume of the profile say, then the mass lost, then what was stated."""
    return [*_from_depth_and_shape(fit), _from_volume(fit), *_from_mass(mass), *_stated(stated)]


def known_from_mass(mass: MassFit, stated: Mapping[str, float]) -> list[KnownK]:
    """What the mass lost says, and what was stated, where no profile was measured."""
    several = _from_mass(mass) if len(mass.of_disc) > 1 else []
    why = "wears the mass that was weighed" if len(mass.volume) == 1 else "nearest to all weighings by least squares"
    if several:
        why = "of both discs together, as with [effects.wear_partition]; each has its own of these in the definition"
    return [KnownK("by weight", mass.wear_coefficient, mass.std, why, use=True), *several, *_stated(stated)]


def _from_depth_and_shape(fit: WearFit) -> list[KnownK]:
    depth, squares = fit.bisection.wear_coefficient, fit.least_squares
    if fit.method == "least squares":
        return [
            KnownK("least squares", squares.value, fit.std, "depth and shape of the profile agree", use=True),
            KnownK("bisection", depth, np.nan, "the paper's: meets the depth alone, to within 1 %"),
        ]
    off = worn_track(fit.y, fit.squares_height, smooth=False).depth / fit.measured.depth - 1.0
    why = (
        "meets the measured depth; the profile has another shape than the model's, and the ± holds both this K and "
        "that of least squares"
    )
    return [
        KnownK("bisection", depth, fit.std, why, use=True),
        KnownK("least squares", squares.value, squares.std, f"nearest to the whole profile, {_percent(off)} in depth"),
    ]


def _from_volume(fit: WearFit) -> KnownK:
    share = fit.wear_coefficient / fit.allowed
    both = "" if fit.part == 1.0 else f", of which disc {fit.disc} bears {fit.part * 100.0:.3g} %"
    why = f"for volumes and masses, whatever the shape; the K to use wears {share * 100.0:.0f} % of the volume{both}"
    return KnownK("W H / E", fit.allowed, np.nan, why)


def _from_mass(mass: MassFit | None) -> list[KnownK]:
    if mass is None:
        return []
    why = "the mass that it lost, whatever its shape"
    if len(mass.of_disc) == 1:
        return [KnownK(f"by weight, disc {disc}", k, mass.std, why) for disc, (k, _) in mass.of_disc.items()]
    return [
        KnownK(f"by weight, disc {disc}", k, std, f"{why}: {KEYS[disc]} under [model]")
        for disc, (k, std) in mass.of_disc.items()
    ]


def _stated(stated: Mapping[str, float]) -> list[KnownK]:
    return [KnownK(what, k, np.nan, STATED[what], from_data=False) for what, k in stated.items()]


def _percent(off: float) -> str:
    return f"{abs(off) * 100.0:.2g} % too {'large' if off > 0.0 else 'small'}"
