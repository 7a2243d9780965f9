"""The closed loop from measured tests to a diagnosis: search, joint refit, errors on held-out data, next experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import monotonic

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Channel
from twindisc_cli.loop.design import next_experiment, up_and_down
from twindisc_cli.loop.diagnosis import (
    UNITS,
    ChannelError,
    Curve,
    Diagnosis,
    Estimate,
    FoundEffect,
    NextExperiment,
    Tried,
    Unexplained,
    Validation,
    Verdict,
)
from twindisc_cli.loop.explain import Explanation, Progress, explain
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.holdout import steps_withheld, withheld, without
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.problem import Case, case_of, channels_of, friction_is_given, stated
from twindisc_cli.loop.screen import Leftover, leftover
from twindisc_cli.loop.search import REFUSAL, SHORT, Candidate, Finding, recorded_stops
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.model.forward import Prediction
from twindisc_cli.model.points import sample_times

COVARIATES = 2
CLOSED = 1.15
"""A channel is closed where its error is within so much of the noise."""
SPARE_STOPS = 3
"""Fewer profiles beyond the parameters than this hardly test the form of a law of wear."""
INTERVAL = 2.706
"""Growth of chi2 at the ends of a 90 % interval."""


def diagnose(tests: Sequence[Experiment], *, validate: Experiment | None, progress: Progress) -> Diagnosis:
    """Find what the model lacks in these tests.

    The answer rests on all samples. How well the answer predicts is judged by a second one, found in the same way as if
    the samples held out had never been measured.

    Raises ValueError where the tests cannot be diagnosed: nothing measured, or nothing that fixes the friction.
    """
    started = monotonic()
    _refuse(tests)
    masks = [withheld(test) for test in tests]
    found = explain(tests, lambda stage, part: progress(stage, 0.05 + 0.45 * part))
    blind = found
    if any(mask.any() for test in masks for mask in test.values()):
        seen = [without(test, mask) for test, mask in zip(tests, masks, strict=True)]
        blind = explain(seen, lambda stage, part: progress(f"{stage}, without what is held out", 0.5 + 0.4 * part))
    progress("errors and intervals", 0.9)
    left = _left(found)
    effects = [effect for finding in found.findings if finding.chosen for effect in _found(finding, found.sure)]
    verdict: Verdict = "effects_found" if effects else "unexplained" if left else "no_missing_effect"
    channels = found.before.problem.channels
    curves = _curves(found, blind, masks)
    progress("next experiment", 0.95)
    return Diagnosis(
        verdict=verdict,
        effects=effects,
        unexplained=left,
        errors={channel: _error(channel, found, curves) for channel in channels},
        base=_base(found.after[channels[-1]], found.sure) | _base(found.after[channels[0]], found.sure),
        tried=[_tried(finding.channel, c) for finding in found.findings if finding.missing for c in finding.candidates],
        curves=curves,
        p_values={finding.channel: finding.p_value for finding in found.findings},
        held_out_steps={test.name: steps_withheld(test) for test in tests},
        notes=_notes(found, blind),
        next_experiment=_next(found, left),
        validation=_validated(validate, found.before, found.after[channels[0]]) if validate is not None else None,
        seconds=monotonic() - started,
    )


def _refuse(tests: Sequence[Experiment]) -> None:
    """Tests that cannot be diagnosed."""
    if not any(channels_of(test) for test in tests):
        raise ValueError("nothing is measured: a closed loop needs traction, a profile or a temperature")
    if any("traction" not in channels_of(test) and not friction_is_given(test) for test in tests):
        raise ValueError("nothing fixes the friction: a closed loop needs the traction measured or mu given")


def _left(found: Explanation) -> list[Unexplained]:
    """What stays unexplained, with the covariates that say most."""
    left: list[Unexplained] = []
    for finding in found.findings:
        if finding.missing and finding.chosen is None:
            left += _listed(finding.before, finding.base)
        elif finding.channel in found.joint.problem.channels:
            rest = leftover(found.joint, finding.channel)
            explained = np.sqrt(max(finding.chosen.gain, 0.0)) if finding.chosen else 0.0
            open_ = rest.length > SHORT * explained or _power(found.joint, finding.channel) > CLOSED**2
            if rest.significant(REFUSAL) and open_:
                left += _listed(rest, found.joint)
    return left


def _power(fitted: Fit, channel: Channel) -> float:
    """Mean square of a channel's white residual: one where only noise is left."""
    return float(np.mean(np.concatenate([fitted.residual[part] for part in fitted.problem.slices[channel]]) ** 2))


