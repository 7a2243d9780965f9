"""The closed loop from measured tests to a diagnosis: search, judgement on held-out data, probabilities, next test."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from time import monotonic

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.law import Law, formula_text, law_key, warnings
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop import free_zero, single_sample
from twindisc_cli.loop.alternatives import Weighed, by_probability, shorter, weighed
from twindisc_cli.loop.candidates import stops_of_wear
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.channels.profile import recorded_stops
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
    PredictedErrors,
    PredictedLevel,
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
from twindisc_cli.loop.learn import confounded
from twindisc_cli.loop.levels import Levels, apart_from_others, is_apart, levels_of, with_what_differs
from twindisc_cli.loop.mixture import Mixture
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.problem import Case, case_of
from twindisc_cli.loop.screen import Residual, is_beyond_assumed, is_unexplained, unexplained_residual
from twindisc_cli.loop.step_scatter import step_scatter
from twindisc_cli.loop.term_intervals import term_parameters, unfixed, widened
from twindisc_cli.loop.terms import Alternative, EffectTerm, LawTerm, Term, joined
from twindisc_cli.loop.thresholds import ACCEPTANCE, RESAMPLING, SEARCH
from twindisc_cli.loop.validate import PredictedTest, at_its_own_level, drawn_levels, predict_test, rms, with_its_noise
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.model.forward import Prediction
from twindisc_cli.quantities import for_reading

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
    weights = {name: weighed(outcome.compared, name) for name in outcome.answer.terms}
    others = [*(case_of(test) for test in predict), *([unseen] if unseen else [])]
    others = [with_its_noise(case, outcome.judged.before) for case in others]
    predictions = [_prediction(outcome, case) for case in others]
    contradicted = contradicted_by(predictions[-1]) if unseen else set()
    doubtful = _crowded(outcome.answer) | missed.keys()
    strongest = _strongest({*doubtful, *(rest.channel for rest in left)}, missed)
    effects, laws = _found(outcome, weights, contradicted, strongest)
    elsewhere = [predict_test(case, outcome.judged.after) for case in others] if laws else []
    separating = [*outcome.judged.prediction("after"), *(e.prediction for e in elsewhere[-1:] if unseen)]
    laws, together = _of_this_history(laws, contradicted | doubtful, separating)
    effects, as_others = not_over_others(effects, separating)
    not_excluded = _not_excluded(outcome)
    free = free_zero.with_free_zero(outcome.sure)
    levels = with_what_differs(levels_of([outcome.judged.after]), tests)
    apart = [*_apart(levels, tests), *predicted_badly(predictions, given=bool(outcome.answer.terms))]
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
            *_of_missed(missed),
            *average_errs(outcome.judged, outcome.mixture),
            *single_sample.notes(outcome.judged.estimated, {rest.channel for rest in left}),
            *together,
            *as_others,
            *_notes(outcome, effects, laws, weights, elsewhere, free),
        ],
        next_experiment=_next(outcome, weights, left),
        validation=predictions[-1] if unseen else None,
        step_scatter=scattered,
        levels=levels,
        predictions=predictions[: len(predict)],
        same_on_all=None if outcome.on_all is None else outcome.on_all == outcome.answer.labels,
        blind=outcome.blind,
        seconds=monotonic() - started,
        difference=_difference(outcome),
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
    are missed.
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
        strength = max(strength, strongest.get(channel, strength), key=STRENGTHS.index)
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

    Of the latter notes say so. predictions: of the tests in which these would have to run apart.
    """
    found, notes = [], []
    for law in laws:
        names = confounded(predictions, law.law.quantity, law.law.covariate)
        alone = bool(names) or law.channel in among
        found.append(replace(law, law=replace(law.law, transfer="same_history")) if alone else law)
        if names:
            notes.append(_may_count(law.name, names, "it"))
    return found, notes


def _may_count(term: str, others: Sequence[str], over: str) -> str:
    """That a term may depend on other covariates, which run with its own on this history."""
    labels = " and ".join(covariate_of(name).label for name in others)
    return f"{term}: {labels} runs with {over} on this history, and may be what counts"


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


def _crowded(answer: Explanation) -> set[str]:
    """Channels that so many terms describe that their sum describes the record more than it names causes."""
    return {c for c in answer.fit.problem.channels if len(answer.terms_in(c)) >= ACCEPTANCE.many_terms}


