"""Worn profiles as they are recorded: in one trace or several, with gaps, not level, and somewhere along the axis.

    recorded (y) = height (y - y_0) + m y + h_0

    m, h_0  slope and offset of the line through the unworn flanks, beside the worn zone and a margin
    y_0     centroid of what is missing above the line, inside the worn zone

Each record is levelled by m and h_0 and centred by y_0 unless the definition says otherwise; one on which no track is
clear yet, beside where later records of its disc are worn, and centred as they are. The standard errors count
neighbours whose roughness is equal as fewer points. Traces of one record are levelled and centred one by one, and
averaged.

A profile at iteration 0 is that of the new disc, over the same y as the later ones: what it departs from the nominal
shape by, levelled by a line through all of it and moved to where the tracks of its disc are. Later ones count from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.measurement.channels import check_place, with_iterations
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.header import Column, Naming
from twindisc_cli.measurement.limit import LIMIT, at_limit
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import Bools, Floats, Ints
from twindisc_cli.measurement.table import Table, read_table
from twindisc_cli.measurement.units import COUNT, LENGTH
from twindisc_cli.model.experiment import History, ProfilePlace, ProfileSamples, Rig, Start

NO_DEPTH = 0.1
"""A height of this share of the smaller rolling radius is none that wear made."""
CHORD_MARGIN = 1.5
"""How far the chord of a depth may exceed the profile: heights of a profile that is not quite level reach so far."""
_FEWEST = 8  # points on a track: a parabola and its scatter
_OUTER = 0.85  # of the half width: beyond it discs are not worn
_MARGIN = 0.15  # of the worn zone on either side, for its rounded shoulders
_FEWEST_IN_FLANK = 5  # points of a straight line with a scatter
_SPREADS = 4.0  # standard deviations by which a track is deeper than its flanks
_PASSES = 4  # of zone and level in turn
_WIDER = 3.0  # times the zone that is seen above the noise, at the most
_CLEAR = 3.0  # standard errors of the place of a track
_STILL_CROWNED = 0.5
"""Share of the discs' curvature that the profile of a new disc departs from its nominal shape by at most."""


@dataclass(frozen=True)
class Placed:
    """A trace levelled and centred: y and height (point,) [m], what was taken off, and the standard errors of it.

    slope [1], offset [m] of the line; centre [m] and edges [m] of the worn zone as recorded; clear: how many times
    deeper the track is than what the flanks' roughness could be taken for.
    """

    y: Floats
    height: Floats
    slope: float
    offset: float
    centre: float
    slope_std: float
    offset_std: float
    centre_std: float
    edges: tuple[float, float]
    clear: float = 0.0


def placed(y: Floats, height: Floats) -> Placed | None:
    """Level a trace on its flanks and centre it on what is worn; None where it has no flanks or nothing is worn."""
    flank = _outer(y)
    zone = None
    for _ in range(_PASSES):
        if _one_sided(y, flank):
            return None
        left = height - np.polyval(np.polyfit(y[flank], height[flank], 1), y)
        zone = _worn_zone(y, left, flank)
        if zone is None:
            return None
        flank = _beside(y, zone)
    assert zone is not None  # the passes are more than none
    if _one_sided(y, flank):
        return None
    inside = (y >= zone[0]) & (y <= zone[1])
    missing, weight = -left[inside], np.gradient(y)[inside]
    area = float(np.sum(missing * weight))
    if not area > 0.0:
        return None
    centre = float(np.sum(missing * weight * y[inside])) / area
    error = float(np.sqrt(np.sum((weight * (y[inside] - centre)) ** 2))) / area
    smooth, limit = _smoothed(y, left, flank)
    return replace(_levelled(y, height, flank, centre, error, zone), clear=float(np.min(smooth)) / limit)


def hardly_worn(y: Floats, height: Floats, others: Sequence[Placed], reach: float) -> Placed | None:
    """Level and centre a trace on which a track cannot be made out.

    It is levelled beside where others are worn and centred as they are. Without others it is on its outer ends, its
    centre known to `reach` [m]; None where something stands out from them.
    """
    flank = _outer(y)
    if others:
        flank = _beside(y, (min(other.edges[0] for other in others), max(other.edges[1] for other in others)))
    if _one_sided(y, flank):
        return None
    left = height - np.polyval(np.polyfit(y[flank], height[flank], 1), y)
    if not others and _stands_out(y, left, flank):
        return None
    centre = float(np.mean([other.centre for other in others])) if others else 0.0
    result = _levelled(y, height, flank, centre, 0.0, (centre, centre))
    return replace(result, centre_std=max((other.centre_std for other in others), default=reach))


