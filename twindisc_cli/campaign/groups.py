"""What the tests of a group say together: one mu or one K for all, which test does not belong, which effects hold.

Tests with the same `[test] group` are repeats. Their mu and K are pooled as logarithms, so that scatters are relative.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.campaign.table import Table
from twindisc_cli.identify import hierarchy
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.model.experiment import Floats, Ints
from twindisc_cli.report.words import listed, p_value, with_interval

SINGLE = 0.05
"""One value for all tests is refused below this probability."""
_ESTIMATES = (
    ("K", "K [1]", "K std [1]"),
    ("K", "base K [1]", "base K std [1]"),
    ("mu", "base mu [1]", "base mu std [1]"),
)
SATURATED = 0.9
"""Share of the largest mean mu over creepage from which on the steps of a group slide all over: below, a softer contact
than smooth discs, or a film, keeps T/N under mu, whatever the theory's slope says of it."""
BAND = 0.1
"""Width of the bands of creepage that means are taken of, in its logarithm: steps of a rig are farther apart."""
_FEW = 3  # names, which a line holds
_STEP = re.compile(r"step (\d+) mu \[1\]")


@dataclass(frozen=True)
class Points:
    """The mu of every test and step, each (point,): the row of its test, creepage [%], mu and its interval."""

    row: Ints
    creepage: Floats
    mu: Floats
    low: Floats
    high: Floats

    @property
    def scatter(self) -> Floats:
        """How the relative standard errors compare, (point,); all equal where one is not known."""
        width = (self.high - self.low) / self.mu
        return width if np.all(width > 0.0) else np.ones_like(width)


@dataclass(frozen=True)
class Curve:
    """mu over creepage [%] of a group, (cell,), and the band in which 90 % of its tests lie."""

    creepage: Floats
    mu: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True)
class Group:
    """A quantity of the tests of a group: pooled, as logarithms, without the outliers, which are named.

    within: relative scatter inside a test, of mu that of one step, of K its standard error.
    """

    name: str
    quantity: str
    tests: tuple[str, ...]
    outliers: tuple[str, ...]
    pooled: hierarchy.Pooled
    within: float
    curve: Curve | None = None

    @property
    def one_for_all(self) -> bool:
        """Whether one value for all its tests agrees with the data."""
        return not self.outliers and self.pooled.p_one > SINGLE

    @property
    def summary(self) -> str:
        """The outcome in one line."""
        p = self.pooled
        one = f"one {self.quantity} for all {'agrees' if self.one_for_all else 'is refused'} ({p_value(p.p_one)})"
        between = f"{_percent(p.between)} ({_percent(p.between_low)} to {_percent(p.between_high)})"
        named = f"; outlier: {', '.join(self.outliers)}" if self.outliers else ""
        level = with_interval(np.exp(p.mean), np.exp(p.low), np.exp(p.high))
        return (
            f"group {self.name}, {len(self.tests)} tests: {self.quantity} = {level}, scatter between tests {between}, "
            f"within {_percent(self.within)}; {one}{named}"
        )

    @property
    def json(self) -> dict[str, Any]:
        """The outcome for scripts."""
        p = self.pooled
        return {
            "group": self.name,
            "quantity": self.quantity,
            "tests": list(self.tests),
            "outliers": list(self.outliers),
            "mean": np.exp(p.mean),
            "low": np.exp(p.low),
            "high": np.exp(p.high),
            "between_percent": 100.0 * p.between,
            "between_low_percent": 100.0 * p.between_low,
            "between_high_percent": 100.0 * p.between_high,
            "within_percent": 100.0 * self.within,
            "p_one_for_all": p.p_one,
            "one_for_all": self.one_for_all,
        }


@dataclass(frozen=True)
class Effect:
    """An effect over the tests of a group: in how many it was found, and the probability in each of them."""

    group: str
    name: str
    tests: tuple[str, ...]
    of: int
    probability: tuple[float, ...]

    @property
    def holds(self) -> str:
        """For all tests, some or one."""
        return "all" if len(self.tests) == self.of else "one" if len(self.tests) == 1 else "some"

    @property
    def summary(self) -> str:
        """The outcome in one line."""
        where = f"group {self.group}: " if self.group else ""
        return (
            f"{where}{self.name} in {len(self.tests)} of {self.of} tests{few(self.tests, self.of)}, "
            f"probability {100.0 * min(self.probability):.0f} to {100.0 * max(self.probability):.0f} %"
        )

    @property
    def json(self) -> dict[str, Any]:
        """The outcome for scripts."""
        return {
            "group": self.group,
            "effect": self.name,
            "tests": list(self.tests),
            "of": self.of,
            "holds": self.holds,
            "probability": list(self.probability),
        }


def few(tests: Sequence[str], of: int) -> str:
    """`: a and b`, the names of some of so many tests where these are few; empty where they are all or many."""
    return f": {listed(tests)}" if len(tests) <= min(_FEW, of - 1) else ""


def _percent(value: float) -> str:
    return f"{100.0 * value:.2g} %" if np.isfinite(value) else "unknown"


