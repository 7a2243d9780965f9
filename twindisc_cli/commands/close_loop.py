"""close-loop: what the model of a test lacks, found, added, and judged on data that were not used."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from twindisc_cli.commands._base import laws_beyond
from twindisc_cli.commands._loop_data import dataset_of
from twindisc_cli.commands._step_friction import with_step_friction
from twindisc_cli.consistency import contradictions
from twindisc_cli.definition import Test, dump, law_table, relocate
from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Param
from twindisc_cli.errors import NEGATIVE_FINDING, DefinitionError, Problem
from twindisc_cli.identify.steps import refuse_reversed
from twindisc_cli.loop.averaging import averaged
from twindisc_cli.loop.channels import channels, measured_channels, place_of
from twindisc_cli.loop.channels.traction import friction_is_given
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import (
    ChannelError,
    Diagnosis,
    Estimate,
    FoundEffect,
    FoundLaw,
    FoundTerm,
    NextExperiment,
    PredictedErrors,
)
from twindisc_cli.loop.terms import Alternative, EffectTerm
from twindisc_cli.report import sentences
from twindisc_cli.report.close_loop import render
from twindisc_cli.report.levels import level_json
from twindisc_cli.report.words import channel_name, listed, number, p_value, percent, sentence, unit, with_error
from twindisc_cli.results import Result, or_null
from twindisc_cli.version import __version__

LINES = 10  # on the terminal, which stay in view
DIGITS = 7  # of a law: its curve comes back to the width of a line


def run(
    tests: Sequence[Test],
    validate: Test | None,
    progress: Callable[[str, float], None],
    *,
    quick: bool = False,
    predict: Sequence[Test] = (),
) -> Result:
    """Diagnose the tests together; `validate` and `predict` are only predicted. Exit code 5: cause in no catalogue.

    quick: no resampling, and so no probabilities.
    """
    predicted = [*predict, *([validate] if validate else [])]
    _refuse(tests, predicted)
    given = [test.experiment for test in (*tests, *predicted)]
    for test in given:
        refuse_reversed(test)
    used = [f"{test.name}: {what}" for test in given for what in contradictions(test)]
    used += [note for test in tests for note in laws_beyond(test.experiment)]
    every = [averaged(test) for test in given]
    used += [note for _, notes in every for note in notes]
    experiments, others = ([test for test, _ in part] for part in (every[: len(tests)], every[len(tests) :]))
    unseen = others.pop() if validate else None
    diagnosis = diagnose(experiments, validate=unseen, progress=progress, quick=quick, predict=others)
    errors = with_step_friction(diagnosis, experiments)
    tests = [replace(test, experiment=own) for test, own in zip(tests, experiments, strict=True)]
    return result_of(replace(diagnosis, errors=errors, notes=[*used, *diagnosis.notes]), tests, validate)


def result_of(diagnosis: Diagnosis, tests: Sequence[Test], validate: Test | None) -> Result:
    """A diagnosis as summary, JSON, arrays, figure, page and revised definition."""
    from twindisc_cli.figures.close_loop import figure
    from twindisc_cli.figures.loop_plots import plots_of
    from twindisc_cli.results.drawn import png

    title = f"{listed([t.experiment.name for t in tests])}: closed loop"
    kinds = [test.experiment.measured.provenance for test in tests]
    experiments = [test.experiment for test in tests]
    verdict = sentences.sentences(diagnosis)[0]
    draw = partial(figure, diagnosis, experiments, title=title, provenance=sentences.provenance(kinds), verdict=verdict)
    every = list(diagnosis.errors)
    several = {f"close-loop-{c}": partial(draw, channel=c) for c in every} if len(every) > 1 else {}
    one = partial(draw, short=True) if several else draw
    drawn = {name: png(own()) for name, own in (several or {"close-loop": one}).items()}
    return Result(
        command="close-loop",
        summary=tuple(summary(diagnosis)),
        json=or_null(_json(diagnosis)),
        dataset=dataset_of(diagnosis),
        figure=one,
        figures=several,
        drawn=drawn,
        exit_code=NEGATIVE_FINDING if diagnosis.verdict == "unexplained" else 0,
        extra_files={
            "close-loop.html": render(
                diagnosis,
                tests,
                validate,
                figures=dict(zip(every, drawn.values(), strict=True)),
                plots=plots_of(diagnosis, experiments),
            ),
            "revised.toml": revised(diagnosis, tests[0]),
            **{f"revised-{test.experiment.name}.toml": _beside(tests[0], test, diagnosis) for test in tests[1:]},
        },
    )


def _refuse(tests: Sequence[Test], predicted: Sequence[Test]) -> None:
    """Every test must bring something to compare with, and those that are fitted must fix the friction."""
    what = "names no data that can be compared: give a traction, a profile, a mass, or a temperature with [thermal]"
    every = [*tests, *predicted]
    problems = [Problem(what, test.path, key="measured") for test in every if not measured_channels(test.experiment)]
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


# ------------------------------------------------------------------------------------------------- for the terminal


def summary(diagnosis: Diagnosis) -> list[str]:
    """At most ten lines: verdict, errors, what was added, open questions, base parameters, what other tests say, the
    next experiment, notes.

    Where these are more, notes give way first, then the details of what was added: the verdict names it.
    """
    verdict = " ".join([sentences.sentences(diagnosis)[0], *sentences.between(diagnosis)])
    head = [f"{diagnosis.verdict}: {verdict}"]
    if diagnosis.difference:
        head.append(f"{sentence(diagnosis.difference)}.")
    head += [_error_line(channel_name(channel), error) for channel, error in diagnosis.errors.items()]
    terms = [_term_line(term) for terms in sentences.together(diagnosis).values() for term in terms]
    notes, least = [f"note: {note}" for note in diagnosis.notes], bool(diagnosis.notes)
    beyond = _beyond_the_terms(diagnosis)[: LINES - len(head) - least]
    shown = _cut(terms, LINES - len(head) - len(beyond) - least, "terms")
    return [*head, *shown, *beyond, *_cut(notes, LINES - len(head) - len(shown) - len(beyond), "notes")]


def _cut(lines: Sequence[str], room: int, what: str) -> list[str]:
    """The lines that there is room for; where not for all, the last says how many more there are."""
    if len(lines) <= room or room < 1:
        return list(lines[: max(room, 0)])
    more = len(lines) - room + 1
    return [*lines[: room - 1], f"{more} {'more ' if room > 1 else ''}{what} in close-loop.html"]


def _beyond_the_terms(diagnosis: Diagnosis) -> list[str]:
    """What stays open, the base parameters, tests that were only predicted, the next experiment."""
    lines = []
    if diagnosis.not_excluded:
        beside = [f"{other.term} ({percent(other.probability)})" for other in diagnosis.not_excluded]
        lines.append(f"not excluded, chosen in some resamples on too little evidence: {listed(beside, 'or')}")
    if diagnosis.unexplained and diagnosis.verdict != "unexplained":
        least = p_value(min(left.p_value for left in diagnosis.unexplained))
        lines.append(f"unexplained: {listed(sentences.open_questions(diagnosis))} ({least})")
    lines += sentences.scatter(diagnosis)
    base = [f"{name} = {_value_text(e)}" for name, e in diagnosis.base.items()]
    with_what = ", with what was added (use them with revised.toml)" if sentences.together(diagnosis) else ""
    what_is_meant = " (± one standard deviation)" if any("±" in text for text in base) else ""
    lines += [f"base{with_what}: {', '.join(base)}{what_is_meant}"] if base else []
    if diagnosis.validation is not None:
        lines.append(f"predicted, not fitted, used in the choice: {_predicted_line(diagnosis.validation)}")
    lines += [f"predicted, used in nothing: {_predicted_line(predicted)}" for predicted in diagnosis.predictions]
    lines += sentences.levels(diagnosis)
    return [*lines, *([f"next: {diagnosis.next_experiment.why}"] if diagnosis.next_experiment is not None else [])]


def _value_text(estimate: Estimate) -> str:
    """A parameter with its standard deviation; with its 90 % interval where that is larger than half of it."""
    e = estimate
    if not e.std > 0.5 * abs(e.value):
        return with_error(e.value, e.std, e.unit)
    return f"{number(e.value, 2)} {unit(e.unit)}".rstrip() + f" (90 %: {number(e.low, 2)} to {number(e.high, 2)})"


def _predicted_line(predicted: PredictedErrors) -> str:
    """Errors of a test that was only predicted; with its own level known where that is another."""
    parts = [f"{channel_name(c)} {_before_after(e)}" for c, e in predicted.errors.items()]
    own = [f"{channel_name(c)} {_before_after(e)}" for c, e in predicted.at_own_level.items()]
    level = [
        f"{key} {number(of.own)} for {number(of.predicted)}, {number(of.low)} to {number(of.high)} expected"
        for key, of in predicted.level.items()
    ]
    known = f"; with its own level ({'; '.join(level)}): {', '.join(own)}" if level else ""
    return f"{predicted.test}: {', '.join(parts)}{known}"


def _before_after(error: ChannelError) -> str:
    return f"{number(error.held_out_before)} -> {number(error.held_out_after)} {unit(error.unit)}".rstrip()


def _error_line(channel: str, error: ChannelError) -> str:
    fitted = f"error {number(error.before)} -> {number(error.after)} {unit(error.unit)}".rstrip()
    noise = f"noise {number(error.noise)}{' (assumed)' * error.assumed}"
    known = np.isfinite(error.before_step_mu)
    stepwise = f" (before, with mu of each step: {number(error.before_step_mu)})" if known else ""
    held_out = f", held out {_before_after(error)}" if np.isfinite(error.held_out_before) else ""
    return f"{channel}: {fitted}{stepwise}{held_out}, {noise}"


def _term_line(term: FoundTerm) -> str:
    """An effect with its parameters, or a law with its formula; how sure, how much, and what else it may be."""
    if isinstance(term, FoundEffect):
        values = [f"{key} = {_value_text(e)}" for key, e in term.parameters.items()]
        parts = [f"{term.key} ({', '.join(values)}): {sentences.sureness(term)}"]
    else:
        parts = [
            f"{term.key}: {sentences.law_text(term)}: {sentences.sureness(term)}",
            sentences.transfer_text(term.law),
        ]
        parts += [f"resembles {sentences.resembles_text(term)}"] if term.resembles else []
    parts += [sentences.taken(term)] if sentences.taken(term) else []
    others = [str(alternative.term) for alternative in term.alternatives]
    return "; ".join(parts + ([f"cannot be separated from {listed(others, 'or')}"] if others else []))


# ------------------------------------------------------------------------------------------------- for scripts


def _json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The outcome for scripts."""
    return {
        "verdict": diagnosis.verdict,
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "laws": [_law(result) for result in diagnosis.laws],
        "not_excluded": [_alternative(alternative) for alternative in diagnosis.not_excluded],
        "unexplained": [
            {key: getattr(left, key) for key in ("channel", "covariate", "kind", "share_of_variance", "p_value")}
            for left in diagnosis.unexplained
        ],
        "error": _errors(diagnosis.errors),
        "base": {name: _estimate(e) for name, e in diagnosis.base.items()},
        "explanations": {c: _explanations(diagnosis, c) for c in diagnosis.errors},
        "next_experiment": _next(diagnosis.next_experiment),
        "revised": "revised.toml",
        "validation": None if diagnosis.validation is None else _prediction(diagnosis.validation),
        "prediction": [_prediction(predicted) for predicted in diagnosis.predictions],
        "step_scatter": [{**vars(each), "varied_with": dict(each.varied_with)} for each in diagnosis.step_scatter],
        "levels": {key: level_json(of, list(diagnosis.held_out_steps)) for key, of in diagnosis.levels.items()},
        "held_out": {"blind": diagnosis.blind},
        "search": {"same_on_all": diagnosis.same_on_all},
        "hold_out_steps": {test: [step + 1 for step in steps] for test, steps in diagnosis.held_out_steps.items()},
        "p_value": dict(diagnosis.p_values),
        "notes": [*([diagnosis.difference] if diagnosis.difference else []), *diagnosis.notes],
    }


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "effect": effect.name,
        **_test(effect.test),
        "channel": effect.channel,
        "parameters": {key: _estimate(e) for key, e in effect.parameters.items()},
        "alternatives": [str(alternative.term) for alternative in effect.alternatives],
        **_sure(effect),
    }


