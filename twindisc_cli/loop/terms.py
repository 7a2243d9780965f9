"""What a term of an explanation is, whatever its form: an effect of the catalogue, or a law learnt from the data.

Where several tests are explained together, a term may act in one of them alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from twindisc_cli.effects._effect import Effect
from twindisc_cli.laws.trial import Trial


def in_test(name: str, test: str) -> str:
    """The name of a term that acts in one test alone."""
    return f"{name} in {test}" if test else name


@dataclass(frozen=True, order=True)
class EffectTerm:
    """An effect of the catalogue; `test`: the only one it acts in."""

    name: str
    test: str = ""

    def __str__(self) -> str:
        """The effect's name, and its test."""
        return in_test(self.name, self.test)


@dataclass(frozen=True, order=True)
class LawTerm:
    """A law: a quantity of the model that changes over a covariate; `test`: the only one it acts in."""

    quantity: str
    covariate: str
    test: str = ""

    def __str__(self) -> str:
        """`quantity over covariate`, and its test."""
        return in_test(f"{self.quantity} over {self.covariate}", self.test)


Term = EffectTerm | LawTerm


def term_of(name: str, effect: Effect) -> Term:
    """What a term is, by the name under which a problem holds it and by how it acts."""
    if isinstance(effect, Trial):
        return LawTerm(effect.quantity, effect.covariate, effect.test)
    return EffectTerm(name.removesuffix(in_test("", effect.test)), effect.test)


@dataclass(frozen=True)
class Alternative:
    """A term that these data cannot separate from another, with its probability; NaN where it was not computed."""

    term: Term
    probability: float


def joined(terms: Iterable[Term], word: str = " and ") -> str:
    """The terms in one text, in the order of their names."""
    return word.join(sorted(str(term) for term in terms))
