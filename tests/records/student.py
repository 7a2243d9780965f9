"""What stands beside the loop: a student who fits eight standard laws and takes the best, and a Gaussian process.

A law is T/N = mu(v, t) f(k v) with the initial slope k free and Polach's saturation

    f(e) = 2/pi (e / (1 + e^2) + atan e)

constant    mu                                  Polach     mu [A + (1 - A) exp(-B v)], f with two slope factors
Eyring      mu asinh(v / v_E), no f             Carreau    eta v (1 + (v / v_c)^2)^((n - 1) / 2), no f
magic       D sin(C atan(B v - E (B v - atan B v))), no f
Stribeck    mu_h + (mu_b - mu_h) exp(-v / v_S) + h v
running-in  mu [1 + d exp(-t / tau)]            line       T/N = m + c t, over the creepage where there is no time

Least squares from several starts, within bounds wider than the tables of the sources; the smallest AICc is taken,
beside it the mean of all laws with their Akaike weights. What does not vary in a record is not fitted over.

Sources: O. Polach, Wear 258 (2005) 992; H. B. Pacejka, Tyre and Vehicle Dynamics (2002); P. J. Carreau, Trans. Soc.
Rheology 16 (1972) 99; H. Eyring, J. Chem. Phys. 4 (1936) 283; P. J. Blau, Tribol. Int. 38 (2005) 1007; C. M. Hurvich,
C.-L. Tsai, Biometrika 76 (1989) 297; K. P. Burnham, D. R. Anderson, Sociol. Methods Res. 33 (2004) 261; C. E.
Rasmussen, C. K. I. Williams, Gaussian Processes (2006), Eq. 4.17.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import least_squares, minimize

Floats = NDArray[np.float64]
Predict = Callable[[Floats, Floats], Floats]
"""T/N (sample,) from creepage and time (sample,)."""
LARGEST = 40.0
STARTS = 6
MOST = 400
"""Samples that the Gaussian process takes at most, evenly from the record."""


def saturation(adhesion: Floats, slip: Floats) -> Floats:
    """T/(mu N) over the normalised creepage in the area of adhesion and in that of slip."""
    return np.asarray(2.0 / np.pi * (adhesion / (1.0 + adhesion**2) + np.arctan(slip)))


def varies(creepage: Floats) -> bool:
    """Whether creepages (sample,) differ by more than the scatter of a rig that holds one."""
    return bool(np.ptp(np.log(np.maximum(np.abs(creepage), 1e-9))) > 0.05)


def _soft(k: float, v: Floats) -> Floats:
    return saturation(np.exp(k) * v, np.exp(k) * v)


def _constant(p: Floats, v: Floats, t: Floats) -> Floats:
    return np.asarray(p[0] * _soft(p[1], v))


def _polach(p: Floats, v: Floats, t: Floats) -> Floats:
    falling = p[2] + (1.0 - p[2]) * np.exp(-np.exp(p[3]) * v)
    return np.asarray(p[0] * falling * saturation(np.exp(p[1]) * v, np.exp(p[1] + p[4]) * v))


def _magic(p: Floats, v: Floats, t: Floats) -> Floats:
    x = np.exp(p[1]) * v
    return np.asarray(p[0] * np.sin(p[2] * np.arctan(x - p[3] * (x - np.arctan(x)))))


def _carreau(p: Floats, v: Floats, t: Floats) -> Floats:
    x = np.exp(p[1]) * v
    return np.asarray(p[0] * x * (1.0 + x**2) ** (0.5 * (p[2] - 1.0)))


def _eyring(p: Floats, v: Floats, t: Floats) -> Floats:
    return np.asarray(p[0] * np.arcsinh(np.exp(p[1]) * v))


def _stribeck(p: Floats, v: Floats, t: Floats) -> Floats:
    return np.asarray((p[0] + p[2] * np.exp(-np.exp(p[3]) * v) + p[4] * v) * _soft(p[1], v))


def _running_in(p: Floats, v: Floats, t: Floats) -> Floats:
    return np.asarray(p[0] * (1.0 + p[2] * np.exp(-np.exp(p[3]) * t)) * _soft(p[1], v))


def _line(p: Floats, v: Floats, t: Floats) -> Floats:
    return np.asarray(p[0] + p[2] * t)


def _line_over_creepage(p: Floats, v: Floats, t: Floats) -> Floats:
    return np.asarray(p[0] + p[2] * v)


@dataclass(frozen=True)
class Law:
    """A law: its value, start values and bounds beside level and logarithm of the slope, what it needs to vary."""

    name: str
    value: Callable[[Floats, Floats, Floats], Floats]
    beside: tuple[tuple[float, ...], ...] = ((),)
    bounds: tuple[tuple[float, float], ...] = ()
    needs: str = ""
    sloped: bool = True


FREE, RATE = (-np.inf, np.inf), (-3.0, 6.0)
SLOPE = (-3.0, 9.0)
LAWS = (
    Law("constant", _constant),
    Law(
        "Polach", _polach, ((0.5, 1.0, -0.5), (0.8, 3.0, -2.0), (0.5, -1.0, -0.1)), ((0.2, 1.0), RATE, (-5.0, 0.0)),
        "creepage",
    ),
    Law("magic formula", _magic, ((1.5, 0.0), (1.2, -2.0), (1.7, 0.9)), ((0.1, 2.5), (-10.0, 1.0)), "creepage"),
    Law("Carreau", _carreau, ((0.1,), (0.4,)), ((0.0, 1.0),), "creepage"),
    Law("Eyring", _eyring, ((),), (), "creepage"),
    Law("running-in", _running_in, ((-0.5, 1.5), (0.5, 1.5), (-0.5, 0.0), (0.5, 3.0)), ((-1.0, 20.0), RATE), "time"),
    Law("Stribeck", _stribeck, ((0.1, 1.5, 0.0), (-0.1, 1.5, 0.0)), (FREE, RATE, FREE), "creepage"),
    Law("line over time", _line, ((0.0,),), (FREE,), "time", sloped=False),
    Law("line over creepage", _line_over_creepage, ((0.0,),), (FREE,), "creepage", sloped=False),
)  # fmt: skip


@dataclass(frozen=True)
class Fitted:
    """A fitted law: its name, AICc and prediction."""

    name: str
    aicc: float
    predict: Predict


def student(creepage: Floats, time: Floats, values: Floats) -> tuple[Fitted, Predict]:
    """The law with the smallest AICc on samples (sample,), and the mean of all laws with their Akaike weights.

    time is NaN where it was not recorded.
    """
    varied = {"": True, "creepage": varies(creepage), "time": bool(np.isfinite(time).all())}
    laws = [law for law in LAWS if varied[law.needs] and not (law.value is _line_over_creepage and varied["time"])]
    fitted = [one for one in (_fit(law, creepage, time, values) for law in laws) if one is not None]
    best = min(fitted, key=lambda one: one.aicc)
    weights = np.exp(-0.5 * np.array([one.aicc - best.aicc for one in fitted]))
    weights = weights / weights.sum()

    def average(v: Floats, t: Floats) -> Floats:
        return np.asarray(sum(weight * one.predict(v, t) for weight, one in zip(weights, fitted, strict=True)))

    return best, average


def _fit(law: Law, creepage: Floats, time: Floats, values: Floats) -> Fitted | None:
    """One law by least squares; None where the samples are too few for it."""
    sizes = float(np.abs(creepage).max()), float(np.nanmax(time)) if np.isfinite(time).any() else 1.0
    given = LARGEST if not varies(creepage) or not law.sloped else None
    starts = _starts(law, values, sloped=given is None)
    count, k = len(values), len(starts[0]) + 1
    if count - k - 1 < 1:
        return None
    limits = [FREE, *([SLOPE] if given is None else []), *law.bounds]
    low, high = np.array(limits).T

    def predict(p: Floats, v: Floats, t: Floats) -> Floats:
        own = p if given is None else np.insert(p, 1, np.log(given))
        return law.value(own, np.abs(v) / sizes[0], np.nan_to_num(t) / sizes[1])

    best = min(
        (least_squares(lambda p: predict(p, creepage, time) - values, s, bounds=(low, high), x_scale="jac",
                       max_nfev=400) for s in starts),
        key=lambda one: one.cost,
    )  # fmt: skip
    aicc = count * np.log(max(2.0 * best.cost / count, 1e-300)) + 2.0 * k + 2.0 * k * (k + 1) / (count - k - 1)
    return Fitted(law.name, float(aicc), lambda v, t: predict(best.x, v, t))


def _starts(law: Law, values: Floats, *, sloped: bool) -> list[Floats]:
    """Start values: level, logarithm of the slope over the largest creepage, the law's own."""
    level = float(np.quantile(values, 0.9))
    slopes = np.linspace(0.0, 5.0, STARTS) if sloped else [np.nan]
    own = [tuple(level * q if law.value is _stribeck else q for q in beside) for beside in law.beside]
    starts = [np.array([level, slope, *beside]) for slope in slopes for beside in own]
    return starts if sloped else [np.delete(start, 1) for start in starts]


