"""The search for what a channel misses: every effect, small combinations, and the gate that refuses them.

Channels are searched in the order in which they drive each other (traction, temperature, profile), each with its own
data, under the effects accepted so far; friction that stays unexplained is replaced by what was measured, iteration by
iteration, so that it does not reach the other channels. An explanation passes the gate if

    no generic function is still significant, or what is left is short against what was explained, and
    no parameter ran into a bound.

Two effects in one channel must act at different stages of the model (two laws for one quantity would fit anything),
must leave nothing at all, each must explain a good part, and together they must say more than the best generic
function; otherwise the channel is reported as unexplained.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.stats import chi2

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Channel
from twindisc_cli.loop.fit import Fit, fit, settled
from twindisc_cli.loop.problem import Case, Problem, Settled, effect_parameters
from twindisc_cli.loop.screen import Leftover, leftover
from twindisc_cli.loop.span import span_of
from twindisc_cli.model.experiment import Experiment, Floats

ALARM = 0.005
REFUSAL = 0.002
DOUBT = 0.1
SHORT = 0.2
ROUNDING = 0.02
SHARP = 0.5
PAIRED = 5
PROMISING = 6.0
CLEARLY = 3.0
KNOWN = 5.0
STRONG = 25.0
PART = 0.15
SET = 0.95
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Candidate:
    """An explanation of one channel: its effects, its fit to that channel, what it leaves, and its probability."""

    names: tuple[str, ...]
    fit: Fit
    gain: float
    evidence: float
    left: Leftover
    passed: bool
    probability: float = 0.0


@dataclass(frozen=True)
class Finding:
    """What was found in one channel.

    before: what the model without new effects leaves; candidates by falling evidence; chosen: None where nothing is
    missing or nothing explains it; missing: whether something is missing at all.
    """

    channel: Channel
    missing: bool
    base: Fit
    before: Leftover
    p_value: float
    candidates: Sequence[Candidate]
    chosen: Candidate | None

    @property
    def alternatives(self) -> list[Candidate]:
        """The other members of the smallest set that holds 95 % of the probability."""
        if self.chosen is None:
            return []
        ranked = sorted((c for c in self.candidates if c.passed), key=lambda c: -c.probability)
        kept: list[Candidate] = []
        for candidate in ranked:
            if sum(c.probability for c in kept) >= SET:
                break
            kept.append(candidate)
        return [c for c in kept if c.names != self.chosen.names]


def search_channel(problem: Problem, channel: Channel, declared: frozenset[str]) -> Finding:
    """Find what one channel misses under the effects that the problem already has."""
    base = refit(problem)
    before = leftover(base, channel)
    singles = [_explained(base, channel, name) for name in _candidates(problem, channel, declared)]
    p_value = min([before.p_value, *(_p_of(c, len(singles)) for c in singles)])
    if p_value > ALARM:
        return Finding(channel, False, base, before, p_value, singles, None)
    unknown = max((s.evidence for s in before.scores), default=0.0)
    gated = [_gated(c, channel, unknown=unknown) for c in sorted(singles, key=lambda c: -c.evidence)]
    if not any(c.passed for c in gated):
        gated = [*_pairs(base, unknown, gated, channel), *gated]
    weighed = weigh(gated)
    passed = [c for c in weighed if c.passed]
    chosen = max(passed, key=lambda c: c.probability) if passed else None
    return Finding(channel, True, base, before, p_value, weighed, chosen)


def refit(problem: Problem, start: Floats | None = None) -> Fit:
    """Fit, find the nuisances there, and fit again."""
    first = fit(replace(problem, nuisance=None), start)
    base = [i for i, p in enumerate(problem.parameters) if p.effect is None]
    return fit(problem.with_nuisance(first.theta, first.jacobian[:, base]), first.theta)


def _candidates(problem: Problem, channel: Channel, declared: frozenset[str]) -> list[str]:
    """Effects that show first in a channel, that these data can show, and that are not in the model yet."""
    stops = max((len(recorded_stops(case.test)) for case in problem.cases), default=0)
    return [
        name
        for name, effect in catalogue().items()
        if effect.channel == channel
        and name not in problem.effects
        and name not in declared
        and (stops > 1 or not effect.needs_stops)
    ]


def recorded_stops(test: Experiment) -> set[tuple[int, int]]:
    """Disc and iteration of every recorded profile."""
    profile = test.measured.profile
    return set() if profile is None else set(zip(profile.disc.tolist(), profile.iteration.tolist(), strict=True))


def _explained(base: Fit, channel: Channel, *names: str) -> Candidate:
    """Fit one effect, or several together, from several starts."""
    problem = base.problem.with_effects(*base.effects, *names)
    best = max(
        (fit(problem, np.concatenate([base.theta, start])) for start in _starts(problem, base, names)),
        key=lambda f: f.evidence,
    )
    nothing_yet = Leftover(channel, [], 1.0, 0.0)
    return Candidate(names, best, _gain(base, best), akaike(best) - akaike(base), nothing_yet, False)


def _gain(base: Fit, better: Fit) -> float:
    """What a fit takes off chi2, without the sample where it takes off most: a stray sample is no effect."""
    taken = base.residual**2 - better.residual**2
    return float(np.sum(taken) - np.max(taken, initial=0.0))


def akaike(fitted: Fit) -> float:
    """Logarithm of the evidence by Akaike, -chi2 / 2 - k: it knows nothing of how large effects usually are.

    Whether there is an effect at all is not asked here: every explanation has passed its test of significance.
    Source: K. P. Burnham, D. R. Anderson, Sociological Methods and Research 33 (2004) 261-304.
    """
    return -0.5 * fitted.chi2 - len(fitted.theta)


def _starts(problem: Problem, base: Fit, names: Sequence[str]) -> list[Floats]:
    """Inner start values of the effects: the best two of a grid of shapes, for either sign of the size."""
    return [start for start, _ in _scored(problem, base, names)[:2]]


def _scored(problem: Problem, base: Fit, names: Sequence[str]) -> list[tuple[Floats, float]]:
    """Inner parameters on a grid, with what each promises to explain of the residual to first order, best first."""
    grid = [_grid(name) for name in names]
    sets = grid[0] if len(grid) == 1 else np.array([np.concatenate([a, b]) for a in grid[0] for b in grid[1]])
    theta = np.concatenate([np.tile(base.theta, (len(sets), 1)), sets], axis=1)
    lower, upper = problem.bounds
    rows = problem.discount(problem.white(problem.predict(np.clip(theta, lower, upper))))
    moved = np.nan_to_num(rows - problem.discount(base.problem.white(base.problem.predict(base.theta[None]))))
    span = span_of(base.jacobian)
    moved = moved - (moved @ span) @ span.T
    along = (moved @ base.residual) / np.sqrt(np.sum(moved**2, axis=1) + 1e-12)
    order = np.argsort(-along)
    return [(sets[i], float(max(along[i], 0.0) ** 2)) for i in order]


def _grid(name: str) -> Floats:
    """Inner parameters of one effect on a coarse grid (set, parameter)."""
    axes = []
    shapes = sum(p.off is None for p in effect_parameters(name))
    for p in effect_parameters(name):
        if p.off is not None:
            sizes = [p.start] + ([2.0 * p.off - p.start] if p.lower <= 2.0 * p.off - p.start <= p.upper else [])
            if p.log and p.lower < p.off < p.upper:
                sizes.append(p.off**2 / p.start)
            axes.append([p.inner(s) for s in sizes])
        elif p.log:
            axes.append([p.inner(float(v)) for v in np.geomspace(p.lower, p.upper, 15 if shapes == 1 else 7)[1:-1]])
        else:
            axes.append([p.inner(p.start)])
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)


def _p_of(candidate: Candidate, searched: int) -> float:
    """Significance of an effect, paid for the number of effects tried."""
    free = sum(len(effect_parameters(name)) for name in candidate.names)
    return min(1.0, searched * float(chi2.sf(max(candidate.gain, 0.0), free)))


def _gated(candidate: Candidate, *channels: Channel, unknown: float = -np.inf, strict: bool = False) -> Candidate:
    """Whether an explanation is one: what it leaves in the channels, and its bounds.

    Where a generic function says more than the explanation (`unknown` is its evidence), even a doubtful leftover is
    too much.
    """
    left = min((leftover(candidate.fit, channel) for channel in channels), key=lambda rest: rest.p_value)
    explained = np.sqrt(max(candidate.gain, 0.0))
    least = DOUBT if unknown > candidate.evidence else REFUSAL
    clean = left.p_value > least / len(channels) or (not strict and left.length < SHORT * explained)
    significant = _p_of(candidate, 1) < ALARM
    return replace(candidate, left=left, passed=bool(clean and significant and not candidate.fit.at_bound))


def _pairs(base: Fit, unknown: float, singles: Sequence[Candidate], channel: Channel) -> list[Candidate]:
    """Pairs of the best single effects that leave nothing, in which each effect explains a good part.

    They count only if the best of them stands up to the best generic function, whose evidence is `unknown`.
    """
    alone = {c.names[0]: c for c in singles[:PAIRED]}
    found = []
    for pair in combinations(alone, 2):
        if catalogue()[pair[0]].stage == catalogue()[pair[1]].stage:
            continue
        candidate = _explained(base, channel, *pair)
        weakest = min(candidate.gain - alone[name].gain for name in pair)
        if weakest > max(STRONG, PART**2 * candidate.gain):
            found.append(_gated(candidate, channel, strict=True))
    best = max((c.evidence for c in found if c.passed), default=-np.inf)
    return found if best > unknown - KNOWN else []


def weigh(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Posterior probabilities over the explanations that passed, by falling evidence.

    The evidence is cooled by what a large effect leaves through the form of its law, which no candidate gets right, and
    more so where two laws at once make up the explanation. It is sharpened so that sets of 95 % hold the truth as
    often as that.
    """
    passed = [c for c in candidates if c.passed]
    if not passed:
        return list(candidates)
    heat = SHARP * (1.0 + ROUNDING * np.sqrt(max(c.gain for c in passed))) * max(len(c.names) for c in passed) ** 2
    best = max(c.evidence for c in passed)
    weights = {c.names: float(np.exp((c.evidence - best) / heat)) for c in passed}
    total = sum(weights.values())
    return [replace(c, probability=weights[c.names] / total if c.passed else 0.0) for c in candidates]


