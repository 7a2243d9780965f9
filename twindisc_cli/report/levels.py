"""The level that each of several tests has of its own, in words and for scripts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from twindisc_cli.loop.levels import Levels
from twindisc_cli.report.words import p_value

WANDERS = 0.05
"""The order of the tests is reported to matter below this probability of so much correlation by chance."""


def level_text(levels: Levels) -> str:
    """How the level of the tests scatters, and whether neighbours are correlated."""
    wander = levels.wander
    inner, unit = np.exp(wander.mean), "" if levels.unit == "1" else f" {levels.unit}"
    order = ""
    if wander.p_order < WANDERS:
        order = (
            f"; it wanders over the order of the tests (correlation of neighbours {wander.correlation:.2f}, "
            f"{p_value(wander.p_order)}), from the first to the last by {100.0 * levels.drift:+.2g} %"
        )
    return f"level of {levels.key} {inner:.3g}{unit}, range {100.0 * levels.range:.2g} %{order}"


def level_json(levels: Levels, tests: Sequence[str]) -> dict[str, Any]:
    """The levels of tests by their names, for scripts."""
    wander = levels.wander
    return {
        "tests": [tests[i] for i in levels.tests],
        "value": levels.value.tolist(),
        "shrunk": levels.shrunk.tolist(),
        "unit": levels.unit,
        "mean": float(np.exp(wander.mean)),
        "between": wander.between,
        "correlation": wander.correlation,
        "p_order": wander.p_order,
        "drift": levels.drift,
        "range": levels.range,
    }