def _outer(y: Floats) -> Bools:
    """The outer ends of a trace."""
    return np.asarray(np.abs(y - 0.5 * (y[0] + y[-1])) > _OUTER * 0.5 * np.ptp(y))


def _beside(y: Floats, zone: tuple[float, float]) -> Bools:
    """Beside a worn zone and a margin."""
    margin = _MARGIN * (zone[1] - zone[0])
    return np.asarray((y < zone[0] - margin) | (y > zone[1] + margin))


def _one_sided(y: Floats, flank: Bools) -> bool:
    """Whether there are too few points on one side to level a trace."""
    return bool(min(np.sum(flank & (y < np.mean(y))), np.sum(flank & (y > np.mean(y)))) < _FEWEST_IN_FLANK)


def _levelled(
    y: Floats, height: Floats, flank: Bools, centre: float, error: float, edges: tuple[float, float]
) -> Placed:
    """A trace without the line through its flanks, about its centre; error: of the centre over the roughness [1]."""
    line = np.polyfit(y[flank], height[flank], 1)
    left = height - np.polyval(line, y)
    rough = float(np.std(left[flank], ddof=2)) * np.sqrt(_correlated(left[flank]))
    return Placed(
        y=y - centre,
        height=left,
        slope=float(line[0]),
        offset=float(np.polyval(line, centre)),
        centre=centre,
        slope_std=rough / float(np.sqrt(np.sum((y[flank] - y[flank].mean()) ** 2))),
        offset_std=rough / float(np.sqrt(flank.sum())),
        centre_std=rough * error,
        edges=edges,
    )


def _worn_zone(y: Floats, left: Floats, flank: Bools) -> tuple[float, float] | None:
    """The edges of the stretch around the deepest point that is deeper than the flanks' roughness explains.

    A parabola that is seen where it is deeper than a limit ends (1 - limit / depth)^(-1/2) times as far out.
    """
    smooth, limit = _smoothed(y, left, flank)
    deepest = int(np.argmin(smooth))
    shallow = np.flatnonzero(smooth >= limit)
    before, after = shallow[shallow < deepest], shallow[shallow > deepest]
    if not smooth[deepest] < limit or not len(before) or not len(after):
        return None
    low, high = float(y[before[-1]]), float(y[after[0]])
    wider = min((1.0 - limit / float(smooth[deepest])) ** -0.5, _WIDER)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return middle - wider * half, middle + wider * half


def _stands_out(y: Floats, left: Floats, flank: Bools) -> bool:
    """Whether anything is deeper than the flanks' roughness explains."""
    smooth, limit = _smoothed(y, left, flank)
    return bool(np.min(smooth) < limit)


