"""The closed loop from measured tests to a diagnosis: search, judgement on held-out data, probabilities, next test."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence, Set
from dataclasses import replace
from time import monotonic

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.law import Law, formula_text, law_key
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop import free_zero, single_sample
from twindisc_cli.loop.alternatives import Weighed, by_probability, weighed
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.channels.traction import friction_is_given
from twindisc_cli.loop.design import next_experiment, up_and_down
from twindisc_cli.loop.diagnosis import (
    STRENGTHS,
    CandidateResult,
    ChannelError,
    Curve,
    Diagnosis,
    FoundEffect,
    FoundLaw,
    LawCurve,
    NextExperiment,
    Strength,
    Unexplained,
    Verdict,
)
from twindisc_cli.loop.explain import Outcome, Progress, explain, significant_on_all
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.extend import too_few_samples
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.holdout import steps_withheld
from twindisc_cli.loop.intervals import base_parameters
from twindisc_cli.loop.judge import Judged, Kind
from twindisc_cli.loop.learn import confounded, passed_together
from twindisc_cli.loop.levels import levels_of, with_what_differs
from twindisc_cli.loop.notes import (
    across_the_track,
    average_errs,
    crowded,
    difference,
    notes_of,
    of_laws_across,
    of_missed,
)
from twindisc_cli.loop.prediction_errors import (
    contradicted_by,
    missed_by,
    predicted_badly,
    prediction_errors,
    tests_apart,
)
from twindisc_cli.loop.problem import case_of
from twindisc_cli.loop.refusal import Refusal
from twindisc_cli.loop.screen import Residual, is_beyond_assumed, is_unexplained, unexplained_residual
from twindisc_cli.loop.step_scatter import step_scatter
from twindisc_cli.loop.term_intervals import term_parameters, unfixed, widened
from twindisc_cli.loop.terms import Alternative, EffectTerm, LawTerm, Term, joined
from twindisc_cli.loop.thresholds import ACCEPTANCE, RESAMPLING, SEARCH
from twindisc_cli.loop.validate import predict_test, rms, with_its_noise
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.model.prediction import Prediction

PLACES = 60  # on the axis of a curve that is drawn
DRAWS = 400  # of a band that is drawn


def diagnose(
    tests: Sequence[Experiment],
    *,
    validate: Experiment | None,
    progress: Progress,
    quick: bool = False,
    predict: Sequence[Experiment] = (),
) -> Diagnosis:
    """Find what the model lacks in these tests.

    `validate` is not fitted, but how well an explanation predicts it counts in the choice; what is in `predict` is
    predicted at the end and counts in nothing. Raises ValueError where nothing is measured or fixes the friction.
    """
    started = monotonic()
    _refuse(tests)
    unseen = case_of(validate) if validate is not None else None
    outcome = explain(tests, validate=unseen, quick=quick, progress=progress)
    progress("intervals", 0.9)
    base = outcome.search.base.fit
    before = {channel: unexplained_residual(base, channel, own=True) for channel in outcome.problem.channels}
    missed = _missed(outcome.judged)
    left, scattered = _left(outcome, before, missed.keys()), step_scatter(outcome.answer.fit)
    weights = {name: weighed(outcome.compared, name, as_one_law=True) for name in outcome.answer.terms}
    others = [*(case_of(test) for test in predict), *([unseen] if unseen else [])]
    others = [with_its_noise(case, outcome.judged.before) for case in others]
    predictions = [prediction_errors(outcome, case) for case in others]
    contradicted = contradicted_by(predictions[-1]) if unseen else set()
    many = crowded(outcome.answer)
    doubtful = many | missed.keys() | (missed_by(predictions[-1]) if unseen else set())
    strongest = _strongest({*doubtful, *(rest.channel for rest in left)}, missed, many)
    if outcome.or_scatter:
        strongest["traction"] = "possible"
    across = across_the_track(base.problem, outcome.answer)
    strongest |= dict.fromkeys(across, "possible")
    effects, laws = _found(outcome, weights, contradicted, strongest)
    elsewhere = [predict_test(case, outcome.judged.after) for case in others] if laws else []
    separating = [*outcome.judged.prediction("after"), *(e.prediction for e in elsewhere[-1:] if unseen)]
    laws, together = _of_this_history(laws, contradicted | doubtful, separating)
    effects, as_others = not_over_others(effects, separating)
    not_excluded = _not_excluded(outcome)
    free = free_zero.with_free_zero(outcome.sure)
    levels = with_what_differs(levels_of([outcome.judged.after]), tests)
    apart = [*tests_apart(levels, tests), *predicted_badly(predictions, given=bool(outcome.answer.terms))]
    progress("next experiment", 0.95)
    return Diagnosis(
        verdict=_verdict(outcome, effects, laws, [*left, *scattered]),
        effects=effects,
        laws=laws,
        unexplained=left,
        errors={channel: _error(channel, outcome) for channel in outcome.problem.channels},
        base=base_parameters(outcome, free),
        tried=_tried(outcome, weights, not_excluded),
        curves=_curves(outcome),
        p_values={channel: rest.p_value for channel, rest in before.items()},
        held_out_steps={test.name: steps_withheld(test) for test in tests},
        notes=[
            *apart,
            *of_missed(missed),
            *of_laws_across(across),
            *average_errs(outcome.judged, outcome.mixture),
            *single_sample.notes(outcome.judged.estimated, {rest.channel for rest in left}),
            *together,
            *as_others,
            *notes_of(outcome, effects, laws, weights, elsewhere, free),
        ],
        next_experiment=_next(outcome, weights, left),
        validation=predictions[-1] if unseen else None,
        step_scatter=scattered,
        levels=levels,
        predictions=predictions[: len(predict)],
        same_on_all=None if outcome.on_all is None else outcome.on_all == outcome.answer.labels,
        blind=outcome.blind,
        seconds=monotonic() - started,
        difference=difference(outcome),
        not_excluded=not_excluded,
        too_few_samples=too_few_samples(outcome.search.base.fit.problem),
    )


def _refuse(tests: Sequence[Experiment]) -> None:
    """Tests that cannot be diagnosed."""
    if not any(measured_channels(test) for test in tests):
        raise ValueError("nothing is measured: a closed loop needs traction, a profile or a temperature")
    if any("traction" not in measured_channels(test) and not friction_is_given(test) for test in tests):
        raise ValueError("nothing fixes the friction: a closed loop needs the traction measured or mu given")


def _verdict(
    outcome: Outcome, effects: Sequence[FoundEffect], laws: Sequence[FoundLaw], left: Sequence[object]
) -> Verdict:
    """The verdict in a word. What was found but is not given, for it predicts worse, leaves the data unexplained."""
    if effects:
        return "effects_found"
    if laws:
        return "law_learned"
    return "unexplained" if left or _explains_what_is_there(outcome) else "no_missing_effect"


def _explains_what_is_there(outcome: Outcome) -> bool:
    """Whether something is refused that explains more than a noise that had to be assumed may be."""
    base = outcome.search.base.fit
    shown = {channel for m in outcome.members if m.labels in outcome.refused for channel in m.explained}
    return any(is_beyond_assumed(base, channel) for channel in shown)


# ------------------------------------------------------------------------------------------------- what is left


def _left(outcome: Outcome, before: Mapping[str, Residual], missed: Set[str]) -> list[Unexplained]:
    """What stays unexplained, with the covariates that say most; of all samples where those held out are missed."""
    left: list[Unexplained] = []
    fitted, base = outcome.answer.fit, outcome.search.base.fit
    for channel in outcome.problem.channels:
        rest = unexplained_residual(fitted, channel, own=True) if fitted.terms else before[channel]
        if is_unexplained(rest, fitted, base) and is_beyond_assumed(fitted, channel):
            left += _listed(rest)
        elif _is_far_off(fitted, channel):
            left += [replace(each, p_value=_chance(fitted, channel)) for each in _listed(rest)]
    known = {each.channel for each in left}
    estimated, before_it = outcome.judged.estimated, outcome.judged.base_estimated
    among = {rest.channel for rest in outcome.left_on_all} | significant_on_all(outcome, missed - known).keys()
    on_all = [unexplained_residual(estimated, channel, own=True) for channel in sorted(among - known)]
    return left + [
        each
        for rest in on_all
        if is_unexplained(rest, estimated, before_it) and is_beyond_assumed(estimated, rest.channel)
        for each in _listed(rest)
    ]


def _is_far_off(fitted: Fit, channel: str) -> bool:
    """Whether a fit leaves twice the noise of a channel, though no generic function sees in what."""
    known = [case.noise[channel].estimated for case in fitted.problem.cases if channel in case.noise]
    return all(known) and fitted.power(channel) > ACCEPTANCE.mean_square_alone * fitted.problem.count(channel)


def _chance(fitted: Fit, channel: str) -> float:
    """Probability that noise alone is as long as what a fit leaves of a channel."""
    return float(chdtrc(fitted.problem.count(channel), fitted.power(channel)))


def _listed(rest: Residual) -> list[Unexplained]:
    scores = rest.covariates[: ACCEPTANCE.covariates_named] or list(rest.scores[:1])
    return [Unexplained(rest.channel, s.group.covariate, s.group.kind, s.share, s.p_value) for s in scores]


# ------------------------------------------------------------------------------------------------- what was found


def _found(
    outcome: Outcome, weights: Mapping[str, Weighed], contradicted: Container[str], strongest: Mapping[str, Strength]
) -> tuple[list[FoundEffect], list[FoundLaw]]:
    """Effects and laws of the answer, each with what cannot be separated from it.

    contradicted: channels that another history shows to be predicted worse than without the answer; strongest:
    strength that nothing in a channel exceeds, for something is left in it, many terms describe it or held-out samples
    are missed, or that a term does not.
    """
    effects, laws = [], []
    for name in outcome.answer.terms:
        effect = outcome.answer.effect(name)
        channel = outcome.problem.shown_in(effect)
        remains = outcome.compared.remains(channel)
        probability, rivals = weights[name].probability, weights[name].alternatives
        probability *= 1.0 - remains
        if channel in contradicted:
            probability = min(probability, RESAMPLING.contradicted)
        strength = _strength(outcome, name, probability, rivals)
        most = [strongest[key] for key in (channel, name) if key in strongest]
        strength = max([strength, *most], key=STRENGTHS.index)
        if isinstance(effect, Trial):
            on_all = outcome.judged.estimated.problem.effect(name)
            assert isinstance(on_all, Trial)
            laws.append(_law(outcome, name, on_all, probability, rivals, strength, remains))
        else:
            parameters = term_parameters(outcome.sure, name)
            strength = "possible" if unfixed(effect, parameters) else strength
            term = outcome.answer.term(name)
            assert isinstance(term, EffectTerm)
            effects.append(
                FoundEffect(term.name, channel, parameters, tuple(rivals), probability, strength, remains, term.test)
            )
    return effects, laws


def _of_this_history(
    laws: Sequence[FoundLaw], among: Container[str], predictions: list[Prediction]
) -> tuple[list[FoundLaw], list[str]]:
    """The laws, as of this history alone those of the channels `among`, and those whose covariate runs as another does.

    Or that jump once, where another passes at the same moment. Of the latter notes say so. predictions: of the tests in
    which these would have to run apart.
    """
    found, notes = [], []
    for law in laws:
        running = confounded(predictions, law.law.quantity, law.law.covariate)
        names = list(dict.fromkeys([*running, *passed_together(law.law, len(predictions))]))
        alone = bool(names) or law.channel in among
        found.append(replace(law, law=replace(law.law, transfer="same_history")) if alone else law)
        if names:
            notes.append(_may_count(law.name, names, "it"))
    return found, notes


def _may_count(term: str, others: Sequence[str], over: str) -> str:
    """That a term may depend on other covariates, which run with its own on this history."""
    labels = " and ".join(covariate_of(name).label for name in others)
    run = "run" if len(others) > 1 else "runs"
    return f"{term}: {labels} {run} with {over} on this history, and may be what counts"


def not_over_others(
    effects: Sequence[FoundEffect], predictions: list[Prediction]
) -> tuple[list[FoundEffect], list[str]]:
    """The effects, none established whose covariate runs as another of its quantity does; notes say so of these."""
    found, notes = [], []
    for effect in effects:
        over, stage = catalogue()[effect.name].over, catalogue()[effect.name].stage
        own = [key for key, of in QUANTITIES.items() if over in of.covariates and of.stage == stage]
        names = list(dict.fromkeys(name for key in own for name in confounded(predictions, key, over)))
        weaker = names and effect.strength == "established"
        found.append(replace(effect, strength="probable") if weaker else effect)
        if names:
            notes.append(_may_count(effect.name, names, covariate_of(over).label))
    return found, notes


def _not_excluded(outcome: Outcome) -> list[Alternative]:
    """Where nothing is given: what the resamples choose all the same, until that and nothing are probable enough.

    Not what is refused: it raises an error, or stands at a bound.
    """
    if outcome.answer.terms:
        return []
    chances, held = dict[Term, float](), 0.0
    for member, share in zip(outcome.members, outcome.shares, strict=True):
        held += float(share) if not member.terms else 0.0
        if not member.fit.at_bound and member.labels not in outcome.refused:
            chances |= {term: chances.get(term, 0.0) + float(share) for term in member.labels}
    beside = list[Alternative]()
    for term, share in by_probability(chances):
        if share > RESAMPLING.rival_share and held < RESAMPLING.set_share:
            beside.append(Alternative(term, share))
        held += share
    return beside


def _strength(outcome: Outcome, name: str, probability: float, rivals: Sequence[Alternative]) -> Strength:
    """In a word: established where it comes back in nine of ten resamples and nothing stands against it."""
    same = outcome.on_all is None or outcome.answer.term(name) in outcome.on_all
    alone = not rivals and not _tied(outcome) and not outcome.search.is_cut
    if probability >= RESAMPLING.established and alone and same and outcome.blind:
        return "established"
    return "probable" if probability >= RESAMPLING.probable else "possible"


def _missed(judged: Judged) -> dict[str, float]:
    """Channels in which something was found and held-out samples are missed, as a test that was not fitted is: by how
    many times the noise."""
    answer = judged.explanation
    found = [channel for channel in answer.fit.problem.channels if answer.terms_in(channel)]
    misses = {c: judged.misses(c, "unseen_after", held_out=True, decided=True) for c in found}
    errors = {channel: rms(missed) / judged.held_out_noise(channel) for channel, missed in misses.items()}
    return {channel: error for channel, error in errors.items() if error > ACCEPTANCE.missed}


def _strongest(doubtful: Set[str], missed: Mapping[str, float], many: Container[str]) -> dict[str, Strength]:
    """Strength that nothing in a doubtful channel exceeds; some are missed by so many times the noise.

    many: channels that many terms describe, of which being missed leaves none more than possible.
    """
    far = {c: ACCEPTANCE.missed if c in many else ACCEPTANCE.far_missed for c in doubtful}
    return {c: "possible" if missed.get(c, 0.0) > least else "probable" for c, least in far.items()}


def _tied(outcome: Outcome) -> bool:
    """Whether another explanation is as good as the answer, to within the numerical error of the evidence."""
    near = [m for m in outcome.members if outcome.answer.evidence - m.evidence <= SEARCH.evidence_error]
    return any(m.labels != outcome.answer.labels for m in near)


def _law(
    outcome: Outcome,
    name: str,
    trial: Trial,
    probability: float,
    rivals: Sequence[Alternative],
    strength: Strength,
    remains: float,
) -> FoundLaw:
    law = _with_range(outcome, trial.law(outcome.sure.values(name)), rivals, trial.test)
    resembles = [
        (term.name, share)
        for term, member in outcome.compared.in_place_of(name).items()
        if isinstance(term, EffectTerm)
        and term.test == trial.test
        and (share := outcome.compared.similarity(name, member, outcome.answer)) > RESAMPLING.resembles
    ]
    return FoundLaw(
        name=law_key(trial.quantity, trial.covariate),
        channel=outcome.problem.shown_in(trial),
        law=law,
        formula=formula_text(law),
        parameters={} if trial.is_curve else term_parameters(outcome.sure, name),
        curve=_band(outcome.sure, name, trial, law),
        resembles=tuple(sorted(resembles, key=lambda pair: -pair[1])),
        alternatives=tuple(rivals),
        probability=probability,
        strength=strength,
        remains=remains,
        test=trial.test,
    )


def _with_range(outcome: Outcome, law: Law, rivals: Sequence[Alternative], test: str) -> Law:
    """The law with the range of its covariate in a test, or in all, and whether it holds on another history."""
    if law.covariate == "y_over_edge":
        return replace(law, valid=(-law.over.reach, law.over.reach))
    values = [
        np.broadcast_to(law.over.of(prediction.state), prediction.section.shape)[0]
        for case, prediction in zip(outcome.problem.cases, outcome.judged.prediction("after"), strict=True)
        if test in ("", case.test.name)
    ]
    every = np.concatenate(values)
    laws = [rival.term for rival in rivals if isinstance(rival.term, LawTerm)]
    mixed = any(term.quantity == law.quantity and term.covariate != law.covariate for term in laws)
    same = mixed or law.covariate in ("time", "cycles")
    return replace(
        law, valid=(float(np.nanmin(every)), float(np.nanmax(every))), transfer="same_history" if same else "inside"
    )


def _band(fitted: Fit, name: str, trial: Trial, law: Law) -> LawCurve:
    """The law over its range with the band that its parameters' uncertainty leaves: factor, or shift in its unit."""
    low, high = law.valid or (0.0, 1.0)
    at = np.linspace(low, high, PLACES)
    own = [i for i, p in enumerate(fitted.problem.parameters) if p.term == name]
    lower, upper = fitted.problem.bounds
    size, direction = np.linalg.eigh(widened(fitted)[np.ix_(own, own)])
    root = direction * np.sqrt(np.maximum(size, 0.0)) @ direction.T  # of no direction of its own, which rounding turns
    drawn = fitted.theta[own] + np.random.default_rng(0).standard_normal((DRAWS, len(own))) @ root
    drawn = np.clip(drawn, lower[own], upper[own])
    parameters = [fitted.problem.parameters[i] for i in own]
    one = 1.0 if law.of.kind == "factor" else 0.0
    curves = np.array(
        [
            one + trial.law({p.key: float(p.outer(v)) for p, v in zip(parameters, row, strict=True)}).change(at)
            for row in drawn
        ]
    )
    low_band, high_band = np.quantile(curves, [0.05, 0.95], axis=0)
    return LawCurve(at, one + law.change(at), low_band, high_band)


