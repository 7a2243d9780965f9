"""What the closed loop concludes, as records for the report: verdict, effects, open questions, errors, and the
curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.laws.law import Law
from twindisc_cli.loop.levels import Levels
from twindisc_cli.loop.refusal import Refusal
from twindisc_cli.loop.step_scatter import StepScatter
from twindisc_cli.loop.terms import Alternative, Term, in_test
from twindisc_cli.model.experiment import Floats, Ints

Verdict = Literal["effects_found", "law_learned", "no_missing_effect", "unexplained"]
Strength = Literal["established", "probable", "possible"]
STRENGTHS: Final = get_args(Strength)
"""The strongest first."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its standard deviation and 90 % interval, in `unit`."""

    value: float
    std: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class BaseEstimate(Estimate):
    """A base parameter; `test` names the one that it belongs to, where several tests have one each."""

    parameter: str
    test: str = ""

    @property
    def name(self) -> str:
        """The name by which results hold it."""
        return f"{self.parameter} ({self.test})" if self.test else self.parameter


@dataclass(frozen=True)
class _Found:
    """A term that was added: parameters by key, what these data cannot separate from it, and how sure it is.

    probability: share of resamples of the data in which it is chosen, weighed by evidence, less what is left for none
    of the explanations; NaN where it was not computed. remains: what is left of the misfit it takes away, 0 to 1. test:
    the only one of several that it acts in.
    """

    name: str
    channel: str
    parameters: Mapping[str, Estimate]
    alternatives: tuple[Alternative, ...]
    probability: float
    strength: Strength
    remains: float = 0.0
    test: str = ""

    @property
    def key(self) -> str:
        """The name by which results hold it."""
        return in_test(self.name, self.test)


class FoundEffect(_Found):
    """An effect that was added."""


@dataclass(frozen=True)
class LawCurve:
    """A law over the places of its covariate where data were, with its 90 % band, each (place,)."""

    at: Floats
    value: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, kw_only=True)
class FoundLaw(_Found):
    """A law that was learnt and added, with its formula and its curve; a curve has no parameters.

    resembles: effects of the catalogue that do nearly the same to all channels, with the share of it that they do.
    """

    law: Law
    formula: str
    curve: LawCurve
    resembles: tuple[tuple[str, float], ...]


FoundTerm = FoundEffect | FoundLaw


@dataclass(frozen=True)
class Unexplained:
    """Something left in a channel, and a covariate it depends on."""

    channel: str
    covariate: str
    kind: str
    share_of_variance: float
    p_value: float


@dataclass(frozen=True)
class ChannelError:
    """Root mean square of measured minus predicted, and the noise, all in `unit`; NaN where nothing is held out.

    assumed: whether the noise of a test is assumed, for nothing in its record scatters. before_step_mu: of the model
    before with the mu of each step in place of the constant one, on the samples of before; NaN where it is not known.
    """

    unit: str
    noise: float
    correlation: float
    before: float
    after: float
    held_out_before: float
    held_out_after: float
    assumed: bool = False
    before_step_mu: float = float("nan")


@dataclass(frozen=True)
class CandidateResult:
    """One term that was tried in the place of another: what it is, and what it says beside the other terms.

    replaces: the name of the term in whose place it stands; gain: fall of chi2 over no term in this place; evidence
    relative to the answer's; probability as in the answer; remains: share of its channel's misfit that is left beside
    it; refused: why it is not the answer, None for the answer
    itself and for what cannot be separated from it.
    """

    channel: str
    replaces: str
    term: Term
    gain: float
    evidence: float
    probability: float
    remains: float
    at_bound: tuple[str, ...]
    refused: Refusal | None
    chosen: bool

    @property
    def why_not(self) -> str:
        """Why it is not the answer, in full; empty where it is, or cannot be separated from it."""
        return "" if self.refused is None else self.refused.why


