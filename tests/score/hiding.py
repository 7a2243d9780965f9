"""What can be hidden, by name: an effect of the catalogue, one of its near-misses, or a law that is in no catalogue.

"falling_friction"            the effect by the formula of the literature
"falling_friction~hyperbola"  the same mechanism by another formula
"mu_over_time:window"         a law
"""

from __future__ import annotations

from dataclasses import dataclass

from numpy.random import Generator

from . import unknowns
from .effects import CATALOGUE, COVARIATE, NEEDS_STOPS, Drawn
from .forms import FORMS
from .rig import Rig, Trace


@dataclass(frozen=True)
class Law:
    """What is hidden, as a law: the quantities that cannot be told apart, the covariate, and its shape or form."""

    quantities: tuple[str, ...]
    covariate: str
    shape: str


def near_misses() -> list[str]:
    """The names of all near-misses."""
    return [f"{effect}~{form}" for effect, forms in FORMS.items() for form in forms]


def effect_of(name: str) -> str | None:
    """The effect of the catalogue that is meant by a hidden one; None for a law that is in no catalogue."""
    effect = name.partition("~")[0]
    return effect if effect in CATALOGUE else None


def law_of(name: str) -> Law | None:
    """What is hidden as a law; None for an effect by its own formula and for what is no law of one covariate."""
    effect, _, form = name.partition("~")
    if form:
        law = FORMS[effect][form].law
        return Law(law[:-1], law[-1], form) if law else None
    if effect in CATALOGUE:
        return None
    quantity, covariate, shape = unknowns.parts(name)
    return Law((quantity,), covariate, shape)


def covariate_of(name: str) -> str | None:
    """What a hidden effect depends on; None for what is there all the time alike."""
    law = law_of(name)
    return law.covariate if law else COVARIATE.get(name.partition("~")[0])


def channel_of(name: str) -> str:
    """Where a hidden effect shows first."""
    effect = effect_of(name)
    return CATALOGUE[effect][0] if effect else unknowns.STAGES[unknowns.parts(name)[0]].channel


def needs_stops(name: str) -> bool:
    """Whether only profiles at several stops can show it."""
    effect = effect_of(name)
    return effect in NEEDS_STOPS if effect else unknowns.STAGES[unknowns.parts(name)[0]].stops


def acts_in_partial_slip(name: str) -> bool:
    """Whether it acts only where the patch sticks, to which the history must come back."""
    return effect_of(name) is None and unknowns.parts(name)[0] in ("slope", "creepage")


def draw(name: str, rng: Generator, rig: Rig, base: Trace) -> Drawn:
    """Draw the shape of what is named for a rig and its undisturbed march."""
    effect, _, form = name.partition("~")
    if form:
        return FORMS[effect][form].draw(rng, rig, base)
    return CATALOGUE[effect][1](rng, rig, base) if effect in CATALOGUE else unknowns.draw(name, rng, rig, base)