# ------------------------------------------------------------------------------------------------- errors and curves


def _error(channel: str, outcome: Outcome) -> ChannelError:
    """Errors of one channel: fitted where all samples were seen, held out where these were not."""
    of, judged = channels()[channel], outcome.judged
    noises = [case.noise[channel] for case in outcome.problem.cases if channel in case.noise]
    return ChannelError(
        unit=of.unit,
        noise=of.factor * judged.noise(channel),
        correlation=float(np.mean([n.correlation for n in noises])),
        before=of.factor * judged.error(channel, "before", held_out=False),
        after=of.factor * judged.error(channel, "after", held_out=False),
        held_out_before=of.factor * judged.error(channel, "unseen_before", held_out=True),
        held_out_after=of.factor * outcome.mixture.error(channel, "unseen_after", held_out=True),
        assumed=not all(n.estimated for n in noises),
    )


def _curves(outcome: Outcome) -> list[Curve]:
    """Every channel of every test, by the answer fitted to all samples and by the one fitted without those held out."""
    curves = []
    kinds: tuple[Kind, ...] = ("before", "after", "unseen_before")
    predictions = {kind: outcome.judged.prediction(kind) for kind in kinds}
    for number, channel in outcome.problem.parts:
        case, of = outcome.problem.cases[number], channels()[channel]
        rows = {kind: of.predicted(case.model, every[number])[0] for kind, every in predictions.items()}
        curves.append(
            Curve(
                test=case.test.name,
                channel=channel,
                measured=case.values(channel),
                unseen_after=outcome.mixture.predicted(channel, number, "unseen_after"),
                held_out=outcome.judged.masks[number][channel],
                kept=case.noise[channel].kept,
                covariates=of.covariates(case.model, predictions["before"][number]),
                provenance=case.test.measured.provenance,
                **rows,
            )
        )
    return curves


