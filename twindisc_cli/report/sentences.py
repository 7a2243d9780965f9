"""What a diagnosis says, in words: shared by the terminal, the figure and the page of close-loop."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.law import Law
from twindisc_cli.laws.quantities import QUANTITIES as CHANGED
from twindisc_cli.loop.channels import base_named, channels
from twindisc_cli.loop.diagnosis import (
    BaseEstimate,
    CandidateResult,
    ChannelError,
    Diagnosis,
    Estimate,
    FoundEffect,
    FoundLaw,
    FoundTerm,
)
from twindisc_cli.loop.terms import Alternative, EffectTerm, LawTerm, Term, in_test
from twindisc_cli.loop.thresholds import ACCEPTANCE, SEARCH
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.report.levels import between_text, level_text, stands_out
from twindisc_cli.report.words import (
    apart,
    channel_name,
    covariate_name,
    law_name,
    listed,
    number,
    percent,
    plain_name,
    sentence,
    term_name,
    unit,
)

AT_FLOOR = 1.15  # times the noise, of which only an estimate is known
WORN = ("profile", "mass")
"""Channels for which an added term acts on the wear, and so on what K means."""
REPORTED = 0.05
"""Share of its misfit from which on a term is reported to leave some."""


def provenance(kinds: Sequence[str]) -> str:
    """Where the data are from; several kinds are named together."""
    return listed(list(dict.fromkeys(kinds)))


# ------------------------------------------------------------------------------------------------- what was added


def together(diagnosis: Diagnosis) -> dict[str, list[FoundTerm]]:
    """The effects and laws that were added, by the channel they were added for."""
    return {c: results for c in channels() if (results := [term for term in diagnosis.terms if term.channel == c])}


def name_of(term: FoundTerm) -> str:
    """What an effect or a law is called."""
    name = plain_name(term.name) if isinstance(term, FoundEffect) else law_name(term.law.quantity, term.law.covariate)
    return in_test(name, term.test)


def rivals(term: FoundTerm) -> list[str]:
    """Names of what these data cannot separate from it, in words."""
    return [term_name(alternative.term) for alternative in term.alternatives]


def weighed(term: FoundTerm) -> list[tuple[Term, str]]:
    """What these data cannot separate from a term, each with its probability, empty where none was computed."""
    known = np.isfinite(term.probability)
    return [(a.term, percent(a.probability) if known and np.isfinite(a.probability) else "") for a in term.alternatives]


def probability(diagnosis: Diagnosis, tried: CandidateResult) -> float:
    """The probability of what was tried: of the answer's terms and what is named beside them, the one given there."""
    term = _replaced(diagnosis, tried)
    if term is not None and tried.chosen:
        return term.probability
    beside = named_beside(diagnosis, tried)
    return beside.probability if term and beside and np.isfinite(term.probability) else tried.probability


def _replaced(diagnosis: Diagnosis, tried: CandidateResult) -> FoundTerm | None:
    """The term of the answer in whose place it was tried."""
    return next((term for term in diagnosis.terms if term.key == tried.replaces), None)


def named_beside(diagnosis: Diagnosis, tried: CandidateResult) -> Alternative | None:
    """What was tried as one that the data cannot separate from the term in whose place it was; None where it is not."""
    term = _replaced(diagnosis, tried)
    return next((other for other in term.alternatives if other.term == tried.term), None) if term else None


def is_out(diagnosis: Diagnosis, tried: CandidateResult) -> bool:
    """Whether what was tried is refused, and not named beside the answer all the same."""
    return tried.refused is not None and named_beside(diagnosis, tried) is None


def tried_name(diagnosis: Diagnosis, tried: CandidateResult) -> str:
    """What that which was tried is called; and in the place of what, where it was tried in several places."""
    name, term = term_name(tried.term), _replaced(diagnosis, tried)
    places = {other.replaces for other in diagnosis.tried if other.term == tried.term}
    return name if term is None or len(places) < 2 else f"{name} (instead of {name_of(term)})"


def share(diagnosis: Diagnosis, tried: CandidateResult) -> str:
    """The probability of what was tried as text; a dash where its resamples count for another in whose words it is."""
    return "–" if _is_same(tried) else percent(probability(diagnosis, tried))


def _is_same(tried: CandidateResult) -> bool:
    """Whether it is another term in other words."""
    return tried.refused is not None and tried.refused.reason == "in other words"


