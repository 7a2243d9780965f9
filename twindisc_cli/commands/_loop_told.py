"""What a diagnosis says, in words: shared by the terminal, the figure and the page of close-loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twindisc_cli.effects._effect import CHANNELS, Channel
from twindisc_cli.loop.diagnosis import ChannelError, Diagnosis, Estimate, FoundEffect, Tried, Unexplained
from twindisc_cli.loop.search import REFUSAL
from twindisc_cli.report.words import CHANNEL, COVARIATE, listed, number, percent, plain_name, unit

TOO_LITTLE = 12.0
"""Fall of chi2 below which an explanation takes away no more than chance would."""
AT_FLOOR = 1.15
BASE: Mapping[str, tuple[str, str]] = {
    "mu": ("friction_coefficient", "coefficient of friction of the base model"),
    "K": ("wear_coefficient", "wear coefficient of the base model"),
    "convection_W_K": ("convection_W_K", "convection h S of the disc"),
}
"""Base parameters: their key in the definition, and what they are."""


def provenance(kinds: Sequence[str]) -> str:
    """Where the data are from; several kinds are named together."""
    return listed(list(dict.fromkeys(kinds)))


def together(diagnosis: Diagnosis) -> dict[Channel, list[FoundEffect]]:
    """The effects that were added, by the channel they were added for."""
    return {c: found for c in CHANNELS if (found := [e for e in diagnosis.effects if e.channel == c])}


def named(effects: Sequence[FoundEffect]) -> str:
    """The effects of one channel; where the data cannot tell them from others, all of them."""
    sure = listed([plain_name(e.name) for e in effects])
    others = [plain_name(name) for name in effects[0].alternatives]
    return listed([sure, *others], "or") if others else sure


def sentences(diagnosis: Diagnosis) -> list[str]:
    """The verdict in plain sentences, the most important first."""
    told = {
        "effects_found": _what_was_found,
        "unexplained": _what_is_unexplained,
        "no_missing_effect": _nothing_missing,
    }[diagnosis.verdict](diagnosis)
    if diagnosis.verdict == "effects_found":
        told += [_fall(c, diagnosis.errors[c]) for c in together(diagnosis) if c in diagnosis.errors]
        told += [f"Part of the disagreement stays unexplained: {rest}." for rest in leftovers(diagnosis)]
    return told


def _what_was_found(diagnosis: Diagnosis) -> list[str]:
    groups = together(diagnosis)
    parts = [f"in the {CHANNEL[channel]} {named(effects)}" for channel, effects in groups.items()]
    open_ = list(dict.fromkeys(CHANNEL[u.channel] for u in diagnosis.unexplained))
    rest = f"; something in the {listed(open_)} stays unexplained" if open_ else ""
    lacks = listed([named(e) for e in groups.values()]) if len(parts) == 1 else "; ".join(parts)
    told = [f"The model lacks {lacks}{rest}."]
    doubtful = [CHANNEL[c] for c, effects in groups.items() if effects[0].alternatives]
    if doubtful:
        told.append(f"These data cannot tell the ones named for the {listed(doubtful)} from each other.")
    return told


def _what_is_unexplained(diagnosis: Diagnosis) -> list[str]:
    channels = list(dict.fromkeys(CHANNEL[u.channel] for u in diagnosis.unexplained))
    told = f"Something is missing in the {listed(channels)} that no effect of the catalogue explains"
    return [f"{told}: {'; '.join(leftovers(diagnosis))}."]


def _nothing_missing(diagnosis: Diagnosis) -> list[str]:
    channels = listed([CHANNEL[c] for c in CHANNELS if c in diagnosis.errors])
    return [f"Nothing is missing: model and measured {channels} agree within the noise."]


def leftovers(diagnosis: Diagnosis) -> list[str]:
    """One phrase a channel: what its leftover depends on."""
    phrases = []
    for channel in CHANNELS:
        here = [u for u in diagnosis.unexplained if u.channel == channel]
        if here:
            what = listed([f"{covariate(u)} ({percent(u.share_of_variance)} of the variance)" for u in here], "or")
            phrases.append(f"what is left of the {CHANNEL[channel]} depends on {what}")
    return phrases


def covariate(left: Unexplained) -> str:
    """What a leftover depends on."""
    return COVARIATE.get(left.covariate, left.covariate)


def _fall(channel: Channel, error: ChannelError) -> str:
    """How far the error fell, on data held out where there are any."""
    held = np.isfinite(error.held_out_before)
    before, after = (error.held_out_before, error.held_out_after) if held else (error.before, error.after)
    where = "on data held out of the fit" if held else "on the data fitted, for none could be held out"
    fall = f"falls from {number(before)} to {number(after)} {unit(error.unit)}".rstrip()
    return f"The error of the {CHANNEL[channel]} {fall} {where}; the noise is {number(error.noise)}."


def against_noise(error: ChannelError) -> str:
    """What the error after says beside the noise."""
    after = error.held_out_after if np.isfinite(error.held_out_after) else error.after
    if not (np.isfinite(after) and error.noise > 0.0):
        return ""
    ratio = after / error.noise
    return "at the noise" if ratio <= AT_FLOOR else f"{number(ratio, 2)} times the noise"


def outcome(tried: Tried) -> tuple[str, str]:
    """What came of an explanation: in a word for the figure, in a sentence for the page."""
    if tried.passed:
        return percent(tried.probability), "holds"
    if tried.gain < TOO_LITTLE:
        return "too little", "takes away no more than chance would"
    if tried.at_bound:
        keys = listed([name.rpartition(".")[2] for name in tried.at_bound])
        return "at a bound", f"refused: {keys} ran into a bound"
    if tried.left_p_value <= REFUSAL:
        return "leaves structure", "refused: what it leaves is not noise"
    return "too little", "refused: takes away too little"


def length(gain: float) -> float:
    """The misfit an explanation takes away [noise units], from the fall of chi2."""
    return float(np.sqrt(max(gain, 0.0)))


def ranked(diagnosis: Diagnosis, channel: Channel) -> list[Tried]:
    """Explanations tried for a channel: those that hold by probability, then the others by what they take away."""
    here = [t for t in diagnosis.tried if t.channel == channel]
    return sorted(here, key=lambda t: (not t.passed, -t.probability, -t.gain))


def is_chosen(diagnosis: Diagnosis, tried: Tried) -> bool:
    """Whether this explanation is the one that was added."""
    return tried.passed and tuple(e.name for e in diagnosis.effects if e.channel == tried.channel) == tried.effects


def base_meaning(name: str) -> str:
    """What a base parameter is; several tests have one each, which carries the test's name."""
    key, _, test = name.partition(" ")
    meaning = BASE.get(key, ("", key))[1]
    return f"{meaning} {test}".strip()


def interval(estimate: Estimate) -> str:
    """The 90 % interval as text."""
    return f"{number(estimate.low)} to {number(estimate.high)}"
