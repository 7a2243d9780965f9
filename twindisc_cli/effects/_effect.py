"""How an effect is declared: its parameters, its stage, the channels it is seen in, and its source."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from twindisc_cli.effects._state import State

Channel = Literal["traction", "profile", "temperature"]
Stage = Literal["operation", "friction", "traction", "contact", "wear", "heat", "sensor"]
STAGES: tuple[Stage, ...] = ("operation", "friction", "traction", "contact", "wear", "heat", "sensor")


@dataclass(frozen=True)
class Param:
    """One parameter of an effect.

    `name` is the key in the test definition (its unit at the end of the name, where it has one); `unit` is the
    unit of the value given there. With the value `off` the effect does nothing, whatever the others are; None
    marks a parameter that only shapes the effect. `start` is a typical size.
    """

    name: str
    unit: str
    off: float | None
    start: float
    lower: float
    upper: float
    meaning: str = ""


@dataclass(frozen=True)
class Effect:
    """A physical effect the base model lacks.

    `channel` is where it shows first; `seen_in` every channel that changes when it is switched on.
    """

    stage: Stage
    channel: Channel
    seen_in: frozenset[Channel]
    params: tuple[Param, ...]
    apply: Callable[..., State]
    source: str
    summary: str
    valid: str
    leaves_behind: str