def _listed(rest: Leftover, fitted: Fit) -> list[Unexplained]:
    scores = rest.covariates[:COVARIATES] or list(rest.scores[:1])
    return [Unexplained(rest.channel, s.group.covariate, s.group.kind, s.share, s.p_value) for s in scores]


def _found(finding: Finding, joint: Fit) -> list[FoundEffect]:
    """Every effect of the chosen explanation, with what stands in its place in the others that are left."""
    chosen = finding.chosen
    assert chosen is not None
    found = []
    for name in chosen.names:
        without = [c.names for c in finding.alternatives if name not in c.names]
        others = tuple(dict.fromkeys(other for names in without for other in names if other not in chosen.names))
        found.append(
            FoundEffect(
                name=name,
                channel=catalogue()[name].channel,
                parameters={
                    p.key: _estimate(joint, i) for i, p in enumerate(joint.problem.parameters) if p.effect == name
                },
                alternatives=others,
                probability=sum(c.probability for c in finding.candidates if name in c.names),
            )
        )
    return found


def _estimate(fitted: Fit, number: int) -> Estimate:
    """Value, standard deviation and 90 % interval of a parameter by its profile likelihood."""
    parameter = fitted.problem.parameters[number]
    value, std = fitted.value(parameter)
    low, high = (_end(fitted, number, side) for side in (-1.0, 1.0))
    return Estimate(value, std, low, high, parameter.unit)


def _end(fitted: Fit, number: int, side: float) -> float:
    """Where chi2, minimised over the other parameters to second order, has grown by 2.706."""
    problem, theta = fitted.problem, fitted.theta
    lower, upper = problem.bounds
    covariance = fitted.covariance
    direction = covariance[:, number] / covariance[number, number]
    reach = side * np.sqrt(INTERVAL * covariance[number, number])
    for _ in range(4):
        at = np.clip(theta + reach * direction, lower, upper)
        row = problem.discount(problem.white(problem.predict(at[None])) - problem.measured)[0]
        growth = float(row @ row) - fitted.chi2
        moved = at[number] - theta[number]
        if growth <= 0.0 or abs(moved) < 1e-12 or not np.isfinite(growth):
            break
        reach = float(np.clip(moved * np.sqrt(INTERVAL / growth), -4.0 * abs(reach), 4.0 * abs(reach)))
    end = np.clip(theta[number] + reach, lower[number], upper[number])
    return float(problem.parameters[number].outer(end))


def _base(after: Fit, joint: Fit) -> dict[str, Estimate]:
    """Base parameters of the revised model with the spread of the joint fit; several tests add their names."""
    cases = after.problem.cases
    found: dict[str, Estimate] = {}
    for number, p in enumerate(after.problem.parameters):
        own = len(cases) > 1 and p.case is not None
        name = f"{p.name} ({cases[p.case].test.name})" if own and p.case is not None else p.name
        same = [i for i, q in enumerate(joint.problem.parameters) if (q.name, q.case) == (p.name, p.case)]
        spread = _estimate(joint, same[0]) if same else _estimate(after, number)
        value = float(p.outer(after.theta[number]))
        found[name] = replace(
            spread, value=value, low=value + spread.low - spread.value, high=value + spread.high - spread.value
        )
    return found


def _error(channel: Channel, found: Explanation, curves: Sequence[Curve]) -> ChannelError:
    """Errors of one channel: fitted where all samples were seen, held out where these were not."""
    unit, factor = UNITS[channel]
    noises = [case.noise[channel] for case in found.before.problem.cases if channel in case.noise]
    own = [curve for curve in curves if curve.channel == channel]

    def rms(kind: str, *, held_out: bool) -> float:
        misses = [(c.measured - getattr(c, kind))[c.kept & (c.held_out == held_out)] for c in own]
        return factor * _rms(np.concatenate(misses))

    return ChannelError(
        unit=unit,
        noise=factor * float(np.sqrt(np.mean([n.std**2 for n in noises]))),
        correlation=float(np.mean([n.correlation for n in noises])),
        before=rms("before", held_out=False),
        after=rms("after", held_out=False),
        held_out_before=rms("unseen_before", held_out=True),
        held_out_after=rms("unseen_after", held_out=True),
    )


