"""How tractions on rectangles strain a rolling half-space, as an FFT convolution.

A tangential point force (F_x, F_y) displaces the surface of both bodies together by (Cerruti)

    u_x = [((1 - nu)/R + nu x^2/R^3) F_x + nu x y / R^3 F_y] / (pi G),      R^2 = x^2 + y^2
    u_y = [nu x y / R^3 F_x + ((1 - nu)/R + nu y^2/R^3) F_y] / (pi G)

and a normal force by  u = K (x, y) / R^2 F_z / (pi G). Integrated over a rectangle these are differences over its
corners of   y ln(x + R) + (1 - nu) x ln(y + R),   -nu R,   (1 - nu) y ln(x + R) + x ln(y + R)   and, for K,
y ln R + x atan(y/x)  and  x ln R + y atan(x/y).

In steady rolling the material that is at x was at x + dx, so that what enters the slip is the backward difference
(u(x) - u(x + dx)) / dx: the operator here. It keeps u' accurate to second order half an element ahead of the centre,
and it lets tractions vanish at the leading edge, which lies at +x. The operator has no length of its own.

A layer between the bodies that shears by L t under the traction t adds that to the displacement of its element alone.

    G, nu   combined shear modulus [Pa] and Poisson ratio [1] of Eq. 7;   K   difference of the bodies' stiffness [1]

Source: J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), chapter 4.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]
SingleComplexes = NDArray[np.complex64]

_SHIFT = 0.03  # added to the operator, which is of order one, before it is inverted
_PARALLEL_FROM = 20_000  # elements from which two threads pay


class Straining:
    """The linear map from tractions over G on a grid to the backward difference of displacements along rolling [1].

    Tractions and differences have shape (2, ny, nx), components x and y. The transform of one grid serves all sizes
    of its elements that share dx/dy.
    """

    def __init__(self, *, shape: tuple[int, int], aspect: float, poisson: float, layer: float = 0.0) -> None:
        """Prepare the transforms for ny by nx = `shape` elements of dx/dy = `aspect`, with a `layer` of L G / dx."""
        self._shape = shape
        self._padded = (fft.next_fast_len(2 * shape[0], real=True), fft.next_fast_len(2 * shape[1], real=True))
        self._workers = 2 if shape[0] * shape[1] >= _PARALLEL_FROM else 1
        self._symbol = self._transform(_tangential(shape, aspect, poisson, layer))
        self._single = self._symbol.astype(np.complex64)
        self._inverse = _shifted_inverse(self._symbol).astype(np.complex64)

    def __call__(self, tractions: Floats) -> Floats:
        """(u(x) - u(x + dx)) / dx at the centres of the elements."""
        whole: Floats = self._convolve(self._symbol, tractions)
        return whole

    def single(self, tractions: Singles) -> Singles:
        """The same in single precision, for steps towards a solution."""
        whole: Singles = self._convolve(self._single, tractions)
        return whole

    def approximate_inverse(self, differences: Singles) -> Singles:
        """Tractions for given differences on an endless periodic surface, nearly: operator plus shift, inverted."""
        whole: Singles = self._convolve(self._inverse, differences)
        return whole

    def _convolve(self, symbol: Complexes | SingleComplexes, field: Floats | Singles) -> Any:
        ny, nx = self._shape
        rows, columns = self._padded
        along = fft.rfft(field, n=columns, axis=2, workers=self._workers)  # the padding's rows are zero
        spectrum = fft.fft(along, n=rows, axis=1, workers=self._workers, overwrite_x=True)
        result = symbol[:2] * spectrum[0]
        result += symbol[1:] * spectrum[1]
        kept = fft.ifft(result, axis=1, workers=self._workers, overwrite_x=True)[:, :ny]
        return fft.irfft(kept, n=columns, axis=2, workers=self._workers)[:, :, :nx]

    def _transform(self, kernel: Floats) -> Complexes:
        """Transform of a kernel given at offsets -(n-1) ... n-1, wrapped around the padded grid."""
        ny, nx = self._shape
        wrapped = np.zeros((kernel.shape[0], *self._padded))
        rows, columns = np.arange(1 - ny, ny) % self._padded[0], np.arange(1 - nx, nx) % self._padded[1]
        wrapped[:, rows[:, None], columns] = kernel
        spectrum: Complexes = fft.rfft2(wrapped, workers=self._workers)
        return spectrum


@lru_cache(maxsize=12)
def straining(*, shape: tuple[int, int], aspect: float, poisson: float, layer: float = 0.0) -> Straining:
    """The operator of a grid, kept for its next use."""
    return Straining(shape=shape, aspect=aspect, poisson=poisson, layer=layer)


def strain_by_pressure(pressure: Floats, *, aspect: float) -> Floats:
    """Backward difference of u along rolling under `pressure` (ny, nx) for K/G = 1, (2, ny, nx) [Pa]."""
    ny, nx = pressure.shape
    kernel = _backward_difference(_normal_corners, (ny, nx), aspect)
    padded = (2 * ny, 2 * nx)
    rows, columns = np.arange(1 - ny, ny) % padded[0], np.arange(1 - nx, nx) % padded[1]
    wrapped = np.zeros((2, *padded))
    wrapped[:, rows[:, None], columns] = kernel
    whole: Floats = fft.irfft2(fft.rfft2(wrapped) * fft.rfft2(pressure, s=padded), s=padded)
    return whole[:, :ny, :nx]


def _tangential(shape: tuple[int, int], aspect: float, poisson: float, layer: float) -> Floats:
    """Kernels xx, xy, yy at all offsets of the grid, (3, 2 ny - 1, 2 nx - 1)."""

    def corners(x: Floats, y: Floats) -> Floats:
        r, along, across = np.hypot(x, y), y * _log_sum(x, y), x * _log_sum(y, x)
        return np.stack([along + (1.0 - poisson) * across, -poisson * r, (1.0 - poisson) * along + across])

    kernel = _backward_difference(corners, shape, aspect)
    kernel[::2, shape[0] - 1, shape[1] - 1] += layer
    kernel[::2, shape[0] - 1, shape[1] - 2] -= layer
    return kernel


def _normal_corners(x: Floats, y: Floats) -> Floats:
    """Corner functions of x/R^2 and y/R^2, (2, ...)."""
    log = 0.5 * np.log(x**2 + y**2)
    return np.stack([y * log + x * np.arctan(y / x), x * log + y * np.arctan(x / y)])


def _log_sum(x: Floats, y: Floats) -> Floats:
    """ln(x + R) for y other than zero, without the cancellation where x is negative."""
    size = np.abs(y)
    return np.asarray(np.arcsinh(x / size) + np.log(size))


def _backward_difference(corners: Callable[[Floats, Floats], Floats], shape: tuple[int, int], aspect: float) -> Floats:
    """(u(x) - u(x + dx)) / dx at all offsets from an element of unit traction over G, dx = aspect, dy = 1."""
    ny, nx = shape
    x = np.linspace(0.5 - nx, nx + 0.5, 2 * nx + 1) * aspect
    y = np.linspace(0.5 - ny, ny - 0.5, 2 * ny)
    displacement = np.diff(np.diff(corners(x, y[:, None]), axis=-1), axis=-2) / np.pi
    difference: Floats = -np.diff(displacement, axis=-1) / aspect
    return difference


def _shifted_inverse(symbol: Complexes) -> Complexes:
    """Inverse of the symmetric 2 by 2 symbol (xx, xy, yy) plus the shift.

    The operator makes no heat of work, so that its symbol is nearly imaginary, and it vanishes for tractions that do
    not vary along rolling; a small real shift bounds the inverse and keeps its product with the operator positive.
    """
    xx, yy = symbol[0] + _SHIFT, symbol[2] + _SHIFT
    inverse: Complexes = np.stack([yy, -symbol[1], xx]) / (xx * yy - symbol[1] ** 2)
    return inverse
