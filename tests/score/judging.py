"""What is right in an answer: hidden effects, laws that are in no catalogue, errors held out and on another history.

An answer's explanation is an effect of the catalogue or a law (quantity over covariate); its set is itself and its
alternatives. Laws are compared by what the data can tell: covariates that are functions of each other are one. Of the
program this takes its words alone: at which stage of the model an effect or a law acts.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.quantities import QUANTITIES

from .unknowns import STAGES

Row = dict[str, Any]
Pair = tuple[str, str]  # quantity, covariate
_SLACK = 1.15  # of the held-out error over the noise
_SLACK_ELSEWHERE = 1.25  # of the error on another history over the noise
_WORSE = 1.05  # from which an error is worse than another
_LARGEST_SET = 3
_WARNING = re.compile(
    r"(outside|beyond|inside) [^.;]*range|transfer|extrapolat|(another|other|same|this) histor", re.IGNORECASE
)
_LAW_NAME = re.compile(f"({'|'.join(sorted(STAGES, key=len, reverse=True))})[_ ]over[_ ]([a-z_]+)")
# key in the answer and in the truth; mu is the traction over the load that was set
_BASE = {"traction": ("mu", "mu"), "profile": ("K", "K"), "temperature": ("convection_W_K", "hS")}


def judge(truth: Row, answer: Row) -> Row:
    """What was right in one answer; the keys depend on what was hidden.

    What is there beside it (a sensor's fault, the other traction law) may be found, by its name or in a set.
    """
    if "failed" in answer:
        return {"failed": True}
    names = [] if isinstance(truth["truth"], str) else truth["truth"]
    tolerated = {*truth.get("tolerated", [])} - {*names}
    named = [e for e in answer["effects"] if _is_meant(truth, _members(e)) or not tolerated & _members(e)]
    laws, leftover = answer.get("laws", []), answer["unexplained"]
    flags: Row = {
        "failed": False,
        "alarm": bool(named or laws or leftover),
        "named": bool(named),
        "law": bool(laws),
        "at_floor": _at_floor(truth, answer),
        "told": [*_told(truth, [*named, *laws])],
        "covered": _covered(truth, answer),
    }
    flags |= _elsewhere(truth, answer)
    hidden = hidden_law(truth)
    if hidden is not None and not names:
        return flags | _judge_unknown(hidden, named, laws, leftover)
    sets = [_members(e) for e in [*named, *laws]]
    for i, name in enumerate(names):
        flags[f"found_{i}"] = any(name in s and len(s) <= _LARGEST_SET for s in sets)
        flags[f"first_{i}"] = any(e["effect"] == name for e in named)
        flags[f"in_any_set_{i}"] = any(name in s for s in sets)
    flags["false"] = sum(not _is_meant(truth, s) for s in sets)
    flags["mechanism"] = any(flags[f"found_{i}"] for i in range(len(names))) or (
        hidden is not None and any(_is_law(_key(law), hidden) for law in laws)
    )
    return flags


def hidden_law(truth: Row) -> Row | None:
    """The law that was hidden, or the one that a formula off the catalogue's amounts to; None if there is none."""
    if truth.get("law"):
        return dict(truth["law"])
    if not isinstance(truth["truth"], str):
        return None
    _, channel, covariate = truth["truth"].split(":")
    quantities = [name for name, stage in STAGES.items() if stage.channel == channel]
    return {"quantities": quantities, "equivalent": truth.get("covariates") or [covariate], "channel": channel}


def _members(explanation: Row) -> set[str | Pair]:
    """What an effect or a law and its alternatives say: names of effects, pairs of laws."""
    return {_key(part) for part in (explanation, *explanation.get("alternatives", []))}


def _key(part: str | Row) -> str | Pair:
    if isinstance(part, str):
        law = _LAW_NAME.fullmatch(part)
        return (law[1], law[2]) if law else part
    if "effect" in part:
        return str(part["effect"])
    return (str(part["quantity"]), str(part["covariate"])) if part.get("covariate") else str(part["quantity"])


def _is_law(member: str | Pair, hidden: Row) -> bool:
    return isinstance(member, tuple) and member[0] in hidden["quantities"] and member[1] in hidden["equivalent"]


def _is_meant(truth: Row, members: Iterable[str | Pair]) -> bool:
    """Whether a hidden effect, or the law that it amounts to, is among the members of a set."""
    hidden = hidden_law(truth)
    names = {*truth["truth"], *truth.get("alternatives", [])} if not isinstance(truth["truth"], str) else set()
    return any(m in names or (hidden is not None and _is_law(m, hidden)) for m in members)


def _judge_unknown(hidden: Row, named: Sequence[Row], laws: Sequence[Row], leftover: Sequence[Row]) -> Row:
    told = {m for e in [*named, *laws] for m in _members(e)}
    pair = any(_is_law(m, hidden) for m in told)
    channels = {STAGES[q].channel for q in hidden["quantities"]}
    return {
        "stage": any(_stage(e) in {QUANTITIES[q].stage for q in hidden["quantities"]} for e in [*named, *laws]),
        "quantity": any(law["quantity"] in hidden["quantities"] for law in laws),
        "first": any(_is_law(_key(law), hidden) for law in laws),
        "pair": pair,
        "wrong_name": bool(named) and not pair,
        "false": sum(not any(_is_law(m, hidden) for m in _members(e)) for e in named),
        "left": bool(leftover) and not named and not laws,
        "left_in_channel": any(u["channel"] in channels for u in leftover),
    }


def _stage(explanation: Row) -> str:
    """The stage of the model at which an effect or a law acts."""
    if "effect" in explanation:
        return catalogue()[explanation["effect"]].stage
    return QUANTITIES[explanation["quantity"]].stage


def _told(truth: Row, explanations: Sequence[Row]) -> Iterator[tuple[float, bool]]:
    """Every probability in an answer, and whether what it was told of is right.

    What the data of the test cannot tell apart is one claim, with the sum of the probabilities: laws over covariates
    that are one on its history, quantities that show alike, and a hidden mechanism by its name or as its law.
    """
    hidden = hidden_law(truth)
    for explanation in explanations:
        claims: dict[str | Pair, tuple[float, list[str | Pair]]] = {}
        for part in (explanation, *explanation.get("alternatives", [])):
            if isinstance(part, Mapping) and part.get("probability") is not None:
                key = _key(dict(part))
                what = _claim(truth, hidden, key)
                probability, members = claims.get(what, (0.0, []))
                claims[what] = (probability + float(part["probability"]), [*members, key])
        for probability, members in claims.values():
            yield min(probability, 1.0), _is_meant(truth, members)


def _claim(truth: Row, hidden: Row | None, member: str | Pair) -> str | Pair:
    """One of all members that the data of the test cannot tell from this one."""
    if hidden is not None and isinstance(truth["truth"], list) and member in truth["truth"]:
        member = (hidden["quantities"][0], hidden["equivalent"][0])
    if isinstance(member, str):
        return member
    alike = hidden["quantities"] if hidden is not None else []
    return min(alike) if member[0] in alike else member[0], min(truth.get("same", {}).get(member[1], [member[1]]))


def _covered(truth: Row, answer: Row) -> list[bool]:
    """Whether the intervals of the base parameters hold the truth; of channels that nothing hidden shows in first."""
    shown = {*truth.get("channels", ())}
    pairs = [_BASE[channel] for channel in _BASE if channel not in shown]
    given = [(answer["base"].get(key, {}), truth.get(true)) for key, true in pairs]
    return [e["low"] <= true <= e["high"] for e, true in given if true is not None and e.get("low") is not None]


# ---------------------------------------------------------------------------------------------- errors


def _elsewhere(truth: Row, answer: Row) -> Row:
    """Errors over the noise on the history that was never fitted, before and after; {} where none was predicted."""
    validation = answer.get("validation")
    if not validation:
        return {}
    floor = truth.get("noise_other", {})
    ratios = {
        channel: [_error(error, when) / max(error["noise"], floor.get(channel, 0.0)) for when in ("before", "after")]
        for channel, error in validation["error"].items()
        if error and _error(error, "after") is not None
    }
    worse = any(after > max(_WORSE * before, _SLACK_ELSEWHERE) for before, after in ratios.values())
    notes = [*answer.get("notes", []), *validation.get("notes", []), *validation.get("warnings", [])]
    return {
        "elsewhere": ratios,
        "transferred": all(after <= _SLACK_ELSEWHERE for _, after in ratios.values()),
        "warned": any(_WARNING.search(note) for note in notes),
        "worse": worse,
    }


def _error(error: Row, when: str) -> Any:
    """The error `when` before or after; None where it is not given or no number."""
    found = (error.get(key) for key in (when, f"held_out_{when}"))
    return next((value for value in found if value is not None and np.isfinite(value)), None)


def _at_floor(truth: Row, answer: Row) -> bool | None:
    """Whether the held-out error after is within 15 % of the noise in every channel; None where it is not given."""
    verdicts = []
    for channel, error in answer["error"].items():
        after = error.get("held_out_after")
        if after is None or channel not in truth.get("noise", {channel: 0.0}):
            continue
        floor = max(error["noise"], _held_out_noise(truth, answer, channel))
        verdicts.append(after <= _SLACK * floor)
    return all(verdicts) if verdicts else None


def _held_out_noise(truth: Row, answer: Row, channel: str) -> float:
    """The true noise (1, um, K) of what the loop held out.

    Steps, and the last iteration of every second other one; in a profile the third of every five bands.
    """
    noise = truth.get("noise", {}).get(channel, 0.0)
    if not isinstance(noise, list):
        return float(noise)
    if channel == "profile":
        return _root_mean(noise, range(2, len(noise), 5))
    steps = {step for held in answer.get("hold_out_steps", {}).values() for step in held}
    ends = np.cumsum(truth["iterations"])
    last = [step for step in range(1, len(ends) + 1) if step not in steps][1::2]
    held = [
        i
        for step, (end, count) in enumerate(zip(ends, truth["iterations"], strict=True), start=1)
        for i in range(end - (count if step in steps else 1 if step in last else 0), end)
    ]
    return _root_mean(noise, [i for i in held if i < len(noise)])


def _root_mean(noise: Sequence[Sequence[float]], parts: Iterable[int]) -> float:
    """Root mean square over some parts of samples and sums of squares."""
    count, total = np.array(noise)[list(parts)].sum(axis=0)
    return float(np.sqrt(total / max(count, 1)))