def _missed(judged: Judged) -> dict[str, float]:
    """Channels in which something was found and held-out samples are missed, as a test that was not fitted is: by how
    many times the noise."""
    answer = judged.explanation
    found = [channel for channel in answer.fit.problem.channels if answer.terms_in(channel)]
    misses = {c: judged.misses(c, "unseen_after", held_out=True, decided=True) for c in found}
    errors = {channel: rms(missed) / judged.held_out_noise(channel) for channel, missed in misses.items()}
    return {channel: error for channel, error in errors.items() if error > ACCEPTANCE.missed}


def _strongest(doubtful: Set[str], missed: Mapping[str, float]) -> dict[str, Strength]:
    """Strength that nothing in a doubtful channel exceeds; some are missed by so many times the noise."""
    return {c: "possible" if missed.get(c, 0.0) > ACCEPTANCE.far_missed else "probable" for c in doubtful}


def _of_missed(errors: Mapping[str, float]) -> list[str]:
    """What follows where held-out samples are missed."""
    return [
        f"held-out samples of the {channels()[channel].label} are missed by {error:.1f} times its noise: nothing in it "
        f"is {'more than possible' if error > ACCEPTANCE.far_missed else 'established'}, and its laws hold on this "
        "history alone"
        for channel, error in errors.items()
    ]


def average_errs(judged: Judged, mixture: Mixture) -> list[str]:
    """Channels of which the average over the explanations misses held-out samples by more than the answer alone does,
    and than by chance: what stands beside the answer was judged by its evidence and not by these samples."""
    notes = []
    for name in judged.before.problem.channels:
        of = channels()[name]
        together, alone = (of.factor * each.error(name, "unseen_after", held_out=True) for each in (mixture, judged))
        noise = of.factor * judged.held_out_noise(name)
        if together > max((1.0 + ACCEPTANCE.growth) * alone, ACCEPTANCE.predicted * noise):
            of_unit = "" if of.unit == "1" else f" {of.unit}"
            notes.append(
                f"held-out samples of the {of.label} are missed by {together:.3g}{of_unit} by the average over what is "
                f"not excluded, and by {alone:.3g}{of_unit} by the answer alone: some of the former errs there"
            )
    return notes


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
    generator = np.random.default_rng(0)
    lower, upper = fitted.problem.bounds
    drawn = generator.multivariate_normal(fitted.theta[own], widened(fitted)[np.ix_(own, own)], DRAWS, method="eigh")
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
    return CandidateResult(
        channel=outcome.problem.shown_in(effect),
        replaces=name,
        term=term,
        gain=short.fit.chi2 - member.fit.chi2,
        evidence=member.evidence - outcome.answer.evidence,
        probability=share,
        at_bound=member.fit.at_bound,
        refused="" if chosen else _why_not(outcome, member, term, weight),
        chosen=chosen and bool(name),
    )


def _why_not(outcome: Outcome, member: Explanation, term: Term, weight: Weighed) -> str:
    """Why an explanation is not the answer; empty where the data cannot separate it from that."""
    if member.labels in outcome.refused:
        return outcome.refused[member.labels].why
    if member.fit.at_bound:
        return f"{' and '.join(n.rpartition('.')[2] for n in member.fit.at_bound)} at a bound"
    if term in weight.same:
        return "in other words"
    if term in {alternative.term for alternative in weight.alternatives}:
        return ""
    behind = (outcome.answer.evidence - member.evidence) / outcome.answer.evidence_scale
    return "explains less" if not outcome.answer.terms or behind > SEARCH.equivalent else ""


# ------------------------------------------------------------------------------------------------- notes


def _difference(outcome: Outcome) -> str:
    """Where the samples held out would have changed the answer."""
    if outcome.on_all in (None, outcome.answer.labels):
        return ""
    other = joined(outcome.on_all or ()) or "nothing"
    return f"the answer was found without the samples held out: fitted to all samples, the evidence is for {other}"


def _refused(outcome: Outcome) -> list[str]:
    """What is not given as the answer, and why."""
    notes = [
        f"{joined(labels)} is not given as the answer: it {refusal.why}" for labels, refusal in outcome.refused.items()
    ]
    if outcome.whole:
        names = " and the ".join(channels()[channel].label for channel in outcome.whole)
        notes.append(
            f"what is found without the samples held out leaves something of the {names} with them: all samples were "
            "searched, and none is left to judge what is given"
        )
    elif not outcome.blind:
        notes.append(
            "the first choice raised the error of held-out samples; what is given was chosen with a look at them"
        )
    return notes


