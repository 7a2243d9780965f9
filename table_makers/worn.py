"""Make twindisc_cli/model/worn.npz: `python -m table_makers.worn`, some six minutes.

Rigs of six ratios a/b of the unworn patch are worn in half-space contact. Each worn profile goes through the full
normal solver and the rolling solver, and so does an ellipse of the same area and ratio, on grids of as many elements:
what one is over the other is free of most of the grids' errors. The mean over the grids is fitted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from table_makers.strips import semi_width, solve_strips
from twindisc_cli.model import worn
from twindisc_cli.model.experiment import Disc, Floats, Rig
from twindisc_cli.model.integration import Setup, integrate
from twindisc_cli.model.wear_path import grid
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.half_space.normal import NormalContact, solve_gap
from twindisc_cli.physics.half_space.strips import StripContact, equivalent_ellipse

RATIOS = (0.08, 0.2, 0.5, 1.0, 2.0, 5.0)
SECTIONS = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Worn sections over that of a facet as wide as the unworn patch."""
SLENDER = 0.04
"""Ratio a/b under which no grid resolves both ends of a patch."""
_GRIDS = (42, 48, 54, 60)
_MARGIN = 3  # elements beyond each end of the patch
_LOAD = 72.0


def rig_of(ratio: float) -> Rig:
    """A straight disc on a crowned one whose unworn patch has this a/b."""
    from scipy.optimize import brentq

    def off(log_curvature: float) -> float:
        patch = _rig(np.exp(-log_curvature)).patch
        return float(np.log(patch.a / patch.b / ratio))

    return _rig(float(np.exp(-brentq(off, np.log(1e-5), np.log(1e5)))))


def _rig(crown: float) -> Rig:
    steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": 7e9}
    return Rig(Disc(0.03, np.inf, **steel), Disc(0.03, crown, **steel), normal_load=_LOAD, rolling_speed=9.42)


@dataclass(frozen=True)
class Profile:
    """A gap over y, and how far its patch reaches along and across rolling [m]."""

    rig: Rig
    gap: Callable[[Floats], Floats]
    along: float
    across: float

    def pressed(self, n: int) -> NormalContact:
        """The full normal contact on n elements along rolling, and more across where the patch is wide."""
        many = int(n * np.clip(1.2 * self.across / self.along, 1.0, 5.0) ** 0.6)
        x, y = (
            size * (1.0 + 2.0 * _MARGIN / count) * ((2.0 * np.arange(c) + 1.0) / c - 1.0)
            for size, count in ((self.along, n), (self.across, many))
            for c in (count + 2 * _MARGIN,)
        )
        gap = 0.5 * self.rig.curvature_x * x**2 + self.gap(y)[:, None]
        load, modulus = self.rig.normal_load, self.rig.effective_modulus
        return solve_gap(x=x, y=y, gap=gap, normal_load=load, effective_modulus=modulus)

    def curve(self, n: int) -> Floats:
        """Linear stiffness [N], and T/(mu N) at the CREEPAGES but the first, on one grid."""
        pressed, load = self.pressed(n), self.rig.normal_load

        def force(bound: Floats, creepage: float) -> float:
            return rolling.solve(
                x=pressed.x,
                y=pressed.y,
                pressure=bound,
                mu=1.0,
                discs=rolling.Discs(self.rig.shear_modulus, self.rig.poisson_ratio),
                creepage=rolling.Creepage(creepage),
                tolerance=1e-4,
            ).force_x

        stiffness = force(np.where(pressed.patch, 1e20, 0.0), 1.0)
        shares = [force(pressed.pressure, xi * load / stiffness) / load for xi in worn.CREEPAGES[1:]]
        return np.array([stiffness, *shares])


def worn_contact(rig: Rig, section: float, wander: float = 0.0) -> tuple[StripContact, Floats]:
    """The strips of a track worn to this section, finer than the wear path's, and its gap [m] (strip,)."""
    usual = grid.strips_of(rig, section, wander)
    y = np.linspace(usual[0], usual[-1], 2 * len(usual) - 1)
    depth = integrate(Setup(rig, "half_space", wander), y, grid.nodes_to(rig, section)).depth[0, -1]
    gap = 0.5 * rig.curvature_y * y**2 + depth
    return solve_strips(
        y=y,
        gap=gap,
        curvature_x=rig.curvature_x,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
        relative_accuracy=1e-4,
    ), gap


def against_ellipse(rig: Rig, contact: StripContact, gap: Floats) -> Floats:
    """Stiffness over that of the equivalent ellipse, and T/(mu N) less that of the ellipse at CREEPAGES[1:]."""
    from scipy.interpolate import CubicSpline

    a, b = (float(axis) for axis in equivalent_ellipse(contact))
    along, across = float(contact.half_length.max()), float(semi_width(contact))
    track = Profile(rig, CubicSpline(contact.y, gap), 1.02 * along, 1.01 * across + 0.5 * contact.strip_width)
    round_rig = rig_of(a / b)
    along, across = float(round_rig.patch.a), float(round_rig.patch.b)
    ellipse = Profile(round_rig, lambda y: 0.5 * round_rig.curvature_y * y**2, 1.02 * along, 1.02 * across)
    found = []
    for n in _GRIDS:
        one, other = track.curve(n), ellipse.curve(n)
        found.append([one[0] / other[0] * along * across / (a * b), *(one[1:] - other[1:])])
    return np.asarray(np.mean(found, axis=0))


def make() -> None:
    """Write worn.npz."""
    rows, features = [], []
    for ratio in RATIOS:
        rig = rig_of(ratio)
        for section in SECTIONS:
            contact, gap = worn_contact(rig, section * grid.first_section(rig))
            a, b = equivalent_ellipse(contact)
            if a / b < SLENDER:
                continue
            rows.append(against_ellipse(rig, contact, gap))
            uneven = worn.unevenness(contact.half_length, contact.line_load)
            features.append([float(a / b), float(worn.squareness(contact.half_length)), float(uneven)])
    fitted = _fitted(np.array(rows), np.array(features))
    np.savez(Path(worn.__file__).with_name("worn.npz"), allow_pickle=False, **fitted)


def _fitted(rows: Floats, features: Floats) -> dict[str, Floats]:
    """The coefficients of `worn`, by least squares."""
    ratio, square, uneven = features.T
    part = ratio / (1.0 + ratio)
    design = uneven[:, None] * np.stack([np.sqrt(part), part], axis=-1)
    stiffening = np.linalg.lstsq(design, rows[:, 0] - 1.0, rcond=None)[0]
    shape = square @ rows[:, 1:] / (square @ square)
    shape[-1] = 0.0
    size = rows[:, 1:] @ shape / (shape @ shape)
    design = square[:, None] * np.stack([np.ones_like(ratio), np.log(ratio), np.log(ratio) ** 2], axis=-1)
    by_ratio = np.linalg.lstsq(design, size, rcond=None)[0]
    return {
        "stiffening": stiffening,
        "departure": np.append(0.0, shape),
        "by_ratio": by_ratio,
        "ratios": np.array([ratio.min(), ratio.max()]),
    }


if __name__ == "__main__":
    make()
