"""The closed loop from measured tests to a diagnosis: search, joint refit, errors on held-out data, next experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
from twindisc_cli.loop.fit import Fit, at, fit, settled
from twindisc_cli.loop.holdout import held_out_steps, training_masks
from twindisc_cli.loop.problem import DRIVEN, Case, Problem, Role, channels_of, friction_is_given, noise_of, stated
from twindisc_cli.loop.screen import Leftover, leftover
from twindisc_cli.loop.search import (
    ALARM,
    SHORT,
    Candidate,
    Finding,
    akaike,
    free_friction,
    recorded_stops,
    refit,
    search,
    weigh,
    with_nuisance_of,
)
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.model.forward import ForwardModel, Prediction
from twindisc_cli.model.points import sample_times

COVARIATES = 2
RIVALS = 5
NEGLIGIBLE = 1e-4
CLOSED = 1.15
"""A channel is closed where its error is within so much of the noise."""
SURPRISE = 0.001
"""Significance at which samples that were held out say that something is missing where the others say nothing."""
SPARE_STOPS = 3
"""Fewer profiles beyond the parameters than this hardly test the form of a law of wear."""
INTERVAL = 2.706
"""Growth of chi2 at the ends of a 90 % interval."""
Progress = Callable[[str, float], None]


def diagnose(tests: Sequence[Experiment], *, validate: Experiment | None, progress: Progress) -> Diagnosis:
    """Find what the model lacks in these tests.

    Raises ValueError where the tests cannot be diagnosed: nothing measured, or nothing that fixes the friction.
    """
    started = monotonic()
    cases = [_case(test) for test in tests]
    channels = tuple(c for c in UNITS if any(c in case.noise for case in cases))
    if not channels:
        raise ValueError("nothing is measured: a closed loop needs traction, a profile or a temperature")
    if any("traction" not in case.noise and not friction_is_given(case.test) for case in cases):
        raise ValueError("nothing fixes the friction: a closed loop needs the traction measured or mu given")
    whole = Problem(cases, channels)
    progress("base model", 0.05)
    before = plain_fit(whole)
    whole = replace(whole, cases=remembered(whole.cases, before))
    findings = search(whole, lambda channel: progress(f"effects seen in the {channel}", 0.1))
    progress("all channels together", 0.7)
    findings, joint = _together(whole, findings)
    progress("errors and intervals", 0.85)
    left = _left(joint, findings)
    sure = as_estimated(joint)
    effects = [effect for finding in findings if finding.chosen is not None for effect in _found(finding, sure)]
    verdict: Verdict = "effects_found" if effects else "unexplained" if left else "no_missing_effect"
    after = _afterwards(whole, sure, findings)
    progress("next experiment", 0.95)
    return Diagnosis(
        verdict=verdict,
        effects=effects,
        unexplained=left,
        errors={channel: _error(before, after[channel], channel) for channel in channels},
        base=_base(after[channels[-1]], sure) | _base(after[channels[0]], sure),
        tried=[_tried(finding.channel, c) for finding in findings if finding.missing for c in finding.candidates],
        curves=_curves(before, after),
        p_values={finding.channel: finding.p_value for finding in findings},
        held_out_steps={case.test.name: _steps_held(case.test) for case in cases},
        notes=_notes(cases, findings),
        next_experiment=_next(findings, joint, left),
        validation=_validated(validate, before, after[channels[0]]) if validate is not None else None,
        seconds=monotonic() - started,
    )


def plain_fit(problem: Problem, *known: Fit) -> Fit:
    """Fit without nuisances, each base parameter to its own channel: what an effect-free identification would give.

    A channel that misses an effect then does not pull at the parameters of the others. `known` fits give start values.
    """
    theta, cases = _carried(problem, *known), remembered(problem.cases, *known)
    names = [(p.name, p.case) for p in problem.parameters]
    for channel in problem.in_order:
        part = replace(problem, channels=(channel,), nuisance=None, cases=cases)
        alone = fit(part, _carried(part, *known))
        cases = settled(cases, alone)
        for p, inner in zip(alone.problem.parameters, alone.theta, strict=True):
            theta[names.index((p.name, p.case))] = inner
    return at(problem, theta)


def remembered(cases: Sequence[Case], *fits: Fit) -> list[Case]:
    """The cases with K and convection as fitted earlier, for where these are not fitted."""
    found = [
        {key: float(value[0]) for f in fits for key, value in f.problem.own_base(number, f.theta[None]).items()}
        for number in range(len(cases))
    ]
    return [replace(case, known={**case.known, **values}) for case, values in zip(cases, found, strict=True)]


def _steps_held(test: Experiment) -> tuple[int, ...]:
    return test.hold_out_steps or held_out_steps(test.history)


def _case(test: Experiment) -> Case:
    return Case(ForwardModel(test), noise_of(test), training_masks(test, _steps_held(test)))


def _carried(problem: Problem, *fits: Fit) -> Floats:
    """Inner start values of a problem, taken from earlier fits where these had the parameter."""
    known = {
        (p.name, p.case): float(value)
        for fitted in fits
        for p, value in zip(fitted.problem.parameters, fitted.theta, strict=True)
    }
    return np.array([known.get((p.name, p.case), p.inner(p.start)) for p in problem.parameters])


def _together(whole: Problem, findings: list[Finding]) -> tuple[list[Finding], Fit]:
    """Refit all explained channels jointly; rivals are weighed by all of them."""
    explained = [f for f in findings if f.chosen is not None or not f.missing]
    if not explained:
        return findings, findings[0].base
    names = [name for f in explained if f.chosen for name in f.chosen.names]
    problem = replace(whole, channels=tuple(f.channel for f in explained), effects=tuple(names))
    if not any(f.channel == "traction" for f in explained):
        last = max(findings, key=lambda f: DRIVEN.index(f.channel)).base.problem
        problem = replace(problem, cases=last.cases, settled=last.settled)
    joint = refit(problem, _carried(problem, *(f.chosen.fit if f.chosen else f.base for f in explained)))
    for number, finding in enumerate(findings):
        rivals = [c for c in finding.candidates if c.passed and c.probability > NEGLIGIBLE][:RIVALS]
        if finding.chosen is None or len(rivals) < 2:
            continue
        others = [name for name in joint.effects if name not in finding.chosen.names]
        weighed = weigh([_jointly(joint, others, rival) for rival in rivals])
        best = max(weighed, key=lambda c: c.probability)
        rest = [c for c in finding.candidates if c.names not in {w.names for w in weighed}]
        findings[number] = replace(finding, candidates=[*weighed, *rest], chosen=best)
        joint = best.fit
    return findings, joint


def _jointly(joint: Fit, others: Sequence[str], rival: Candidate) -> Candidate:
    """A rival explanation fitted to all explained channels, beside the effects of the other channels."""
    problem = joint.problem.with_effects(*others, *rival.names)
    fitted = fit(problem, _carried(problem, rival.fit, joint))
    return replace(rival, fit=fitted, evidence=akaike(fitted) - akaike(joint))


def _left(joint: Fit, findings: Sequence[Finding]) -> list[Unexplained]:
    """What stays unexplained, with the covariates that say most.

    Also what only the held-out samples show: the model fails to predict them.
    """
    found: list[Unexplained] = []
    revised = everywhere(joint)
    for finding in findings:
        if finding.missing and finding.chosen is None:
            found += _listed(finding.before, finding.base)
        elif finding.channel in joint.problem.channels:
            rest = leftover(revised, finding.channel)
            explained = np.sqrt(max(finding.chosen.gain, 0.0)) if finding.chosen else 0.0
            open_ = rest.length > SHORT * explained or _power(revised, finding.channel) > CLOSED**2
            if rest.significant(ALARM if finding.missing else SURPRISE) and open_:
                found += _listed(rest, revised)
    return found


def as_estimated(fitted: Fit) -> Fit:
    """The fit under the noise as estimated: the caution of the tests of significance would widen the intervals."""
    cases = [
        replace(case, noise={channel: replace(noise, cautious=None) for channel, noise in case.noise.items()})
        for case in fitted.problem.cases
    ]
    return refit(replace(fitted.problem, cases=cases), fitted.theta)


def everywhere(fitted: Fit) -> Fit:
    """The same model on all samples, with those held out, to which it is not fitted."""
    problem, theta = fitted.problem, fitted.theta
    cases = [
        replace(c, train={channel: np.ones_like(used) for channel, used in c.train.items()}) for c in problem.cases
    ]
    return at(with_nuisance_of(at(replace(problem, cases=cases, nuisance=None), theta)), theta)


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


def _afterwards(whole: Problem, joint: Fit, findings: Sequence[Finding]) -> dict[Channel, Fit]:
    """The revised model of each channel: the effects found are declared, as the revised definition will say.

    Where the friction stays unexplained, the other channels are judged with friction as it was measured.
    """
    cases = [
        replace(case, model=replace(case.model, experiment=replace(case.test, effects=other.test.effects)))
        for case, other in zip(whole.cases, settled(whole.cases, joint), strict=True)
    ]
    revised = plain_fit(replace(whole, cases=cases), joint)
    after = dict.fromkeys(whole.channels, revised)
    if any(f.channel == "traction" and f.missing and f.chosen is None for f in findings):
        freed = replace(whole, cases=[free_friction(case) for case in cases], channels=whole.channels[1:])
        if freed.channels:
            after.update(dict.fromkeys(freed.channels, plain_fit(freed, joint)))
    return after


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


def _error(before: Fit, after: Fit, channel: Channel) -> ChannelError:
    cases = before.problem.cases
    unit, factor = UNITS[channel]
    first, last = (fitted.problem.predict(fitted.theta[None]) for fitted in (before, after))
    noises = [case.noise[channel] for case in cases if channel in case.noise]
    return ChannelError(
        unit=unit,
        noise=factor * float(np.sqrt(np.mean([n.std**2 for n in noises]))),
        correlation=float(np.mean([n.correlation for n in noises])),
        before=factor * _rms(cases, first, channel, "train"),
        after=factor * _rms(cases, last, channel, "train"),
        held_out_before=factor * _rms(cases, first, channel, "held_out"),
        held_out_after=factor * _rms(cases, last, channel, "held_out"),
    )


def _rms(cases: Sequence[Case], predictions: Sequence[Prediction], channel: Channel, role: Role) -> float:
    """Root mean square of measured minus predicted over all tests; NaN without samples."""
    misses = [
        (case.values(channel) - getattr(p, channel)[0])[case.used(channel, role)]
        for case, p in zip(cases, predictions, strict=True)
        if channel in case.noise
    ]
    everything = np.concatenate(misses)
    return float(np.sqrt(np.mean(everything**2))) if len(everything) else float("nan")


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


def _curves(before: Fit, after: Mapping[Channel, Fit]) -> list[Curve]:
    first = before.problem.predict(before.theta[None])
    last = {channel: fitted.problem.predict(fitted.theta[None]) for channel, fitted in after.items()}
    return [
        Curve(
            test=case.test.name,
            channel=channel,
            measured=case.values(channel),
            before=getattr(first[number], channel)[0],
            after=getattr(last[channel][number], channel)[0],
            held_out=~case.train[channel],
            kept=case.noise[channel].kept,
            covariates=_covariates(case, channel, first[number]),
            provenance=case.test.measured.provenance,
        )
        for number, case in enumerate(before.problem.cases)
        for channel in case.noise
    ]


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


def _notes(cases: Sequence[Case], findings: Sequence[Finding]) -> list[str]:
    """What the reader must know to weigh the verdict."""
    notes = []
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
        profile = case.test.measured.profile
        if profile is not None and len(np.unique(np.stack([profile.disc, profile.iteration]), axis=1).T) == 1:
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


def _next(findings: Sequence[Finding], joint: Fit, left: Sequence[Unexplained]) -> NextExperiment | None:
    """Separate the models alive; else a history that tells the covariates of the leftover apart."""
    history = joint.problem.cases[0].test.history
    for finding in findings:
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
    case = replace(_case(test), train={c: np.zeros(len(n.kept), dtype=bool) for c, n in noise_of(test).items()})
    known = _known_elsewhere(case, after)
    predictions = [_predict_other(case, fitted) for fitted in (before, after)]
    errors = {}
    for channel, noise in case.noise.items():
        if NEEDED[channel] in known:
            unit, factor = UNITS[channel]
            first, last = (factor * _rms([case], [p], channel, "held_out") for p in predictions)
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
