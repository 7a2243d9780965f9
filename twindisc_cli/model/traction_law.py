"""The laws of rolling that a test may declare, for the patch its discs make: an ellipse, or a strip.

T = mu N f(xi),   xi = |linear force| / (mu N),   linear force G a b C11 v along and G a b C22 v across rolling

Between discs of unlike elasticity the pressure drives as well (`physics.unlike`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twindisc_cli.effects._state import State
from twindisc_cli.model.experiment import Floats, Rig, Traction
from twindisc_cli.physics import exact, fastrip, fastsim, kalker, line_contact, unlike

NEARLY_FULL = 0.999
"""Share of mu N that counts as full slip in the exact theory of an ellipse, where traction never points along rolling
everywhere."""


@dataclass(frozen=True)
class TractionLaw:
    """f [1] over xi [1] and the ratio a/b of the patch [1], its inverse, and the share of mu N that is full slip."""

    saturation: Callable[[Floats, Floats], Floats]
    unsaturation: Callable[[Floats, Floats], Floats]
    full: float = 1.0


def theory_for(rig: Rig, named: Traction | None) -> Traction:
    """The theory that is named, else the usual one: the paper's FASTSIM, and on two cylinders Carter's exact law."""
    return named or ("exact" if rig.is_line else "fastsim")


def traction_law(rig: Rig, theory: Traction) -> TractionLaw:
    """The law of a theory; on a strip FaStrip is exact, and Carter's."""
    if rig.is_line:
        plane: line_contact.Theory = "fastsim" if theory == "fastsim" else "exact"
        return TractionLaw(
            lambda xi, ratio: line_contact.saturation(xi, plane),
            lambda share, ratio: line_contact.unsaturation(share, plane),
        )
    if theory == "exact":
        nu = rig.poisson_ratio
        return TractionLaw(
            lambda xi, ratio: exact.saturation(xi, ratio, nu),
            lambda share, ratio: exact.unsaturation(share, ratio, nu),
            NEARLY_FULL,
        )
    module = fastrip if theory == "fastrip" else fastsim
    return TractionLaw(lambda xi, ratio: module.saturation(xi), lambda share, ratio: module.unsaturation(share))


def creep_stiffness(rig: Rig, a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """G a b C11 and G a b C22 [N]: force per creepage of a patch that sticks all over, along and across rolling."""
    if rig.is_line:
        c11, c22 = line_contact.coefficients(rig.poisson_ratio)
        return rig.shear_modulus * a * b * c11, rig.shear_modulus * a * b * c22
    c = kalker.coefficients(a / b, rig.poisson_ratio)
    return rig.shear_modulus * a * b * c.c11, rig.shear_modulus * a * b * c.c22


def slip_of_pressure(rig: Rig, a: Floats, b: Floats, normal_load: Floats) -> Floats:
    """Slip that the pressure makes between discs of unlike elasticity, at the middle of the patch, as creepage [1]."""
    p0 = (1.0 if rig.is_line else 1.5) * normal_load / (np.pi * a * b)
    return unlike.slip_of_pressure(rig.dundurs, p0, rig.effective_modulus, np.zeros(()) if rig.is_line else a / b)


def share_of_full_slip(rig: Rig, state: State) -> Floats:
    """T/(mu N) [1] by the power; of discs of unlike elasticity, whose pressure dissipates too, along rolling alone."""
    capacity = state.mu * state.normal_load
    with np.errstate(invalid="ignore", divide="ignore"):
        if rig.dundurs:
            return np.asarray(np.abs(state.traction_ratio) * state.recorded_load / capacity)
        return np.asarray(state.power / (state.sliding_speed * capacity))
