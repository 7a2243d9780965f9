"""From a diagnosis to the page of close-loop: every number as text with its unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twindisc_cli.commands import _loop_told as told
from twindisc_cli.definition import Test
from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import CHANNELS
from twindisc_cli.loop.diagnosis import ChannelError, Curve, Diagnosis, Estimate, NextExperiment
from twindisc_cli.loop.holdout import BANDS, EVERY
from twindisc_cli.report import close_loop as view
from twindisc_cli.report.words import (
    CHANNEL,
    KIND,
    explanation,
    listed,
    look_at,
    number,
    p_value,
    percent,
    plain_name,
    unit,
    with_error,
)


def page_of(diagnosis: Diagnosis, tests: Sequence[Test], validate: Test | None) -> view.Page:
    """The page of a diagnosis of these tests."""
    checked = diagnosis.validation
    return view.Page(
        title=listed([test.experiment.name for test in tests]),
        verdict=diagnosis.verdict,
        sentences=told.sentences(diagnosis),
        errors=[_error(channel, error) for channel, error in diagnosis.errors.items()],
        found=_found(diagnosis),
        left=_left(diagnosis),
        next=_next(diagnosis.next_experiment, tests[0]),
        base=[_value(name, told.base_meaning(name), e) for name, e in diagnosis.base.items()],
        tried=_tried(diagnosis),
        validation=_validation(tests, validate),
        validation_errors=[_error(channel, error) for channel, error in checked.errors.items()] if checked else [],
        notes=list(diagnosis.notes),
        sources=[
            *(_source(test, diagnosis, "fitted") for test in tests),
            *([_source(validate, diagnosis, "only predicted")] if validate else []),
        ],
        provenance=told.provenance([test.experiment.measured.provenance for test in tests]),
    )


def _error(channel: str, error: ChannelError) -> view.ErrorRow:
    return view.ErrorRow(
        channel=CHANNEL[channel],
        unit=unit(error.unit),
        noise=number(error.noise),
        before=number(error.before),
        after=number(error.after),
        held_out_before=number(error.held_out_before),
        held_out_after=number(error.held_out_after),
        comment=told.against_noise(error),
    )


def _value(name: str, meaning: str, estimate: Estimate) -> view.Value:
    return view.Value(
        name=name,
        meaning=meaning,
        value=with_error(estimate.value, estimate.std, estimate.unit),
        interval=told.interval(estimate),
    )


def _effect(name: str) -> view.Effect:
    source = catalogue()[name].source
    return view.Effect(key=name, name=plain_name(name), explanation=explanation(name), source=source)


def _found(diagnosis: Diagnosis) -> list[view.Found]:
    groups = []
    for channel, effects in told.together(diagnosis).items():
        cards = []
        for found in effects:
            meanings = {p.name: p.meaning for p in catalogue()[found.name].params}
            rows = [_value(key, meanings[key], estimate) for key, estimate in found.parameters.items()]
            cards.append((_effect(found.name), rows))
        likely, others = percent(effects[0].probability), [_effect(name) for name in effects[0].alternatives]
        groups.append(view.Found(CHANNEL[channel], likely, cards, others))
    return groups


def _left(diagnosis: Diagnosis) -> list[view.Left]:
    return [
        view.Left(
            channel=CHANNEL[left.channel],
            covariate=told.covariate(left),
            kind=KIND.get(left.kind, left.kind),
            share=percent(left.share_of_variance),
            significance=p_value(left.p_value),
            look_at=look_at(left.channel, left.covariate),
        )
        for left in diagnosis.unexplained
    ]


def _tried(diagnosis: Diagnosis) -> list[view.TriedRow]:
    return [
        view.TriedRow(
            channel=CHANNEL[channel],
            names=" + ".join(plain_name(name) for name in tried.effects),
            gain=f"{told.length(tried.gain):.1f}",
            probability=percent(tried.probability) if tried.passed else "",
            left=f"{p_value(tried.left_p_value)}, {tried.left_length:.1f} noise units long",
            outcome=told.outcome(tried)[1] + ("; added to the model" if told.is_chosen(diagnosis, tried) else ""),
            passed=tried.passed,
        )
        for channel in CHANNELS
        for tried in told.ranked(diagnosis, channel)
    ]


def _next(planned: NextExperiment | None, test: Test) -> view.Next | None:
    if planned is None or not planned.steps:
        return None
    wanted = CHANNEL[planned.channel_wanted] if planned.channel_wanted else ""
    return view.Next(
        why=planned.why[:1].upper() + planned.why[1:], history=history_toml(planned, test), channel_wanted=wanted
    )


def history_toml(planned: NextExperiment, test: Test) -> str:
    """The planned history as a [history] table ready for a definition."""
    revolutions = test.resolved["history"]["revolutions_per_iteration"]
    lines = [
        f"  {{ creepage_percent = {float(step['creepage_percent']):.6g}, iterations = {int(step['iterations'])} }},"
        for step in planned.steps
    ]
    return "\n".join(["[history]", f"revolutions_per_iteration = {revolutions:.10g}", "steps = [", *lines, "]"])


def _validation(tests: Sequence[Test], validate: Test | None) -> str:
    if validate is None:
        return ""
    fitted = listed([test.experiment.name for test in tests])
    name = validate.experiment.name
    return f"{name} was not fitted: it is predicted by what was found from {fitted}, without the effects and with them."


def _source(test: Test, diagnosis: Diagnosis, role: str) -> view.Source:
    experiment, measured = test.experiment, test.experiment.measured
    counts = {"traction": measured.traction, "profile": measured.profile, "temperature": measured.temperature}
    return view.Source(
        name=experiment.name,
        description=experiment.description,
        role=role,
        provenance=measured.provenance,
        measured=listed([CHANNEL[channel] for channel, samples in counts.items() if samples is not None]) or "nothing",
        declared=listed([plain_name(name) for name in experiment.effects]),
        held_out=_held_out(test, diagnosis) if role == "fitted" else "",
        files=sorted(test.inputs.items()),
    )


def _held_out(test: Test, diagnosis: Diagnosis) -> str:
    """Steps held out, from 1 as the user counts them, and how many samples of each channel."""
    creepage = test.experiment.history.step_creepage
    steps = diagnosis.held_out_steps.get(test.experiment.name, ())
    named = [f"{step + 1} ({100.0 * creepage[step]:g} %)" for step in steps]
    parts = [f"step{'s' if len(named) > 1 else ''} {listed(named)}"] if named else []
    parts.append("the last iteration of every second other step where it is long enough")
    if test.experiment.measured.profile is not None:
        parts.append(f"every {EVERY}th of {BANDS} bands across the track")
    curves = [curve for curve in diagnosis.curves if curve.test == test.experiment.name]
    return f"{listed(parts)}; in samples, {listed([_share(curve) for curve in curves])}"


def _share(curve: Curve) -> str:
    return f"{int(np.sum(curve.held_out))} of {len(curve.held_out)} of the {CHANNEL[curve.channel]}"
