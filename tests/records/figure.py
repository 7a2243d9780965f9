"""The figure: errors on held-out samples beside the student's, and the records with what was learnt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.channels._channel import known
from twindisc_cli.loop.explain import Outcome, explain
from twindisc_cli.loop.validate import predict_test
from twindisc_cli.model.experiment import Experiment, TractionSamples

from .answers import choice, silent
from .errors import Errors
from .sources import shipped, sweeps
from .splits import SEED
from .table import KIND

Floats = NDArray[np.float64]


def draw(errors: Sequence[Errors]) -> Figure:
    """The three shipped records with the base model and the revised one; every held-out error beside the student's."""
    figure = Figure(figsize=(12.0, 3.2), layout="constrained")
    axes = figure.subplots(1, 4)
    _draw_curve(axes[0], explained("eurosprinter"), "creepage [%]", lambda s: 100.0 * s.creepage)
    axes[0].set_title("locomotive, digitised", loc="left", fontsize=9)
    _draw_sweeps(axes[1])
    _draw_curve(axes[2], explained("mtm_running_in"), "time [h]", lambda s: s.time / 3600.0)
    axes[2].set_title("running-in, lubricated ball on disc", loc="left", fontsize=9)
    for axis in axes[:3]:
        axis.set_ylabel("traction ratio T/N [1]")
    _draw_errors(axes[3], errors)
    for axis in axes:
        axis.legend(fontsize=7, frameon=False)
    return figure


def _draw_errors(axis: Axes, errors: Sequence[Errors]) -> None:
    for kind, mark in (("blocks", "o"), ("folds", "."), ("groups", "s")):
        own = [one for one in errors if KIND[one.split[0]] == kind]
        if own:
            axis.loglog([one.student for one in own], [one.loop for one in own], mark, ms=4, mfc="none", label=kind)
    low, high = axis.get_xlim()
    axis.plot([low, high], [low, high], "-", color="0.6", lw=0.8)
    axis.set_xlabel("error of the best of eight laws [1]")
    axis.set_ylabel("of the loop [1]")
    axis.set_title("samples that nothing saw", loc="left", fontsize=9)


@cache
def explained(name: str) -> Outcome:
    """The answer to a shipped record."""
    return explain([shipped(name)], validate=None, quick=False, progress=silent)


def _draw_curve(axis: Axes, found: Outcome, label: str, across: Callable[[TractionSamples], Floats]) -> None:
    judged, case = found.judged, found.problem.cases[0]
    samples = _traction(case.test)
    x, held = across(samples), judged.masks[0]["traction"]
    order = np.argsort(x, kind="stable")
    axis.plot(x[~held], samples.ratio[~held], ".", ms=3, color="0.6", label="fitted")
    axis.plot(x[held], samples.ratio[held], "o", ms=3, mfc="none", color="0.3", label="held out")
    for kind, style, what in (("before", "--", "base model"), ("unseen_after", "-", "revised, held out unseen")):
        row = channels()["traction"].predicted(case.model, judged.prediction(kind)[0])[0]
        axis.plot(x[order], row[order], style, color="C0" if kind == "before" else "C3", lw=1.4, label=what)
    axis.set_xlabel(label)


def _draw_sweeps(axis: Axes) -> None:
    learnt = choice(SEED)
    found = explain([sweeps()[i] for i in learnt], validate=None, quick=False, progress=silent)
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
        told = predict_test(others[0], fitted)
        row = channels()["traction"].predicted(told.case.model, told.prediction)[0]
        axis.plot(100.0 * samples.creepage[order], row[order], style, color=colour, lw=1.4, label=what)
    axis.set_xlabel("creepage [%]")
    axis.set_title("traction sweeps, lubricated ball on disc", loc="left", fontsize=9)


def _traction(test: Experiment) -> TractionSamples:
    return known(test.measured.traction)
