"""What a reader must know to weigh a verdict, in sentences: what was refused, assumed, left out or is not fixed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.repeats import repeats_of
from twindisc_cli.laws.law import warnings
from twindisc_cli.loop import free_zero
from twindisc_cli.loop.alternatives import Weighed, shared_laws, shorter
from twindisc_cli.loop.candidates import knows_crowns, stops_of_wear
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.channels.profile import recorded_stops
from twindisc_cli.loop.diagnosis import FoundEffect, FoundLaw
from twindisc_cli.loop.explain import Outcome
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.judge import Judged
from twindisc_cli.loop.mixture import Mixture
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.term_intervals import unfixed
from twindisc_cli.loop.terms import LawTerm, joined
from twindisc_cli.loop.thresholds import ACCEPTANCE, SEARCH
from twindisc_cli.loop.validate import PredictedTest
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.quantities import for_reading


def notes_of(
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
        *_one_law(outcome.answer),
        *_or_noise(outcome),
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


def _sums_of_many(answer: Explanation) -> list[str]:
    """Channels that so many terms describe that none of them is sure."""
    return [
        f"{ACCEPTANCE.many_terms} terms or more describe the {channels()[channel].label}: a sum of that many describes "
        "this record, and may name no cause"
        for channel in sorted(crowded(answer), key=list(channels()).index)
    ]


def crowded(answer: Explanation) -> set[str]:
    """Channels that so many terms describe that their sum describes the record more than it names causes."""
    return {c for c in answer.fit.problem.channels if len(answer.terms_in(c)) >= ACCEPTANCE.many_terms}


def _cut(outcome: Outcome) -> list[str]:
    """What follows where the search was ended."""
    what = (
        f"the search was ended after {SEARCH.most_effort:,} predictions and may not have tried all: another term, or "
        "what explains as much, may be missed, and nothing is established"
    )
    return [what] if outcome.search.is_cut else []


def _shorter(outcome: Outcome) -> list[str]:
    """What explains as much with fewer terms, of what was not refused."""
    together = joined(outcome.answer.labels)
    return [
        f"{joined(member.labels)} alone explains as much as {together}, with fewer terms ({100.0 * share:.0f} %)"
        for member, share in shorter(outcome.compared)
        if member.labels not in outcome.refused
    ]


def _one_law(answer: Explanation) -> list[str]:
    """Terms that change one quantity over one covariate together."""
    return [
        f"{joined(terms)} are a change of {law} together: one law that is in no catalogue would do the same"
        for law, terms in shared_laws(answer).items()
    ]


def _or_noise(outcome: Outcome) -> list[str]:
    """Terms that cannot be separated from noise, for which what they explain is taken or might be."""
    answer, scatter = outcome.answer, "friction that scatters from step to step"
    is_scatter = any(case.mu_scatter for case in answer.fit.problem.cases)
    pairs = [(outcome.or_noise, scatter if is_scatter else "slow noise")]
    if outcome.or_scatter:
        pairs.append((frozenset(answer.term(name) for name in answer.terms_in("traction")), scatter))
    return [
        f"{joined(terms)} explains as much as {noise} does: these data cannot separate the two"
        for terms, noise in pairs
        if terms
    ]


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


def _equal_covariates(weights: Mapping[str, Weighed]) -> list[str]:
    """Laws named for others of the same quantity, whose covariates are proportional on this history."""
    notes = []
    for weight in weights.values():
        for law in (alternative.term for alternative in weight.alternatives):
            others = [o.covariate for o, named in weight.same.items() if named == law and isinstance(o, LawTerm)]
            if others and isinstance(law, LawTerm):
                notes.append(f"{law} stands for {' and '.join(others)}, too: on this history they change together")
    return notes


def _warned(laws: Sequence[FoundLaw], predicted: PredictedTest) -> list[str]:
    """Where a test goes beyond what a law was learnt on."""
    name, state = predicted.case.test.name, predicted.prediction.state
    return warnings({law.name: law.law for law in laws if law.test in ("", name)}, state, name)


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
    yield from _notes_on_repeats(test)
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


def _notes_on_repeats(test: Experiment) -> Iterator[str]:
    """How far separate tests scatter, and which of them lie apart."""
    shown = repeats_of(test)
    if np.isnan(shown.scatter) or shown.scatter > 0.0:
        by = f"{100.0 * shown.scatter:.2g} %"
        if np.isnan(shown.scatter):
            by = f"{100.0 * ACCEPTANCE.repeat_scatter:.2g} %, as is assumed where no repeats show it,"
        yield (
            f"separate tests at one setting scatter by {by} in friction: each may be that far off, and what changes "
            "between the tests has to stand out of it"
        )
    for number, off in shown.apart.items():
        yield (
            f"separate test {number + 1} lies {100.0 * off:+.2g} % from what the others let expect: something happened "
            "in it that did not in the others, and what it says alone is not counted"
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


def few_stops(answer: Explanation, stops: int) -> Iterator[str]:
    """Effects whose parameters take up about as many profiles or weighings as were recorded."""
    for name in answer.terms:
        effect = answer.effect(name)
        if effect.needs_stops and stops - len(effect.params) - 1 < ACCEPTANCE.spare_stops:
            yield (
                f"{stops} profiles or weighings fix K and the parameters of {name} and leave little to refuse it: a "
                "wear coefficient that changed in another way could look the same"
            )


def across_the_track(base: Problem, answer: Explanation) -> list[str]:
    """Laws of the answer across the track where another transverse radius was not tried, which changes the wear there,
    too; base: the problem without terms."""
    return [] if knows_crowns(base) else [n for n, law in answer.laws.items() if law.covariate == "y_over_edge"]


def of_laws_across(names: Sequence[str]) -> list[str]:
    """What follows for laws across the track beside which another transverse radius was not tried."""
    return [
        f"{name}: a transverse radius that is not the declared one changes the wear across the track, too, and was not "
        "tried: how discs of other radii wear in this history is not tabulated"
        for name in names
    ]


def of_missed(errors: Mapping[str, float]) -> list[str]:
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


def difference(outcome: Outcome) -> str:
    """Where the samples held out would have changed the answer."""
    if outcome.on_all in (None, outcome.answer.labels):
        return ""
    other = joined(outcome.on_all or ()) or "nothing"
    return f"the answer was found without the samples held out: fitted to all samples, the evidence is for {other}"