def answers(diagnosis: Diagnosis) -> list[tuple[str, list[str]]]:
    """The answer as questions that a reader asks, each with its answers."""
    terms = [term for result in together(diagnosis).values() for term in result]
    rows = [
        ("How sure is it?", [f"{sentence(name_of(term))}: {_how_sure(term)}." for term in terms]),
        ("What changed?", [*map(_added, terms), *(_fall(c, e) for c, e in diagnosis.errors.items() if terms)]),
        ("What else could it be?", [_what_else(diagnosis, term) for term in terms]),
        ("What is still open?", [f"{sentence(rest)}." for rest in open_questions(diagnosis)]),
    ]
    if diagnosis.next_experiment is not None:
        rows.append(("What should be measured next?", [f"{sentence(next_step(diagnosis))}."]))
    return [(question, lines) for question, lines in rows if lines]


def _how_sure(term: FoundTerm) -> str:
    """The strength with what it means."""
    if not np.isfinite(term.probability):
        return f"{term.strength} (no probability was computed: --quick)"
    return f"{term.strength}; it is chosen in {percent(term.probability)} of the resamples of the data"


def _added(term: FoundTerm) -> str:
    """A term that was added with its parameters and their intervals."""
    if isinstance(term, FoundLaw):
        return f"Added: {law_text(term)}."
    meanings = {p.name: p.meaning for p in catalogue()[term.name].params}
    parts = [f"{meanings.get(key, key)} {value(e)} (90 % interval {interval(e)})" for key, e in term.parameters.items()]
    return f"Added: {name_of(term)}; {'; '.join(parts)}."


def _what_else(diagnosis: Diagnosis, term: FoundTerm) -> str:
    others = [f"{term_name(other)}{f' ({p})' if p else ''}" for other, p in weighed(term)]
    if others:
        return f"In the place of {name_of(term)}: {listed(others, 'or')}. These data cannot separate them."
    less = [
        f"{term_name(tried.term)} ({share(diagnosis, tried)})"
        for tried in diagnosis.tried
        if tried.replaces == term.key and not tried.chosen and not tried.refused
    ]
    if less:
        return f"In the place of {name_of(term)}, less probable but not excluded: {listed(less, 'or')}."
    return f"Nothing that was tried explains the data as well as {name_of(term)}."


def next_step(diagnosis: Diagnosis) -> str:
    """What to measure next, with the explanations in words."""
    if diagnosis.next_experiment is None:
        return ""
    return in_words(diagnosis, diagnosis.next_experiment.why).replace(" + ", " and ")


def in_words(diagnosis: Diagnosis, text: str) -> str:
    """A text with the effects and laws that it names by their keys in words."""
    terms: list[Term] = [EffectTerm(name) for name in catalogue()]
    terms += [LawTerm(key, covariate) for key, changed in CHANGED.items() for covariate in changed.covariates]
    terms += [tried.term for tried in diagnosis.tried]
    terms += [other.term for term in diagnosis.terms for other in term.alternatives]
    names = {str(term): term_name(term) for term in terms}
    longest_first = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    return re.sub(rf"\b(?:{longest_first})\b", lambda found: names[found[0]], text)


def declared(test: Experiment) -> str:
    """The effects and laws that a definition declares."""
    laws = [law_name(law.quantity, law.covariate) for law in test.laws.values()]
    return listed([*(plain_name(name) for name in test.effects), *laws])


def named(term: FoundTerm) -> str:
    """An effect or a law with how sure it is, and what the data cannot separate from it."""
    others = f"; or {listed(rivals(term), 'or')}" if rivals(term) else ""
    return f"{name_of(term)} ({sureness(term)}{others})"


def sureness(term: FoundTerm) -> str:
    """`established, 97 %`; the word alone where no probability was computed."""
    return f"{term.strength}, {percent(term.probability)}" if np.isfinite(term.probability) else term.strength


def taken(term: FoundTerm) -> str:
    """How much of the misfit it takes away, where that is not all of it."""
    return f"takes away {percent(1.0 - term.remains)} of the misfit" if term.remains > REPORTED else ""


def law_text(result: FoundLaw) -> str:
    """The law in words: what is changed, by what formula, and over what range of what."""
    law, low, high = result.law, float(np.min(result.curve.value)), float(np.max(result.curve.value))
    act = "times" if law.of.kind == "factor" else "shifted by"
    own = "" if law.of.kind == "factor" else f" {unit(law.of.unit)}"
    formula = f"({result.formula})" if law.of.kind == "factor" else result.formula
    form = formula if law.shape else f"a curve from {number(low)} to {number(high)}{own}".rstrip()
    meaning = "" if law.over.symbol == law.over.label else f", with {law.over.symbol} the {law.over.label}"
    return f"{law.of.label} {act} {form}{meaning} {range_of(law)}".rstrip()


