"""From a diagnosis to the rows of the figure of close-loop: units for reading, and what to draw over what."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twindisc_cli.commands import _loop_told as told
from twindisc_cli.effects._effect import CHANNELS, Channel
from twindisc_cli.figures.close_loop import Ranked, Row, Span, Trace
from twindisc_cli.loop.diagnosis import UNITS, Curve, Diagnosis
from twindisc_cli.loop.search import ALARM
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.report.words import p_value, plain_name

SHOWN = 9
LONGEST = 34
GAP = 0.03
"""Pause drawn between tests that follow each other, over the length of all of them."""
BINS = 12
DECADES = 15.0
"""Creepages that span more than this factor are drawn on a logarithmic axis."""


@dataclass(frozen=True)
class Scale:
    """How a quantity is drawn: its label with the unit, and shown = SI * factor + offset."""

    label: str
    factor: float
    offset: float = 0.0

    def __call__(self, values: Floats | Ints) -> Floats:
        """The values as shown."""
        return np.asarray(values, dtype=float) * self.factor + self.offset


OVER: Mapping[str, Scale] = {
    "creepage": Scale("creepage [%]", 100.0),
    "time": Scale("time [min]", 1.0 / 60.0),
    "cycles": Scale("revolutions [thousands]", 1e-3),
    "energy": Scale("dissipated energy [kJ]", 1e-3),
    "temperature": Scale("disc temperature of the model [°C]", 1.0, -273.15),
    "y": Scale("across the track, y [mm]", 1e3),
}
DRAWN: Mapping[Channel, tuple[Scale, str]] = {
    "traction": (Scale("traction ratio T/N [1]", 1.0), "measured − model [1]"),
    "profile": (Scale("height change [µm]", 1e6), "measured − model [µm]"),
    "temperature": (Scale("disc temperature [°C]", 1.0, -273.15), "measured − model [K]"),
}


def rows_of(diagnosis: Diagnosis, tests: Sequence[Experiment]) -> list[Row]:
    """One row for every measured channel."""
    by_name = {test.name: test for test in tests}
    return [
        _Channel(diagnosis, channel, [(c, by_name[c.test]) for c in diagnosis.curves if c.channel == channel]).row()
        for channel in CHANNELS
        if channel in diagnosis.errors
    ]


@dataclass(frozen=True)
class _Channel:
    """One channel of a diagnosis with the curves of all tests, and what they are drawn over."""

    diagnosis: Diagnosis
    channel: Channel
    curves: Sequence[tuple[Curve, Experiment]]

    @property
    def along(self) -> str:
        """Abscissa of the left panel: time; creepage where samples were recorded without time; y of a profile."""
        if self.channel == "profile":
            return "y"
        timed = [
            self.channel != "traction" or test.measured.traction is None or np.isfinite(test.measured.traction.time)
            for _, test in self.curves
        ]
        return "time" if all(np.all(known) for known in timed) else "creepage"

    @property
    def clock(self) -> Scale:
        """Seconds, minutes or hours, as fits the tests."""
        longest = sum(self.lengths)
        name, seconds = ("s", 1.0) if longest < 600.0 else ("min", 60.0) if longest < 21600.0 else ("h", 3600.0)
        return Scale(f"time [{name}]", 1.0 / seconds)

    @property
    def lengths(self) -> list[float]:
        """Duration of each test [s]."""
        return [float(test.history.end_time[-1]) for _, test in self.curves]

    @property
    def starts(self) -> list[float]:
        """Where each test begins on a common time axis [s]."""
        pause = GAP * sum(self.lengths)
        return [float(sum(self.lengths[:i]) + i * pause) for i in range(len(self.curves))]

    def row(self) -> Row:
        """The row of the figure."""
        along, over = self.along, strongest(self.diagnosis, self.channel)
        scales = {**OVER, "time": self.clock}
        drawn, rest = DRAWN[self.channel]
        wide = {"creepage"} if self._wide() else set()
        return Row(
            what=self.channel,
            x=scales[along].label,
            y=drawn.label,
            over=scales[over].label,
            rest=rest,
            noise=self.diagnosis.errors[self.channel].noise / UNITS[self.channel][1] * drawn.factor,
            traces=[t for curve, start in self._placed() for t in self._traces(curve, start, along, over, scales)],
            spans=list(self._spans()) if along == "time" else [],
            ranking=_ranking(self.diagnosis, self.channel),
            outcome=_outcome(self.diagnosis, self.channel),
            x_log=along in wide,
            over_log=over in wide,
        )

    def _placed(self) -> Iterator[tuple[Curve, float]]:
        return zip((curve for curve, _ in self.curves), self.starts, strict=True)

    def _wide(self) -> bool:
        creepages = [np.abs(curve.covariates["creepage"]) for curve, _ in self.curves if "creepage" in curve.covariates]
        every = np.concatenate([*creepages, np.empty(0)])
        return bool(len(every) and every.min() > 0.0 and every.max() > DECADES * every.min())

    def _traces(
        self, curve: Curve, start: float, along: str, over: str, scales: Mapping[str, Scale]
    ) -> Iterator[Trace]:
        """The samples of a test, those of every recorded profile apart."""
        drawn = DRAWN[self.channel][0]
        name = curve.test if len(self.curves) > 1 else ""
        x = np.asarray(curve.covariates[along], dtype=float) + (start if along == "time" else 0.0)
        for label, part in _parts(curve):
            yield Trace(
                label=" ".join(text for text in (name, label) if text),
                x=scales[along](x[part]),
                over=scales[over](curve.covariates[over][part]),
                measured=drawn(curve.measured[part]),
                before=drawn(curve.before[part]),
                after=drawn(curve.after[part]),
                held_out=curve.held_out[part],
                kept=curve.kept[part],
            )

    def _spans(self) -> Iterator[Span]:
        """The steps of every test on the common time axis."""
        for (_, test), start in zip(self.curves, self.starts, strict=True):
            history = test.history
            for step in np.unique(history.step):
                here = np.flatnonzero(history.step == step)
                end = start + history.end_time[here[-1]]
                begin = start + history.end_time[here[0]] - history.duration[here[0]]
                yield Span(
                    begin=float(begin) * self.clock.factor,
                    end=float(end) * self.clock.factor,
                    creepage=100.0 * float(history.creepage[here[0]]),
                )


def _parts(curve: Curve) -> list[tuple[str, np.ndarray[tuple[int], np.dtype[np.bool_]]]]:
    """Every recorded profile of a curve with its label; all samples of a channel over time."""
    everything = np.ones(len(curve.measured), dtype=bool)
    if curve.channel != "profile":
        return [("", everything)]
    disc, iteration = curve.covariates["disc"], curve.covariates["iteration"]
    stops = np.unique(np.stack([disc, iteration]), axis=1).T
    if len(stops) == 1:
        return [("", everything)]
    return [(f"disc {d}, iteration {i}", np.asarray((disc == d) & (iteration == i))) for d, i in stops]


def strongest(diagnosis: Diagnosis, channel: Channel) -> str:
    """The covariate on which the leftover depends most: the one named for it, else that of the model before."""
    curves = [curve for curve in diagnosis.curves if curve.channel == channel]
    known = [name for name in OVER if all(np.isfinite(curve.covariates.get(name, np.nan)).all() for curve in curves)]
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


def _ranking(diagnosis: Diagnosis, channel: Channel) -> list[Ranked]:
    return [
        Ranked(
            label=_broken(" + ".join(plain_name(name) for name in tried.effects)),
            gain=told.length(tried.gain),
            note=told.outcome(tried)[0],
            passed=tried.passed,
            chosen=told.is_chosen(diagnosis, tried),
        )
        for tried in told.ranked(diagnosis, channel)[:SHOWN]
    ]


def _broken(label: str) -> str:
    """A long label on two lines."""
    return label.replace(" + ", " +\n", 1) if len(label) > LONGEST else label


def _outcome(diagnosis: Diagnosis, channel: Channel) -> str:
    """What came of the search in this channel, as the title of its panel."""
    effects = told.together(diagnosis)
    left = [u.channel for u in diagnosis.unexplained]
    if channel in effects:
        return "what was tried: explained"
    if channel in left:
        return "what was tried: unexplained"
    p = diagnosis.p_values.get(channel, float("nan"))
    if not np.isfinite(p):
        return "not searched"
    instead = (
        ",\nonce the unexplained friction is taken as measured"
        if "traction" in left and "traction" not in effects
        else ""
    )
    return f"nothing is missing here{instead}\n({p_value(p)}; alarm below {ALARM:g})"
