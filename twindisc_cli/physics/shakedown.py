"""Yield and shakedown of rolling contact: how hard may be pressed before every pass leaves plastic strain behind.

    p0 / k <= 1 / max |tau_1| / p0        nothing flows; tau_1 the greatest shear of the elastic contact (Tresca)
    p0 / k <= 1 / max |tau_zx| / p0       residual stress built up by the first passes makes the rest elastic (Melan)

    k      yield stress in shear; of steel H / (3 sqrt 3), Tabor's H = 3 Y with von Mises' Y = sqrt 3 k [Pa]
    tau    of a line contact that slides all over with t = (T/N) p, in closed form (McEwen); residual stress can take
           away all of it but tau_zx
    circle, ellipse   first yield is that without traction, times what traction leaves of a line's; shakedown goes by
           tau_zx of pressure p and traction t = (T/N) p together, at most 1 / (T/N), at which the surface itself flows

    tau_zx = - 3 / (2 pi) integral of (p z^2 r + t z r^2) / R^5,   r = x - x' along rolling, R the distance (Boussinesq,
             Cerruti), which do not depend on Poisson's ratio

Without traction tau_zx of an ellipse is sqrt(2 t - 1) / [2 t (t + 1)] p0 with a/b = sqrt[(t^2 - 1) (2 t - 1)], where
t = 1 is a line (0.250), and 1.281 a circle (0.214). Beyond shakedown the surface ratchets, and wear is not Archard's.

Source: K. L. Johnson, Contact Mechanics (1985), sections 4.2 (Table 4.1), 7.1 and 9.2; G. Lundberg and A. Palmgren,
Acta Polytechnica 7 (1947); A. R. S. Ponter, A. D. Hearle and K. L. Johnson, J. Mech. Phys. Solids 33 (1985) 339-362.
Valid for: elastic, perfectly plastic bodies; first yield of an ellipse under traction is an estimate.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from twindisc_cli.physics._arrays import Floats

RATIOS = np.linspace(0.0, 1.0, 101)
"""T/N of the line's limits; between them they are linear."""
_SLENDER = 1e6
"""Axis ratio of an ellipse that has the limits of one without end, to 1e-4; sums over one of 1e100 overflow."""
_ALONG, _ACROSS = 120, 16
"""Places along and across rolling at which an ellipse's forces are summed."""
_NARROW = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
_SHEAR = np.array([0.300, 0.322, 0.325, 0.323, 0.317, 0.310])
_DEPTH = np.array([0.785, 0.745, 0.665, 0.590, 0.530, 0.480])


def shear_yield(hardness: ArrayLike) -> Floats:
    """The yield stress in shear k [Pa] from the hardness [Pa]."""
    return np.asarray(np.asarray(hardness, dtype=float) / (3.0 * np.sqrt(3.0)))


def greatest_shear(a: float, b: float) -> tuple[float, float]:
    """The greatest shear below a patch without traction, over p0, and its depth [m]; semi-axes [m], b = inf: a line."""
    narrow, wide = min(a, b), max(a, b)
    share = narrow / wide
    return float(np.interp(share, _NARROW, _SHEAR)), narrow * float(np.interp(share, _NARROW, _DEPTH))


def orthogonal_shear(a: float, b: float) -> tuple[float, float]:
    """The greatest tau_zx without traction, over p0, and its depth [m]; a along rolling, b = inf: a line [m]."""
    t = _shape(a / b)
    root = np.sqrt(2.0 * t - 1.0)
    return float(root / (2.0 * t * (t + 1.0))), float(a / ((t + 1.0) * root))


def limits(traction_ratio: ArrayLike, a: float, b: float) -> tuple[Floats, Floats]:
    """p0 / k at which the contact first yields, and up to which it shakes down, at T/N of any shape [1]."""
    ratio = np.abs(np.asarray(traction_ratio, dtype=float))
    first, last = _of_a_line()
    a = a if np.isinf(b) else b * float(np.clip(a / b, 1.0 / _SLENDER, _SLENDER))
    yields = np.interp(ratio, RATIOS, first) / first[0] / greatest_shear(a, b)[0]
    left = np.interp(ratio, RATIOS, last if np.isinf(b) else _of_an_ellipse(a / b))
    shakes = left / (last[0] if np.isinf(b) else 1.0) / orthogonal_shear(a, b)[0]
    with np.errstate(divide="ignore"):
        surface = 1.0 / ratio
    return np.minimum(yields, surface), np.minimum(shakes, surface)