def _law(result: FoundLaw) -> dict[str, Any]:
    law, curve = result.law, result.curve
    return {
        "law": result.name,
        **_test(result.test),
        "channel": result.channel,
        "quantity": law.quantity,
        "covariate": law.covariate,
        "form": law.shape or "curve",
        "formula": result.formula,
        "curve": {key: getattr(curve, key).tolist() for key in ("at", "value", "low", "high")},
        "parameters": {key: _estimate(e) for key, e in result.parameters.items()},
        "resembles": [{"effect": name, "share": share} for name, share in result.resembles],
        "alternatives": [_alternative(alternative) for alternative in result.alternatives],
        **_sure(result),
        "transfer": law.transfer,
        "valid": list(law.valid) if law.valid else None,
    }


def _alternative(alternative: Alternative) -> dict[str, Any]:
    """What cannot be separated from a law or nothing: an effect, or a quantity and a covariate; its probability."""
    term = alternative.term
    law = {} if isinstance(term, EffectTerm) else {"quantity": term.quantity, "covariate": term.covariate}
    what = {"effect": term.name} if isinstance(term, EffectTerm) else law
    return {**what, **_test(term.test), **_probability(alternative.probability)}


def _test(name: str) -> dict[str, str]:
    """The only test that a term acts in; absent where it acts in all."""
    return {"test": name} if name else {}