def range_of(law: Law) -> str:
    """Where data were: `from 0 to 420 s`."""
    if law.valid is None:
        return ""
    return f"from {number(law.valid[0])} to {number(law.valid[1])} {unit(law.over.unit)}".rstrip()


def transfer_text(law: Law) -> str:
    """Whether the law can be carried over to another history."""
    if law.transfer == "inside":
        return "inside its range it can be carried over to another history, if it is right"
    what = f"it is known of this history alone, on which {law.over.label} may stand for what changed with it"
    return f"{what}: on another the law may not hold"


def resembles_text(law: FoundLaw) -> str:
    """What of the catalogue does nearly the same."""
    return listed([f"{plain_name(name)} ({percent(share)} of it)" for name, share in law.resembles])


# ------------------------------------------------------------------------------------------------- the verdict


def sentences(diagnosis: Diagnosis) -> list[str]:
    """The verdict in plain sentences, the most important first."""
    if diagnosis.verdict == "no_missing_effect":
        return _nothing_missing(diagnosis)
    if diagnosis.verdict == "unexplained":
        return _what_is_unexplained(diagnosis)
    groups = together(diagnosis)
    lines = [_what_was_found(diagnosis, groups), *difference(diagnosis)]
    lines += [f"Learnt from the data: {law_text(law)}; {transfer_text(law.law)}." for law in diagnosis.laws]
    doubtful = [channel_name(c) for c, terms in groups.items() if any(rivals(term) for term in terms)]
    if doubtful:
        lines.append(f"These data cannot separate the ones named for the {listed(doubtful)} from each other.")
    lines += [f"{sentence(name_of(t))} {taken(t)}." for terms in groups.values() for t in terms if taken(t)]
    lines += [_fall(c, diagnosis.errors[c]) for c in groups if c in diagnosis.errors]
    lines += [f"Part of the disagreement stays unexplained: {rest}." for rest in open_questions(diagnosis)]
    return [*lines, *scatter(diagnosis)]


def difference(diagnosis: Diagnosis) -> list[str]:
    """Where what is printed is not what was judged on held-out samples."""
    return [f"{sentence(in_words(diagnosis, diagnosis.difference))}."] if diagnosis.difference else []


def _what_was_found(diagnosis: Diagnosis, groups: Mapping[str, Sequence[FoundTerm]]) -> str:
    parts = {channel: ", with ".join(named(term) for term in terms) for channel, terms in groups.items()}
    open_ = list(dict.fromkeys(channel_name(u.channel) for u in diagnosis.unexplained))
    rest = f"; something in the {listed(open_)} stays unexplained" if open_ else ""
    if len(parts) == 1:
        return f"The model lacks {listed(list(parts.values()))}{rest}."
    return f"The model lacks {'; '.join(f'in the {channel_name(c)} {text}' for c, text in parts.items())}{rest}."


def _what_is_unexplained(diagnosis: Diagnosis) -> list[str]:
    rest, refused = open_questions(diagnosis), _refused(diagnosis)
    few = {channel_name(channel) for channel in diagnosis.too_few_samples} & set(_open(diagnosis))
    what = (
        "Something is missing" if rest or refused or not diagnosis.step_scatter else "Something differs between steps"
    )
    missing = f"{what} in the {listed(_open(diagnosis))} that no effect and no learnt law explains"
    missing += ", of those that so few samples allow to be tried" if few else ""
    first = f"{missing}: {'; '.join(rest)}." if rest else f"{missing}."
    return [first, *refused, *scatter(diagnosis), *_not_excluded(diagnosis), *difference(diagnosis)]


def _open(diagnosis: Diagnosis) -> list[str]:
    """Names of the channels in which something stays unexplained."""
    open_ = [left.channel for left in diagnosis.unexplained] + [each.channel for each in diagnosis.step_scatter]
    refused = [tried.channel for tried in diagnosis.tried if tried.refused]
    return [channel_name(channel) for channel in dict.fromkeys(open_ or refused)]


def _refused(diagnosis: Diagnosis) -> list[str]:
    """What explains the samples that were fitted and does not predict those held out."""
    names = [term_name(t.term) for t in diagnosis.tried if t.refused and t.refused.reason == "does not predict"]
    return [f"{sentence(listed(names))} explains these samples and does not predict others."] if names else []