def inputs_off(fitted: Fit) -> list[str]:
    """Inputs with which the model would meet the data better, if they were off by more than their tolerances."""
    nuisance = fitted.problem.nuisance
    if nuisance is None:
        return []
    off = zip(nuisance.names, np.abs(nuisance.off(fitted.residual)), strict=True)
    far = [f"{name} ({by:.1f} times)" for name, by in off if by > ACCEPTANCE.tolerances_off]
    what = "the model would meet the data better with inputs that are off by more than their tolerance"
    return [f"{what} (one standard deviation): {', '.join(far)}"] if far else []


def _unfixed(effects: Sequence[FoundEffect]) -> list[str]:
    """Parameters of the effects added that the data do not fix."""
    return [
        f"{' and '.join(keys)} of {result.name}: at a bound, or not fixed by these data"
        for result in effects
        if (keys := unfixed(catalogue()[result.name], result.parameters))
    ]


def _sums_of_many(answer: Explanation) -> list[str]:
    """Channels that so many terms describe that none of them is sure."""
    return [
        f"{ACCEPTANCE.many_terms} terms or more describe the {channels()[channel].label}: a sum of that many describes "
        "this record, and may name no cause"
        for channel in sorted(_crowded(answer), key=list(channels()).index)
    ]


def _cut(outcome: Outcome) -> list[str]:
    """What follows where the search was ended."""
    what = (
        f"the search was ended after {SEARCH.most_effort:,} predictions and may not have tried all: another term, or "
        "what explains as much, may be missed, and nothing is established"
    )
    return [what] if outcome.search.is_cut else []


def _shorter(outcome: Outcome) -> list[str]:
    """What explains as much with fewer terms, of what was not refused."""
    together = _labels(outcome.answer)
    return [
        f"{_labels(member)} alone explains as much as {together}, with fewer terms ({100.0 * share:.0f} %)"
        for member, share in shorter(outcome.compared)
        if member.labels not in outcome.refused
    ]


def _labels(explanation: Explanation) -> str:
    return " and ".join(sorted(map(str, explanation.labels)))


def _same_as(effects: Sequence[FoundEffect]) -> list[str]:
    """What is outside the catalogue and does the same, or nearly, as an effect that was added."""
    return [
        f"{effect.name}: {catalogue()[effect.name].same_as}" for effect in effects if catalogue()[effect.name].same_as
    ]


def _levels_of_sensors(laws: Sequence[FoundLaw]) -> list[str]:
    """Laws of what a sensor records, which say how it changes and not where it is right."""
    return [
        f"{law.name}: that what is recorded is right where this law changes nothing is assumed: "
        "mu, and what is computed with it, are as far off as the record is there"
        for law in laws
        if law.law.stage == "sensor" and law.channel == "traction"
    ]


def _equal_covariates(weights: Mapping[str, Weighed]) -> list[str]:
    """Laws named for others of the same quantity, whose covariates are proportional on this history."""
    notes = []
    for weight in weights.values():
        for law in (alternative.term for alternative in weight.alternatives):
            others = [o.covariate for o, named in weight.same.items() if named == law and isinstance(o, LawTerm)]
            if others and isinstance(law, LawTerm):
                notes.append(f"{law} stands for {' and '.join(others)}, too: on this history they change together")
    return notes


def _notes(
    outcome: Outcome,
    effects: Sequence[FoundEffect],
    laws: Sequence[FoundLaw],
    weights: Mapping[str, Weighed],
    elsewhere: Sequence[PredictedTest],
    free: Fit | None,
) -> list[str]:
    """What the reader must know to weigh the verdict; elsewhere: tests that laws predict; free: with a free zero."""
    cases = outcome.problem.cases
    notes = [
        *_refused(outcome),
        *_sums_of_many(outcome.answer),
        *_cut(outcome),
        *_shorter(outcome),
        *_same_as(effects),
        *_levels_of_sensors(laws),
    ]
    notes += [*inputs_off(outcome.answer.fit), *_unfixed(effects), *_equal_covariates(weights)]
    notes += [note for predicted in elsewhere for note in _warned(laws, predicted)]
    notes += [f"{case.test.name}: {note}" for case in cases for note in _notes_on(case)]
    notes += free_zero.notes(outcome.sure, free) if free else []
    notes += few_stops(outcome.answer, stops_of_wear(cases))
    if len({replace(case.test.rig, normal_load=0.0, rolling_speed=0.0) for case in cases}) > 1:
        notes.append(
            "the tests are of different rigs or materials; K is shared between them all the same, and so are effects "
            "and laws that are not said to act in one of them"
        )
    return notes


