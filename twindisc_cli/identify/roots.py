"""Roots of monotone functions, many at a time, all of them evaluated together.

scipy.optimize.elementwise.find_root, which is the same method, evaluates those that are left alone: it cannot serve
where one prediction takes the friction of all steps of a test.

Source: T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149: inverse quadratic interpolation where it
is safe, bisection elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from twindisc_cli.model.experiment import Floats

_MOST_STEPS = 80  # bisection alone needs 60 for all digits
_TOLERANCE = 4e-16  # two units in the last place


def bracketed_root(
    function: Callable[[Floats], Floats], low: Floats, high: Floats, ends: tuple[Floats, Floats] | None = None
) -> Floats:
    """The root of an elementwise function between `low` and `high`, each (...), where it changes sign; to rounding.

    Where it does not change sign, the end at which it is nearer to zero. ends: its values there, if they are known.
    """
    a, b = np.array(low, dtype=float), np.array(high, dtype=float)
    fa, fb = (function(a), function(b)) if ends is None else ends
    changes = np.sign(fa) * np.sign(fb) <= 0.0
    c, fc, part = b.copy(), fb.copy(), np.full_like(a, 0.5)
    for _ in range(_MOST_STEPS):
        x = a + part * (b - a)
        fx = function(x)
        same = np.sign(fx) == np.sign(fa)
        c, fc = np.where(same, a, b), np.where(same, fa, fb)
        b, fb = np.where(same, b, a), np.where(same, fb, fa)
        a, fa = x, fx
        best = np.where(np.abs(fa) < np.abs(fb), a, b)
        width = np.abs(b - a)
        limit = (2.0 * _TOLERANCE * np.abs(best) + 1e-300) / np.where(width > 0.0, width, np.inf)
        if np.all((limit > 0.5) | (width == 0.0) | (fa == 0.0) | (fb == 0.0) | ~changes):
            break
        part = np.clip(_next_part(a, b, c, fa, fb, fc), np.minimum(limit, 0.5), np.maximum(1.0 - limit, 0.5))
    return np.where(np.abs(fa) < np.abs(fb), a, b)


def _next_part(a: Floats, b: Floats, c: Floats, fa: Floats, fb: Floats, fc: Floats) -> Floats:
    """Where between a and b to look next, as a part of the way: by interpolation where that is safe, else half."""
    with np.errstate(divide="ignore", invalid="ignore"):
        place, value = (a - b) / (c - b), (fa - fb) / (fc - fb)
        safe = (value**2 < place) & ((1.0 - value) ** 2 < 1.0 - place)
        part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return np.where(safe & np.isfinite(part), part, 0.5)
