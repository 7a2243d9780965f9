"""Laws on trial: a formula or a curve as an effect whose parameters are fitted.

    formula   change = size * shape(x)
    curve     change = exp(f) - 1 of a factor, f of a shift,   f(x_j) = sum_k L_jk u_k,   u ~ N(0, 1)

f is linear between the knots x_j and constant beyond; L L' is the covariance that the prior of f has at the knots.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from twindisc_cli.effects._effect import Effect, Param, seen
from twindisc_cli.effects._state import Floats, State
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.law import Law, acted, formula_value
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.shapes import SHAPES

LARGEST = 6.0
"""Bound of a curve's normal parameters."""


@dataclass(frozen=True)
class Trial(Effect):
    """A law as an effect. fixed: parameters of the formula that are not fitted; at, mix: knots and L of a curve."""

    quantity: str = ""
    covariate: str = ""
    shape: str | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    at: tuple[float, ...] = ()
    mix: Floats | None = field(default=None, compare=False, repr=False)

    @property
    def jumps(self) -> Floats:
        """Places of the covariate at which a formula jumps (jump,), in the unit of the definition."""
        return np.array([*self.fixed.values()] if self.shape in ("step", "window") else [], dtype=float)

    @property
    def unfixed(self) -> Effect:
        """The same formula with all its parameters free, for a scan of those that have no slope."""
        assert self.shape is not None
        extra = tuple(Param(key, "1", value, -np.inf, np.inf, key) for key, value in self.fixed.items())
        act = partial(_act, self.quantity, self.covariate, self.shape, {})
        return Effect(self.stage, (*self.params, *extra), act, self.source, self.channel, self.seen_in, test=self.test)

    def fixed_at(self, values: Mapping[str, float]) -> Trial:
        """The same formula with other values of what is not fitted."""
        assert self.shape is not None
        fixed = {**self.fixed, **values}
        return replace(self, fixed=fixed, apply=partial(_act, self.quantity, self.covariate, self.shape, fixed))

    @property
    def is_curve(self) -> bool:
        """Whether it is a curve and no formula."""
        return self.shape is None

    def heights(self, u: Floats, places: Floats) -> Floats:
        """f of a curve of parameters (parameter,) at places of the covariate (place,)."""
        assert self.mix is not None
        return np.asarray(_between(places, np.array(self.at), u[None] @ self.mix.T)[0])

    def law(self, values: Mapping[str, float]) -> Law:
        """The law with fitted parameters."""
        if self.shape is not None:
            return Law(self.quantity, self.covariate, self.shape, {**values, **self.fixed})
        assert self.mix is not None
        f = self.mix @ np.array([values[p.name] for p in self.params])
        value = np.exp(f) if QUANTITIES[self.quantity].kind == "factor" else f
        return Law(self.quantity, self.covariate, at=self.at, value=tuple(float(v) for v in value))


def formula(
    quantity: str, covariate: str, shape: str, start: Mapping[str, float], span: tuple[float, float], most: float
) -> Trial:
    """A formula on trial from start values by the definition's keys, over a covariate that spans `span`.

    most: bound of the size of a shift; a factor may not fall below a twentieth.
    """
    over, form, of = covariate_of(covariate), SHAPES[shape], QUANTITIES[quantity]
    fixed = {over.key(name): start[over.key(name)] for name in form.fixed}
    lower, upper = (-0.95, 20.0) if of.kind == "factor" else (-most, most)
    first = start[of.size_key]
    params = [Param(of.size_key, of.unit, first, lower, upper, f"size of the change of {of.label}", off=0.0)]
    length = span[1] - span[0]
    for name in (*form.along, *form.pure):
        key = over.key(name) if name in form.along else name
        if key in fixed:
            continue
        low, high, log = {
            "at": (span[0], span[1], False),
            "width": (0.01 * length, 2.0 * length, True),
            "scale": (0.02 * length, 10.0 * length, True),
            "period": (0.03 * length, 3.0 * length, True),
            "phase": (-7.0, 7.0, False),
            "exponent": (-4.0, 4.0, False),
        }[name]
        unit = over.unit if name in form.along else "1"
        params.append(Param(key, unit, float(np.clip(start[key], low, high)), low, high, name, log=log))
    act = partial(_act, quantity, covariate, shape, fixed)
    return Trial(
        of.stage, tuple(params), act, "learnt", of.channel, seen(of.channel),
        quantity=quantity, covariate=covariate, shape=shape, fixed=fixed,
    )  # fmt: skip


def _act(quantity: str, covariate: str, shape: str, fixed: Mapping[str, float], s: State, **own: Floats) -> State:
    parameters: dict[str, Any] = {**own, **fixed}
    if covariate == "y_over_edge":
        parameters = {name: np.asarray(v)[..., None] if np.ndim(v) else v for name, v in parameters.items()}
    return acted(quantity, covariate, lambda x: formula_value(quantity, covariate, shape, x, parameters), s)


def curve(quantity: str, covariate: str, at: Floats, mix: Floats) -> Trial:
    """A curve on trial through knots (knot,), with the square root of its prior covariance (knot, parameter)."""
    of = QUANTITIES[quantity]
    params = tuple(
        Param(f"u{k}", "1", 0.0, -LARGEST, LARGEST, "coordinate of the curve", off=0.0, normal=True)
        for k in range(mix.shape[1])
    )
    return Trial(
        of.stage, params, partial(_bend, quantity, covariate, at, mix), "learnt", of.channel, seen(of.channel),
        quantity=quantity, covariate=covariate, at=tuple(float(x) for x in at), mix=mix,
    )  # fmt: skip


def _bend(quantity: str, covariate: str, at: Floats, mix: Floats, s: State, **u: Floats) -> State:
    heights = np.concatenate(list(u.values()), axis=1) @ mix.T

    def change(x: Floats) -> Floats:
        f = _between(x, at, heights)
        return np.expm1(f) if QUANTITIES[quantity].kind == "factor" else f

    return acted(quantity, covariate, change, s)


def _between(x: Floats, at: Floats, heights: Floats) -> Floats:
    """Heights (set, knot) at x (set, ...), linear between the knots."""
    right = np.clip(np.searchsorted(at, x), 1, len(at) - 1)
    part = np.clip((x - at[right - 1]) / (at[right] - at[right - 1]), 0.0, 1.0)
    if x.ndim == 1:
        return np.asarray((1.0 - part) * heights[:, right - 1] + part * heights[:, right])
    shape, sets = (len(heights), *x.shape[1:]), np.arange(len(heights)).reshape(-1, *[1] * (x.ndim - 1))
    right = right + len(at) * sets
    low, high = (heights.take(np.broadcast_to(index, shape)) for index in (right - 1, right))
    return np.asarray(low + part * (high - low))


def bins(quantity: str, covariate: str, edges: Floats) -> Effect:
    """A change by `level` in one of the bins between the edges, whose number is `bin`: what a law of any shape adds.

    A bin holds its upper edge; the first and the last have no end.
    """
    of = QUANTITIES[quantity]
    params = (
        Param("level", "1", 1e-3, -1.0, 1.0, "change in the bin", off=0.0),
        Param("bin", "1", 0.0, 0.0, float(len(edges)), "number of the bin"),
    )

    def act(s: State, *, level: Floats, bin: Floats) -> State:
        if covariate == "y_over_edge":
            level, bin = level[..., None], bin[..., None]
        return acted(quantity, covariate, lambda x: level * (np.searchsorted(edges[1:-1], x) == bin), s)

    return Effect(of.stage, params, act, "learnt", of.channel, seen(of.channel))
