"""python tests/records.py: what the loop says of records that nobody made up, and how well that comes back.

Two minutes on two cores. The halves and the choices are drawn from SEED, which nothing was calibrated on.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import cache, partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from twindisc_cli.definition import load
from twindisc_cli.loop import explain as loop
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.channels._channel import known
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis, Estimate, LawCurve
from twindisc_cli.loop.explain import Outcome, explain
from twindisc_cli.loop.validate import foretell
from twindisc_cli.model.experiment import (
    Disc,
    Experiment,
    History,
    Measured,
    Options,
    Rig,
    TractionSamples,
)

Floats = NDArray[np.float64]
HERE = Path(__file__).parent
SEED = 2006
HALVES, FEW_HALVES, CHOICES, LEARNT = 20, 5, 10, 5
BLOCKS = ((0.0, 0.02), (0.02, 0.08), (0.08, 1.0))
"""Creepages of the locomotive that are held out, one block after the other."""


def shipped(name: str) -> Experiment:
    """A test as it is shipped."""
    return load(HERE.parent / "configs" / f"{name}.toml").experiment


def silent(_what: str, _share: float) -> None:
    """Progress that nobody watches."""


def half(test: Experiment, number: int, *, seed: int) -> Experiment:
    """One half of the samples of every channel, pairs of neighbours drawn at random; 0 and 1 are complements."""
    measured = test.measured
    for name in measured_channels(test):
        samples = channels()[name].samples(test)
        count = len(channels()[name].values(samples))
        drawn = np.random.default_rng(seed).integers(0, 2, count // 2 + 1)
        kept = np.repeat(drawn if number == 0 else 1 - drawn, 2)[:count] == 1
        columns = {column.name: getattr(samples, column.name)[kept] for column in fields(samples)}
        measured = measured.with_samples(name, replace(samples, **columns))
    return replace(test, measured=measured)


@dataclass(frozen=True)
class Said:
    """What is named with its probability, and with it all that these data cannot tell from it.

    parameters of the terms, base parameters and curves of the laws, each with its interval, by name.
    """

    named: dict[str, float]
    near: set[str]
    parameters: dict[str, Estimate]
    base: dict[str, Estimate]
    curves: dict[str, LawCurve]


def said(answer: Diagnosis) -> Said:
    """The names in an answer."""
    named = {e.name: e.probability for e in answer.effects}
    named |= {f"{law.law.quantity} over {law.law.covariate}": law.probability for law in answer.laws}
    beside = {f"{q} over {c}" if c else q for law in answer.laws for q, c, _ in law.alternatives}
    beside |= {other for effect in answer.effects for other in effect.alternatives}
    parameters = {f"{t.name}.{key}": e for t in (*answer.effects, *answer.laws) for key, e in t.parameters.items()}
    curves = {law.name: law.curve for law in answer.laws}
    return Said(named, {*named, *beside}, parameters, dict(answer.base), curves)


def of_halves(name: str, seed: int) -> tuple[Said, Said]:
    """What each half of a record says."""
    test = shipped(name)
    one, two = (said(diagnose([half(test, n, seed=seed)], validate=None, progress=silent)) for n in (0, 1))
    return one, two


def come_back(pairs: Iterable[tuple[Said, Said]]) -> list[tuple[float, bool]]:
    """Of every name in a half its probability, and whether it is in the set of the other half."""
    both = [pair for one, two in pairs for pair in ((one, two), (two, one))]
    return [(probability, name in other.near) for own, other in both for name, probability in own.named.items()]


def whole(name: str) -> Said:
    """What a whole record says."""
    return said(diagnose([shipped(name)], validate=None, progress=silent))


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


def without_block(low: float, high: float) -> tuple[list[str], float, float]:
    """The locomotive with the creepages from low to high held out: what is named, their error before and after."""
    test = shipped("eurosprinter")
    samples = _traction(test)
    mask = (samples.creepage >= low) & (samples.creepage < high)
    with patch.object(loop, "withheld", lambda _test: {"traction": mask}):
        answer = diagnose([test], validate=None, progress=silent)
    error = answer.errors["traction"]
    return list(said(answer).named), error.held_out_before, error.held_out_after


@cache
def sweeps() -> list[Experiment]:
    """Twenty traction sweeps of a lubricated ball on a flat disc; creepages in steps of equal ratio."""
    number, creepage, ratio = np.loadtxt(
        HERE / "reference" / "etm_sweeps.csv", delimiter=",", comments="#", skiprows=4
    ).T
    steel = {"youngs_modulus": 207e9, "poisson_ratio": 0.29, "hardness": 760 * 9.80665e6}
    rig = Rig(Disc(9.525e-3, 9.525e-3, **steel), Disc(np.inf, np.inf, **steel), normal_load=1647.0, rolling_speed=0.025)
    tests = []
    for sweep in np.unique(number):
        inside = (number == sweep) & (creepage > 0.02)
        x, y = creepage[inside] / 100.0, ratio[inside]
        levels = np.geomspace(2e-4, 0.2, 25)
        near = np.argmin(np.abs(np.log(x[:, None] / levels)), axis=1)
        used, step = np.unique(near, return_inverse=True)
        unknown, ones = np.full(len(x), np.nan), np.ones(len(used))
        course = History(np.arange(len(used)), levels[used], 84.0 * ones, 4200.0 * ones, np.nan * ones)
        measured = Measured(traction=TractionSamples(unknown, step, x, y, unknown))
        tests.append(Experiment(f"sweep {sweep:.0f}", "", rig, course, Options(), None, measured=measured))
    return tests


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
    missed = np.concatenate([foretell(every[i], found.judged.after).misses("traction") for i in others])
    names = tuple(sorted(" over ".join(label) for label in found.answer.labels))
    return Foretold(tuple(learnt), names, float(np.sqrt(np.mean(constant**2))), float(np.sqrt(np.mean(missed**2))))


def choice(seed: int) -> list[int]:
    """Five of the twenty sweeps."""
    return sorted(np.random.default_rng(seed).choice(len(sweeps()), LEARNT, replace=False).tolist())


# ---------------------------------------------------------------------------------------------- the table


def main() -> int:
    """Print the table; draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figure", type=Path, help="file for the figure")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(options.processes) as pool:
        seeds = [SEED + i for i in range(HALVES)]
        train = list(pool.map(partial(of_halves, "eurosprinter"), seeds))
        _tell_locomotive(train, list(pool.map(without_block, *zip(*BLOCKS, strict=True))))
        _tell_sweeps(list(pool.map(foretold, [choice(SEED + i) for i in range(CHOICES)])))
        halves = list(pool.map(partial(of_halves, "mtm_running_in"), seeds[:FEW_HALVES]))
        _tell_running_in(whole("mtm_running_in"), halves)
    if options.figure:
        draw().savefig(options.figure, dpi=160)
    return 0