def scatter(diagnosis: Diagnosis) -> list[str]:
    """The steps that differ beyond the noise, and what was recorded that differs with them."""
    lines = []
    for each in diagnosis.step_scatter:
        varied = [f"{name} ({percent(share)})" for name, share in each.varied_with.items()]
        of_mu = f", as where mu scatters by {percent(each.mu_scatter)} from step to step" if each.mu_scatter else ""
        with_what = f"; squared rank correlation with what was recorded: {listed(varied)}" if varied else ""
        lines.append(
            f"The {each.steps} steps of {each.test} differ in the {channel_name(each.channel)} by {number(each.size)} "
            f"standard deviations of the noise beyond what the model explains{of_mu}{with_what}."
        )
    return lines


def _nothing_missing(diagnosis: Diagnosis) -> list[str]:
    seen = listed([channel_name(c) for c in channels() if c in diagnosis.errors])
    agree = f"model and measured {seen} agree within noise and tolerances"
    first = f"Nothing is missing: {agree}."
    if elsewhere := _missed_elsewhere(diagnosis):
        first = f"Nothing is missing in what was fitted: {agree}. But {listed(elsewhere)}."
    return [first, *between(diagnosis), *_not_excluded(diagnosis), *difference(diagnosis)]


def _missed_elsewhere(diagnosis: Diagnosis) -> list[str]:
    """Channels of tests that were only predicted in which more is missed than a right model would leave."""
    validation = [diagnosis.validation] if diagnosis.validation else []
    return [
        f"{predicted.test}, only predicted, is missed in the {channel_name(channel)} by {times:.1f} times its noise"
        for predicted in [*validation, *diagnosis.predictions]
        for channel in predicted.errors
        if (times := predicted.missed(channel)) > ACCEPTANCE.missed
    ]


def between(diagnosis: Diagnosis) -> list[str]:
    """What the levels of the tests go with, where nothing is missing but what they may swallow."""
    nothing = diagnosis.verdict == "no_missing_effect"
    return [text for of in diagnosis.levels.values() if nothing and (text := between_text(of))]


def levels(diagnosis: Diagnosis) -> list[str]:
    """The levels of the tests that wander over their order or go with something that differs between them."""
    return [level_text(of) for of in diagnosis.levels.values() if stands_out(of)]


def _not_excluded(diagnosis: Diagnosis) -> list[str]:
    """What may be missing all the same, where nothing was added."""
    names = [f"{term_name(other.term)} ({percent(other.probability)})" for other in diagnosis.not_excluded]
    return [f"Not excluded, chosen in some resamples on too little evidence: {listed(names, 'or')}."] if names else []


def open_questions(diagnosis: Diagnosis) -> list[str]:
    """One phrase a channel: what its unexplained residual depends on."""
    phrases = []
    for channel in channels():
        here = [u for u in diagnosis.unexplained if u.channel == channel]
        if here:
            names, left = [covariate_name(u.covariate) for u in here], f"what is left of the {channel_name(channel)}"
            shares = [percent(u.share_of_variance) for u in here]
            if set(shares) == {percent(0.0)}:
                phrases.append(
                    f"{left} follows no covariate: {listed(names, 'or')} explains {shares[0]} of its variance"
                )
            else:
                of_each = [f"{name} ({share} of the variance)" for name, share in zip(names, shares, strict=True)]
                phrases.append(f"{left} depends on {listed(of_each, 'or')}")
    return phrases


def _fall(channel: str, error: ChannelError) -> str:
    """How far the error fell, on data held out where there are any."""
    held = np.isfinite(error.held_out_before)
    before, after = (error.held_out_before, error.held_out_after) if held else (error.before, error.after)
    where = "on data held out of the fit" if held else "on the data fitted, for none is held out"
    if number(before) == number(after):
        fall = f"stays at {number(after)} {unit(error.unit)}".rstrip()
    else:
        way = "falls" if after < before else "rises"
        fall = f"{way} from {number(before)} to {number(after)} {unit(error.unit)}".rstrip()
    return f"The error of the {channel_name(channel)} {fall} {where}; the noise is {number(error.noise)}."


def floor(errors: Mapping[str, ChannelError]) -> str:
    """What the noise of the channels says of an error, and that it says nothing where it is assumed."""
    assumed = [channel_name(channel) for channel, error in errors.items() if error.assumed]
    if not assumed:
        return (
            "The noise is the scatter of the samples about a right model: an error well above it says that something "
            "is missing. An error may lie somewhat below it by chance, the more the fewer the samples, and where free "
            "parameters, as mu of each step, fit a part of the scatter."
        )
    return (
        f"The noise of the {listed(assumed)} is assumed, one percent of its size, for nothing in the record scatters: "
        "a model may err less, and every significance and probability there rests on that percent."
    )


