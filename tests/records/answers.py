"""What the loop says of records and of parts of them, and whether it comes back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis, Estimate, LawCurve
from twindisc_cli.loop.explain import explain
from twindisc_cli.loop.validate import predict_test
from twindisc_cli.model.experiment import Experiment

from .sources import shipped, sweeps
from .splits import part

LEARNT = 5


def silent(_what: str, _share: float) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True)
class Said:
    """What is named with its probability, and with it all that these data cannot tell from it, or from nothing.

    sets: the probability of a name and of what cannot be told from it together, by the name. forms: the effects of
    which a law that is named does nine tenths, by its name. parameters of the terms, base
    parameters and curves of the laws, each with its interval, by name.
    """

    named: dict[str, float]
    near: set[str]
    sets: dict[str, float]
    forms: dict[str, set[str]]
    parameters: dict[str, Estimate]
    base: dict[str, Estimate]
    curves: dict[str, LawCurve]


def said(answer: Diagnosis) -> Said:
    """The names in an answer."""
    terms = {e.name: e for e in answer.effects} | {
        f"{law.law.quantity} over {law.law.covariate}": law for law in answer.laws
    }
    named = {name: term.probability for name, term in terms.items()}
    sets = {n: t.probability + sum(other.probability for other in t.alternatives) for n, t in terms.items()}
    beside = {str(other.term) for found in (*answer.effects, *answer.laws) for other in found.alternatives}
    parameters = {f"{t.name}.{key}": e for t in (*answer.effects, *answer.laws) for key, e in t.parameters.items()}
    curves = {law.name: law.curve for law in answer.laws}
    forms = {
        f"{law.law.quantity} over {law.law.covariate}": {effect for effect, share in law.resembles if share > 0.9}
        for law in answer.laws
    }
    beside |= {str(other.term) for other in answer.not_excluded}
    near = {*named, *beside}.union(*forms.values())
    return Said(named, near, sets, forms, parameters, dict(answer.base), curves)


def of_parts(test: Experiment, parts: int, seed: int) -> list[Said]:
    """What each of several parts of a record says."""
    return [
        said(diagnose([part(test, parts, number, seed=seed)], validate=None, progress=silent))
        for number in range(parts)
    ]


def of_halves(name: str, seed: int) -> tuple[Said, Said]:
    """What each half of a shipped record says."""
    one, two = of_parts(shipped(name), 2, seed)
    return one, two


@dataclass(frozen=True)
class Back:
    """A name in a part: its probability, its set's, and whether it, or an effect it is a form of, is in another set."""

    probability: float
    of_set: float
    found: bool


def come_back(splits: Iterable[Sequence[Said]]) -> list[Back]:
    """What becomes of every name in a part in every other part."""
    both = [(own, other) for parts in splits for own in parts for other in parts if own is not other]
    return [
        Back(probability, min(own.sets[name], 1.0), bool({name, *own.forms.get(name, ())} & other.near))
        for own, other in both
        for name, probability in own.named.items()
    ]


def holds(interval: Said, found: Said) -> list[bool]:
    """Whether the 90 % intervals hold what was found on other samples: parameters, and nine tenths of a curve.

    Base parameters mean the same beside the same terms only: mu is the mean over a law of mu, and not over a shift.
    """
    same = interval.named.keys() == found.named.keys()
    mine, others = (one.parameters | (one.base if same else {}) for one in (interval, found))
    held = [told.low <= others[name].value <= told.high for name, told in mine.items() if name in others]
    for name, told in interval.curves.items():
        if name in found.curves:
            value = np.interp(told.at, found.curves[name].at, found.curves[name].value)
            held.append(bool(np.mean((told.low <= value) & (value <= told.high)) >= 0.9))
    return held


@dataclass(frozen=True)
class Foretold:
    """What was learnt on some sweeps: their numbers, the names, errors of a constant mu and of what was learnt."""

    learnt: tuple[int, ...]
    named: tuple[str, ...]
    constant: float
    error: float


def foretold(learnt: Sequence[int], *, quick: bool = False) -> Foretold:
    """Learn on some of the sweeps, predict the others."""
    every = sweeps()
    ratios = [channels()["traction"].values(channels()["traction"].samples(test)) for test in every]
    found = explain([every[i] for i in learnt], validate=None, quick=quick, progress=silent)
    others = [i for i in range(len(every)) if i not in learnt]
    level = np.concatenate([ratios[i] for i in learnt]).mean()
    constant = np.concatenate([ratios[i] - level for i in others])
    missed = np.concatenate([predict_test(every[i], found.judged.after).misses("traction") for i in others])
    names = tuple(sorted(str(term) for term in found.answer.labels))
    return Foretold(tuple(learnt), names, float(np.sqrt(np.mean(constant**2))), float(np.sqrt(np.mean(missed**2))))


def choice(seed: int) -> list[int]:
    """Five of the twenty sweeps."""
    return sorted(np.random.default_rng(seed).choice(len(sweeps()), LEARNT, replace=False).tolist())
