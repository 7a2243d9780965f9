"""Whether what a test declares makes a state that can be: no law or effect may turn friction, wear or heat around."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.effects._state import State
from twindisc_cli.errors import Problem, ValidityError
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel

LARGEST_MU = 2.0
"""Of clean metals in vacuum; a larger one that the definition gives is taken as it is."""
LARGEST_RATIO = 3.0
"""Of T/N as a sensor records it."""
HOTTEST = 1e4
"""Kelvin, beyond all solids."""
ROUNDING = 1e-9  # of the largest value: far above the rounding of sums, far below what a sensor resolves


@dataclass(frozen=True)
class _Limit:
    """A quantity of the state, and between what it lies; where it cannot be known, it is NaN."""

    label: str
    of: Callable[[State], Floats]
    low: float
    high: float = np.inf


LIMITS = (
    _Limit("the coefficient of friction", lambda s: s.mu, 0.0, LARGEST_MU),
    _Limit("the factor on the initial slope of the traction", lambda s: s.slope, 0.0),
    _Limit("the factor on the wear coefficient", lambda s: s.wear_factor, 0.0),
    _Limit("the heat into the disc", lambda s: s.heat, 0.0),
    _Limit("the convection", lambda s: s.convection, 0.0),
    _Limit("the absolute temperature of the disc", lambda s: s.disc_temperature, 0.0, HOTTEST),
    _Limit("T/N", lambda s: s.traction_ratio, -LARGEST_RATIO, LARGEST_RATIO),
)


def as_declared(test: Experiment) -> tuple[State, Floats]:
    """The state of a test with what it declares, and the coefficient of friction (point,) it begins from.

    An unknown friction is NaN there, and 1 in the state.
    """
    model = ForwardModel(test)
    mu = friction_in_use(model).mu
    base = BaseParameters.declared(test, np.nan_to_num(mu, nan=1.0)[None])
    state = model.predict(base, profiled=False).state
    return state, mu[test.history.step][model.points.iteration]


def refuse_impossible(test: Experiment) -> None:
    """ValidityError names the law or the effect by which a test gets into a state that cannot be."""
    if not (test.effects or test.laws) or (what := _impossible(test)) is None:
        return
    if _impossible(replace(test, effects={}, laws={})) is not None:
        return  # so it is without them, and the commands say why
    names = [f"effects.{name}" for name in test.effects] + [f"laws.{name}" for name in test.laws]
    guilty = [name for name in names if len(names) == 1 or _impossible(_without(test, name)) is None]
    raise ValidityError(Problem(what, key=" and ".join(guilty or names)))


def _without(test: Experiment, name: str) -> Experiment:
    """The test without one of the terms that it declares."""
    table, _, key = name.partition(".")
    if table == "effects":
        return replace(test, effects={other: own for other, own in test.effects.items() if other != key})
    return replace(test, laws={other: law for other, law in test.laws.items() if other != key})


def _impossible(test: Experiment) -> str | None:
    """What cannot be in the state of a test where it rolls; None where all can."""
    with np.errstate(all="ignore"):
        state, base = as_declared(test)
    rolls = state.rolling_speed[0] > 0.0
    time = state.time[rolls]
    for limit in LIMITS:
        values = np.broadcast_to(limit.of(state)[0], rolls.shape)[rolls]
        high = limit.high
        if limit.label == LIMITS[0].label:
            high = np.where(np.isfinite(base), np.fmax(base, limit.high), np.inf)[rolls]
        slack = ROUNDING * np.nanmax(np.abs(values), initial=0.0)
        beyond = (values < limit.low - slack) | (values > high + slack) | np.isinf(values)
        if np.any(beyond):
            first = int(np.argmax(beyond))
            return f"makes {limit.label} {values[first]:.3g} at {time[first]:.4g} s, which cannot be"
    return None
