"""An explanation judged on samples that it has not seen: the revised model beside the base model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.laws.law import law_key
from twindisc_cli.laws.trial import Trial
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.edges import edges_anew
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import Fit, carried, plain_fit, refit
from twindisc_cli.loop.holdout import holds_out
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.problem import Case
from twindisc_cli.loop.terms import EffectTerm, term_of
from twindisc_cli.loop.thresholds import ACCEPTANCE
from twindisc_cli.loop.tolerances import creepage_tolerance, mu_tolerance, scaled
from twindisc_cli.loop.validate import rms
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.prediction import Prediction

OFF_IN_STEPS: Mapping[str, Callable[[Case], Floats]] = {
    "creepage_factor": lambda case: creepage_tolerance(case.test) * bool(case.test.measured.creepage_noise),
    "mu": mu_tolerance,
}
"""What may be off in each step by a draw of its own, over its value (iteration,), by the key of the base parameter."""
Kind = Literal["before", "after", "unseen_before", "unseen_after"]


@dataclass(frozen=True)
class Judged:
    """An explanation with the base and the revised model, and how far each is from what was measured.

    explanation: as it was found, without the samples held out. before, after: the two models with their parameters
    estimated on all samples; unseen_before, unseen_after: on those that are not held out. Errors are over a channel of
    all tests, in SI units.
    """

    explanation: Explanation
    before: Fit
    unseen_before: Fit
    unseen_after: Fit
    masks: Sequence[Mapping[str, Mask]]
    _known: dict[Kind, list[Prediction]] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def estimated(self) -> Fit:
        """All parameters of the explanation estimated on all samples."""
        member = self.explanation.fit
        if not member.terms:
            return self.base_estimated
        problem = self.before.problem.with_terms(*member.terms, trial=member.problem.trial)
        again = refit(problem, carried(problem, self.before, member))
        return edges_anew(again) if holds_out(self.masks) else again

    @cached_property
    def base_estimated(self) -> Fit:
        """The base model estimated on all samples, with the nuisances there."""
        return refit(self.before.problem, self.before.theta)

    @cached_property
    def after(self) -> Fit:
        """The revised model on all samples."""
        return revised_fit(self.estimated, self.before) if self.explanation.terms else self.before

    def prediction(self, kind: Kind) -> list[Prediction]:
        """Predictions of all tests at all samples by one of the four fits."""
        if kind not in self._known:
            self._known[kind] = predicted(getattr(self, kind), self.before.problem.cases)
        return self._known[kind]

    def misses(self, channel: str, kind: Kind, *, held_out: bool, decided: bool = False) -> Floats:
        """Measured minus predicted of a channel, in the order of the record (sample,).

        decided: without the samples held out on which it is open what the explanation says.
        """
        misses = []
        for i, case in enumerate(self.before.problem.cases):
            if channel in case.noise:
                order = case.noise[channel].order
                order = order[self.masks[i][channel][order] == held_out]
                order = order[~self._open(i, channel)[order]] if decided else order
                values = channels()[channel].predicted(case.model, self.prediction(kind)[i])[0]
                misses.append((case.values(channel) - values)[order])
        return np.concatenate(misses)

    def error(self, channel: str, kind: Kind, *, held_out: bool) -> float:
        """Root mean square of measured minus predicted; NaN without samples."""
        return rms(self.misses(channel, kind, held_out=held_out))

    def noise(self, channel: str) -> float:
        """Root mean square of the noise of a channel over the tests, in SI units."""
        stds = [case.noise[channel].std for case in self.before.problem.cases if channel in case.noise]
        return float(np.sqrt(np.mean(np.square(stds))))

    def held_out_noise(self, channel: str) -> float:
        """The same with what steps held out may be off by, which no fit has seen: the creepages of a log, and mu of
        separate tests."""
        return float(np.hypot(self.noise(channel), self._off_in_steps.get(channel, 0.0)))

    @cached_property
    def _off_in_steps(self) -> dict[str, float]:
        """Root mean square change of the samples held out where inputs of each step are off by two standard errors.

        By two: a step is off by one draw. By channel, in SI units.
        """
        squares = dict[str, float]()
        for key, off_in in OFF_IN_STEPS.items():
            changes = dict[str, list[Floats]]()
            for number in range(len(self.masks)):
                if np.any(off := off_in(self.before.problem.cases[number])):
                    for channel, change in self._changes(number, key, 1.0 + 2.0 * off).items():
                        changes.setdefault(channel, []).append(change)
            for channel, parts in changes.items():
                if (change := np.concatenate(parts)).size:
                    squares[channel] = squares.get(channel, 0.0) + rms(change) ** 2
        return {channel: float(np.sqrt(square)) for channel, square in squares.items()}

    def _changes(self, number: int, key: str, factor: Floats) -> dict[str, Floats]:
        """Changes of the samples of one test held out (sample,) with an input times a factor (iteration,), by
        channel."""
        problem, case = self.before.problem, self.before.problem.cases[number]
        off = scaled(problem, number, self.unseen_before.theta, key, factor[None])[number]
        result = dict[str, Floats]()
        for channel, noise in case.noise.items():
            read = channels()[channel].predicted
            change = read(case.model, off)[0] - read(case.model, self.prediction("unseen_before")[number])[0]
            result[channel] = change[self.masks[number][channel] & noise.kept]
        return result

    def _open(self, number: int, channel: str) -> Mask:
        """Samples of a test held out where a law jumps between two that are fitted: in which, no sample shows.

        Not those that a window of its own covers: a law that acts on them alone is judged by them alone.
        """
        held_out = self.masks[number][channel]
        of_time = [law.jumps for law in self.explanation.laws.values() if law.covariate == "time" and law.jumps.size]
        model, prediction = self.before.problem.cases[number].model, self.prediction("unseen_before")[number]
        over = channels()[channel].covariates(model, prediction) if of_time else {}
        if "time" not in over:
            return np.zeros_like(held_out)
        time = np.asarray(over["time"], dtype=float)
        fitted = np.sort(time[~held_out])
        across = [jumps for jumps in of_time if len(set(np.searchsorted(fitted, jumps))) == len(jumps)]
        return held_out & about_jumps("time", np.concatenate(across or [np.empty(0)]), fitted, time)

    def rises(self, *, held_out: bool) -> list[str]:
        """Channels in which the revised model errs more than the base, on samples held out or on the others.

        Both are fitted without the samples held out. Those that are predicted within their noise judge nothing. A small
        rise is up to chance where all channels together are predicted better, and so is one of samples fitted by which
        chi2 hardly grows, as that of seven weighings may, which share the wear coefficient with a profile.
        """
        better = held_out and self.fall > 0.0
        return [
            channel
            for channel, (before, after) in self._judging(held_out).items()
            if not self._is_chance(channel, before, after, held_out=held_out) and rises(before, after, far=better)
        ]

    def _is_chance(self, channel: str, before: Floats, after: Floats, *, held_out: bool) -> bool:
        if held_out:
            few = len(after) < ACCEPTANCE.fewest_judged
            times = ACCEPTANCE.missed if few else ACCEPTANCE.predicted
            return rms(after) < times * self.held_out_noise(channel)
        return -fall(before, after, self.noise(channel)) < ACCEPTANCE.growth_chi2

    @cached_property
    def fall(self) -> float:
        """By how much the chi2 of the samples held out falls, of all channels together."""
        return sum(fall(*both, self.noise(channel)) for channel, both in self._judging(held_out=True).items())

    def _judging(self, held_out: bool) -> dict[str, tuple[Floats, Floats]]:
        """Misses (sample,) before and after, by channel.

        Held-out samples that are far from both models are of another state than those fitted, and judge neither.
        """
        both = dict[str, tuple[Floats, Floats]]()
        for channel in self.before.problem.channels:
            before = self.misses(channel, "unseen_before", held_out=held_out, decided=True)
            after = self.misses(channel, "unseen_after", held_out=held_out, decided=True)
            base = self.error(channel, "unseen_before", held_out=False)
            if not (held_out and min(rms(before), rms(after)) > ACCEPTANCE.foreign_state * base):
                both[channel] = before, after
        return both


def fall(before: Floats, after: Floats, noise: float) -> float:
    """By how much chi2 falls from misses (sample,) before to those after; what cannot be predicted left out."""
    return float(np.nansum(before**2 - after**2)) / noise**2


def about_jumps(covariate: str, places: Floats, known: Floats, values: Floats) -> Mask:
    """Which values (value,) of a covariate lie between two that are known, sorted (sample,), as a jump does.

    places: of the jumps (jump,) in the unit of the definition.
    """
    jumps = np.searchsorted(known, covariate_of(covariate).quantity.shown.to_si(places))
    above = np.searchsorted(known, values)
    return np.asarray((above == np.searchsorted(known, values, side="right")) & np.isin(above, jumps))


def rises(before: Floats, after: Floats, *, far: bool = False) -> bool:
    """Whether misses (sample,) grew from before to after: by more than blocks of neighbours scatter, or by far.

    far: only what grew by far counts, as where samples are few.
    """
    if not len(before):
        return False
    growth = rms(after) / max(rms(before), 1e-300) - 1.0
    if len(before) < ACCEPTANCE.fewest_judged:
        return bool(growth > ACCEPTANCE.growth_at_most)
    parts = np.array_split(after**2 - before**2, min(ACCEPTANCE.judged_blocks, len(before) // 2))
    means = np.array([part.mean() for part in parts])
    chance = float(means.std(ddof=1)) / np.sqrt(len(means))
    sure = float(means.mean()) > ACCEPTANCE.growth_errors * chance
    return bool(growth > ACCEPTANCE.growth_at_most or (growth > ACCEPTANCE.growth and sure and not far))


def judge(member: Explanation, before: Fit, seen_before: Fit, masks: Sequence[Mapping[str, Mask]]) -> Judged:
    """An explanation found without the samples held out, with the revised model fitted without them."""
    blind = revised_fit(member.fit, seen_before) if member.terms else seen_before
    return Judged(member, before, seen_before, blind, masks)


def revised_fit(fitted: Fit, before: Fit) -> Fit:
    """The revised model: what was found is declared, as the revised definition will say, the base fitted anew."""
    cases = [revised_case(case, fitted) for case in before.problem.cases]
    tracks = fitted.followed.tracks
    return plain_fit(replace(before.problem, cases=cases, tracks=tracks), before, fitted)


def revised_case(case: Case, fitted: Fit) -> Case:
    """A test with the effects and the laws of a fit declared."""
    effects, laws = dict(case.test.effects), dict(case.test.laws)
    for name in fitted.terms:
        effect = fitted.problem.effect(name)
        term = term_of(name, effect)
        if effect.test not in ("", case.test.name):
            continue
        if isinstance(effect, Trial):
            laws[law_key(effect.quantity, effect.covariate)] = effect.law(fitted.values(name))
        elif isinstance(term, EffectTerm):
            effects[term.name] = fitted.values(name)
    return replace(case, model=replace(case.model, experiment=replace(case.test, effects=effects, laws=laws)))


def predicted(fitted: Fit, cases: Sequence[Case]) -> list[Prediction]:
    """Predictions at all samples of these tests by a fit that may have seen fewer of them."""
    whole = [
        replace(case, model=replace(case.model, experiment=replace(case.test, measured=other.test.measured)))
        for case, other in zip(fitted.problem.cases, cases, strict=True)
    ]
    whole = [replace(case, known=first.held) for case, first in zip(whole, fitted.problem.cases, strict=True)]
    return replace(fitted.problem, cases=whole).predict(fitted.theta[None])
