"""How an effect is declared: its parameters, its stage, the channels it is seen in, and its source."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from twindisc_cli.effects._state import State

Floats = NDArray[np.float64]

Channel = str
"""The name of a measured channel."""
Stage = Literal["operation", "friction", "traction", "contact", "wear", "heat", "surface", "sensor"]
STAGES: tuple[Stage, ...] = get_args(Stage)
FIRST_SEEN: Mapping[Stage, Channel] = {
    "operation": "traction", "friction": "traction", "traction": "traction",
    "contact": "profile", "wear": "profile", "surface": "profile", "heat": "temperature",
}  # fmt: skip
"""The channel in which an effect of a stage shows first."""
SEEN_IN: Mapping[Stage, frozenset[Channel]] = dict.fromkeys(
    ("operation", "friction", "traction", "contact", "wear"), frozenset({"traction", "profile", "temperature"})
)
"""The channels that an effect of a stage may change; of another stage it is the one in which it shows first."""


@dataclass(frozen=True)
class Param:
    """One parameter of an effect.

    `name` is its key in the test definition and the keyword of the effect's function; `unit` is the unit of that
    value. With the value `off` the effect does nothing; None marks a parameter that only shapes it. `start` is a
    typical size. A `log` parameter is positive and spans decades; a `normal` one is expected to be of order one.
    `width_of` a transition names the parameter of its place: at its lower bound the transition is a jump there.
    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float
    meaning: str
    off: float | None = None
    log: bool = False
    normal: bool = False
    width_of: str = ""


@dataclass(frozen=True)
class Effect:
    """A physical effect the base model lacks.

    `channel` is where it shows first; `seen_in` every channel that may change when it is switched on: those of its
    stage (FIRST_SEEN, SEEN_IN) unless it names others; an effect of a sensor names its channel. An effect that
    `needs_stops` is not separated from the base model by one final profile; one that `needs_temperature` does nothing
    where the disc's temperature is not known; one that `needs_time` is not tried on samples of no known time;
    one that `needs_yaw` not where no step declares a yaw: its longitudinal force alone is that of a softer contact;
    one that `needs_crowns` not where wear with other crowns is not tabulated (loads that change, K that differs from
    strip to strip): each of its sizes would have to be integrated.
    A `local` effect of the stage `wear` is asked strip by strip: it gets the wear index of strips across the track, and
    may use nothing else that changes along the test.
    `level_of` names the base parameter that tests share and of which the effect is the level in one of them: it is
    tried only where several tests are explained together, and in one alone.
    `over` is the covariate of a learnt law that the effect changes over; "" where it is no law of a single one.
    One that is `exact` adds a constant, or a straight line, to a record: no formula of it can err.
    `same_as` says what is outside the catalogue and does the same, or nearly, to all that is recorded.
    Where several tests are explained together, `test` names the only one that it acts in.
    The module's docstring is its explanation: formula, symbols, what it leaves behind, validity.
    """

    stage: Stage
    params: tuple[Param, ...]
    apply: Callable[..., State]
    source: str
    channel: Channel = ""
    seen_in: frozenset[Channel] = frozenset()
    needs_stops: bool = False
    needs_temperature: bool = False
    needs_time: bool = False
    needs_yaw: bool = False
    needs_crowns: bool = False
    local: bool = False
    level_of: str = ""
    over: str = ""
    exact: bool = False
    same_as: str = ""
    test: str = ""

    def __post_init__(self) -> None:
        """Take from the stage what is not named."""
        channel = self.channel or FIRST_SEEN[self.stage]
        object.__setattr__(self, "channel", channel)
        object.__setattr__(self, "seen_in", self.seen_in or SEEN_IN.get(self.stage, frozenset({channel})))

    def is_off(self, **parameters: Floats) -> bool:
        """Whether every parameter that can switch the effect off does so."""
        return all(bool(np.all(parameters[p.name] == p.off)) for p in self.params if p.off is not None)

    @property
    def explanation(self) -> str:
        """Formula, symbols, what the effect leaves behind when it is missing, and where it is valid."""
        return (self.apply.__globals__["__doc__"] or "").strip()


def seen(*channels: Channel) -> frozenset[Channel]:
    """Return the set of channels in which an effect is seen."""
    return frozenset(channels)