def _shape(ratio: float) -> float:
    """The t of Lundberg and Palmgren for a/b; NaN where that is none."""
    if ratio == 0.0 or not np.isfinite(ratio):
        return 1.0 if ratio == 0.0 else np.nan
    return float(brentq(lambda t: np.sqrt((t * t - 1.0) * (2.0 * t - 1.0)) - ratio, 1.0, 2.0 + ratio))


@cache
def _of_a_line() -> tuple[Floats, Floats]:
    """p0 / k of first yield and of shakedown of a line, over RATIOS."""
    x, z = np.meshgrid(np.linspace(-1.5, 1.5, 241), np.concatenate([[0.0], np.geomspace(1e-3, 1.5, 90)]))
    sigma_x, sigma_z, tau = line_stress(x, z)
    first, last = [], []
    for mu in RATIOS:
        shear = tau + mu * sigma_x
        along = sigma_x + mu * _tangential_stress(x, z)
        across = sigma_z + mu * tau
        first.append(1.0 / np.sqrt(0.25 * (along - across) ** 2 + shear**2).max())
        last.append(1.0 / np.abs(shear).max())
    return np.array(first), np.array(last)


@lru_cache(maxsize=64)
def _of_an_ellipse(ratio: float) -> Floats:
    """What traction leaves of the p0 / k of shakedown of an ellipse with a/b, over RATIOS [1]."""
    pressed, driven = _ellipse_shear(ratio)
    greatest = np.array(
        [np.maximum(np.abs(pressed + mu * driven), np.abs(pressed - mu * driven)).max() for mu in RATIOS]
    )
    return np.asarray(greatest[0] / greatest)


def _ellipse_shear(ratio: float) -> tuple[Floats, Floats]:
    """tau_zx over p0 in the plane y = 0 below an ellipse, by its pressure and by a traction of that shape, (z, x >= 0).

    Semi-axes are a/b and 1. Forces are summed over chords along rolling, which crowd about y = 0 near the surface.
    """
    place = ratio * np.linspace(0.0, 1.5, 46)
    angle = np.pi * (np.arange(_ALONG) + 0.5) / _ALONG
    pressed, driven = [], []
    for depth in min(ratio, 1.0) * np.linspace(0.12, 1.4, 25):
        way, share = np.polynomial.legendre.leggauss(_ACROSS)
        reach = 0.5 * np.arcsinh(1.0 / depth)
        y = depth * np.sinh(reach * (1.0 + way))
        half = np.sqrt(np.maximum(1.0 - y**2, 0.0))[:, None]
        force = 2.0 * share[:, None] * reach * np.hypot(y, depth)[:, None] * ratio * (half * np.sin(angle)) ** 2
        force *= np.pi / _ALONG
        apart = place[:, None, None] - ratio * half * np.cos(angle)
        kernel = -1.5 / np.pi * depth * force / (apart**2 + y[:, None] ** 2 + depth**2) ** 2.5
        pressed.append((kernel * apart * depth).sum(axis=(1, 2)))
        driven.append((kernel * apart**2).sum(axis=(1, 2)))
    return np.array(pressed), np.array(driven)


def line_stress(x: ArrayLike, z: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Stresses sigma_x, sigma_z, tau_zx over p0 below a line contact; x along rolling and depth z over a [1]."""
    m, n, x, z = _mn(x, z)
    size = np.maximum(m**2 + n**2, 1e-300)
    share = (z**2 + n**2) / size
    return -(m * (1.0 + share) - 2.0 * z), -m * (1.0 - share), -n * (m**2 - z**2) / size


def _tangential_stress(x: ArrayLike, z: ArrayLike) -> Floats:
    """sigma_x under tractions of the pressure's shape, over their peak."""
    m, n, x, z = _mn(x, z)
    return np.asarray(n * (2.0 - (z**2 - m**2) / np.maximum(m**2 + n**2, 1e-300)) - 2.0 * x)


def _mn(x: ArrayLike, z: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
    """McEwen's m and n, and x and z as arrays."""
    x, z = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(z, dtype=float))
    inner = 1.0 - x**2 + z**2
    root = np.sqrt(inner**2 + 4.0 * x**2 * z**2)
    m = np.sqrt(np.maximum(0.5 * (root + inner), 0.0))
    return m, np.sign(x) * np.sqrt(np.maximum(0.5 * (root - inner), 0.0)), x, z