def _rms(misses: Floats) -> float:
    """Root mean square; NaN without samples."""
    return float(np.sqrt(np.mean(misses**2))) if len(misses) else float("nan")


def _tried(channel: Channel, candidate: Candidate) -> Tried:
    return Tried(
        channel=channel,
        effects=candidate.names,
        gain=candidate.gain,
        evidence=candidate.evidence,
        probability=candidate.probability,
        left_p_value=candidate.left.p_value,
        left_length=candidate.left.length,
        at_bound=candidate.fit.at_bound,
        passed=candidate.passed,
    )


def _curves(found: Explanation, blind: Explanation, masks: Sequence[Mapping[Channel, Mask]]) -> list[Curve]:
    """Every channel of every test, by the answer that saw all samples and by the one that did not."""
    cases = found.before.problem.cases
    first, unseen_first = (_predicted(answer.before, cases) for answer in (found, blind))
    curves = []
    for channel in found.after:
        last, unseen_last = (_predicted(answer.after[channel], cases) for answer in (found, blind))
        for number, case in enumerate(cases):
            if channel not in case.noise:
                continue
            before, after, unseen_before, unseen_after = (
                getattr(predictions[number], channel)[0] for predictions in (first, last, unseen_first, unseen_last)
            )
            curves.append(
                Curve(
                    test=case.test.name,
                    channel=channel,
                    measured=case.values(channel),
                    before=before,
                    after=after,
                    unseen_before=unseen_before,
                    unseen_after=unseen_after,
                    held_out=masks[number][channel],
                    kept=case.noise[channel].kept,
                    covariates=_covariates(case, channel, first[number]),
                    provenance=case.test.measured.provenance,
                )
            )
    return curves


def _predicted(fitted: Fit, cases: Sequence[Case]) -> list[Prediction]:
    """Predictions at all samples of these tests by a fit that may have seen fewer of them."""
    whole = [
        replace(
            case,
            model=replace(case.model, experiment=replace(case.test, measured=other.test.measured)),
            known={"K": case.first_wear, "convection_W_K": case.first_convection},
        )
        for case, other in zip(fitted.problem.cases, cases, strict=True)
    ]
    return replace(fitted.problem, cases=whole).predict(fitted.theta[None])


def _covariates(case: Case, channel: Channel, prediction: Prediction) -> dict[str, Floats | Ints]:
    """What a residual may be drawn over, in SI units (sample,)."""
    measured, points, state = case.test.measured, case.model.points, prediction.state
    if channel == "profile" and measured.profile is not None:
        profile = measured.profile
        return {"y": profile.y, "disc": profile.disc, "iteration": profile.iteration}
    if channel == "traction" and measured.traction is not None:
        at = points.of_traction
        own: dict[str, Floats | Ints] = {
            "time": sample_times(case.test.history, measured.traction),
            "creepage": measured.traction.creepage,
        }
    else:
        assert measured.temperature is not None
        at = points.of_temperature
        own = {"time": measured.temperature.time, "creepage": points.creepage[at]}
    return {
        **own,
        "cycles": points.cycles[at],
        "energy": state.energy[0, at],
        "temperature": state.temperature[0, at],
    }