def free_friction(case: Case) -> Case:
    """The case with mu as measured, one value an iteration, in place of a model of friction."""
    samples = case.test.measured.traction
    assert samples is not None
    points = case.model.points
    iteration = points.iteration[points.of_traction]
    kept = case.noise["traction"].kept
    count = len(case.test.history.step)
    mu = np.full(count, float(np.mean(np.abs(samples.ratio))))
    weight = np.array([np.sum(kept & (iteration == i)) for i in range(count)])
    base = {"K": np.array([case.first_wear]), "convection_W_K": np.array([case.first_convection])}
    for _ in range(8):
        predicted = case.model.predict({**base, "mu": mu[None]}).traction[0]
        ratio = np.ones(count)
        for i in range(count):
            here = kept & (iteration == i)
            if here.any():
                ratio[i] = np.clip(np.mean(samples.ratio[here]) / max(np.mean(predicted[here]), 1e-9), 0.25, 4.0)
        mu = np.clip(mu * ratio, 1e-3, 3.0)
    seen = np.flatnonzero(weight)
    noise = case.noise["traction"]
    std, correlation = noise.cautious or (noise.std, noise.correlation)
    spread = std * np.sqrt((1.0 + correlation) / (1.0 - correlation) / np.maximum(weight, 1))
    level = np.array([np.mean(np.abs(samples.ratio[kept & (iteration == i)])) for i in seen])
    relative = np.interp(np.arange(count), seen, spread[seen] / np.maximum(level, 1e-9))
    mu = np.interp(np.arange(count), seen, mu[seen])
    return replace(case, free_mu=(mu, relative * mu))


