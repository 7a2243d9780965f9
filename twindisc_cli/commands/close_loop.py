"""close-loop: what the model of a test lacks, found, added, and judged on data that were not used."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from twindisc_cli import __version__
from twindisc_cli.commands import _loop_told as told
from twindisc_cli.commands._loop_data import dataset_of
from twindisc_cli.commands._loop_page import page_of
from twindisc_cli.commands._loop_rows import rows_of
from twindisc_cli.definition import Test, dump
from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import CHANNELS, Param
from twindisc_cli.errors import NEGATIVE_FINDING, DefinitionError, Problem
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import ChannelError, Diagnosis, Estimate, FoundEffect, NextExperiment
from twindisc_cli.loop.problem import channels_of, friction_is_given
from twindisc_cli.report.close_loop import render
from twindisc_cli.report.words import CHANNEL, listed, number, p_value, percent, plain_name, unit, with_error
from twindisc_cli.results import Result, or_null

LINES = 10
DIGITS = 7


def run(tests: Sequence[Test], validate: Test | None, progress: Callable[[str, float], None]) -> Result:
    """Diagnose the tests together; `validate` is only predicted. Exit code 5 where the cause is in no catalogue."""
    _refuse_nothing_measured(tests)
    experiments = [test.experiment for test in tests]
    unseen = validate.experiment if validate else None
    return result_of(diagnose(experiments, validate=unseen, progress=progress), tests, validate)


def result_of(diagnosis: Diagnosis, tests: Sequence[Test], validate: Test | None) -> Result:
    """A diagnosis as summary, JSON, arrays, figure, page and revised definition."""
    from twindisc_cli.figures.close_loop import figure
    from twindisc_cli.results.store import png

    title = f"{listed([t.experiment.name for t in tests])}: {told.sentences(diagnosis)[0]}"
    kinds = [test.experiment.measured.provenance for test in tests]
    rows = rows_of(diagnosis, [test.experiment for test in tests])
    drawn = figure(rows, title=title, provenance=told.provenance(kinds))
    return Result(
        command="close-loop",
        summary=tuple(summary(diagnosis)),
        json=or_null(_json(diagnosis)),
        dataset=dataset_of(diagnosis),
        figure=lambda: drawn,
        exit_code=NEGATIVE_FINDING if diagnosis.verdict == "unexplained" else 0,
        extra_files={
            "close-loop.html": render(page_of(diagnosis, tests, validate), figure=png(drawn)),
            "revised.toml": revised(diagnosis, tests[0]),
        },
    )


def _refuse_nothing_measured(tests: Sequence[Test]) -> None:
    """Every test must bring something to compare with."""
    what = "names no data that can be compared: give a traction, a profile, or a temperature with [thermal]"
    problems = [Problem(what, test.path, key="measured") for test in tests if not channels_of(test.experiment)]
    problems += [
        Problem(
            "neither measured nor given: measure the traction, or give mu in the model or in every step",
            test.path,
            key="model.friction_coefficient",
        )
        for test in tests
        if test.experiment.measured.traction is None and not friction_is_given(test.experiment)
    ]
    if problems:
        raise DefinitionError(problems)


def summary(diagnosis: Diagnosis) -> list[str]:
    """At most ten lines: the verdict, errors, effects, leftovers, base parameters, the next experiment, notes."""
    lines = [f"{diagnosis.verdict}: {told.sentences(diagnosis)[0]}"]
    lines += [_error_line(CHANNEL[channel], error) for channel, error in diagnosis.errors.items()]
    lines += [_effects_line(effects) for effects in told.together(diagnosis).values()]
    if diagnosis.unexplained and diagnosis.verdict == "effects_found":
        lines.append(f"unexplained: {listed(told.leftovers(diagnosis))} ({_significance(diagnosis)})")
    base = [f"{name} = {with_error(e.value, e.std, e.unit)}" for name, e in diagnosis.base.items()]
    lines += [f"base: {', '.join(base)}"] if base else []
    if diagnosis.validation is not None:
        parts = [f"{CHANNEL[c]} {_before_after(e)}" for c, e in diagnosis.validation.errors.items()]
        lines.append(f"predicted, never fitted: {diagnosis.validation.test}: {', '.join(parts)}")
    if diagnosis.next_experiment is not None:
        lines.append(f"next: {diagnosis.next_experiment.why}")
    room = LINES - len(lines)
    notes = [f"note: {note}" for note in diagnosis.notes]
    if len(notes) > room:
        kept = notes[: max(room - 1, 0)]
        notes = [*kept, f"{len(notes) - len(kept)} {'more ' if kept else ''}notes in close-loop.html"]
    return (lines + notes)[:LINES]


def _significance(diagnosis: Diagnosis) -> str:
    return p_value(min(left.p_value for left in diagnosis.unexplained))


def _before_after(error: ChannelError) -> str:
    return f"{number(error.held_out_before)} -> {number(error.held_out_after)} {unit(error.unit)}".rstrip()


def _error_line(channel: str, error: ChannelError) -> str:
    fitted = f"error {number(error.before)} -> {number(error.after)} {unit(error.unit)}".rstrip()
    return f"{channel}: {fitted}, held out {_before_after(error)}, noise {number(error.noise)}"


def _effects_line(effects: Sequence[FoundEffect]) -> str:
    parts = []
    for effect in effects:
        values = [f"{key} = {with_error(e.value, e.std, e.unit)}" for key, e in effect.parameters.items()]
        parts.append(f"{effect.name} ({', '.join(values)})")
    others = f"; cannot be told from {listed(effects[0].alternatives, 'or')}" if effects[0].alternatives else ""
    return f"{' with '.join(parts)}, probability {percent(effects[0].probability)}{others}"


def _json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The outcome for scripts."""
    return {
        "verdict": diagnosis.verdict,
        "effects": [
            {
                "effect": effect.name,
                "channel": effect.channel,
                "parameters": {key: _estimate(e) for key, e in effect.parameters.items()},
                "alternatives": list(effect.alternatives),
                "probability": effect.probability,
            }
            for effect in diagnosis.effects
        ],
        "unexplained": [
            {key: getattr(left, key) for key in ("channel", "covariate", "kind", "share_of_variance", "p_value")}
            for left in diagnosis.unexplained
        ],
        "error": _errors(diagnosis.errors),
        "base": {name: _estimate(e) for name, e in diagnosis.base.items()},
        "next_experiment": _next(diagnosis.next_experiment),
        "revised": "revised.toml",
        "validation": None
        if diagnosis.validation is None
        else {"test": diagnosis.validation.test, "error": _errors(diagnosis.validation.errors)},
        "hold_out_steps": {test: [step + 1 for step in steps] for test, steps in diagnosis.held_out_steps.items()},
        "p_value": dict(diagnosis.p_values),
        "notes": list(diagnosis.notes),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {key: getattr(estimate, key) for key in ("value", "std", "low", "high", "unit")}


def _errors(errors: Mapping[Any, ChannelError]) -> dict[str, Any]:
    """Every channel; an empty object for one that was not measured."""
    keys = ("unit", "noise", "before", "after", "held_out_before", "held_out_after")
    return {c: {key: getattr(errors[c], key) for key in keys} if c in errors else {} for c in CHANNELS}


def _next(planned: NextExperiment | None) -> dict[str, Any]:
    if planned is None:
        return {"why": "nothing is left to be told apart", "steps": []}
    return {
        "why": planned.why,
        "steps": [{**step, "iterations": int(step["iterations"])} for step in planned.steps],
        "rivals": list(planned.rivals),
        "separation": planned.separation,
        "separation_now": planned.separation_now,
        "channel_wanted": planned.channel_wanted,
    }


def revised(diagnosis: Diagnosis, test: Test) -> str:
    """The definition with the effects that were added and the base parameters that were identified."""
    document: dict[str, Any] = copy.deepcopy(dict(test.resolved))
    for name, estimate in diagnosis.base.items():
        key, _, other = name.partition(" ")
        if other in ("", f"({test.experiment.name})") and key in told.BASE:
            table = "thermal" if key == "convection_W_K" else "model"
            document.setdefault(table, {}).setdefault(told.BASE[key][0], _rounded(estimate.value))
    params = {effect.name: {p.name: p for p in catalogue()[effect.name].params} for effect in diagnosis.effects}
    effects = {
        effect.name: {key: _inside(params[effect.name][key], e.value) for key, e in effect.parameters.items()}
        for effect in diagnosis.effects
    }
    return f"{_heading(diagnosis, test)}\n{dump(document, effects)}"


def _heading(diagnosis: Diagnosis, test: Test) -> str:
    found = listed([plain_name(effect.name) for effect in diagnosis.effects])
    what = f"with {found} added" if found else "with no effect added"
    return f"# {test.experiment.name}, {what} by twindisc close-loop {__version__} ({diagnosis.verdict})"


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _inside(param: Param, value: float) -> float:
    """The value, rounded, within what a definition allows."""
    ends = (param.lower, param.upper) if param.off is None else (param.lower, param.upper, param.off)
    return float(np.clip(_rounded(value), min(ends), max(ends)))
