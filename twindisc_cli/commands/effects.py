"""effects: the catalogue of physical effects, or one of them explained."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from twindisc_cli.definition import load
from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect, Param
from twindisc_cli.errors import DefinitionError, Problem, did_you_mean
from twindisc_cli.loop.channels import channels
from twindisc_cli.report.effect_file import effect_file
from twindisc_cli.report.words import explanation
from twindisc_cli.results import Dataset, Result

_INDENT = "  "


def run(name: str | None) -> Result:
    """List every effect by the channel it shows in first, or explain the one named."""
    if name is None:
        return _result(_listed(), {"effects": [_brief(n, e) for n, e in catalogue().items()]})
    effect = catalogue().get(name)
    if effect is None:
        near = did_you_mean(name, catalogue())
        raise DefinitionError(Problem(f"no effect is called {name}{near or '; `twindisc effects` lists them all'}"))
    return _result(_explained(name, effect), _full(name, effect))


def from_law(path: Path, name: str | None) -> str:
    """The effect file of a law that a definition declares; `name` says which where there are several."""
    test = load(path).experiment
    if not test.laws:
        raise DefinitionError(Problem("declares no law: close-loop writes one where it learnt one", path, key="laws"))
    if name is None and len(test.laws) > 1:
        raise DefinitionError(Problem(f"declares several laws; name one of {', '.join(test.laws)}", path, key="laws"))
    name = name or next(iter(test.laws))
    if name not in test.laws:
        what = f"declares no law called {name}{did_you_mean(name, test.laws)}"
        raise DefinitionError(Problem(what, path, key="laws"))
    if test.laws[name].local:
        what = f"{name} is asked strip by strip, which no effect file does; it stays a law"
        raise DefinitionError(Problem(what, path, key=f"laws.{name}"))
    return effect_file(name, test.laws[name], test)


def _result(lines: list[str], json: dict[str, Any]) -> Result:
    return Result("effects", tuple(lines), json, Dataset((), ()), figure=None)


def _summary(effect: Effect) -> str:
    """The first line of the explanation, without the effect's name."""
    first = effect.explanation.partition("\n")[0]
    return first.partition(": ")[2] or first


def _listed() -> list[str]:
    """One line an effect, channel by channel."""
    width = max(map(len, catalogue()))
    lines = []
    for channel in channels():
        chosen = [(n, e) for n, e in catalogue().items() if e.channel == channel]
        lines += [f"seen first in the {channel}"] * bool(chosen)
        lines += [f"{_INDENT}{n:<{width}}  {_summary(e)}" for n, e in chosen]
    return [*lines, "`twindisc effects NAME` explains one"]


def _explained(name: str, effect: Effect) -> list[str]:
    """Formula and symbols, the parameters as a definition takes them, channels and source."""
    seen = ", ".join(channel for channel in channels() if channel in effect.seen_in)
    return [
        name,
        "",
        *explanation(name).splitlines(),
        "",
        f"Seen in: {seen}; first in the {effect.channel}.",
        f"Source: {effect.source}.",
        "",
        "Declared in a test definition, with typical values:",
        f"{_INDENT}[effects.{name}]",
        *(f"{_INDENT}{line}" for line in _aligned(effect.params)),
    ]


def _aligned(params: tuple[Param, ...]) -> list[str]:
    """`key = value  # meaning [unit], bounds` for each parameter, the comments under each other."""
    pairs = [f"{p.name} = {p.start}" for p in params]
    width = max(map(len, pairs))
    return [f"{pair:<{width}}  # {_remark(p)}" for pair, p in zip(pairs, params, strict=True)]


def _remark(p: Param) -> str:
    off = "" if p.off is None else f"; {p.off:g} switches it off"
    return f"{p.meaning} [{p.unit}], {p.lower:g} to {p.upper:g}{off}"


def _brief(name: str, effect: Effect) -> dict[str, Any]:
    return {"effect": name, "channel": effect.channel, "summary": _summary(effect)}


def _full(name: str, effect: Effect) -> dict[str, Any]:
    return {
        **_brief(name, effect),
        "stage": effect.stage,
        "seen_in": [channel for channel in channels() if channel in effect.seen_in],
        "explanation": explanation(name),
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit,
                "meaning": p.meaning,
                "start": p.start,
                "lower": p.lower,
                "upper": p.upper,
                "off": p.off,
            }
            for p in effect.params
        ],
        "source": effect.source,
    }
