"""The next experiment: the history that would separate the models still alive best.

    maximise over histories   sum over pairs of  w_a w_b [1 - exp(-D_ab^2 / 8)]

    w     probabilities of the models
    D_ab  distance of their predictions in noise units, after the parameters of the rival have been refitted

The histories stay within the creepages and the length of the test at hand: again, reversed, up and down, alternating,
and held constant. All of them are under the load, at the speed and with the yaw of the rig; declared columns run over
time as they did.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from twindisc_cli.identify.span import span_of
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import NextExperiment
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Case
from twindisc_cli.model.experiment import (
    Experiment,
    Floats,
    History,
    Measured,
    RecordedColumn,
)
from twindisc_cli.model.forward import ForwardModel

SAMPLES = 4  # a stop: noise falls by two, as with a short hold
SLIGHTLY = 0.01  # relative step of a derivative that is drawn, not fitted
CLEAR = 5.0  # standard deviations: separated beyond doubt
HARDLY = 1.0  # standard deviation: not separated
TEMPERED = "; both explain much more, and formulas err the more, so that this does not decide yet"
"""Why explanations that the record at hand sets apart clearly still stand side by side: evidence is tempered."""


def next_experiment(alive: Sequence[tuple[Fit, float]], names: Sequence[str]) -> NextExperiment:
    """Choose among the histories for the models alive: (fit, probability) and a name each."""
    return next_for_set([alive], names)


def next_for_set(alive: Sequence[Sequence[tuple[Fit, float]]], names: Sequence[str]) -> NextExperiment:
    """The history that is best for a set of tests: the models alive in each, in one order, with a name each.

    Distances are root mean squares over the tests, each by its own fits; histories are those of the first test of the
    fits, or of the first in which alone a term acts: in another such a term does nothing.
    """
    number, weight = _acted_in([fitted for models in alive for fitted, _ in models]), [share for _, share in alive[0]]
    first = _case(alive[0], number)
    present = [channel for channel in channels() if channel in first.noise]
    ranked = []
    for label, steps in _histories(first.test.history):
        distances = _mean_distances(steps, alive, number, present)
        worth = 0.0
        for (a, b), by_channel in distances.items():
            worth += weight[a] * weight[b] * (1.0 - np.exp(-sum(by_channel.values()) / 8.0))
        ranked.append((worth, label, steps, distances))
    now = ranked[0]
    best = max(ranked, key=lambda r: (round(r[0], 3), min(_length(by_channel) for by_channel in r[3].values())))
    closest = min(best[3], key=lambda pair: _length(best[3][pair]))
    separation = _length(best[3][closest])
    near = separation < CLEAR and first.test.thermal is not None
    missing = [channel for channel in channels() if near and channel not in present]
    more = {c: _length(_mean_distances(best[2], alive, number, [*present, c])[closest]) for c in missing}
    wanted = max(more, key=lambda c: more[c], default=None)
    helps = wanted is not None and _twice(more[wanted], separation)
    rivals = (names[closest[0]], names[closest[1]])
    pair, before = f"{rivals[0]} from {rivals[1]}", _length(now[3][closest])
    each = f" in each of {len(alive)} tests" if len(alive) > 1 else ""
    separates = separation >= HARDLY and (before <= CLEAR or _twice(separation, before))
    if separates:
        where = "" if first.test.history.is_constant else ", all at the load, the speed and the yaw of the rig"
        again = f" (this history again: {before:.1f}{TEMPERED * (before > CLEAR)})" if best is not now else ""
        why = f"{best[1]}{where}: expected to separate {pair} by {separation:.1f} standard deviations{each}{again}"
    elif separation < HARDLY:
        why = f"no history of these creepages separates {pair}: they do the same to what is recorded"
    else:
        why = (
            f"no history of these creepages separates {pair} much better than this one, on which they differ by "
            f"{before:.1f} standard deviations{each}{TEMPERED}"
        )
    return NextExperiment(
        why=why if not helps else f"{why}; recording the {wanted} as well would settle it",
        steps=best[2] if helps or separates else (),
        rivals=rivals,
        separation=separation,
        separation_now=before,
        channel_wanted=wanted if helps else None,
        test=first.test.name,
    )


def _twice(one: float, other: float) -> bool:
    """Whether a separation rests on more than twice what another rests on."""
    return one**2 > 2.0 * other**2


def _acted_in(fits: Sequence[Fit]) -> int:
    """Number of the first test in which alone a term of these fits acts; 0 where every term acts in all."""
    tests = [fitted.problem.effect(name).test for fitted in fits for name in fitted.terms]
    alone = [fits[0].problem.tests.index(test) for test in tests if test]
    return min(alone, default=0)


def _case(alive: Sequence[tuple[Fit, float]], number: int) -> Case:
    return alive[0][0].problem.cases[number]


def _mean_distances(
    steps: Sequence[Mapping[str, float]],
    alive: Sequence[Sequence[tuple[Fit, float]]],
    number: int,
    channels: Sequence[str],
) -> dict[tuple[int, int], dict[str, float]]:
    """Squared distances of each pair of models by recorded channel, on average over the tests."""
    every = [_distances(number, steps, models, channels) for models in alive]
    return {pair: {c: float(np.mean([result[pair][c] for result in every])) for c in channels} for pair in every[0]}


def up_and_down(history: History, why: str) -> NextExperiment:
    """The history that separates time from creepage, where no two models stand against each other."""
    steps = dict(_histories(history))["creepages up and down again"]
    return NextExperiment(why, steps, (), np.nan, np.nan, None)


def _length(by_channel: Mapping[str, float]) -> float:
    return float(np.sqrt(sum(by_channel.values())))


def _histories(history: History) -> list[tuple[str, list[dict[str, float]]]]:
    """Candidate histories of about the same length (label, steps)."""
    numbers = np.unique(history.step[history.driven])
    creepages = [float(history.creepage[history.step == n][0]) for n in numbers]
    counts = [int(np.sum(history.step == n)) for n in numbers]
    half = [max(1, count // 2) for count in counts]
    rising = sorted(creepages)
    low_high = [c for pair in zip(rising, reversed(rising), strict=True) for c in pair][: len(rising)]
    sizes = np.abs(creepages)
    middle, greatest = float(np.sqrt(max(sizes.min(), 1e-6) * sizes.max())), creepages[int(np.argmax(sizes))]
    return [
        ("the same history again", _steps(creepages, counts)),
        ("the same steps in reverse", _steps(creepages[::-1], counts[::-1])),
        ("creepages up and down again", _steps([*creepages, *creepages[::-1]], [*half, *half[::-1]])),
        ("low and high creepages in turn", _steps(low_high, counts)),
        ("low and high creepages in turn, twice", _steps([*low_high, *low_high], [*half, *half])),
        ("one creepage held throughout", _steps([middle], [sum(counts)])),
        ("the greatest creepage held throughout", _steps([greatest], [sum(counts)])),
    ]


def _steps(creepages: Sequence[float], counts: Sequence[int]) -> list[dict[str, float]]:
    return [
        {"creepage_percent": round(100.0 * creepage, 6), "iterations": count}
        for creepage, count in zip(creepages, counts, strict=True)
    ]


def _distances(
    number: int, steps: Sequence[Mapping[str, float]], alive: Sequence[tuple[Fit, float]], channels: Sequence[str]
) -> dict[tuple[int, int], dict[str, float]]:
    """Squared distance of each pair of models by recorded channel, the parameters of the rival refitted."""
    model = ForwardModel(_planned(_case(alive, number), steps))
    rows, slopes = zip(*[_rows(model, number, fitted) for fitted, _ in alive], strict=True)
    results = {}
    for a, b in combinations(range(len(alive)), 2):
        gap = np.concatenate([rows[a][c] - rows[b][c] for c in channels])
        span = span_of(np.concatenate([slopes[b][c] for c in channels]))
        gap = gap - span @ (span.T @ gap)
        parts = np.split(gap, np.cumsum([len(rows[a][c]) for c in channels])[:-1])
        results[a, b] = {c: float(part @ part) for c, part in zip(channels, parts, strict=True)}
    return results


def _rows(model: ForwardModel, number: int, fitted: Fit) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Predicted channels of a test in noise units, and their slopes over the parameters (sample, parameter)."""
    problem, case = fitted.problem, fitted.problem.cases[number]
    start = {key: value for key, value in (case.held | fitted.base(number)).items() if np.isfinite(value)}
    shaped = [i for i, p in enumerate(problem.parameters) if p.term is not None]
    sets = 1 + len(start) + len(shaped)
    base = {key: np.full(sets, value) for key, value in start.items()}
    for place, key in enumerate(start, start=1):
        base[key][place] *= 1.0 + SLIGHTLY
    theta = np.tile(fitted.theta, (sets, 1))
    for place, i in enumerate(shaped, start=1 + len(start)):
        theta[place, i] += SLIGHTLY if theta[place, i] + SLIGHTLY <= problem.bounds[1][i] else -SLIGHTLY
    predicted = model.predict(base, problem.acting(number, problem.terms_of(theta), {}), problem.trial)
    rows, slopes = {}, {}
    for channel in channels():
        noise = case.noise[channel].std if channel in case.noise else channels()[channel].assumed_noise
        white = np.nan_to_num(channels()[channel].predicted(model, predicted)) / noise
        rows[channel], slopes[channel] = white[0], (white[1:] - white[0]).T / SLIGHTLY
    return rows, slopes