def few_stops(answer: Explanation, stops: int) -> Iterator[str]:
    """Effects whose parameters take up about as many profiles or weighings as were recorded."""
    for name in answer.terms:
        effect = answer.effect(name)
        if effect.needs_stops and stops - len(effect.params) - 1 < ACCEPTANCE.spare_stops:
            yield (
                f"{stops} profiles or weighings fix K and the parameters of {name} and leave little to refuse it: a "
                "wear coefficient that changed in another way could look the same"
            )


def _notes_on_noise(channel: str, noise: Noise) -> Iterator[str]:
    """What is left out of a channel, and what is assumed of its noise or special in it."""
    dropped, label = int(np.sum(~noise.kept)), channels()[channel].label
    if noise.rounded:
        step = channels()[channel].quantity.difference
        size = f"{step.of_si(noise.rounded):.3g} {for_reading(step.name)}".strip()
        back = f"; {dropped} that go a step and come back are left out" if dropped else ""
        yield (
            f"readings of the {label} are rounded to steps of {size}, which is most of their noise: the error of "
            f"one lasts as long as it is read{back}"
        )
        return
    if dropped:
        yield f"{dropped} {'samples' if dropped > 1 else 'sample'} of the {label} far from the others left out"
    if not noise.estimated:
        yield (
            f"the {channel} has no scatter to estimate its noise from; one percent of its size is "
            f"assumed, and every significance in that channel rests on this; its {int(noise.kept.sum())} samples "
            f"are asked for no more than {int(noise.kept.sum()) // SEARCH.samples_each} parameters"
        )
    if noise.slow is not None:
        one, many = (
            f"a memory of {noise.slow.memories[0]:.0f} samples",
            "memories from a sample to the whole record",
        )
        yield (
            f"the noise of the {channel} wanders: {100.0 * noise.slow.share:.0f} % of its variance has "
            f"{many if len(noise.slow.memories) > 1 else one}; a slow change has to stand out of that"
        )


def _notes_on(case: Case) -> Iterator[str]:
    """What one test does not say, or what is assumed of it."""
    test = case.test
    for channel, noise in case.noise.items():
        yield from _notes_on_noise(channel, noise)
    if test.effects:
        yield (
            f"{' and '.join(test.effects)} declared: the parameters stay as given; taken out of the "
            f"definition, an effect is looked for and fitted"
        )
    if test.approximates_a_line:
        yield (
            "FASTSIM is an approximation on two cylinders: its difference from the exact law counts as an error of the "
            'model, in every interval and in what is looked for; traction = "exact" under [model] is without it'
        )
    showing = {effect.channel for effect in catalogue().values()}
    missing = [c for c in channels() if c in showing and c not in measured_channels(test)]
    if missing:
        yield f"{' and '.join(missing)} not measured; effects seen only there stay unseen"
    if len(recorded_stops(test)) == 1:
        yield (
            "a single profile cannot show a wear coefficient that changed over the history; "
            "profiles at several stops would"
        )
    if len(np.unique(test.history.step_creepage)) < 3:
        yield "fewer than three creepages; what depends on creepage cannot be separated from the rest"
    if test.thermal is not None and not np.isfinite(case.held["convection_W_K"]):
        yield (
            "the convection is neither given nor identified, so that the temperature is not known; "
            "effects and laws of the temperature are left out"
        )


# ------------------------------------------------------------------------------------------------- next, validation


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


def _prediction(outcome: Outcome, case: Case) -> PredictedErrors:
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


OTHER_KIND = "are its surfaces, its load and its zeros those of the others?"


def _apart(levels: Mapping[str, Levels], tests: Sequence[Experiment]) -> list[str]:
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


def _warned(laws: Sequence[FoundLaw], predicted: PredictedTest) -> list[str]:
    """Where a test goes beyond what a law was learnt on."""
    name, state = predicted.case.test.name, predicted.prediction.state
    return warnings({law.name: law.law for law in laws if law.test in ("", name)}, state, name)
