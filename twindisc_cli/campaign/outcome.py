"""What a campaign says as a whole: the groups, the regimes and the effects behind its table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twindisc_cli.campaign.groups import Effect, Group, effects_of, groups_of
from twindisc_cli.campaign.table import Table
from twindisc_cli.identify.regimes import Regime, regimes

SEED = 1  # of the search for regimes: the same table gives the same lines
ENERGY, RATE = "T gamma / A [N/mm2]", "wear rate [um/km]"
_MOST_EFFECTS = 8  # of one cell, which a reader takes in at once


@dataclass(frozen=True)
class Outcome:
    """The groups, the regimes of K and of the wear rate over T gamma / A (as logarithms), and the effects found."""

    groups: tuple[Group, ...]
    k: tuple[Regime, ...]
    rate: tuple[Regime, ...]
    effects: tuple[Effect, ...]

    @property
    def summary(self) -> tuple[str, ...]:
        """The outcome in lines."""
        result = sorted(self.effects, key=lambda effect: -len(effect.tests) / effect.of)
        return (
            *(group.summary for group in self.groups),
            *(_told(name, breaks) for name, breaks in (("K", self.k), ("wear rate", self.rate)) if len(breaks) > 1),
            *(effect.summary for effect in result[:_MOST_EFFECTS]),
        )

    @property
    def json(self) -> dict[str, Any]:
        """The outcome for scripts."""
        return {
            "groups": [group.json for group in self.groups],
            "regimes": {"K": [_json(r) for r in self.k], "wear_rate": [_json(r) for r in self.rate]},
            "effects": [effect.json for effect in self.effects],
        }


def outcome_of(table: Table) -> Outcome:
    """Pool, split and count what a table holds."""
    k, declared = table.numbers("K [1]"), table.numbers("wear coefficient [1]")
    return Outcome(
        groups=tuple(groups_of(table)),
        k=_regimes(table, np.where(np.isfinite(k), k, declared)),
        rate=_regimes(table, table.numbers(RATE)),
        effects=tuple(effects_of(table)),
    )


def _regimes(table: Table, values: np.ndarray[Any, np.dtype[np.float64]]) -> tuple[Regime, ...]:
    """The regimes of a positive quantity over T gamma / A, both as logarithms."""
    energy = table.numbers(ENERGY)
    known = (energy > 0.0) & (values > 0.0)
    if not np.any(known):
        return ()
    return tuple(regimes(np.log(energy[known]), np.log(values[known]), np.random.default_rng(SEED)))


def _told(name: str, result: tuple[Regime, ...]) -> str:
    breaks = ", ".join(f"{np.exp(r.low):.3g} N/mm² (p = {r.p_value:.2g})" for r in result[1:])
    return f"{name} has {len(result)} regimes over T gamma / A, from {breaks}"


def _json(regime: Regime) -> dict[str, Any]:
    return {
        "from_N_mm2": np.exp(regime.low),
        "to_N_mm2": np.exp(regime.high),
        "exponent": regime.slope,
        "p_value": regime.p_value if np.isfinite(regime.p_value) else None,
    }