def _tried(
    outcome: Outcome, weights: Mapping[str, Weighed], not_excluded: Sequence[Alternative]
) -> list[CandidateResult]:
    """What was tried in the place of each term, the answer's own term among it."""
    tried = []
    for name in outcome.answer.terms:
        others = outcome.answer.labels - {outcome.answer.term(name)}
        short = next((m for m in outcome.members if m.labels == others), outcome.search.base)
        places = {outcome.answer.term(name): outcome.answer} | outcome.compared.in_place_of(name)
        tried += [_place(outcome, name, short, member, term, weights[name]) for term, member in places.items()]
    if not outcome.answer.terms:
        base = outcome.search.base
        tried = [
            _place(outcome, "", base, member, term, Weighed(np.nan, not_excluded, {term: float(share)}, {}))
            for member, share in zip(outcome.members, outcome.shares, strict=True)
            for term in member.labels
            if len(member.labels) == 1 or member.labels in outcome.refused
        ]
    return sorted(tried, key=lambda t: (t.replaces, -t.evidence))


def _place(
    outcome: Outcome, name: str, short: Explanation, member: Explanation, term: Term, weight: Weighed
) -> CandidateResult:
    chosen = member.labels == outcome.answer.labels
    effect = next(member.effect(other) for other in member.terms if member.term(other) == term)
    share = weight.chances.get(term, 0.0) if np.isfinite(outcome.shares).all() else np.nan
    channel = outcome.problem.shown_in(effect)
    return CandidateResult(
        channel=channel,
        replaces=name,
        term=term,
        gain=short.fit.chi2 - member.fit.chi2,
        evidence=member.evidence - outcome.answer.evidence,
        probability=share,
        remains=outcome.compared.remains(channel, member),
        at_bound=member.fit.at_bound,
        refused=None if chosen else _why_not(outcome, member, term, weight),
        chosen=chosen and bool(name),
    )