def _tell_locomotive(pairs: Sequence[tuple[Said, Said]], blocks: Sequence[tuple[list[str], float, float]]) -> None:
    back = come_back(pairs)
    share, told = np.mean([right for _, right in back]), np.mean([p for p, _ in back])
    print(f"eurosprinter, {len(pairs)} random halves: what one names is in the other's set {share:.0%} (>= 80 %)")
    print(f"    mean probability told {told:.2f} (<= {share + 0.1:.2f})")
    for (low, high), (names, before, after) in zip(BLOCKS, blocks, strict=True):
        held = f"creepages from {low:.0%} to {high:.0%} held out"
        fate = f"error {before:.4f} -> {after:.4f}: {', '.join(names)}" if names else "no answer given"
        print(f"    {held}: {fate}")


def _tell_sweeps(learnt: Sequence[Foretold]) -> None:
    worst = max(one.error / one.constant for one in learnt)
    middle = float(np.median([one.error / one.constant for one in learnt]))
    print(f"sweeps, {len(learnt)} choices of {LEARNT} of 20: error on the others over a constant mu's {middle:.2f}")
    print(f"    at most {worst:.2f} (<= 0.45)")
    counts = Counter(name for one in learnt for name in one.named)
    print("    named: " + ", ".join(f"{name} {count}" for name, count in counts.most_common()))


