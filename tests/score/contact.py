"""Normal contact of the score's rig: the Hertz ellipse, and a numerical half-space contact that wears implicitly.

Gap between the discs, x along rolling, y across:  x^2 / (2 Rx) + g(y).  Pressure and deflection are even in x.
The deflection of a uniformly pressed rectangle is Love's (A. E. H. Love, Phil. Trans. A 228 (1929) 377); the
unilateral contact is solved by conjugate gradients on the pressed set (I. A. Polonsky and L. M. Keer, Wear 231
(1999) 206), convolving along y by FFT and along x by a matrix for each wave number.

Implicit wear: within a step the surface recedes by  S q(y),  q(y) line load [N/m],  S wear compliance [m2/N].
It is added to the elastic deflection, so that a step of any size is stable and removes exactly its volume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize, special

Floats = NDArray[np.float64]

# Creepage coefficient C11 for nu = 0.3, computed with CONTACT (open-source release 2025-07-23, revision 2707),
# extrapolated in the grid.
_ASPECT = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.11111, 1.25, 1.42857, 1.66667, 2.0, 2.5, 3.33333, 5.0)
_C11: tuple[float, ...] = (
    3.54221,
    3.59063,
    3.65707,
    3.73463,
    3.81938,
    3.90892,
    4.00172,
    4.09675,
    4.19327,
    4.29080,
    4.39988,
    4.53678,
)
_C11 += (4.71298, 4.94721, 5.27232, 5.75193, 6.52834, 8.00478)
_C22: tuple[float, ...] = (
    2.52893,
    2.63893,
    2.76573,
    2.89978,
    3.03706,
    3.17556,
    3.31424,
    3.45252,
    3.59004,
    3.72663,
    3.87716,
    4.06341,
)
_C22 += (4.29971, 4.60937, 5.03318, 5.64998, 6.63612, 8.49202)


def creepage_coefficients(aspect: float) -> tuple[float, float]:
    """C11 and C22 [1] of an ellipse with a/b = `aspect`, nu = 0.3, interpolated over log(a/b)."""
    at, table = np.log(aspect), np.log(_ASPECT)
    return float(np.interp(at, table, _C11)), float(np.interp(at, table, _C22))


@dataclass(frozen=True)
class Ellipse:
    """A contact ellipse: semi-axes [m], a along rolling."""

    a: float
    b: float


def hertz_ellipse(load: float, modulus: float, curvature_x: float, curvature_y: float) -> Ellipse:
    """The Hertz ellipse of `load` [N], E* `modulus` [Pa] and the relative curvatures [1/m].

    With k^2 = 1 - (short/long)^2 and elliptic integrals K, E of k^2 (K. L. Johnson, Contact Mechanics, 4.2).
    """
    ratio = max(curvature_x, curvature_y) / min(curvature_x, curvature_y)

    def excess(log_axes: float) -> float:
        short = np.exp(-log_axes)
        k, e = special.ellipk(1 - short**2), special.ellipe(1 - short**2)
        return float((e / short**2 - k) / (k - e) - ratio)

    axes = float(np.exp(-optimize.brentq(excess, 1e-6, 8.0))) if ratio > 1 + 1e-5 else 1 - 1e-9
    k, e = special.ellipk(1 - axes**2), special.ellipe(1 - axes**2)
    # curvature of the short side: p0 / (E* short) * (E - axes^2 K) / (1 - axes^2), p0 = 3 N / (2 pi long short)
    half = 0.5 * max(curvature_x, curvature_y)
    long_cubed = 1.5 * load / (np.pi * modulus) * (e - axes**2 * k) / (1 - axes**2) / (axes**2 * half)
    long = float(np.cbrt(long_cubed))
    return Ellipse(axes * long, long) if curvature_x >= curvature_y else Ellipse(long, axes * long)


def _love(x: Floats, y: Floats, half_x: float, half_y: float) -> Floats:
    """Deflection times pi E* over pressure [m] at (x, y) from the middle of a pressed rectangle."""

    def corner(u: Floats, v: Floats) -> Floats:
        return u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v))

    right, left, up, down = x + half_x, x - half_x, y + half_y, y - half_y
    return corner(right, up) - corner(right, down) - corner(left, up) + corner(left, down)


class HalfSpace:
    """Contact on a grid of half the patch (x > 0); keeps its last pressure as the start of the next solution."""

    def __init__(
        self, *, load: float, modulus: float, curvature_x: float, y: Floats, half_length: float, cells: int
    ) -> None:
        """`y` [m] is uniform; `half_length` [m] bounds the patch along x and is cut into `cells`."""
        self.load, self.y, self.dx = load, y, half_length / cells
        self.dy = float(y[1] - y[0])
        self.x = (np.arange(cells) + 0.5) * self.dx
        self._area = 2.0 * self.dx * self.dy
        self._gap_x = (0.5 * curvature_x * self.x**2)[:, None]
        away = np.abs((np.arange(2 * y.size) + y.size) % (2 * y.size) - y.size) * self.dy  # circular distance
        to, source = self.x[:, None, None], self.x[None, :, None]
        kernel = _love(to - source, away, self.dx / 2, self.dy / 2) + _love(to + source, away, self.dx / 2, self.dy / 2)
        self._spectrum = np.ascontiguousarray(np.moveaxis(fft.rfft(kernel / (np.pi * modulus)).real, -1, 0))
        self.pressure = np.zeros((cells, y.size))

    def press_with(self, load: float) -> None:
        """Take another load, and the last pressure in proportion as the start under it."""
        self.pressure *= load / self.load
        self.load = load

    def _deflection(self, pressure: Floats) -> Floats:
        waves = np.ascontiguousarray(fft.rfft(pressure, 2 * self.y.size, axis=1).T)
        pairs = waves.view(float).reshape(waves.shape[0], -1, 2)
        turned = np.matmul(self._spectrum, pairs).reshape(waves.shape[0], -1).view(complex).T
        out: Floats = fft.irfft(turned, 2 * self.y.size, axis=1)[:, : self.y.size]
        return out

    def solve(self, gap: Floats, worn: Floats | None = None, *, tolerance: float = 1e-5) -> Floats:
        """The line load q(y) [N/m] under `gap` g(y) [m]; `worn` is the matrix S(y, y') [m2/N] of this step's wear."""
        full = self._gap_x + gap
        p = self.pressure
        if not p.any():
            p = np.maximum(full.min() + 2e-6 - full, 0.0)
            p = p * (self.load / (p.sum() * self._area))
        wear = None if worn is None else 2.0 * self.dx * worn.T

        def respond(field: Floats) -> Floats:
            answer = self._deflection(field)
            return answer if wear is None else answer + field.sum(axis=0) @ wear

        direction, last, keep, under = np.zeros_like(p), 1.0, 0.0, respond(p)
        for _ in range(500):
            pressed = p > 0.0
            misfit = under + full
            misfit -= misfit[pressed].mean()
            size = float((misfit[pressed] ** 2).sum())
            direction = np.where(pressed, misfit + keep * size / last * direction, 0.0)
            answer = respond(direction)
            level = answer[pressed].mean()
            step = (misfit[pressed] @ direction[pressed]) / ((answer[pressed] - level) @ direction[pressed])
            free = p - step * direction
            new = np.maximum(free, 0.0)
            overlap = (new == 0.0) & (misfit < 0.0)
            new[overlap] = -step * misfit[overlap]
            last, keep = size, 0.0 if overlap.any() else 1.0
            scale = self.load / (new.sum() * self._area)
            under = respond(new) * scale if (new != free).any() else (under - step * answer) * scale
            moved = float(np.abs(new * scale - p).sum() * self._area / self.load)
            p = new * scale
            if moved < tolerance:
                self.pressure = p
                return self.line_load()
        raise RuntimeError("the half-space contact did not converge")

    def line_load(self) -> Floats:
        """q(y) [N/m] of the last solution."""
        return np.asarray(2.0 * self.dx * self.pressure.sum(axis=0))

    def half_lengths(self) -> Floats:
        """a(y) [m] of the semi-elliptic strip with the same second moment along x; 0 outside the patch."""
        total = self.pressure.sum(axis=0)
        moment = self.x**2 @ self.pressure
        return np.asarray(2.0 * np.sqrt(np.divide(moment, total, out=np.zeros_like(total), where=total > 0)))