@dataclass(frozen=True)
class Curve:
    """One channel of one test in SI units, each (sample,): measured, predicted before and after, what was held out.

    unseen_before and unseen_after are of the answer found without what was held out; covariates by name (creepage,
    time, y, ...); kept is False for outliers.
    """

    test: str
    channel: str
    measured: Floats
    before: Floats
    after: Floats
    unseen_before: Floats
    unseen_after: Floats
    held_out: NDArray[np.bool_]
    kept: NDArray[np.bool_]
    covariates: Mapping[str, Floats | Ints]
    provenance: str


@dataclass(frozen=True)
class NextExperiment:
    """The history that would separate the models still alive best: steps for the definition and expected distances.

    test: whose rig and iterations it has; the first one where none is named.
    """

    why: str
    steps: Sequence[Mapping[str, float]]
    rivals: tuple[str, ...]
    separation: float
    separation_now: float
    channel_wanted: str | None
    test: str = ""


@dataclass(frozen=True)
class PredictedLevel:
    """A base parameter of a test that was only predicted: as those fitted let expect it, with the 90 % interval in
    which one more test lies, and as the test itself has it."""

    predicted: float
    low: float
    high: float
    own: float

    @property
    def inside(self) -> bool:
        """Whether its own level is one that the scatter of the tests lets expect."""
        return self.low <= self.own <= self.high

    @property
    def off(self) -> float:
        """By how much its logarithm is larger than expected [1]."""
        return float(np.log(self.own / self.predicted))

    @property
    def scatter(self) -> float:
        """Standard deviation of the logarithm in one more test [1]; 0 where it is not known."""
        return float(np.nan_to_num(np.log(self.high / self.low) / (2.0 * NINETY)))


@dataclass(frozen=True)
class PredictedErrors:
    """A test that was only predicted: the error of each channel before and after.

    errors: with the level (mu, K, h S) of the tests that were fitted; at_own_level: with the level estimated on the
    test itself, so that only its course is predicted. level: the base parameters that differ, by key; level_before: by
    the base model.
    """

    test: str
    errors: Mapping[str, ChannelError]
    at_own_level: Mapping[str, ChannelError]
    level: Mapping[str, PredictedLevel]
    level_before: Mapping[str, PredictedLevel]

    def missed(self, channel: str) -> float:
        """Error of a channel over its noise, with the level of the tests fitted or its own, whichever is less."""
        error = self.errors[channel]
        return min(error.held_out_after, self.at_own_level[channel].held_out_after) / error.noise


@dataclass(frozen=True)
class Diagnosis:
    """All that the closed loop found out.

    levels: base parameters that each of several tests has of its own, by key, and how they wander over their order.
    step_scatter: scatter between steps beyond the noise, by something that is in none of the terms.
    same_on_all: whether a choice on all samples would give the same terms, None where not asked.
    blind: whether the held-out samples had no say in the choice.
    not_excluded: where nothing was added, what the resamples choose all the same, by falling probability.
    too_few_samples: channels in which some effect was not tried, for it asks too much of their samples.
    """

    verdict: Verdict
    effects: Sequence[FoundEffect]
    laws: Sequence[FoundLaw]
    unexplained: Sequence[Unexplained]
    errors: Mapping[str, ChannelError]
    base: Mapping[str, BaseEstimate]
    tried: Sequence[CandidateResult]
    curves: Sequence[Curve]
    p_values: Mapping[str, float]
    held_out_steps: Mapping[str, tuple[int, ...]]
    notes: Sequence[str]
    next_experiment: NextExperiment | None
    validation: PredictedErrors | None
    predictions: Sequence[PredictedErrors]
    step_scatter: Sequence[StepScatter]
    same_on_all: bool | None
    blind: bool
    seconds: float
    difference: str = ""
    levels: Mapping[str, Levels] = field(default_factory=dict)
    not_excluded: Sequence[Alternative] = ()
    too_few_samples: Sequence[str] = ()

    @property
    def terms(self) -> list[FoundTerm]:
        """What was added: effects, then laws."""
        return [*self.effects, *self.laws]
