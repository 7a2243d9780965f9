"""What a term of an explanation is, whatever its form: an effect of the catalogue, or a law learnt from the data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class EffectTerm:
    """An effect of the catalogue."""

    name: str

    def __str__(self) -> str:
        """The effect's name."""
        return self.name


@dataclass(frozen=True, order=True)
class LawTerm:
    """A law: a quantity of the model that changes over a covariate."""

    quantity: str
    covariate: str

    def __str__(self) -> str:
        """`quantity over covariate`."""
        return f"{self.quantity} over {self.covariate}"


Term = EffectTerm | LawTerm


@dataclass(frozen=True)
class Alternative:
    """A term that these data cannot tell from another, with its probability; NaN where it was not computed."""

    term: Term
    probability: float


def joined(terms: Iterable[Term], word: str = " and ") -> str:
    """The terms in one text, in the order of their names."""
    return word.join(sorted(str(term) for term in terms))
