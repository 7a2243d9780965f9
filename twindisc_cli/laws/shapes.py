"""The formulas of learnt laws: change = size * shape(x).

x is the covariate in the unit of the definition. Parameters along x are named without their unit here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from twindisc_cli.effects._state import Floats


@dataclass(frozen=True)
class Shape:
    """A formula: its value at x (...), its parameters beside the size, and how it reads.

    `along`: parameters measured along x; `pure`: those without a unit; `fixed`: those that are set and not fitted,
    because the formula has no slope over them or they only say from where x counts.
    """

    value: Callable[..., Floats]
    along: tuple[str, ...]
    text: str
    pure: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()


def _step(x: Floats, *, at: Any) -> Floats:
    return np.asarray(np.where(x > at, 1.0, 0.0))


def _window(x: Floats, *, begin: Any, end: Any) -> Floats:
    return np.asarray(np.where((x > begin) & (x <= end), 1.0, 0.0))


def _linear(x: Floats, *, begin: Any, end: Any) -> Floats:
    return np.asarray(np.clip((x - begin) / (end - begin), 0.0, 1.0))


def _exponential(x: Floats, *, origin: Any, scale: Any) -> Floats:
    return np.asarray(np.exp(-np.maximum(x - origin, 0.0) / scale))


def _power(x: Floats, *, reference: Any, exponent: Any) -> Floats:
    return np.asarray(np.maximum(np.abs(x) / reference, 1e-6) ** exponent - 1.0)


def _logistic(x: Floats, *, at: Any, width: Any) -> Floats:
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * (x - at) / width)))


def _bump(x: Floats, *, at: Any, width: Any) -> Floats:
    return np.asarray(np.exp(-0.5 * ((x - at) / width) ** 2))


def _sine(x: Floats, *, period: Any, phase: Any) -> Floats:
    return np.asarray(np.sin(2.0 * np.pi * x / period + phase))


SHAPES: Mapping[str, Shape] = {
    "step": Shape(_step, ("at",), "[{x} > {at}]", fixed=("at",)),
    "window": Shape(_window, ("begin", "end"), "[{begin} < {x} < {end}]", fixed=("begin", "end")),
    "linear": Shape(
        _linear, ("begin", "end"), "min(1, max(0, ({x} - {begin}) / ({end} - {begin})))", fixed=("begin", "end")
    ),
    "exponential": Shape(_exponential, ("origin", "scale"), "exp(-({x} - {origin}) / {scale})", fixed=("origin",)),
    "power": Shape(
        _power, ("reference",), "(({x} / {reference})^{exponent} - 1)", pure=("exponent",), fixed=("reference",)
    ),
    "logistic": Shape(_logistic, ("at", "width"), "1 / (1 + exp(-({x} - {at}) / {width}))"),
    "bump": Shape(_bump, ("at", "width"), "exp(-({x} - {at})^2 / (2 {width}^2))"),
    "sine": Shape(_sine, ("period",), "sin(2 pi {x} / {period} + {phase})", pure=("phase",)),
}
