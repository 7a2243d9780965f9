"""Hidden effects that are in no catalogue: a random law (shape) of a random stage (quantity) over a random covariate.

    quantity * (1 + size f(u))   mu, slope, wear, wear_across, heat, convection
    quantity + size f(u)         creepage [1], traction_ratio [1], environment, temperature [K], profile [m]

u is the covariate's place in its range on the history, from 0 to 1 (creepages by their logarithm, the place across
the track by y / edge), constant beyond; |f| <= 1. A law is named "quantity_over_covariate:shape". Where the catalogue
has a formula of the same quantity over the same covariate, only shapes that rise and fall again are drawn: a rising
one could be the catalogue's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.stats import rankdata

from .effects import Drawn
from .hidden import COVARIATES, Hidden, Moment
from .rig import Rig, Trace

Floats = NDArray[np.float64]
Curve = Callable[[Floats], Floats]
_EQUIVALENT = 0.98  # rank correlation from which two covariates are functions of each other on a history
_FAITHFUL = 0.08  # of a covariate's range: how well an equivalent one must foretell it on another history
_KNOTS = 9  # of a curve at another stage that may imitate a law


@dataclass(frozen=True)
class Stage:
    """Where a law acts: the channel that shows it first, the largest size and the covariates it is drawn over.

    `catalogued`: covariates over which the catalogue has a formula of this quantity, or of one that shows alike;
    `stops`: only profiles at several stops can show it.
    """

    channel: str
    largest: float
    covariates: tuple[str, ...]
    catalogued: tuple[str, ...] = ()
    stops: bool = False


STAGES: Mapping[str, Stage] = {
    "mu": Stage(
        "traction", 0.5, ("creepage", "time", "energy", "temperature", "power", "time_in_step", "greatest_creepage"),
        ("creepage", "time", "energy", "temperature", "power", "greatest_creepage"),
    ),
    "slope": Stage("traction", 0.8, ("time", "energy", "temperature", "greatest_creepage")),
    "creepage": Stage("traction", 3e-3, ("time", "energy", "temperature")),
    "traction_ratio": Stage(
        "traction", 0.15, ("time", "creepage", "temperature", "time_in_step"), ("time", "creepage", "temperature"),
    ),
    "wear": Stage(
        "profile", 6.0, ("time", "energy", "temperature", "power", "creepage"),
        ("time", "energy", "temperature", "power", "creepage"), stops=True,
    ),
    "wear_across": Stage("profile", 0.95, ("y_over_edge",)),
    "profile": Stage("profile", 5e-6, ("y_over_edge",), ("y_over_edge",)),
    "heat": Stage(
        "temperature", 0.6, ("time", "creepage", "temperature", "time_in_step", "power"),
        ("creepage", "temperature", "power"),
    ),
    "convection": Stage(
        "temperature", 0.8, ("time", "creepage", "temperature", "power"), ("creepage", "temperature", "power"),
    ),
    "environment": Stage("temperature", 15.0, ("time", "energy", "time_in_step"), ("time", "energy")),
    "temperature": Stage(
        "temperature", 10.0, ("time", "creepage", "temperature", "time_in_step"), ("time", "creepage", "temperature"),
    ),
}  # fmt: skip


# ---------------------------------------------------------------------------------------------- shapes


def _step(rng: Generator) -> Curve:
    place = rng.uniform(0.3, 0.7)
    return lambda u: np.where(u > place, 1.0, 0.0)


def _window(rng: Generator) -> Curve:
    begin = rng.uniform(0.15, 0.6)
    end = begin + rng.uniform(0.15, 0.35)
    return lambda u: np.where((u > begin) & (u < end), 1.0, 0.0)


def _hump(rng: Generator) -> Curve:
    place, width = rng.uniform(0.25, 0.75), rng.uniform(0.06, 0.18)
    return lambda u: np.exp(-0.5 * ((u - place) / width) ** 2)


def _sine(rng: Generator) -> Curve:
    waves, phase = rng.uniform(1.2, 4.0), rng.uniform(0.0, 2.0 * np.pi)
    return lambda u: np.sin(2.0 * np.pi * waves * u + phase)


def _saturating(rng: Generator) -> Curve:
    scale = rng.uniform(0.1, 0.5)
    return lambda u: -np.expm1(-u / scale)


def _power(rng: Generator) -> Curve:
    exponent = float(rng.choice([0.5, 1.0, 1.5, 2.0, 3.0]))
    return lambda u: np.clip(u, 0.0, 1.0) ** exponent


def _logistic_like(rng: Generator) -> Curve:
    """Hill's curve: as the logistic over log(u), with an exponent of its own."""
    exponent, half = rng.uniform(2.5, 7.0), rng.uniform(0.3, 0.7)
    return lambda u: np.clip(u, 1e-9, 1.0) ** exponent / (np.clip(u, 1e-9, 1.0) ** exponent + half**exponent)


