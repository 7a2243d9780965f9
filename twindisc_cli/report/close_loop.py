"""The page of the closed loop: one HTML file that needs nothing beside it and reads well when printed."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass

from twindisc_cli import __version__


@dataclass(frozen=True)
class ErrorRow:
    """Error of one channel, as text with its unit: noise, before and after, fitted and held out; the comment on it."""

    channel: str
    unit: str
    noise: str
    before: str
    after: str
    held_out_before: str
    held_out_after: str
    comment: str


@dataclass(frozen=True)
class Value:
    """A parameter: key in the definition, meaning, value ± standard deviation, 90 % interval."""

    name: str
    meaning: str
    value: str
    interval: str


@dataclass(frozen=True)
class Effect:
    """An effect: key in the definition, what it is called, its explanation and source."""

    key: str
    name: str
    explanation: str
    source: str


@dataclass(frozen=True)
class Found:
    """What was added for one channel: the effects with their parameters, and what these data cannot tell from them."""

    channel: str
    probability: str
    effects: Sequence[tuple[Effect, Sequence[Value]]]
    alternatives: Sequence[Effect]


@dataclass(frozen=True)
class Left:
    """Something unexplained: channel, covariate, its shape, share of variance, significance, and where to look."""

    channel: str
    covariate: str
    kind: str
    share: str
    significance: str
    look_at: str


@dataclass(frozen=True)
class TriedRow:
    """One explanation that was tried, and what came of it."""

    channel: str
    names: str
    gain: str
    probability: str
    left: str
    outcome: str
    passed: bool


@dataclass(frozen=True)
class Next:
    """The next experiment: why, the history to copy, and the channel that would settle it."""

    why: str
    history: str
    channel_wanted: str


@dataclass(frozen=True)
class Source:
    """A test: name, description, where its data are from, what was measured, declared and held out, and its files."""

    name: str
    description: str
    role: str
    provenance: str
    measured: str
    declared: str
    held_out: str
    files: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Page:
    """Everything the page tells, as text."""

    title: str
    verdict: str
    sentences: Sequence[str]
    errors: Sequence[ErrorRow]
    found: Sequence[Found]
    left: Sequence[Left]
    next: Next | None
    base: Sequence[Value]
    tried: Sequence[TriedRow]
    validation: str
    validation_errors: Sequence[ErrorRow]
    notes: Sequence[str]
    sources: Sequence[Source]
    provenance: str


def render(page: Page, *, figure: bytes) -> str:
    """The page as HTML, the figure (a PNG) inside."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("twindisc_cli", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.get_template("close_loop.html")
    return template.render(page=page, figure=b64encode(figure).decode("ascii"), version=__version__)
