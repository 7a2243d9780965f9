"""Closed forms that the program is held against.

Full adhesion (Eq. 9), Kalker's linear theory, valid for creepages small against mu N/(G ab):

    Tx =  G ab C11 vx
    Ty =  G ab C22 vy + G (ab)^(3/2) C23 phi
    Mz = -G (ab)^(3/2) C32 vy + G (ab)^2 C33 phi,      C32 = C23

in the paper's signs: forces are positive where creepage is, minus those on body 1. Mz is the moment of these tractions,
the integral of (x ty - y tx); its lateral term is then negative, and (ab)^2 is what its units ask for. The paper prints
+ and ab there.

The strip at y of an ellipse by FASTSIM without spin, integrated over s: it sticks for s < 2 a(y) - 2 k a, then slides.

    q(y) = 2 mu N / (pi b) [4 k h (h - k) + 4 k^3 / 3]  where h > k,   else 2 mu N / (pi b) 4 h^3 / 3
    h = sqrt(1 - y^2/b^2),   k = min(1, xi / FULL_SLIP)

Sources: J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990); integration of `fastsim`'s strips.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics.fastsim import FULL_SLIP
from twindisc_cli.physics.kalker import Coefficients

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Forces:
    """Longitudinal and lateral force [N] and spin moment [N m]."""

    longitudinal: Floats
    lateral: Floats
    moment: Floats


def adhesion(
    *,
    creepage_x: ArrayLike,
    creepage_y: ArrayLike,
    spin: ArrayLike,
    a: float,
    b: float,
    shear_modulus: float,
    coefficients: Coefficients,
) -> Forces:
    """Force and moment of a patch that sticks everywhere; all arguments broadcast."""
    c, size = coefficients, np.sqrt(a * b)
    vx, vy, turn = np.asarray(creepage_x), np.asarray(creepage_y), np.asarray(spin) * size
    return Forces(
        longitudinal=shear_modulus * size**2 * c.c11 * vx,
        lateral=shear_modulus * size**2 * (c.c22 * vy + c.c23 * turn),
        moment=shear_modulus * size**3 * (c.c33 * turn - c.c23 * vy),
    )


def traction_per_length(*, y: ArrayLike, b: ArrayLike, normal_load: float, mu: float, xi: ArrayLike) -> Floats:
    """The force per length [N/m] of the strip at `y` [m] at the normalised creepage xi [1]; all broadcast."""
    k = np.minimum(np.asarray(xi) / FULL_SLIP, 1.0)
    half_length = np.sqrt(np.maximum(1.0 - (np.asarray(y) / b) ** 2, 0.0))
    stuck = 4.0 * k * half_length * (half_length - k) + (4.0 / 3.0) * k**3
    shape = np.where(half_length > k, stuck, (4.0 / 3.0) * half_length**3)
    return np.asarray(2.0 / np.pi * mu * normal_load / b * shape)