def _smoothed(y: Floats, left: Floats, flank: Bools) -> tuple[Floats, float]:
    """A levelled trace over a sixtieth of its width, and the height below which it is worn."""
    width = max(1, len(y) // 60)
    smooth = np.convolve(np.pad(left, width // 2, mode="edge"), np.full(width, 1.0 / width), mode="valid")[: len(y)]
    sides = [flank & (y < np.mean(y)), flank & (y > np.mean(y))]
    rough = np.concatenate([_beyond_a_bend(y[side], left[side]) for side in sides])
    off = np.abs(left[flank] - np.median(left[flank]))
    spread = 1.4826 * float(np.median(off)) * np.sqrt(_correlated(rough) / width)
    return smooth, -max(_SPREADS * spread, 0.01 * abs(float(smooth.min())))


def _beyond_a_bend(y: Floats, height: Floats) -> Floats:
    """What a parabola leaves of a stretch."""
    at = (y - np.mean(y)) / np.ptp(y)
    return np.asarray(height - np.polyval(np.polyfit(at, height, 2), at))


def _correlated(rough: Floats) -> float:
    """How many neighbours say the same, (1 + r) / (1 - r) by the correlation r of one point with the next."""
    size = float(np.sum(rough**2))
    r = min(max(float(np.sum(rough[1:] * rough[:-1])) / size, 0.0), 0.98) if size > 0.0 else 0.0
    return (1.0 + r) / (1.0 - r)


def read_profile(
    data: bytes | Content,
    file: str,
    *,
    rig: Rig,
    history: History,
    naming: Naming | None = None,
    as_recorded: bool = False,
) -> tuple[ProfileSamples | None, ProfilePlace | None, Start | None, RowCount]:
    """Height change of the worn disc across the track, for each disc and stop, and how well its place is known.

    as_recorded: neither levelled nor centred; the worn zone must then lie under the contact. The new discs, and None
    where they were not recorded; None for the height change where nothing else was.
    """
    counts = (Column(name, COUNT, required=False) for name in ("disc", "iteration", "trace"))
    wanted = (Column("y", LENGTH), Column("height", LENGTH), *counts)
    table = read_table(data, file, wanted, naming, gaps=True)
    table.keep(~at_limit(table.columns["height"]), LIMIT)
    columns = table.columns
    history = with_iterations(table, history)
    last = history.iterations
    disc = columns.get("disc", np.full(len(table), 2.0)).astype(np.int64)
    iteration = columns.get("iteration", np.full(len(table), float(last))).astype(np.int64)
    check_place(table, disc, iteration, last, first=0)
    stops = [
        (which, np.flatnonzero((disc == which[0]) & (iteration == which[1])))
        for which in np.unique(np.stack([disc, iteration]), axis=1).T
    ]
    fresh = {int(which[0]): _fresh(table, rows, rig) for which, rows in stops if which[1] == 0}
    _count_from(table, disc, fresh)
    stops = [(which, rows) for which, rows in stops if which[1] > 0]
    worn = {
        which: [one for (own, _), rows in stops if own == which for one in _worn(table, rows)]
        for which in np.unique(disc)
    }
    records = [(which, _record(table, rows, rig, worn[which[0]], as_recorded=as_recorded)) for which, rows in stops]
    if not fresh and not any(len(y) for _, (y, _, _) in records):
        table.note("no row holds both a place and a height", line=1)
    table.check()
    start = _start(fresh, {int(which[0]): result[-1].centre for which, (_, _, result) in records if result})
    if not records:
        return None, None, start, table.count()
    return _samples(records, history), _place([result for _, (_, _, result) in records]), start, table.count()


def _samples(
    records: Sequence[tuple[Ints, tuple[Floats, Floats, Sequence[Placed]]]], history: History
) -> ProfileSamples:
    """The records of all stops, each (disc, iteration) with its y, height and place, as one."""
    counts = [len(y) for _, (y, _, _) in records]
    disc, iteration = np.repeat([which for which, _ in records], counts, axis=0).T
    return ProfileSamples(
        y=np.concatenate([y for _, (y, _, _) in records]),
        height=np.concatenate([height for _, (_, height, _) in records]),
        disc=disc,
        iteration=history.entry(iteration),
    )


def _fresh(table: Table, rows: Ints, rig: Rig) -> tuple[Floats, Floats]:
    """The profile of a new disc, the mean of its traces, levelled: y and height [m]."""
    y, height = table.columns["y"], table.columns["height"]
    traces = _traces(table, rows)
    if not all(_check_trace(table, trace, rig) for trace in traces):
        return y[rows], height[rows]
    traces = [trace[np.argsort(y[trace])] for trace in traces]
    place, mean = _mean_of(table, [(y[trace], height[trace]) for trace in traces])
    bent = 2.0 * float(np.polyfit(place - np.mean(place), mean, 2)[0])
    if abs(bent) > _STILL_CROWNED * abs(rig.curvature_y):
        what = (
            f"the new disc is bent by {1e-3 / abs(bent):.3g} mm of radius beside its nominal shape; take its crown off"
        )
        table.note(what, "height", int(table.lines[rows[0]]))
    table.notes.append("iteration 0 is the new disc: wear begins there, and later profiles count from it")
    return place, mean


def _count_from(table: Table, disc: Ints, fresh: dict[int, tuple[Floats, Floats]]) -> None:
    """Take the profile of each new disc off its later ones."""
    height = table.columns["height"].copy()
    for which, (y, new) in fresh.items():
        own = disc == which
        height[own] -= np.interp(table.columns["y"][own], y, new)
    table.columns["height"] = height


def _start(fresh: dict[int, tuple[Floats, Floats]], centre: dict[int, float]) -> Start | None:
    """The new discs on the places of both, about the centres of their tracks; what was not recorded is nominal."""
    if not fresh:
        return None
    about = {
        disc: (y - centre.get(disc, 0.0), new - np.polyval(np.polyfit(y, new, 1), y))
        for disc, (y, new) in fresh.items()
    }
    places = np.unique(np.concatenate([y for y, _ in about.values()]))
    nominal = np.zeros_like(places)
    return Start(places, np.array([np.interp(places, *about[d]) if d in about else nominal for d in (1, 2)]))


def _place(sequences: Sequence[Sequence[Placed]]) -> ProfilePlace | None:
    """How well slope, offset and centre of the records are known; None where one of them is as it was recorded."""
    if not all(sequences):
        return None
    worst = [[max(getattr(p, name) for p in traces) / np.sqrt(len(traces)) for traces in sequences]
             for name in ("slope_std", "offset_std", "centre_std")]  # fmt: skip
    return ProfilePlace(*(float(max(stds)) for stds in worst))


def _worn(table: Table, rows: Ints) -> list[Placed]:
    """The traces of a record on which a track is clear, put in place."""
    y, height = table.columns["y"], table.columns["height"]
    ordered = [trace[np.argsort(y[trace])] for trace in _traces(table, rows)]
    result = (placed(y[order], height[order]) for order in ordered)
    return [one for one in result if one and one.clear >= _CLEAR]


def _record(
    table: Table, rows: Ints, rig: Rig, worn: Sequence[Placed], *, as_recorded: bool
) -> tuple[Floats, Floats, list[Placed]]:
    """One record: its traces checked, put in place and averaged, y and height [m]; none placed where one cannot be.

    worn: the traces of the same disc on which a track is clear.
    """
    y, height = table.columns["y"], table.columns["height"]
    traces = _traces(table, rows)
    if not all(_check_trace(table, trace, rig) for trace in traces):
        return y[rows], height[rows], []
    result: list[Placed] = []
    traces = [trace[np.argsort(y[trace])] for trace in traces]
    for order in [] if as_recorded else traces:
        one = placed(y[order], height[order])
        if one is None or (one.clear < _CLEAR and worn):
            one = hardly_worn(y[order], height[order], worn, float(rig.patch.b))
        if one:
            result.append(one)
    if len(result) < len(traces):
        _check_depth(table, rows, height[rows], rig)
        if not as_recorded:
            table.notes.append("the flanks beside the track do not show where it is level: taken as recorded")
        else:
            _check_under_contact(table, rows, rig)
        result = []
    else:
        for one, trace in zip(result, traces, strict=True):
            _check_depth(table, trace, one.height, rig)
        table.notes.append(_note(result))
    curves = [(p.y, p.height) for p in result] or [(y[trace], height[trace]) for trace in traces]
    if len(curves) == 1 and not result:
        return y[rows], height[rows], []
    return (*_mean_of(table, curves), result)


def _note(places: Sequence[Placed]) -> str:
    """What was taken off a record."""
    shifts = [
        ("slope", [p.slope * 1e3 for p in places], [p.slope_std * 1e3 for p in places], "um/mm"),
        ("offset", [p.offset * 1e6 for p in places], [p.offset_std * 1e6 for p in places], "um"),
        ("centre", [p.centre * 1e3 for p in places], [p.centre_std * 1e3 for p in places], "mm"),
    ]
    parts = [f"{name} {np.round(np.mean(v), 9) + 0.0:.3g} ± {np.max(e):.2g} {unit}" for name, v, e, unit in shifts]
    seen = all(p.edges[0] < p.edges[1] for p in places)
    how = "levelled on the flanks and centred on the track" if seen else "no clear track, levelled beside its place"
    return f"{how}, taken off (± one standard deviation): {', '.join(parts)}"


def _mean_of(table: Table, curves: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    """The mean of several traces on the places of the first that all of them reach; their scatter is reported."""
    if len(curves) == 1:
        return curves[0]
    low, high = max(y[0] for y, _ in curves), min(y[-1] for y, _ in curves)
    grid = curves[0][0][(curves[0][0] >= low) & (curves[0][0] <= high)]
    if len(grid) < _FEWEST:
        what = f"{len(curves)} traces share {len(grid)} points of the first, at least {_FEWEST} are needed for a mean"
        table.note(f"{what}: check the order of the rows, or give each trace its number in a column trace", "y")
        return curves[0]
    heights = np.array([np.interp(grid, y, height) for y, height in curves])
    scatter = float(np.sqrt(np.mean(np.var(heights, axis=0, ddof=1))))
    table.notes.append(f"{len(curves)} traces: their mean is taken, they scatter by {scatter * 1e6:.2g} um")
    return grid, heights.mean(axis=0)


def _traces(table: Table, rows: Ints) -> list[Ints]:
    """The rows of each trace: as the file numbers them, else cut where y goes back to its beginning."""
    if "trace" in table.columns:
        number = table.columns["trace"][rows]
        return [rows[number == n] for n in np.unique(number)]
    y = table.columns["y"][rows]
    if len(y) < _FEWEST:
        return [rows]
    rise = np.diff(y) * (np.sign(np.median(np.diff(y))) or 1.0)
    cuts = np.flatnonzero(rise < -0.5 * np.ptp(y)) + 1
    return np.split(rows, cuts)


def _check_trace(table: Table, rows: Ints, rig: Rig) -> bool:
    """One trace: enough points, y in order, at least as wide as the contact."""
    y, height, before = table.columns["y"][rows], table.columns["height"][rows], len(table.problems)
    first = int(table.lines[rows[0]])
    if len(rows) < _FEWEST:
        if not table.problems:
            table.note(f"too few points: {len(rows)}, at least {_FEWEST} are needed for a profile", line=first)
        return False
    rise = np.diff(y) * (np.sign(y[-1] - y[0]) or 1.0)
    rises_instead = np.all(np.diff(height) > 0.0) or np.all(np.diff(height) < 0.0)
    hint = f"; swapped with {table.headers['height']}?" if rises_instead else ""
    bad = np.zeros(len(table), dtype=bool)
    bad[rows[1:][rise <= 0.0]] = True
    table.flag(bad, "y", lambda row: f"y = {table.written('y')[row]:g} occurs twice or out of order here{hint}")
    span, width = float(np.ptp(y)), 2.0 * float(rig.patch.b)
    if span < width:
        what = f"the profile spans {span * 1e3:.4g} mm, the contact is {width * 1e3:.4g} mm wide"
        table.note(f"{what}: measure across the whole track, or check the unit", "y", first)
    return len(table.problems) == before


def _check_under_contact(table: Table, rows: Ints, rig: Rig) -> None:
    """The worn zone of a profile that is taken as recorded lies under the contact."""
    order = rows[np.argsort(table.columns["y"][rows])]
    y = table.columns["y"][order]
    result = placed(y, table.columns["height"][order])
    if result is None:
        return
    zone = y[-result.height > 0.05 * np.max(-result.height)]
    if zone.min() > rig.patch.b or zone.max() < -rig.patch.b:
        what = (
            f"the worn zone lies at y = {zone.min() * 1e3:.3g} to {zone.max() * 1e3:.3g} mm, the contact at 0 ± "
            f'{rig.patch.b * 1e3:.3g} mm; leave profile_place = "as recorded" out, and it is centred'
        )
        table.note(what, "y", int(table.lines[rows[0]]))


def _check_depth(table: Table, rows: Ints, height: Floats, rig: Rig) -> None:
    """A track of depth d is a chord, sqrt(8 d / curvature) wide, which the profile must hold."""
    y = table.columns["y"][rows]
    deepest = int(np.argmax(np.abs(height)))
    most, line = float(height[deepest]), int(table.lines[rows[deepest]])
    if abs(most) > NO_DEPTH * min(rig.disc1.rolling_radius, rig.disc2.rolling_radius):
        table.note(f"{most * 1e3:g} mm is not a wear depth; check the unit", "height", line)
        return
    if rig.is_line:
        return
    chord, span = float(np.sqrt(8.0 * abs(most) / rig.curvature_y)), float(np.ptp(y))
    if chord > CHORD_MARGIN * span:
        what = f"a track {abs(most) * 1e3:.3g} mm deep is {chord * 1e3:.3g} mm wide on these discs"
        table.note(
            f"{what}, the profile spans {span * 1e3:.3g} mm; check the unit, and level the profile", "height", line
        )