def _planned(case: Case, steps: Sequence[Mapping[str, float]]) -> Experiment:
    """The same rig with another history, sampled a few times an iteration and profiled at four stops."""
    test = case.test
    number = np.repeat(np.arange(len(steps)), [int(s["iterations"]) for s in steps])
    creepage = np.array([s["creepage_percent"] / 100.0 for s in steps])[number]
    duration, revolutions = float(np.median(test.history.duration)), float(np.median(test.history.revolutions))
    ones = np.ones(len(number))
    history = History(number, creepage, duration * ones, revolutions * ones, np.nan * ones)
    planned = replace(test, history=history)
    times = duration * (np.arange(SAMPLES * len(number)) + 1.0) / SAMPLES
    half = 3.0 * float(case.model.path(test.options.contact, 0.0).b[-1])
    measured = Measured(columns={name: _over_time(column) for name, column in test.measured.columns.items()})
    for name, channel in channels().items():
        measured = measured.with_samples(name, channel.planned(planned, times, half))
    return replace(planned, measured=measured, options=replace(test.options, wear_coefficient=case.held["K"]))


def _over_time(column: RecordedColumn) -> RecordedColumn:
    """A declared column that runs over time as it did, whatever the step."""
    return replace(column, step=np.full_like(column.step, -1))