def _smooth(rng: Generator) -> Curve:
    """Four cosines with random amplitudes that fall with their number, the largest deflection 1; rises and falls."""
    number, ends = np.arange(1, 5), np.linspace(0.0, 1.0, 201)
    while True:
        amplitude, phase = rng.normal(size=4) / number**0.7, rng.uniform(0.0, 2.0 * np.pi, 4)
        value = np.cos(np.pi * np.multiply.outer(ends, number) + phase) @ amplitude
        value /= np.abs(value).max()
        if max(value.max() - max(value[0], value[-1]), min(value[0], value[-1]) - value.min()) > 0.5:
            return lambda u: np.interp(u, ends, value)


SHAPES: Mapping[str, Callable[[Generator], Curve]] = {
    "window": _window, "hump": _hump, "sine": _sine, "smooth": _smooth,
    "step": _step, "saturating": _saturating, "power": _power, "logistic_like": _logistic_like,
}  # fmt: skip
RIVALS = (
    ("mu", "traction_ratio"), ("slope", "creepage"), ("wear_across", "profile"),
    ("heat", "convection", "environment", "temperature"),
)  # fmt: skip
"""Quantities that show alike."""
RETURNING = ("window", "hump", "sine", "smooth")
"""Shapes that rise and fall again, as no formula of the catalogue does."""


def kinds(quantity: str) -> tuple[str, ...]:
    """The names of all laws of a quantity that can be drawn."""
    stage = STAGES[quantity]
    return tuple(
        f"{quantity}_over_{covariate}:{shape}"
        for covariate, shape in product(stage.covariates, SHAPES)
        if covariate not in stage.catalogued or shape in RETURNING
    )


def parts(kind: str) -> tuple[str, str, str]:
    """Quantity, covariate and shape of a law's name."""
    pair, shape = kind.split(":")
    quantity, covariate = pair.split("_over_", 1)
    return quantity, covariate, shape


# ---------------------------------------------------------------------------------------------- the law in the rig