def search(problem: Problem, progress: Progress) -> list[Finding]:
    """Search all channels, each with what was found in those before it given, then all of them for a common cause."""
    declared = frozenset(name for case in problem.cases for name in case.test.effects)
    findings: list[Finding] = []
    known, now = declared, problem
    for channel in problem.in_order:
        progress(channel)
        finding = _economical(now, search_channel(replace(now, channels=(channel,)), channel, known))
        findings.append(finding)
        if finding.missing and finding.chosen is None and channel == "traction":
            now = replace(now, cases=[free_friction(case) for case in now.cases])
        else:
            fitted = finding.chosen.fit if finding.chosen else finding.base
            now = given(now, fitted)
            known |= set(fitted.effects)
    first = findings[0]
    if first.channel == "traction" and not first.missing and len(findings) > 1:
        progress("all channels")
        findings = _common_cause(problem, findings, declared)
    return sorted(findings, key=lambda f: problem.channels.index(f.channel))


def given(problem: Problem, fitted: Fit) -> Problem:
    """The problem with what was fitted given, as well as it is known."""
    known = Settled(fitted.problem, fitted.theta, fitted.covariance)
    return replace(problem, cases=settled(problem.cases, fitted), settled=(*problem.settled, known))


def _economical(problem: Problem, finding: Finding) -> Finding:
    """Of the explanations that a channel leaves open, choose one after which the channels it drives miss nothing."""
    order = problem.in_order
    driven = order[order.index(finding.channel) + 1 :]
    if not finding.alternatives or not driven:
        return finding
    assert finding.chosen is not None
    alive = sorted([finding.chosen, *finding.alternatives], key=lambda c: -c.probability)
    enough = (c for c in alive if _enough(given(problem, c.fit), driven))
    return replace(finding, chosen=next(enough, finding.chosen))


