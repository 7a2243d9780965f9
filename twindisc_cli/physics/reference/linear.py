"""Kalker's linear theory (Eq. 9): the tangential force of a patch that sticks everywhere.

    Tx =  G ab C11 vx
    Ty =  G ab C22 vy + G (ab)^(3/2) C23 phi
    Mz = -G (ab)^(3/2) C32 vy + G (ab)^2 C33 phi,      C32 = C23

    vx, vy   longitudinal and lateral creepage [1];   phi   spin [rad/m]
    a, b     semi-axes of the patch [m];              G     shear modulus of Eq. 7 [Pa]

Signs: the paper's. Forces are positive where creepage is, and so are what it costs to drive the contact: they are
minus those on body 1. Mz is the moment of these tractions, the integral of (x ty - y tx); its lateral term is then
negative, and (ab)^2 is what its units ask for. The paper prints + and ab there.

Source: J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990).
Valid for: creepage small against mu N/(G ab).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.physics._arrays import Floats, arrays
from twindisc_cli.physics.kalker import Coefficients


@dataclass(frozen=True)
class Forces:
    """Longitudinal and lateral force [N] and spin moment [N m]."""

    longitudinal: Floats
    lateral: Floats
    moment: Floats


def forces(
    *,
    creepage_x: ArrayLike,
    creepage_y: ArrayLike,
    spin: ArrayLike,
    a: ArrayLike,
    b: ArrayLike,
    shear_modulus: ArrayLike,
    coefficients: Coefficients,
) -> Forces:
    """Force and moment of full adhesion at each operating point; all arguments broadcast."""
    vx, vy, phi, a, b, g = arrays(creepage_x, creepage_y, spin, a, b, shear_modulus)
    c = coefficients
    size = np.sqrt(a * b)
    turn = phi * size
    return Forces(
        longitudinal=g * size**2 * c.c11 * vx,
        lateral=g * size**2 * (c.c22 * vy + c.c23 * turn),
        moment=g * size**3 * (c.c33 * turn - c.c23 * vy),
    )
