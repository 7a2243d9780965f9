"""What the figure of close-loop draws of a channel: the samples of all tests over one axis, the steps, the noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.figures.style import is_wide
from twindisc_cli.figures.time_axis import TimeAxis, time_axis
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import Curve, Diagnosis, FoundLaw
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.quantities import QUANTITIES, Quantity

Mask = NDArray[np.bool_]

GAP = 0.03
"""Pause drawn between tests that follow each other, over the length of all of them."""
BINS = 12  # of a mean over a covariate: each holds enough samples, a bend stays visible
LABELS = ("disc", "iteration")
"""What distinguishes records, and is no axis."""


@dataclass(frozen=True)
class Trace:
    """Samples of one test, or of one recorded profile, in the units of the panels; each (sample,).

    x is the abscissa of the left panel, over that of the middle one. kept is False for outliers.
    """

    label: str
    x: Floats
    over: Floats
    measured: Floats
    before: Floats
    after: Floats
    held_out: Mask
    kept: Mask


@dataclass(frozen=True)
class Span:
    """A step of the history along x, with its creepage [%]."""

    begin: float
    end: float
    creepage: float


def views_of(diagnosis: Diagnosis, tests: Sequence[Experiment]) -> list[View]:
    """One view for every measured channel."""
    by_name = {test.name: test for test in tests}
    return [
        View(diagnosis, channel, [(c, by_name[c.test]) for c in diagnosis.curves if c.channel == channel])
        for channel in channels()
        if channel in diagnosis.errors
    ]


@dataclass(frozen=True)
class View:
    """One channel of a diagnosis with the curves of all tests, and what they are drawn over."""

    diagnosis: Diagnosis
    channel: str
    curves: Sequence[tuple[Curve, Experiment]]

    @property
    def kind(self) -> str:
        """What kind of data they are: measured, digitised, reconstructed, synthetic."""
        return " and ".join(dict.fromkeys(test.measured.provenance for _, test in self.curves))

    @cached_property
    def along(self) -> str:
        """Abscissa of the left panel: y; time; creepage where samples were recorded without time."""
        if all("y" in curve.covariates for curve, _ in self.curves):
            return "y"
        recorded = [getattr(channels()[self.channel].samples(test), "time", np.zeros(1)) for _, test in self.curves]
        return "time" if all(np.isfinite(times).all() for times in recorded) else "creepage"

    @cached_property
    def clocks(self) -> list[TimeAxis]:
        """What the time of each test is drawn over: what was asked for, else s, min or h as fits the tests."""
        seconds = sum(float(test.history.end_time[-1]) for _, test in self.curves)
        usual = "s" if seconds < 600.0 else "min" if seconds < 21600.0 else "h"
        return [time_axis(test, usual) for _, test in self.curves]

    @cached_property
    def starts(self) -> list[float]:
        """Where each test begins on their common axis of time."""
        ends = [float(clock.drawn(clock.test.history.end_time[-1])) for clock in self.clocks]
        return [sum(ends[:i]) + i * GAP * sum(ends) for i in range(len(ends))]

    @property
    def quantity(self) -> Quantity:
        """What the channel measures."""
        return channels()[self.channel].quantity

    @property
    def noise(self) -> float:
        """Noise of the channel as drawn."""
        return self.diagnosis.errors[self.channel].noise

    @cached_property
    def over(self) -> str:
        """Abscissa of what the model leaves."""
        return strongest(self.diagnosis, self.channel)

    def scale(self, covariate: str, number: int = 0) -> Quantity | TimeAxis:
        """How a covariate of a test, by its number, is drawn."""
        return self.clocks[number] if covariate == "time" else channels()[self.channel].covariate(covariate)

    def is_wide(self, covariate: str) -> bool:
        """Whether a covariate is drawn on a logarithmic axis."""
        if covariate != "creepage":
            return False
        creepages = [np.asarray(curve.covariates["creepage"], dtype=float) for curve, _ in self.curves]
        return is_wide(np.concatenate([*creepages, np.empty(0)]))

    @cached_property
    def traces(self) -> list[Trace]:
        """The samples of every test, those of every recorded profile apart."""
        return [trace for number in range(len(self.curves)) for trace in self._traces(number)]

    def _traces(self, number: int) -> Iterator[Trace]:
        curve, along, over = self.curves[number][0], self.along, self.over
        name = curve.test if len(self.curves) > 1 else ""
        start = self.starts[number] if along == "time" else 0.0
        x, across = (self.scale(key, number).drawn(curve.covariates[key]) for key in (along, over))
        for label, part in _parts(curve):
            yield Trace(
                label=" ".join(text for text in (name, label) if text),
                x=x[part] + start,
                over=across[part],
                measured=self.quantity.drawn(curve.measured[part]),
                before=self.quantity.drawn(curve.before[part]),
                after=self.quantity.drawn(curve.after[part]),
                held_out=curve.held_out[part],
                kept=curve.kept[part],
            )

    @cached_property
    def spans(self) -> list[Span]:
        """The steps of every test on the common time axis; none where the samples are not drawn over time."""
        return list(self._spans()) if self.along == "time" else []

    @cached_property
    def pauses(self) -> list[tuple[float, float]]:
        """Beginning and end of every entry in which the discs stand still, on the common time axis."""
        return list(self._pauses()) if self.along == "time" else []

    def _pauses(self) -> Iterator[tuple[float, float]]:
        for clock, start in zip(self.clocks, self.starts, strict=True):
            history = clock.test.history
            ends, still = history.end_time, ~history.driven
            for begin, end in zip(clock.drawn(ends - history.duration)[still], clock.drawn(ends)[still], strict=True):
                yield start + float(begin), start + float(end)

    def broken(self, x: Floats, *values: Floats) -> list[Floats]:
        """Abscissa and values over it, sorted (sample,), with a gap where a pause lies between two samples."""
        after = [np.searchsorted(x, end) for begin, end in self.pauses if not np.any((x > begin) & (x < end))]
        gaps = np.unique([place for place in after if 0 < place < len(x)]).astype(np.int64)
        between = 0.5 * (x[gaps - 1] + x[gaps])
        return [np.insert(x, gaps, between), *(np.insert(each, gaps, np.nan) for each in values)]

    def _spans(self) -> Iterator[Span]:
        """The steps of every test on the common time axis."""
        for clock, start in zip(self.clocks, self.starts, strict=True):
            history = clock.test.history
            for step in np.unique(history.step):
                here = np.flatnonzero(history.step == step)
                begin, end = clock.drawn(
                    [history.end_time[here[0]] - history.duration[here[0]], history.end_time[here[-1]]]
                )
                yield Span(
                    begin=start + float(begin),
                    end=start + float(end),
                    creepage=100.0 * float(history.creepage[here[0]]),
                )


def _parts(curve: Curve) -> list[tuple[str, Mask]]:
    """Every recorded profile of a curve, or what is known of each disc, with its label; else all samples."""
    everything = np.ones(len(curve.measured), dtype=bool)
    if "disc" not in curve.covariates:
        return [("", everything)]
    names = [name for name in ("disc", "iteration") if name in curve.covariates]
    numbers = np.stack([curve.covariates[name] for name in names])
    stops = np.unique(numbers, axis=1).T
    if len(stops) == 1:
        return [("", everything)]
    labels = [", ".join(f"{name} {i}" for name, i in zip(names, stop, strict=True)) for stop in stops]
    return [(label, np.all(numbers == stop[:, None], axis=0)) for label, stop in zip(labels, stops, strict=True)]


def strongest(diagnosis: Diagnosis, channel: str) -> str:
    """The covariate on which the unexplained residual depends most: the one named for it, else that of the model
    before."""
    curves = [curve for curve in diagnosis.curves if curve.channel == channel]
    names = [*QUANTITIES, *channels()[channel].over]
    known = [
        name
        for name in names
        if name not in LABELS and all(np.isfinite(curve.covariates.get(name, np.nan)).all() for curve in curves)
    ]
    named = [left.covariate for left in diagnosis.unexplained if left.channel == channel]
    for name in named:
        if name in known:
            return name
    return max(known, key=lambda name: sum(_explained(curve, name) for curve in curves))


def _explained(curve: Curve, name: str) -> float:
    """Sum of squares of the residual before that lies between the bins of a covariate, paid for the bins."""
    kept = curve.kept
    residual, covariate = (curve.measured - curve.before)[kept], np.asarray(curve.covariates[name])[kept]
    levels, bins = np.unique(np.round(covariate, 12), return_inverse=True)
    if len(levels) > BINS:
        bins = np.searchsorted(np.quantile(covariate, np.linspace(0.0, 1.0, BINS + 1)[1:-1]), covariate)
    count = np.maximum(np.bincount(bins), 1)
    means = np.bincount(bins, weights=residual) / count
    within = float(np.sum((residual - means[bins]) ** 2)) / max(len(residual) - len(count), 1)
    between = float(np.sum(count * (means - residual.mean()) ** 2))
    return between - (len(count) - 1) * within


def samples_over(diagnosis: Diagnosis, law: FoundLaw) -> Floats:
    """Where the samples of a law's channel lie along its covariate, in the covariate's unit; none where unknown."""
    every = [np.asarray(c.covariates.get(law.law.covariate, []), dtype=float) for c in diagnosis.curves]
    return law.law.over.quantity.shown.of_si(np.unique(np.concatenate([*every, np.empty(0)])))
