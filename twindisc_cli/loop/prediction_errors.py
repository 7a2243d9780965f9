"""Errors of tests that were not fitted, as an answer predicts them, and what they say against it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import ChannelError, PredictedErrors, PredictedLevel
from twindisc_cli.loop.explain import Outcome
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.levels import Levels, apart_from_others, is_apart
from twindisc_cli.loop.mixture import Mixture
from twindisc_cli.loop.problem import Case
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.loop.validate import PredictedTest, at_its_own_level, drawn_levels, predict_test, rms
from twindisc_cli.model.experiment import Experiment

OTHER_KIND = "are its surfaces, its load and its zeros those of the others?"


def prediction_errors(outcome: Outcome, case: Case) -> PredictedErrors:
    """Errors of a test that was not fitted: as predicted, and with its own level known."""
    first = predict_test(case, outcome.judged.before)
    last = [predict_test(case, member.after) for member in outcome.mixture.members]
    own = at_its_own_level(first), [at_its_own_level(each) for each in last]
    levels = (
        _predicted_levels(last[0], own[1][0], outcome.judged.after),
        _predicted_levels(first, own[0], outcome.judged.before),
    )
    mixture = outcome.mixture.on_all
    errors = _predicted_errors(first, last, mixture), _predicted_errors(*own, mixture)
    return PredictedErrors(case.test.name, *errors, *levels)


def _predicted_levels(predicted: PredictedTest, own: PredictedTest, fitted: Fit) -> dict[str, PredictedLevel]:
    """The level of a test as a fit of others predicts it, beside its own, by key, where they differ."""
    drawn = drawn_levels(fitted)
    return {
        key: PredictedLevel(float(value), *drawn.get(key, (np.nan, np.nan)), float(own.level[key]))
        for key, value in predicted.level.items()
        if np.isfinite(value) and own.level[key] != value
    }


def _predicted_errors(first: PredictedTest, last: Sequence[PredictedTest], mixture: Mixture) -> dict[str, ChannelError]:
    """Errors of each channel by the base model, and by the average over the explanations."""
    errors = {}
    for channel, noise in first.case.noise.items():
        of = channels()[channel]
        before = of.factor * first.error(channel)
        weights = mixture.weights_at(channel, first.case.model, first.prediction)[:, noise.order]
        after = of.factor * rms(np.sum(weights * np.array([each.misses(channel) for each in last]), axis=0))
        if np.isfinite(before):
            errors[channel] = ChannelError(
                of.unit, of.factor * noise.std, noise.correlation, np.nan, np.nan, before, after, not noise.estimated
            )
    return errors


def tests_apart(levels: Mapping[str, Levels], tests: Sequence[Experiment]) -> list[str]:
    """Tests whose level lies apart from those of the others."""
    return [
        f"{tests[number].name}: its {key} is {times:.2g} times that of the other tests, which agree: {OTHER_KIND}"
        for key, of in levels.items()
        for number, times in apart_from_others(of)
    ]


def predicted_badly(predictions: Sequence[PredictedErrors], *, given: bool = True) -> list[str]:
    """Tests that were not fitted whose level lies apart, or of which the answer misses a channel, or the base model
    predicts it better.

    given: whether anything was found that could be wrong there.
    """
    notes = [
        f"{predicted.test}: its {key} is {level.own / level.predicted:.2g} times that of the tests fitted: {OTHER_KIND}"
        for predicted in predictions
        for key, level in predicted.level.items()
        if key in _levels_apart(predicted.level)
    ]
    return notes + [
        f"{predicted.test}: on this other history the {channels()[channel].label} is {how}"
        for predicted in predictions
        for channel, error in predicted.errors.items()
        if (how := _how_badly(error, predicted.missed(channel), given=given))
    ]


def contradicted_by(predicted: PredictedErrors) -> set[str]:
    """Channels that the base model predicts better than the answer, with the level of the test known, too.

    Or as well, where by the answer alone that level lies apart from those of the tests fitted.
    """
    own = predicted.at_own_level
    lifted = _levels_apart(predicted.level) - _levels_apart(predicted.level_before)
    by_level = {c for c in own if any(base.key in lifted for base in channels()[c].parameters)}
    return {c for c, e in predicted.errors.items() if _is_worse(e) and (c in by_level or _is_worse(own[c]))}


def missed_by(predicted: PredictedErrors) -> set[str]:
    """Channels that the answer misses with the level of the test known, too."""
    return {channel for channel in predicted.errors if predicted.missed(channel) > ACCEPTANCE.missed}


def _levels_apart(levels: Mapping[str, PredictedLevel]) -> set[str]:
    """Base parameters of which a test that was only predicted has a level apart from those of the tests fitted."""
    return {key for key, level in levels.items() if is_apart(level.off, level.scatter)}


def _is_worse(error: ChannelError) -> bool:
    """Whether the answer predicts worse than the base model, and than the noise."""
    return error.held_out_after > max(
        (1.0 + ACCEPTANCE.growth) * error.held_out_before, ACCEPTANCE.predicted * error.noise
    )


def _how_badly(error: ChannelError, missed: float, *, given: bool) -> str:
    """What is wrong with a prediction that misses the samples by so many times their noise, if anything."""
    before, after = error.held_out_before, error.held_out_after
    if _is_worse(error):
        return f"predicted worse than by the base model, {after / before:.2f} times its error"
    if missed > ACCEPTANCE.missed:
        noise = "assumed noise" if error.assumed else "noise"
        why = "what was found does not hold there, or more is missing" if given else "something is missing there"
        return f"missed by {missed:.1f} times its {noise}: {why}"
    return ""