def _sure(term: FoundTerm) -> dict[str, Any]:
    """How sure, and what is left of the misfit it takes away."""
    return {**_probability(term.probability), "strength": term.strength, "remains": term.remains}


def _probability(value: float) -> dict[str, float]:
    """The probability; absent where it was not computed."""
    return {"probability": float(value)} if np.isfinite(value) else {}


def _explanations(diagnosis: Diagnosis, channel: str) -> list[dict[str, Any]]:
    """Every explanation within reach of the best, the one given first."""
    return [
        {
            "label": str(tried.term),
            "in_place_of": tried.replaces,
            "gain": float(tried.gain),
            "evidence": float(tried.evidence),
            **_probability(sentences.probability(diagnosis, tried)),
            "remains": tried.remains,
            "at_bound": list(tried.at_bound),
            "refused": tried.why_not,
            "chosen": tried.chosen,
        }
        for tried in sentences.ranked(diagnosis, channel)
    ]


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {key: getattr(estimate, key) for key in ("value", "std", "low", "high", "unit")}


def _errors(errors: Mapping[str, ChannelError]) -> dict[str, Any]:
    """Every channel; an empty object for one that was not measured."""
    keys = ("unit", "noise", "before", "before_step_mu", "after", "held_out_before", "held_out_after")
    return {c: {key: getattr(errors[c], key) for key in keys} if c in errors else {} for c in channels()}


