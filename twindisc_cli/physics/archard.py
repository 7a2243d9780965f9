"""Archard's law, worn depth and volume from the dissipated power (Eqs. 12-15).

    du/dn (y) = K P_l(y) / (H V)        depth one revolution takes off [m]
    W = K E / H                         volume worn by the dissipated energy E [m^3]

    K   wear coefficient [1];  H  hardness [Pa];  V  rolling speed [m/s]
    P_l dissipated power per length across rolling [W/m], integrated along rolling

Eq. 15 follows from Eq. 14 with one pass a revolution; over the track 2 pi R and the time 2 pi R/V it holds W = K E/H.
Source: J. F. Archard, J. Applied Physics 24 (1953) 981; R. Hill's form with dissipated power: Li and Kalker (1998).
Valid for: mild sliding wear with one K; a severe regime needs its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.physics._arrays import Floats, arrays


def worn_volume(*, y: ArrayLike, depth: ArrayLike, rolling_radius: ArrayLike) -> Floats:
    """The volume [m^3] of a groove of `depth` [m] (..., y), positive downwards, around the rim of a disc; y [m]."""
    y, depth, radius = arrays(y, depth, rolling_radius)
    return 2.0 * np.pi * radius * np.trapezoid(depth, y, axis=-1)


def allowed_coefficient(*, volume: ArrayLike, energy: ArrayLike, hardness: ArrayLike) -> Floats:
    """The one K [1] that joins a worn `volume` [m^3] and a dissipated `energy` [J], W H / E; all broadcast."""
    volume, energy, hardness = arrays(volume, energy, hardness)
    return volume * hardness / energy