def draw(kind: str, rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Draw the law named `kind` for a rig and the range of its covariate there."""
    quantity, covariate, shape = parts(kind)
    curve, sign = SHAPES[shape](rng), 1.0 if rng.random() < 0.5 else -1.0
    if covariate == "y_over_edge":
        return Drawn(lambda size: _across(quantity, lambda y: sign * size * _over_track(curve, y)), _largest(quantity))
    place = _scale(covariate, base.moments[COVARIATES[covariate]])
    return Drawn(lambda size: _acting(quantity, covariate, lambda x: sign * size * curve(place(x))), _largest(quantity))


def rivals(quantity: str) -> list[str]:
    """The other quantities that show alike."""
    return [other for group in RIVALS if quantity in group for other in group if other != quantity]


def imitations(quantity: str, covariate: str, base: Trace) -> list[Hidden]:
    """Small laws of a quantity over a covariate, each at one knot of a curve: together any law of it."""
    curves = [_hat(knot, 0.05 * _largest(quantity)) for knot in np.linspace(0.0, 1.0, _KNOTS)]
    if covariate == "y_over_edge":
        return [_across(quantity, partial(_over_track, curve)) for curve in curves]
    place = _scale(covariate, base.moments[COVARIATES[covariate]])
    return [_acting(quantity, covariate, partial(_placed, curve, place)) for curve in curves]


def _hat(knot: float, size: float) -> Curve:
    return lambda u: size * np.clip(1.0 - np.abs(u - knot) * (_KNOTS - 1.0), 0.0, 1.0)


def _placed(curve: Curve, place: Curve, x: Floats) -> Floats:
    return curve(place(x))


def _largest(quantity: str) -> float:
    return STAGES[quantity].largest


def _scale(covariate: str, seen: Floats) -> Curve:
    """From the covariate to its place in the range `seen`, 0 to 1; creepages by their logarithm."""
    if "creepage" in covariate:
        low, high = np.log(seen.min()), np.log(seen.max())
        return lambda x: np.clip((np.log(np.maximum(x, 1e-9)) - low) / (high - low), 0.0, 1.0)
    low, high = seen.min(), seen.max()
    return lambda x: np.clip((x - low) / (high - low), 0.0, 1.0)


def _over_track(curve: Curve, y: Floats) -> Floats:
    """A law across the track: u from 0 to 1 between its edges, nothing outside."""
    return np.asarray(np.where(np.abs(y) < 1.0, curve(0.5 + 0.5 * np.clip(y, -1.0, 1.0)), 0.0))


def _across(quantity: str, law: Curve) -> Hidden:
    if quantity == "profile":
        return Hidden(shift_profile=law)
    return Hidden(wear_across=lambda y: np.clip(1.0 + law(y), 0.02, None))


def _acting(quantity: str, covariate: str, law: Curve) -> Hidden:
    """The law at its stage; a factor never falls below 0.05."""
    if quantity == "traction_ratio":
        return Hidden(shift_traction=lambda at: law(at[covariate]))
    if quantity == "temperature":
        return Hidden(shift_temperature=lambda at: law(at[covariate]))
    name = COVARIATES[covariate]

    def added(m: Moment) -> float:
        return float(law(np.asarray(getattr(m, name))))

    def factor(m: Moment) -> float:
        return max(1.0 + added(m), 0.05)

    match quantity:
        case "mu":
            return Hidden(friction=factor)
        case "slope":
            return Hidden(slope=factor)
        case "wear":
            return Hidden(wear=factor)
        case "heat":
            return Hidden(warming=factor)
        case "convection":
            return Hidden(cooling=factor)
        case "creepage":
            return Hidden(slip=added)
        case "environment":
            return Hidden(room=added)
    raise ValueError(f"no such quantity: {quantity}")


# ---------------------------------------------------------------------------------------------- what can be told


def equivalent(covariate: str, seen: Mapping[str, Floats]) -> list[str]:
    """The covariates that are monotone functions of this one where they were `seen`, itself among them."""
    if covariate == "y_over_edge":
        return [covariate]
    rank = {name: rankdata(np.round(x, 9)) for name, x in seen.items()}
    one = rank[covariate]
    return [name for name, other in rank.items() if abs(_correlation(one, other)) >= _EQUIVALENT or name == covariate]


def _correlation(one: Floats, other: Floats) -> float:
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def is_separable(covariate: str, seen: Mapping[str, Floats], elsewhere: Mapping[str, Floats]) -> bool:
    """Whether a law over any covariate that is equivalent where it was `seen` says the same on another history.

    And whether that history stays inside the range in which the law was seen.
    """
    low, high = seen[covariate].min(), seen[covariate].max()
    outside = (elsewhere[covariate] < low - 0.02 * (high - low)) | (elsewhere[covariate] > high + 0.02 * (high - low))
    if outside.mean() > 0.05:
        return False
    return all(
        _foretold(seen[other], seen[covariate], elsewhere[other], elsewhere[covariate]) < _FAITHFUL * (high - low)
        for other in equivalent(covariate, seen)
    )


def _foretold(other: Floats, own: Floats, other_there: Floats, own_there: Floats) -> float:
    """Root mean square miss of a covariate that is foretold from another by what was seen of both."""
    order = np.argsort(other)
    return float(np.sqrt(np.mean((np.interp(other_there, other[order], own[order]) - own_there) ** 2)))