def _why_not(outcome: Outcome, member: Explanation, term: Term, weight: Weighed) -> Refusal | None:
    """Why an explanation is not the answer; None where the data cannot separate it from that."""
    if member.labels in outcome.refused:
        return outcome.refused[member.labels]
    if member.fit.at_bound:
        return Refusal("at a bound", f"{' and '.join(n.rpartition('.')[2] for n in member.fit.at_bound)} at a bound")
    if term in weight.same:
        return Refusal("in other words")
    if term in {alternative.term for alternative in weight.alternatives}:
        return None
    behind = (outcome.answer.evidence - member.evidence) / outcome.answer.evidence_scale
    less = not outcome.answer.terms or behind > SEARCH.equivalent
    return Refusal("explains less") if less else None


# ------------------------------------------------------------------------------------------------------------ next


def _next(outcome: Outcome, weights: Mapping[str, Weighed], left: Sequence[Unexplained]) -> NextExperiment | None:
    """Separate the explanations that the data do not; else what the unexplained residual depends on."""
    labels = {alternative.term for weight in weights.values() for alternative in weight.alternatives}
    rivals = [member for member in outcome.members if member.labels & labels]
    if rivals:
        alive = [outcome.answer, *rivals[: RESAMPLING.most_separated - 1]]
        evidence = np.array([(e.evidence - outcome.answer.evidence) / outcome.answer.evidence_scale for e in alive])
        weight = np.maximum(np.exp(evidence - evidence.max()), 0.05)
        names = [joined(e.labels, " + ") for e in alive]
        return next_experiment([(e.fit, float(w)) for e, w in zip(alive, weight / weight.sum(), strict=True)], names)
    if left:
        names = list(dict.fromkeys(u.covariate for u in left))
        history = outcome.problem.cases[0].test.history
        return up_and_down(
            history,
            f"the residual depends on {' and '.join(names)}; a history up and down separates time from creepage",
        )
    return None