def points_of(table: Table) -> Points:
    """Every mu that a campaign of identify-mu found, but those less certain than their own size."""
    parts: list[tuple[Any, ...]] = []
    for step in (int(match[1]) for name in table.columns if (match := _STEP.fullmatch(name))):
        creepage, mu, low, high = (
            table.numbers(f"step {step} {name}") for name in ("creepage [%]", "mu [1]", "mu low [1]", "mu high [1]")
        )
        known = np.flatnonzero((mu > 0.0) & np.isfinite(creepage) & ~(high - low > mu))
        parts.append((known, creepage[known], mu[known], low[known], high[known]))
    if not parts:
        empty = np.empty(0)
        return Points(np.empty(0, dtype=np.int64), empty, empty, empty, empty)
    return Points(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def groups_of(table: Table) -> list[Group]:
    """Every group of at least two tests, for each quantity that its tests have."""
    points = points_of(table)
    results = []
    for name, rows in _members(table):
        results += [group for group in (_friction(table, name, rows, points), *_estimates(table, name, rows)) if group]
    return results


def effects_of(table: Table) -> list[Effect]:
    """The effects that close-loop named, over each group and over the tests of none."""
    verdict, effects = table.texts("verdict"), [set(text.split("; ")) - {""} for text in table.texts("effects")]
    groups = table.texts("group")
    results = []
    for group in dict.fromkeys(groups):
        rows = [i for i, name in enumerate(groups) if name == group and verdict[i]]
        for effect in sorted(set().union(*(effects[i] for i in rows))):
            inside = [i for i in rows if effect in effects[i]]
            probability = table.numbers(f"{effect} probability [1]")[inside]
            tests = tuple(str(table.columns["test"][i]) for i in inside)
            results.append(Effect(group, effect, tests, len(rows), tuple(float(p) for p in probability)))
    return results


def _members(table: Table) -> Iterator[tuple[str, Ints]]:
    groups = np.array(table.texts("group"))
    for name in dict.fromkeys(groups[groups != ""].tolist()):
        yield name, np.flatnonzero(groups == name)


def _friction(table: Table, name: str, rows: Ints, points: Points) -> Group | None:
    """mu of a group over the creepages that its tests share, from where they slide all over."""
    inside = _sliding(points, np.isin(points.row, rows))
    present, test = np.unique(points.row[inside], return_inverse=True)
    if len(present) < 2:
        return None
    cell, creepage = hierarchy.cells_of(points.creepage[inside])
    y, scatter = np.log(points.mu[inside]), points.scatter[inside]
    every = hierarchy.levels(y, test, cell, scatter)
    if every is None or every.within == 0.0:
        return None
    out = hierarchy.outliers(every.level, every.std)
    kept = ~np.isin(test, out)
    _, again = np.unique(test[kept], return_inverse=True)
    shared, used = np.unique(cell[kept], return_inverse=True)
    rest = hierarchy.levels(y[kept], again, used, scatter[kept])
    if rest is None:
        return None
    pooled = hierarchy.pool(rest.level + float(np.mean(rest.cells)), rest.std, rest.dof)
    names = tuple(str(table.columns["test"][row]) for row in present)
    curve = _curve(creepage[shared], rest, pooled)
    return Group(name, "mu", names, tuple(names[i] for i in out), pooled, rest.within, curve)


def _sliding(points: Points, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The points among some (point,) from the creepage on at which their mean mu first comes near its largest."""
    size = np.abs(points.creepage)
    known = inside & (size > 0.0)
    if not known.any():
        return inside
    places, band = np.unique(np.round(np.log(size[known]) / BAND), return_inverse=True)
    mean = np.bincount(band, np.log(points.mu[known])) / np.bincount(band)
    first = places[np.argmax(mean >= mean.max() + np.log(SATURATED))]
    return np.asarray(known & (size >= np.exp(BAND * (first - 0.5))))


def _curve(creepage: Floats, levels: hierarchy.Levels, pooled: hierarchy.Pooled) -> Curve:
    """The mean curve, and where a test of the same kind lies at each creepage with 90 % probability."""
    half = hierarchy.prediction_half(len(levels.level), np.hypot(pooled.between, pooled.std))
    middle = np.exp(levels.cells)
    return Curve(creepage, middle, middle * np.exp(-half), middle * np.exp(half))


def _estimates(table: Table, name: str, rows: Ints) -> Iterator[Group]:
    """Each quantity that the tests of a group give with its standard error, but what is less certain than its size."""
    for quantity, column, error in _ESTIMATES:
        value, std = table.numbers(column)[rows], table.numbers(error)[rows]
        known = np.flatnonzero((value > 0.0) & (std > 0.0) & ~(2.0 * NINETY * std > value))
        if len(known) < 2:
            continue
        y, s = np.log(value[known]), std[known] / value[known]
        out = hierarchy.outliers(y, s)
        kept = np.setdiff1d(np.arange(len(known)), out)
        names = [str(test) for test in table.columns["test"][rows[known]]]
        pooled = hierarchy.pool(y[kept], s[kept])
        yield Group(name, quantity, tuple(names), tuple(names[i] for i in out), pooled, pooled.within)