def _tell_running_in(record: Said, pairs: Sequence[tuple[Said, Said]]) -> None:
    back = come_back(pairs)
    halves = [half for pair in pairs for half in pair]
    counts = Counter(name for half in halves for name in half.named)
    share = np.mean([right for _, right in back])
    print(f"running-in: {', '.join(record.named)}; {len(pairs)} random halves: named in the other's set {share:.0%}")
    print("    named by the halves: " + ", ".join(f"{name} {count}" for name, count in counts.most_common()))
    of_record = [held for half in halves for held in holds(record, half)]
    each = [held for one, two in pairs for own, other in ((one, two), (two, one)) for held in holds(own, other)]
    print(f"    values of a half inside the record's 90 % intervals: {sum(of_record)} of {len(of_record)} (all)")
    print(f"    values of a half inside the other's 90 % intervals: {sum(each)} of {len(each)}")


# ---------------------------------------------------------------------------------------------- the figure


def draw() -> Figure:
    """The three records with the base model, the revised model and what was held out."""
    figure = Figure(figsize=(10.0, 3.4), layout="constrained")
    axes = figure.subplots(1, 3)
    _draw_curve(axes[0], explained("eurosprinter"), "creepage [%]", lambda s: 100.0 * s.creepage)
    axes[0].set_title("locomotive, digitised", loc="left", fontsize=9)
    _draw_sweeps(axes[1])
    _draw_curve(axes[2], explained("mtm_running_in"), "time [h]", lambda s: s.time / 3600.0)
    axes[2].set_title("running-in, lubricated ball on disc", loc="left", fontsize=9)
    for axis in axes:
        axis.set_ylabel("traction ratio T/N [1]")
        axis.legend(fontsize=7, frameon=False)
    return figure


@cache
def explained(name: str) -> Outcome:
    """The answer to a shipped record, without resampling."""
    return explain([shipped(name)], validate=None, quick=True, progress=silent)


def _draw_curve(axis: Axes, found: Outcome, label: str, across: Callable[[TractionSamples], Floats]) -> None:
    judged, case = found.judged, found.problem.cases[0]
    samples = _traction(case.test)
    x, held = across(samples), judged.masks[0]["traction"]
    order = np.argsort(x, kind="stable")
    axis.plot(x[~held], samples.ratio[~held], ".", ms=3, color="0.6", label="fitted")
    axis.plot(x[held], samples.ratio[held], "o", ms=3, mfc="none", color="0.3", label="held out")
    for kind, style, what in (("before", "--", "base model"), ("unseen_after", "-", "revised, held out unseen")):
        row = channels()["traction"].predicted(case.model, judged.predictions[kind][0])[0]
        axis.plot(x[order], row[order], style, color="C0" if kind == "before" else "C3", lw=1.4, label=what)
    axis.set_xlabel(label)


def _draw_sweeps(axis: Axes) -> None:
    learnt = choice(SEED)
    found = explain([sweeps()[i] for i in learnt], validate=None, quick=True, progress=silent)
    others = [test for i, test in enumerate(sweeps()) if i not in learnt]
    for test in others:
        samples = _traction(test)
        what = "never fitted" if test is others[0] else None
        axis.plot(100.0 * samples.creepage, samples.ratio, ".", ms=2, color="0.6", label=what)
    samples = _traction(others[0])
    order = np.argsort(samples.creepage)
    for fitted, style, colour, what in (
        (found.judged.before, "--", "C0", "base model"),
        (found.judged.after, "-", "C3", "learnt on five others"),
    ):
        told = foretell(others[0], fitted)
        row = channels()["traction"].predicted(told.case.model, told.prediction)[0]
        axis.plot(100.0 * samples.creepage[order], row[order], style, color=colour, lw=1.4, label=what)
    axis.set_xlabel("creepage [%]")
    axis.set_title("traction sweeps, lubricated ball on disc", loc="left", fontsize=9)


def _traction(test: Experiment) -> TractionSamples:
    return known(test.measured.traction)


if __name__ == "__main__":
    raise SystemExit(main())