def against_noise(error: ChannelError) -> str:
    """What the error after says beside the noise."""
    after = error.held_out_after if np.isfinite(error.held_out_after) else error.after
    if not (np.isfinite(after) and error.noise > 0.0):
        return ""
    ratio = after / error.noise
    return "at the noise" if ratio <= AT_FLOOR else f"{number(ratio, 2)} times the noise"


# ------------------------------------------------------------------------------------------------- what was tried


def outcome(diagnosis: Diagnosis, tried: CandidateResult) -> str:
    """What came of an explanation."""
    if tried.chosen:
        return "added to the model"
    if named_beside(diagnosis, tried):
        itself = f"; not the answer itself: {tried.why_not}" if tried.refused else ""
        return f"cannot be separated from what was added{itself}"
    if tried.refused:
        return "the same in other words, counted there" if _is_same(tried) else f"refused: {tried.why_not}"
    if not diagnosis.terms:
        return "not excluded, too little evidence"
    if _fits_as_well(diagnosis, tried):
        return "fits as well, less probable"
    return "fits less well, but by no more than the formulas may err; less probable"


def _fits_as_well(diagnosis: Diagnosis, tried: CandidateResult) -> bool:
    """Whether its chi2 is that of the answer, but for what two that cannot be separated may differ by."""
    best = max((t.gain for t in diagnosis.tried if t.chosen and t.replaces == tried.replaces), default=tried.gain)
    return 0.5 * (best - tried.gain) < SEARCH.equivalent


def length(gain: float) -> float:
    """How much better an explanation makes the fit: the root of the fall of chi2 [1], about 1 by chance."""
    return float(np.sqrt(max(gain, 0.0)))


def ranked(diagnosis: Diagnosis, channel: str) -> list[CandidateResult]:
    """What was tried for a channel, in the place of one term after the other: what holds first, then by its gain."""
    place = {term.key: c for c, terms in together(diagnosis).items() for term in terms}
    here = [t for t in diagnosis.tried if place.get(t.replaces, t.channel) == channel]
    return sorted(
        here,
        key=lambda t: (
            t.replaces, not t.chosen, is_out(diagnosis, t), -np.nan_to_num(probability(diagnosis, t)), -t.gain
        ),
    )  # fmt: skip


def base_meaning(estimate: BaseEstimate) -> str:
    """What a base parameter is, and of which test."""
    base = base_named(estimate.parameter)
    meaning = base.meaning if base and base.meaning else estimate.parameter
    return f"{meaning} ({estimate.test})" if estimate.test else meaning


def base_note(diagnosis: Diagnosis) -> str:
    """With what the K of the revised model goes, where something that acts on the wear was added."""
    known = any(estimate.parameter == "K" for estimate in diagnosis.base.values())
    added = [name_of(term) for c in WORN for term in together(diagnosis).get(c, [])]
    if not (known and added):
        return ""
    return (
        f"This K goes with what was added ({listed(added)}): use it with revised.toml, and the K of fit-k with the "
        "model as it was. The two differ because they share out the same worn volume in another way."
    )


def seen(diagnosis: Diagnosis, channel: str) -> str:
    """What is to be seen in the figure of a channel, for those who do not see it."""
    laws = [f"A learnt curve: {law_text(result)}." for result in diagnosis.laws if result.channel == channel]
    return " ".join([_seen_in_panels(diagnosis, channel), *laws])


def _seen_in_panels(diagnosis: Diagnosis, channel: str) -> str:
    error, unit_ = diagnosis.errors[channel], unit(diagnosis.errors[channel].unit)
    samples = sum(len(curve.measured) for curve in diagnosis.curves if curve.channel == channel)
    course = (
        f"{sentence(channel_name(channel))}: {samples} samples; the model before is off by {number(error.before)} "
        f"{unit_}".rstrip()
        + f" (root mean square), the model after by {number(error.after)}, at a noise of {number(error.noise)}."
    )
    ranking = ranked(diagnosis, channel)
    if not ranking:
        return f"{course} Nothing was tried."
    best = max(ranking, key=lambda tried: tried.gain)
    chosen = [term_name(tried.term) for tried in ranking if tried.chosen]
    end = f", chosen: {listed(chosen)}" if chosen else ", none chosen"
    return f"{course} {len(ranking)} explanations as bars, the longest {term_name(best.term)}{end}."


def interval(estimate: Estimate) -> str:
    """The 90 % interval as text, with as many digits as distinguish its ends."""
    return " to ".join(apart(estimate.low, estimate.high))


def value(estimate: Estimate) -> str:
    """The value with its unit."""
    return f"{number(estimate.value)} {unit(estimate.unit)}".rstrip()
