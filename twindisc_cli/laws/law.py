"""A learnt law as it stands in a definition, and as it acts in the forward model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from twindisc_cli.effects._effect import Stage
from twindisc_cli.effects._state import Floats, State
from twindisc_cli.laws.covariates import LOCAL, Column, Covariate, covariate_of, identifier
from twindisc_cli.laws.quantities import QUANTITIES, Quantity
from twindisc_cli.laws.shapes import SHAPES

BEYOND = 0.02
"""A covariate counts as outside a law's range from this share of the range on."""
Transfer = Literal["inside", "same_history"]
Change = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Law:
    """One law: quantity, covariate, and either a formula or a curve.

    parameters: of the formula `shape`, by the keys of the definition; else `at` and `value` (place,), the factor or
    the shift there, constant beyond. valid: where data were, in the covariate's unit. transfer: whether the law holds
    inside its range on any history, or only on the one it was learnt on.
    """

    quantity: str
    covariate: str
    shape: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    at: tuple[float, ...] = ()
    value: tuple[float, ...] = ()
    valid: tuple[float, float] | None = None
    transfer: Transfer = "inside"

    @property
    def name(self) -> str:
        """What the law is called where it has no name of its own."""
        return law_key(self.quantity, self.covariate)

    @property
    def stage(self) -> Stage:
        """When it acts."""
        return self.of.stage

    @property
    def of(self) -> Quantity:
        """The quantity."""
        return QUANTITIES[self.quantity]

    @property
    def over(self) -> Covariate:
        """The covariate."""
        return covariate_of(self.covariate)

    @property
    def local(self) -> bool:
        """Whether it is asked strip by strip."""
        return self.covariate in LOCAL

    def change(self, x: Floats) -> Floats:
        """Relative change, or shift in the quantity's unit, at x (...) in the covariate's unit."""
        if self.shape is None:
            value = np.interp(x, self.at, self.value)
            return np.asarray(value - 1.0 if self.of.kind == "factor" else value)
        return formula_value(self.quantity, self.covariate, self.shape, x, self.parameters)

    def apply(self, state: State) -> State:
        """The state with the quantity changed."""
        return acted(self.quantity, self.covariate, self.change, state)


def law_key(quantity: str, covariate: str) -> str:
    """What a law is called in definitions: `mu_over_time`."""
    return f"{quantity}_over_{identifier(covariate)}"


def acted(quantity: str, covariate: str, change: Change, state: State) -> State:
    """A state with one quantity changed by change(x); where the covariate is not known, nothing changes."""
    if covariate == "y_over_edge" and state.surface is None:
        return state
    over = covariate_of(covariate)
    x = over.of(state)
    result = np.where(np.isfinite(x) & (np.abs(x) <= over.reach), change(np.nan_to_num(x)), 0.0)
    return QUANTITIES[quantity].apply(state, result * QUANTITIES[quantity].scale)


def formula_value(quantity: str, covariate: str, shape: str, x: Floats, parameters: Mapping[str, Any]) -> Floats:
    """The change by a formula whose parameters, numbers or arrays that broadcast with x, have the definition's keys."""
    over, form = covariate_of(covariate), SHAPES[shape]
    own = {name: parameters[over.key(name)] for name in form.along} | {name: parameters[name] for name in form.pure}
    return np.asarray(parameters[QUANTITIES[quantity].size_key] * form.value(x, **own))


def formula_text(law: Law) -> str:
    """The law as one reads it: `1 - 0.18 exp(-E / 1.4 kJ)`; of a curve, that it is one."""
    x = law.over.symbol
    if law.shape is None:
        return f"curve over {x}, {len(law.at)} places"
    form, unit = SHAPES[law.shape], "" if law.over.unit == "1" else f" {law.over.unit}"
    along = {name: f"{law.parameters[law.over.key(name)]:.4g}{unit}" for name in form.along}
    body = form.text.format(x=x, **along, **{name: f"{law.parameters[name]:.4g}" for name in form.pure})
    body = body.replace(f"({x} - 0{unit})", x).replace("- -", "+ ")
    size = law.parameters[law.of.size_key]
    sign = "-" if size < 0.0 else "+"
    if law.of.kind == "factor":
        return f"1 {sign} {abs(size):.4g} {body}"
    own = "" if law.of.unit == "1" else f" {law.of.unit}"
    return f"{sign}{abs(size):.4g}{own} {body}"


def warnings(laws: Mapping[str, Law], state: State, test: str) -> list[str]:
    """Where laws are used outside of the range they were learnt on, or cannot be carried over to another history."""
    results = []
    for name, law in laws.items():
        if law.transfer == "same_history":
            results.append(
                f"{test}: {name} cannot be carried over with certainty to another history than the one it was learnt "
                f"on: there {law.over.label} could not be separated from what changed with it"
            )
        if isinstance(law.over, Column) and law.covariate not in state.columns:
            results.append(f"{test}: {name} changes nothing, for no column {law.covariate} was recorded in this test")
        outside = _outside(law, state)
        if outside > 0.0:
            low, high = law.valid or (np.nan, np.nan)
            results.append(
                f"{test}: {name} is used outside of the range it was learnt on ({low:.4g} to {high:.4g} "
                f"{law.over.unit}) in {100.0 * outside:.0f} % of the test"
            )
    return results


def _outside(law: Law, state: State) -> float:
    """Share of a test in which the covariate of a law is beyond its range."""
    if law.valid is None or law.covariate == "y_over_edge":
        return 0.0
    x = np.broadcast_to(np.atleast_2d(law.over.of(state))[0], state.duration.shape)
    slack = BEYOND * (law.valid[1] - law.valid[0])
    beyond = (x < law.valid[0] - slack) | (x > law.valid[1] + slack)
    return float(np.sum(state.duration[beyond]) / max(float(np.sum(state.duration)), 1e-300))
