"""What a worn patch transmits beyond the ellipse it is taken for, in half-space contact.

    k = G a b C11 (1 + e (p1 sqrt(t) + p2 t)),     t = r / (1 + r),   r = a/b          linear stiffness
    T/(mu N) = f(xi; r) + s C(ln r) g(xi),         xi = k v / (mu N)                    law of the exact theory

    a, b  semi-axes of `equivalent_ellipse` [m];    f  law of an ellipse
    s     squareness of the patch [1], from its half-lengths h over the strips: with m = <h^3> <h> / <h^2>^2, which is
          27 pi^2 / 256 for an ellipse (s = 0) and 1 for a rectangle (s = 1)
    e     unevenness [1]: standard deviation of h^2 / q over its mean, both weighted by the line load q. A strip slides
          at a creepage that goes as q / h^2; on an ellipse all do at one, and e = 0
    g     departure of the law where the patch is a rectangle [1], C its change with the ratio

A worn patch nears a rectangle, of which more slides late and at once: T/(mu N) rises by up to 0.02 at xi = 1.6, the
stiffness by up to 5 %.

Source: curves of half_space.rolling on the worn profiles of six rigs (table_makers/worn.py). Against it on tracks of
other rigs, with lateral wander too, T/(mu N) is within 0.003 and k within 0.7 %. The stiffness across rolling takes the
same factor, which is up to 1.4 % off there. On new discs with grooves T/(mu N) was found up to 0.009 off, k 1.4 %.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from twindisc_cli.model.experiment import Floats
from twindisc_cli.physics._arrays import stored

ELLIPSE = 27.0 * np.pi**2 / 256.0
"""<h^3> <h> / <h^2>^2 of an ellipse."""
CREEPAGES = np.array([0.0, 0.2, 0.4, 0.7, 1.0, 1.3, 1.6, 1.8, 2.0, 2.2, 2.5, 3.0, 3.6])
"""Normalised creepages at which g is known; it is 0 at both ends and beyond."""


def squareness(half_length: Floats) -> Floats:
    """s [1] of patches with these half-lengths (..., strip)."""
    first, second, third = (np.sum(half_length**power, axis=-1) for power in (1, 2, 3))
    return np.asarray((ELLIPSE - third * first / second**2) / (ELLIPSE - 1.0))


def unevenness(half_length: Floats, line_load: Floats) -> Floats:
    """e [1] of patches with these half-lengths and line loads (..., strip)."""
    total, second = line_load.sum(axis=-1), np.sum(half_length**2, axis=-1)
    square = np.divide(half_length**4, line_load, out=np.zeros_like(line_load), where=line_load > 0.0).sum(axis=-1)
    return np.asarray(np.sqrt(np.maximum(square * total / second**2 - 1.0, 0.0)))


def stiffening(ratio: Floats, uneven: Floats) -> Floats:
    """Linear stiffness over that of the equivalent ellipse [1], at ratios a/b and unevenness (...)."""
    part = ratio / (1.0 + ratio)
    return np.asarray(1.0 + uneven * (np.stack([np.sqrt(part), part], axis=-1) @ _table()["stiffening"]))


def departure(xi: Floats, ratio: Floats, square: Floats) -> Floats:
    """What is added to the exact law's T/(mu N) at normalised creepages, ratios a/b and squareness, which broadcast."""
    known = _table()
    size = square * np.polynomial.polynomial.polyval(np.log(np.clip(ratio, *known["ratios"])), known["by_ratio"])
    return np.asarray(size * np.interp(xi, CREEPAGES, known["departure"]))


@cache
def _table() -> dict[str, Floats]:
    """stiffening (2,), departure (creepage,), by_ratio: polynomial over ln a/b, ratios: the least and the greatest."""
    return stored("twindisc_cli.model", "worn.npz")
