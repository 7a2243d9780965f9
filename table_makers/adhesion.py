"""Exact rolling of an ellipse without slip, by polynomials: the creepage coefficients to five digits.

Galin's theorem: tractions  t = P(x, y) / sqrt(1 - x^2/a^2 - y^2/b^2)  with polynomials P of degree M displace the patch
by polynomials of degree M. Without slip in steady rolling du/dx is given,

    -du_x/dx = vx - phi y,      -du_y/dx = vy + phi x          so that only terms of u in y alone are left free,

and the tractions must vanish along the leading edge, x = +a sqrt(1 - y^2/b^2). The first holds exactly here, the second
by least squares. With M = 20 the coefficients are settled to five digits between a/b = 0.2 and 5; C23 and C32, equal
by reciprocity and computed apart, tell the error.

Work is done on the unit disk, X = x/a, Y = y/b, with products of Chebyshev polynomials T_i(X) T_j(Y), i + j <= M.
Displacement of a polynomial traction is an integral over directions through the point, and over the chord in each.

Source: J. J. Kalker, On the rolling contact of two elastic bodies in the presence of dry friction, thesis Delft (1967).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Adhesion:
    """Creepage coefficients C11, C22, C23, C32, C33 [1] of one ellipse."""

    c11: float
    c22: float
    c23: float
    c32: float
    c33: float


def creepage_coefficients(*, a_over_b: float, poisson: float, degree: int = 20) -> Adhesion:
    """Coefficients of linear theory for a/b [1] and the combined Poisson ratio [1], by polynomials of even `degree`."""
    a, b = np.sqrt(a_over_b), 1.0 / np.sqrt(a_over_b)
    powers = _powers(degree)
    equations, given = _no_slip(a, b, poisson, degree, powers)
    edge = np.kron(np.eye(2), _on_leading_edge(degree, powers))
    particular = np.linalg.lstsq(equations, given, rcond=None)[0]
    free = np.linalg.svd(equations)[2][equations.shape[0] :].T
    tractions = particular - free @ np.linalg.lstsq(edge @ free, edge @ particular, rcond=None)[0]
    force, moment_x, moment_y = _moments(a, b, degree, powers)
    tx, ty = np.split(tractions, 2)
    moment = moment_x @ ty - moment_y @ tx
    return Adhesion(c11=force @ tx[:, 0], c22=force @ ty[:, 1], c23=force @ ty[:, 2], c32=-moment[1], c33=moment[2])


def _powers(degree: int) -> NDArray[np.int64]:
    """Degrees (i, j) of the basis, (2, basis), those with i = 0 first."""
    pairs = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    return np.array(pairs).T


def _basis(x: Floats, y: Floats, degree: int, powers: NDArray[np.int64]) -> Floats:
    """T_i(x) T_j(y), (..., basis)."""
    return chebyshev.chebvander(x, degree)[..., powers[0]] * chebyshev.chebvander(y, degree)[..., powers[1]]


def _no_slip(a: float, b: float, nu: float, degree: int, powers: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Equations for the terms of u that vary with x, and their right-hand sides for unit vx, vy, phi; G = 1."""
    xx, xy, yy = _compliance(a, b, nu, degree, powers)
    varies = powers[0] > 0
    count = int(varies.sum())
    equations = np.block([[xx[varies], xy[varies]], [xy[varies], yy[varies]]])
    where = {(int(i), int(j)): k for k, (i, j) in enumerate(powers[:, varies].T)}
    given = np.zeros((2 * count, 3))
    given[where[1, 0], 0] = -a
    given[count + where[1, 0], 1] = -a
    given[where[1, 1], 2] = a * b
    given[count + where[2, 0], 2] = -0.25 * a**2
    return equations, given


def _compliance(a: float, b: float, nu: float, degree: int, powers: NDArray[np.int64]) -> Floats:
    """Coefficients of u in the basis for each basis traction, kernels xx, xy, yy: (3, basis of u, basis of t)."""
    x, y = _disk_points(degree)
    count = 2 * degree + 40 + int(30 * max(a / b, b / a))
    angle = np.pi * (np.arange(count) + 0.5) / count
    node = np.cos(np.pi * (np.arange(degree // 2 + 1) + 0.5) / (degree // 2 + 1))
    displacement = np.zeros((3, x.size, powers.shape[1]))
    for cos, sin in zip(np.cos(angle), np.sin(angle), strict=True):
        middle = -(x * cos + y * sin)
        along = middle[:, None] + np.sqrt(1.0 - x**2 - y**2 + middle**2)[:, None] * node
        chord = _basis(x[:, None] + along * cos, y[:, None] + along * sin, degree, powers).mean(axis=1)
        c, s = a * cos, b * sin
        square = c**2 + s**2
        kernel = np.array([(1.0 - nu) * square + nu * c**2, nu * c * s, (1.0 - nu) * square + nu * s**2])
        displacement += (kernel * square**-1.5)[:, None, None] * chord
    displacement *= a * b * np.pi / count
    fit: Floats = np.linalg.pinv(_basis(x, y, degree, powers)) @ displacement
    return fit


def _disk_points(degree: int) -> tuple[Floats, Floats]:
    """Points of the unit disk, enough to determine polynomials of the degree."""
    radius = np.sqrt(0.5 * (leggauss(degree // 2 + 2)[0] + 1.0))[:, None]
    angle = 2.0 * np.pi * (np.arange(2 * degree + 3) + 0.3) / (2 * degree + 3)
    return (radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()


def _on_leading_edge(degree: int, powers: NDArray[np.int64]) -> Floats:
    """Values of the basis along the leading edge, (point, basis)."""
    angle = np.pi * ((np.arange(8 * degree) + 0.5) / (8 * degree) - 0.5)
    return _basis(np.cos(angle), np.sin(angle), degree, powers)


def _moments(a: float, b: float, degree: int, powers: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Integrals over the patch of each basis traction, and of x and y times it, each (basis,)."""
    node, weight = leggauss(degree + 3)
    radius = np.sqrt(1.0 - (0.5 * (node + 1.0)) ** 2)[:, None]
    angle = 2.0 * np.pi * np.arange(2 * degree + 4) / (2 * degree + 4)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    measure = np.broadcast_to((np.pi / angle.size * a * b) * weight[:, None], x.shape)
    force, moment_x, moment_y = np.einsum(
        "mra,rak->mk", np.stack([measure, a * x * measure, b * y * measure]), _basis(x, y, degree, powers)
    )
    return force, moment_x, moment_y