# ---------------------------------------------------------------------------------------------- a Gaussian process


def gaussian_process(creepage: Floats, time: Floats, values: Floats) -> Predict:
    """A Gaussian process with Matern's covariance (5/2) over ln creepage and time, as they vary; by likelihood."""
    chosen = np.unique(np.linspace(0, len(values) - 1, min(MOST, len(values))).astype(int))
    axes = _axes(creepage, time)
    x, y = axes(creepage[chosen], time[chosen]), values[chosen]
    mean, size = float(y.mean()), max(float(y.std()), 1e-12)
    y = (y - mean) / size

    def factor(q: Floats) -> tuple[Floats, tuple[Floats, bool]]:
        own = _matern(x, x, np.exp(q[2:])) * np.exp(2.0 * q[0]) + np.exp(2.0 * q[1]) * np.eye(len(x))
        held = cho_factor(own + 1e-10 * np.eye(len(x)), lower=True)
        return cho_solve(held, y), held

    def cost(q: Floats) -> float:
        weights, held = factor(q)
        return float(0.5 * y @ weights + np.sum(np.log(np.diag(held[0]))))

    bounds = [(-3.0, 4.0), (-6.0, 1.0), *[(-4.0, 3.0)] * x.shape[1]]
    tried = [minimize(cost, [0.0, -1.5, *[s] * x.shape[1]], bounds=bounds, method="L-BFGS-B") for s in (-1.5, 0.5)]
    best = min(tried, key=lambda one: one.fun).x
    weights = factor(best)[0]

    def predict(v: Floats, t: Floats) -> Floats:
        return np.asarray(mean + size * (_matern(axes(v, t), x, np.exp(best[2:])) * np.exp(2.0 * best[0])) @ weights)

    return predict


def _axes(creepage: Floats, time: Floats) -> Callable[[Floats, Floats], Floats]:
    """What varies, each of standard deviation 1 over the samples: (sample, axis)."""
    columns: list[tuple[int, float, float]] = []
    chosen = (varies(creepage), bool(np.isfinite(time).all()))
    for number, values in enumerate((np.log(np.maximum(np.abs(creepage), 1e-7)), time)):
        if chosen[number]:
            columns.append((number, float(values.mean()), float(values.std())))

    def axes(v: Floats, t: Floats) -> Floats:
        both = (np.log(np.maximum(np.abs(v), 1e-7)), t)
        return np.stack([(both[number] - mean) / std for number, mean, std in columns], axis=1)

    return axes


def _matern(one: Floats, other: Floats, lengths: Sequence[float] | Floats) -> Floats:
    """Matern's correlation (5/2) between points (i, axis) and (j, axis)."""
    apart = np.sqrt(5.0 * np.sum(((one[:, None] - other[None]) / np.asarray(lengths)) ** 2, axis=-1))
    return np.asarray((1.0 + apart + apart**2 / 3.0) * np.exp(-apart))