def _prediction(predicted: PredictedErrors) -> dict[str, Any]:
    """Errors of a test that was only predicted, with the level of the tests fitted and with its own."""
    return {
        "test": predicted.test,
        "error": _errors(predicted.errors),
        "error_at_own_level": _errors(predicted.at_own_level),
        "levels": {key: {**vars(of), "inside": of.inside} for key, of in predicted.level.items()},
    }


def _next(planned: NextExperiment | None) -> dict[str, Any]:
    if planned is None:
        return {"why": "nothing is left to be separated", "steps": []}
    return {
        "why": planned.why,
        "steps": [{**step, "iterations": int(step["iterations"])} for step in planned.steps],
        "rivals": list(planned.rivals),
        "separation": planned.separation,
        "separation_now": planned.separation_now,
        "channel_wanted": planned.channel_wanted,
    }


# ------------------------------------------------------------------------------------------------- revised.toml


def revised(diagnosis: Diagnosis, test: Test) -> str:
    """The definition with the effects and laws that were added and the base parameters that were identified."""
    document: dict[str, Any] = copy.deepcopy(dict(test.resolved))
    for estimate in diagnosis.base.values():
        if estimate.test in ("", test.experiment.name):
            *tables, place = place_of(estimate.parameter)
            within = document
            for table in tables:
                within = within.setdefault(table, {})
            within.setdefault(place, _rounded(estimate.value))
    own = ("", test.experiment.name)
    found = [effect for effect in diagnosis.effects if effect.test in own]
    params = {effect.name: {p.name: p for p in catalogue()[effect.name].params} for effect in found}
    effects = {
        effect.name: {key: _inside(params[effect.name][key], e.value) for key, e in effect.parameters.items()}
        for effect in found
    }
    learnt = [result for result in diagnosis.laws if result.test in own]
    laws = {result.name: law_table(result.law, digits=DIGITS) for result in learnt}
    return f"{_heading(diagnosis, test, [*found, *learnt])}\n{dump(document, effects, laws)}"


def _beside(first: Test, test: Test, diagnosis: Diagnosis) -> str:
    """The revised definition of another test as it stands beside that of the first."""
    return relocate(revised(diagnosis, test), source=test.path.parent, target=first.path.parent)


def _heading(diagnosis: Diagnosis, test: Test, terms: Sequence[FoundTerm]) -> str:
    result = listed([sentences.name_of(term) for term in terms])
    what = f"with {result} added" if result else "with no effect added"
    return f"# {test.experiment.name}, {what} by twindisc close-loop {__version__} ({diagnosis.verdict})"


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _inside(param: Param, value: float) -> float:
    """The value, rounded, within what a definition allows."""
    ends = (param.lower, param.upper) if param.off is None else (param.lower, param.upper, param.off)
    return float(np.clip(_rounded(value), min(ends), max(ends)))