def _notes(found: Explanation, blind: Explanation) -> list[str]:
    """What the reader must know to weigh the verdict."""
    cases, findings = found.before.problem.cases, found.findings
    notes = []
    if set(blind.effects) != set(found.effects):
        notes.append(
            f"without the samples held out the search finds {' and '.join(blind.effects) or 'no effect'}: the held-out "
            f"errors are of that answer"
        )
    for case in cases:
        name = case.test.name
        for channel, noise in case.noise.items():
            if not noise.estimated:
                notes.append(
                    f"{name}: the {channel} has no scatter to estimate its noise from; one percent of its size is "
                    f"assumed, and every significance in that channel rests on this"
                )
        if case.test.effects:
            notes.append(
                f"{name}: {' and '.join(case.test.effects)} declared: the parameters stay as given; taken out of the "
                f"definition, an effect is looked for and fitted"
            )
        missing = [c for c in UNITS if c not in channels_of(case.test)]
        if missing:
            notes.append(f"{name}: {' and '.join(missing)} not measured; effects seen only there stay unseen")
        if len(recorded_stops(case.test)) == 1:
            notes.append(
                f"{name}: a single profile cannot show a wear coefficient that changed over the history; "
                f"profiles at several stops would"
            )
        if len(np.unique(case.test.history.step_creepage)) < 3:
            notes.append(f"{name}: fewer than three creepages; what depends on creepage cannot be told from the rest")
    stops = max((len(recorded_stops(case.test)) for case in cases), default=0)
    for finding in findings:
        for name in finding.chosen.names if finding.chosen else ():
            effect = catalogue()[name]
            if effect.needs_stops and stops - len(effect.params) - 1 < SPARE_STOPS:
                notes.append(
                    f"{stops} profiles fix K and the parameters of {name} and leave little to refuse it: a wear "
                    f"coefficient that changed in another way could look the same"
                )
    if len({replace(case.test.rig, normal_load=0.0, rolling_speed=0.0) for case in cases}) > 1:
        notes.append(
            "the tests are of different rigs or materials; K and the effects are shared between them all the same"
        )
    if any(f.channel == "traction" and f.missing and f.chosen is None for f in findings) and len(findings) > 1:
        notes.append("the unexplained friction was replaced by the measured one to judge the other channels")
    return notes


def _next(found: Explanation, left: Sequence[Unexplained]) -> NextExperiment | None:
    """Separate the models alive; else a history that tells the covariates of the leftover apart."""
    history = found.joint.problem.cases[0].test.history
    for finding in found.findings:
        if finding.chosen is not None:
            rivals = [finding.chosen, *finding.alternatives]
            if len(rivals) == 1:
                rivals += [c for c in finding.candidates if c.names != finding.chosen.names][:1]
            if len(rivals) > 1:
                weights = [max(c.probability, 0.05) for c in rivals]
                alive = [(c.fit, w / sum(weights)) for c, w in zip(rivals, weights, strict=True)]
                return next_experiment(alive, [" + ".join(c.names) for c in rivals])
    if left:
        names = " and ".join(dict.fromkeys(u.covariate for u in left))
        return up_and_down(history, f"the leftover depends on {names}; a history up and down tells time from creepage")
    return None


NEEDED: Mapping[Channel, str] = {"traction": "mu", "profile": "K", "temperature": "convection_W_K"}
"""The base parameter without which a channel of a test that was not fitted cannot be predicted."""


def _validated(test: Experiment, before: Fit, after: Fit) -> Validation:
    """Predict a test that was not fitted, with the base parameters of the first and the effects found."""
    case = case_of(test)
    known = _known_elsewhere(case, after)
    predictions = [_predict_other(case, fitted) for fitted in (before, after)]
    errors = {}
    for channel, noise in case.noise.items():
        if NEEDED[channel] in known:
            unit, factor = UNITS[channel]
            misses = [(case.values(channel) - getattr(p, channel)[0])[noise.kept] for p in predictions]
            first, last = (factor * _rms(miss) for miss in misses)
            errors[channel] = ChannelError(unit, factor * noise.std, noise.correlation, np.nan, np.nan, first, last)
    return Validation(test.name, errors)


def _known_elsewhere(case: Case, fitted: Fit) -> dict[str, float]:
    """Base parameters for another test: as fitted, those of a single test from the first, else as either test says."""
    said = stated(fitted.problem.cases[0].test) | stated(case.test)
    return said | {p.key: fitted.value(p)[0] for p in reversed(fitted.problem.parameters) if p.effect is None}


def _predict_other(case: Case, fitted: Fit) -> Prediction:
    base = {"mu": np.nan, "K": 0.0, "convection_W_K": 1.0, **_known_elsewhere(case, fitted)}
    declared = fitted.problem.cases[0].test.effects
    effects = {name: {key: np.array([v]) for key, v in table.items()} for name, table in declared.items()}
    return case.model.predict({key: np.array([value]) for key, value in base.items()}, effects)