def _enough(problem: Problem, channels: Sequence[Channel]) -> bool:
    """Whether the base model explains each of these channels."""
    return all(leftover(refit(replace(problem, channels=(channel,))), channel).p_value > ALARM for channel in channels)


def _common_cause(problem: Problem, findings: list[Finding], declared: frozenset[str]) -> list[Finding]:
    """Let one effect that acts before the traction stand against all that was found in the channels it drives.

    Such an effect may be too small to show in any channel alone, or show where its power goes.
    """
    base = refit(problem)
    found = tuple(name for f in findings if f.chosen for name in f.chosen.names)
    rival = refit(problem.with_effects(*found)) if found else base
    names = _candidates(problem, "traction", declared)
    tried = [c for name in names if _promise(base, name) > PROMISING and (c := _explained(base, "traction", name))]
    enough = akaike(rival) - akaike(base) + CLEARLY
    better = [c for c in tried if _p_of(c, len(names)) < ALARM and c.evidence > enough]
    gated = weigh([_gated(c, *problem.channels) for c in sorted(better, key=lambda c: -c.evidence)])
    passed = [c for c in gated if c.passed]
    if not passed:
        return findings
    chosen = max(passed, key=lambda c: c.probability)
    least = min(_p_of(c, len(names)) for c in tried)
    traction = replace(findings[0], missing=True, p_value=least, candidates=gated, chosen=chosen, base=base)
    return [traction, *(replace(f, missing=False, chosen=None, candidates=[]) for f in findings[1:])]


def _promise(base: Fit, name: str) -> float:
    """Largest growth of the likelihood, twice its logarithm, that an effect promises to first order."""
    return max(score for _, score in _scored(base.problem.with_effects(*base.effects, name), base, [name]))
