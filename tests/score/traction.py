"""Traction laws of the score's rig: FASTSIM by quadrature, strips of a computed patch, and the exact curve.

All give T / (mu N) as a function of xi, the linear theory's force over mu N,  xi = G a b C11 vx / (mu N).

FASTSIM on a strip of half-length a(y), bound mu p(x) parabolic in x: traction grows as vx/L (a - x) from the
leading edge and meets the bound at  a + x = d,  behind which the strip slides (J. J. Kalker, Vehicle System
Dynamics 11 (1982) 1). The exact curve is tabulated from CONTACT (open-source release 2025-07-23, revision 2707),
extrapolated in the grid, for a/b = 0.6306, nu = 0.3; over xi it hardly depends on a/b.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from .contact import Ellipse, creepage_coefficients

Floats = NDArray[np.float64]

_TABLE_CREEPAGE: tuple[float, ...] = (
    1e-4,
    2e-4,
    4e-4,
    6e-4,
    8e-4,
    1e-3,
    1.2e-3,
    1.5e-3,
    1.8e-3,
    2e-3,
    2.5e-3,
    3e-3,
    3.5e-3,
    4e-3,
)
_TABLE_CREEPAGE += (4.5e-3, 5e-3, 5.5e-3, 6e-3, 6.5e-3, 7e-3, 7.5e-3, 8e-3, 1e-2, 2e-2, 6e-2)  # at mu = 0.6
_TABLE_RATIO: tuple[float, ...] = (
    0.019823,
    0.039244,
    0.076936,
    0.113081,
    0.147697,
    0.180840,
    0.212529,
    0.257339,
    0.298957,
    0.324956,
)
_TABLE_RATIO += (0.384040, 0.434913, 0.477867, 0.513430, 0.542019, 0.564034, 0.579962, 0.590521, 0.596585, 0.599026)
_TABLE_RATIO += (0.599333, 0.599414, 0.599626, 0.599907, 0.599990)  # T/N
_TABLE_SLOPE = 79.3e9 * 0.170591303e-3 * 0.270524050e-3 * 3.9388 / 72.0  # G a b C11 / N of that rig


def _fastsim_curve(points: int = 400) -> tuple[Floats, Floats]:
    """xi and T/(mu N) of a parabolic ellipse, integrated strip by strip with Gauss points in y = b sin(theta)."""
    node, weight = np.polynomial.legendre.leggauss(80)
    theta = 0.25 * np.pi * (node + 1.0)
    length = np.cos(theta)  # a(y) / a
    reach = np.linspace(0.0, 2.0, points)[:, None]  # d / a, the same for every strip of a parabolic ellipse
    meet = np.minimum(reach, 2.0 * length) - length  # x / a where the strip begins to slide
    slid = length**2 * (meet + length) - (meet**3 + length**3) / 3.0
    stuck = 0.5 * reach * (length - meet) ** 2
    force = (4.0 / np.pi) * 0.25 * np.pi * ((slid + stuck) * length) @ weight  # over mu N, p0 = 2 N / (pi a b)
    return reach[:, 0] * 16.0 / (3.0 * np.pi), np.asarray(force)


_FASTSIM = _fastsim_curve()
_EXACT = PchipInterpolator(
    np.concatenate([[0.0], np.array(_TABLE_CREEPAGE) * _TABLE_SLOPE / 0.6, [1e4]]),
    np.concatenate([[0.0], np.array(_TABLE_RATIO) / 0.6, [1.0]]),
)
_EXACT_XI = np.concatenate([np.linspace(0.0, 5.0, 501), np.geomspace(5.05, 1e4, 200)])
_EXACT_RATIO = _EXACT(_EXACT_XI)


def saturation(xi: float, law: str) -> float:
    """T / (mu N) [1] at xi >= 0 under `law` "fastsim" or "exact"."""
    return float(np.interp(xi, *_FASTSIM) if law == "fastsim" else np.interp(xi, _EXACT_XI, _EXACT_RATIO))


def equivalent_ellipse(half_length: Floats, spacing: float) -> Ellipse:
    """The ellipse with the area of a patch of strips a(y) [m] and with its mean strip length."""
    area = 2.0 * half_length.sum() * spacing
    a = float(np.sqrt(4.0 / 3.0 * (half_length**3).sum() / half_length.sum()))
    return Ellipse(a, area / (np.pi * a))


def strip_share(line_load: Floats, half_length: Floats, ellipse: Ellipse, xi: float, load: float) -> Floats:
    """T(y) / (mu q(y)) of each strip of a computed patch under FASTSIM; 0 outside the patch.

    The flexibility of the equivalent ellipse, L = 8 a / (3 C11 G); strips with parabolas 3 q / (4 a) (1 - (x/a)^2).
    """
    inside = line_load > 0.0
    q, a = line_load[inside], half_length[inside]
    # vx / (L mu) = xi N / (G a b C11) * 3 C11 G / (8 a) = 3 xi N / (8 a^2 b)
    growth = 3.0 * xi * load / (8.0 * ellipse.a**2 * ellipse.b)
    meet = np.minimum(4.0 * growth * a**3 / (3.0 * q), 2.0 * a) - a
    slid = 0.75 * q / a * (meet + a - (meet**3 + a**3) / (3.0 * a**2))
    share = np.zeros_like(line_load)
    share[inside] = np.minimum((slid + 0.5 * growth * (a - meet) ** 2) / q, 1.0)
    return share


def linear_force(ellipse: Ellipse, shear_modulus: float, flexibility: float) -> tuple[float, float]:
    """G a b C11 and G a b C22 [N], both divided by `flexibility` (1: bare steel)."""
    c11, c22 = creepage_coefficients(ellipse.a / ellipse.b)
    scale = shear_modulus * ellipse.a * ellipse.b / flexibility
    return scale * c11, scale * c22
