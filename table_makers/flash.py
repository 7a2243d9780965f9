"""Make twindisc_cli/physics/flash.npz, the joining of the limits of flash temperature: `python -m table_makers.flash`.

    T(x, y) = 1/(rho c) integral over the source of q and over the time t since of  1/sqrt(pi kappa t)
              [erf] along [erf] across / 4

an even flux over each of N x N elements of the patch, moved past at speed V, kappa = k / (rho c): Jaeger's rectangular
source. The half-ellipsoid of flux is their sum. Kept is ln T over the root-mean-square joining of the limits, over
ln a/b and ln (fast limit / slow limit); beyond the ends it is let go to 0.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import fftconvolve
from scipy.special import elliprf, erf

from twindisc_cli.physics import flash
from twindisc_cli.physics._arrays import Floats
from twindisc_cli.physics.flash import FAST, RATIOS, SLOW, WAYS

N, TIMES = 36, 260


def rise(ratio: float, peclet: float) -> Floats:
    """Largest and mean rise [1], (2,), for a = k = kappa = peak flux = 1, b = 1 / ratio and V = 2 Pe."""
    b, speed = 1.0 / ratio, 2.0 * peclet
    half, side = 1.0 / N, b / N
    along, across = 2.0 * half * np.arange(-(N - 1), N), 2.0 * side * np.arange(N)
    small, large = 1e-6 * min(half, side) ** 2, 1e5 * max(1.0, b) ** 2
    kernel = np.zeros((N, 2 * N - 1))
    times = np.geomspace(small, large, TIMES)
    for time in times:
        spread = np.sqrt(4.0 * time)
        behind = along - speed * time
        by_x = erf((behind + half) / spread) - erf((behind - half) / spread)
        by_y = erf((across + side) / spread) - erf((across - side) / spread)
        kernel += 0.25 * np.sqrt(time / np.pi) * np.outer(by_y, by_x)
    kernel *= np.log(times[1] / times[0])
    place = (2.0 * np.arange(N) + 1.0) / N - 1.0
    left = 1.0 - place**2 - place[:, None] ** 2
    flux = np.sqrt(np.maximum(left, 0.0))
    found = fftconvolve(np.concatenate([kernel[:0:-1], kernel]), flux, mode="valid")
    whole = 2.0 / 3.0 * np.pi * b / (flux.sum() * 4.0 * half * side)
    return np.asarray(np.array([found.max(), found[left > 0.0].mean()]) * whole)


def main() -> None:
    """Write the table."""
    table = np.empty((2, len(RATIOS), len(WAYS)))
    for row, log in enumerate(RATIOS):
        ratio = float(np.exp(log))
        slow = 0.5 / ratio * elliprf(0.0, 1.0, ratio**-2) * np.array(SLOW)
        for column, way in enumerate(WAYS):
            for kind in range(2):
                fast = slow[kind] * np.exp(way)
                peclet = (FAST[kind] / fast) ** 2 / (2.0 * np.pi)
                joined = fast * slow[kind] / np.hypot(fast, slow[kind])
                table[kind, row, column] = np.log(rise(ratio, float(peclet))[kind] / joined)
    np.savez_compressed(Path(flash.__file__).with_name("flash.npz"), correction=np.round(table, 5))


if __name__ == "__main__":
    main()
