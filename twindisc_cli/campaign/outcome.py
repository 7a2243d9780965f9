"""What a campaign says as a whole: the groups, the regimes and the effects behind its table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twindisc_cli.campaign.groups import Effect, Group, effects_of, groups_of
from twindisc_cli.campaign.table import Table
from twindisc_cli.identify.regimes import Regime, regimes_of_logarithms
from twindisc_cli.report.words import regimes_text

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
            *(
                f"{name} has {regimes_text(breaks)}"
                for name, breaks in (("K", self.k), ("wear rate", self.rate))
                if len(breaks) > 1
            ),
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
    k, declared, energy = (table.numbers(key) for key in ("K [1]", "wear coefficient [1]", ENERGY))
    return Outcome(
        groups=tuple(groups_of(table)),
        k=tuple(regimes_of_logarithms(energy, np.where(np.isfinite(k), k, declared))),
        rate=tuple(regimes_of_logarithms(energy, table.numbers(RATE))),
        effects=tuple(effects_of(table)),
    )


def _json(regime: Regime) -> dict[str, Any]:
    return {
        "from_N_mm2": np.exp(regime.low),
        "to_N_mm2": np.exp(regime.high),
        "exponent": regime.slope,
        "p_value": regime.p_value if np.isfinite(regime.p_value) else None,
    }
