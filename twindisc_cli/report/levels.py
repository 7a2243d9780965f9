"""The level that each of several tests has of its own, in words and for scripts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.loop.levels import ENVIRONMENT, Follows, Levels
from twindisc_cli.report.words import listed, p_value, unit, with_error

WANDERS = 0.05
"""The order of the tests is reported to matter below this probability of so much correlation by chance."""


def level_text(levels: Levels) -> str:
    """How the level of the tests scatters, whether neighbours are correlated, and with what it goes."""
    wander = levels.wander
    inner, own = np.exp(wander.mean), "" if levels.unit == "1" else f" {levels.unit}"
    order = ""
    if wander.p_order < WANDERS:
        order = (
            f"; it wanders over the order of the tests (correlation of neighbours {wander.correlation:.2f}, "
            f"{p_value(wander.p_order)}), from the first to the last by {100.0 * levels.drift:+.2g} %"
        )
    beside = f"; it goes with {_line_text(levels.follows)}" if levels.follows else ""
    return f"level of {levels.key} {inner:.3g}{own}, range {100.0 * levels.range:.2g} %{order}{beside}"


def stands_out(levels: Levels) -> bool:
    """Whether the levels wander over the order or go with something that differs between the tests."""
    return levels.wander.p_order < WANDERS or levels.follows is not None


def between_text(levels: Levels) -> str:
    """That a law across the tests may be behind their levels, as a sentence; empty where nothing says so."""
    follows = levels.follows
    if follows is None:
        return ""
    names = [follows.covariate, *follows.others]
    laws = [_label(name) for name in names if name != ENVIRONMENT]
    use = f": a law over {listed(laws, 'or')} would say so; declare it as a law to use it" if laws else ""
    doubt = "" if follows.proven else ", which three tests cannot prove"
    return f"The level of {levels.key} goes with {listed(_labels(names), 'or')} from test to test{doubt}{use}."


def _line_text(follows: Follows) -> str:
    """`rolling speed to the power of -0.18 ± 0.01 (p = 0.01)`, and what it cannot be separated from."""
    label = _label(follows.covariate)
    if follows.power:
        what = f"{label} to the power of {with_error(follows.slope, follows.std, '1')}"
    else:
        shown = "degC" if follows.covariate == ENVIRONMENT else covariate_of(follows.covariate).unit
        what = f"{label}, by {with_error(100.0 * follows.slope, 100.0 * follows.std, '1')} % a {unit(shown)}"
    sure = p_value(follows.p_value)
    if not follows.proven:
        sure = f"{sure}: three tests cannot prove it"
    beside = f", or as well with {listed(_labels(follows.others), 'or')}" if follows.others else ""
    return f"{what} ({sure}){beside}"


def _labels(names: Sequence[str]) -> list[str]:
    return [_label(name) for name in names]


def _label(name: str) -> str:
    return "environment temperature" if name == ENVIRONMENT else covariate_of(name).label


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
        "follows": None if levels.follows is None else {**vars(levels.follows), "proven": levels.follows.proven},
    }
