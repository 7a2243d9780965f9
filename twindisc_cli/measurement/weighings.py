"""Mass that the discs lost, from tables as laboratories write them.

when   iteration, revolutions or cycles of the discs, running time (without pauses), distance rolled or slid
what   the loss since the start, or the weight of each disc, which begins with that of the new one
std    as stated row by row, else sqrt(2) of the balance's for the difference of two weighings
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twindisc_cli.measurement.channels import check_place, with_iterations
from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.found_steps import SLIVER, counted, cut_at
from twindisc_cli.measurement.header import Column, Naming
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import Floats, Ints
from twindisc_cli.measurement.table import Table, read_table
from twindisc_cli.measurement.units import COUNT, LENGTH, MASS, NUMBER, TIME
from twindisc_cli.model.experiment import History, MassSamples, Rig

HEAVIEST = 0.1
"""A mass loss [kg] that no test discs survive."""
WHEN = {
    "iteration": COUNT, "revolutions": NUMBER, "cycles": NUMBER, "time": TIME, "distance": LENGTH,
    "sliding distance": LENGTH,
}  # fmt: skip
WEIGHTS = ("mass 1", "mass 2")
ALSO = {
    "mass loss": ("weight loss",),
    "mass": ("weight",),
    "mass 1": ("weight 1", "mass disc 1", "weight disc 1", "mass upper", "weight upper"),
    "mass 2": ("weight 2", "mass disc 2", "weight disc 2", "mass lower", "weight lower"),
}
"""Other names of masses in the tables of laboratories."""
_BEYOND = 1.02
"""A counter that says more than the log by no more than this share means its end."""


@dataclass(frozen=True)
class _Weighed:
    """Weighings, each (weighing,): row of the table, disc, loss since the start [kg] and its standard error [kg]."""

    row: Ints
    disc: Ints
    loss: Floats
    std: Floats


def read_mass(
    data: bytes | Content,
    file: str,
    *,
    rig: Rig,
    history: History,
    naming: Naming | None = None,
    balance: float = np.nan,
) -> tuple[MassSamples, History, RowCount]:
    """Mass loss of the discs since the start, and the history with iterations that end at the weighings.

    balance: standard error [kg] of one weighing, where the table states none. Only a history that was found in the data
    is cut; on one that was given the weighings must lie at ends of iterations.
    """
    first, *others = _ways()
    table = read_table(data, file, first, naming, instead=others)
    when = next(name for name in WHEN if name in table.columns)
    if "time stamps, counted from the first" in table.notes:
        table.note("time stamps do not say how long was run; give revolutions or minutes of running", when)
    table.check()
    weighed = _weighed(table, when, balance)
    if when == "iteration" and history.per_iteration is not None:
        history = with_iterations(table, history)
        history = counted(history, float(history.per_iteration or np.nan))
    entry, history = _entries(table, when, rig, history)
    worn = table.columns[when][weighed.row] > 0.0
    _check_weighed(table, when, weighed)
    table.check()
    row, fresh = weighed.row[worn], np.unique(weighed.row[~worn])
    if len(fresh):
        table.left_out["of the new disc"] = len(fresh)
    samples = MassSamples(entry[row], weighed.loss[worn], weighed.disc[worn], weighed.std[worn])
    return samples, history, table.count(len(np.unique(row)))


def _ways() -> list[tuple[Column, ...]]:
    """The sets of columns that make a table of weighings."""
    disc, error = Column("disc", COUNT, required=False), Column("uncertainty", MASS, required=False)
    one, two = (Column(name, MASS, also=ALSO[name]) for name in WEIGHTS)
    whats = (
        (Column("mass loss", MASS, also=ALSO["mass loss"]), disc, error),
        (one, two, error), (one, error), (two, error),
        (Column("mass", MASS, also=ALSO["mass"]), disc, error),
    )  # fmt: skip
    return [(Column(name, quantity), *what) for name, quantity in WHEN.items() for what in whats]


def _series(table: Table) -> list[tuple[int, Ints, Floats]]:
    """Disc, rows and what was written of its mass [kg], for each disc."""
    columns, rows = table.columns, np.arange(len(table))
    both = [(disc, rows, columns[name]) for disc, name in enumerate(WEIGHTS, start=1) if name in columns]
    if both:
        return both
    mass = columns["mass loss"] if "mass loss" in columns else columns["mass"]
    disc = columns.get("disc", np.full(len(table), 2.0)).astype(np.int64)
    return [(int(one), rows[disc == one], mass[disc == one]) for one in np.unique(disc)]


def _weighed(table: Table, when: str, balance: float) -> _Weighed:
    """The losses of each disc; a weight counts from the first of its disc, which must be that of the new one."""
    stated = table.columns.get("uncertainty", np.full(len(table), np.nan))
    is_loss, parts = "mass loss" in table.columns, []
    for disc, rows, mass in _series(table):
        one = np.where(np.isnan(stated[rows]), balance, stated[rows])
        if is_loss:
            loss, std = mass, np.where(np.isnan(stated[rows]), np.sqrt(2.0) * balance, stated[rows])
        else:
            loss, std = mass[0] - mass, np.hypot(one, one[0])
            if table.columns[when][rows[0]] > 0.0:
                what = f"the first weight of disc {disc} must be that of the new one, at {when} 0"
                table.note(what, when, int(table.lines[rows[0]]))
        parts.append((rows, np.full(len(rows), disc), loss, std))
    return _Weighed(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _check_weighed(table: Table, when: str, weighed: _Weighed) -> None:
    """Each disc is weighed in order, and has lost what a disc can lose."""
    place, loss = table.columns[when][weighed.row], weighed.loss
    again = (np.diff(place, prepend=-np.inf) <= 0.0) & (np.diff(weighed.disc, prepend=0) == 0)
    worn = place > 0.0
    heavy = dict(zip(weighed.row, loss, strict=True))
    for bad, name, what in (
        (again, when, lambda row: f"{when} {table.written(when)[row]:g} is not after the row before"),
        (np.abs(loss) > HEAVIEST, "mass loss", lambda row: f"{heavy[row] * 1e3:g} g is not wear; check the unit"),
        (~worn & (loss != 0.0), "mass loss", lambda _: "the new disc has lost nothing yet"),
    ):
        rows = np.zeros(len(table), dtype=bool)
        rows[weighed.row[bad]] = True
        table.flag(rows, name, what)
    if np.any(worn) and np.all(loss[worn] < 0.0):
        table.note("the discs grow heavier: a mass loss is positive", "mass loss", int(table.lines[0]))
    if "uncertainty" in table.columns:
        table.flag(table.columns["uncertainty"] <= 0.0, "uncertainty", lambda _: "must be greater than 0")
    if not np.any(worn):
        table.note("no weighing after the start")


def _entries(table: Table, when: str, rig: Rig, history: History) -> tuple[Ints, History]:
    """The entry of the history, from 1, at whose end each row was weighed, and the history with such ends."""
    place = table.columns[when]
    if when == "iteration":
        disc = table.columns.get("disc", np.full(len(place), 2.0)).astype(np.int64)
        check_place(table, disc, place.astype(np.int64), history.iterations, first=0)
        table.check()
        return history.entry(np.maximum(place.astype(np.int64), 1)), history
    ends = _counted_by(when, rig, history)
    over = place > ends[-1] * _BEYOND
    factor, _ = table.scales[when]
    end = f"{ends[-1] / factor:.6g}"
    table.flag(over, when, lambda row: f"{table.written(when)[row]:g} lies beyond the end of the test, {end}")
    if history.per_iteration is not None:
        history = cut_at(history, ends, place[place > 0.0])
        ends = _counted_by(when, rig, history)
    entry = history.nearest_end(ends, place)
    size = np.diff(ends, prepend=0.0)[entry - 1]
    off = (np.abs(ends[entry - 1] - place) > SLIVER * size) & (place > 0.0) & (place <= ends[-1])
    what = lambda row: f"no iteration ends there; the nearest end is at {ends[entry[row] - 1] / factor:.6g}"  # noqa: E731
    table.flag(off, when, what)
    return entry, history


def _counted_by(when: str, rig: Rig, history: History) -> Floats:
    """What a counter shows at the end of each entry, (iteration,): revolutions, running time [s], or distance [m]."""
    if when in ("revolutions", "cycles"):
        return np.cumsum(history.revolutions)
    running = np.where(history.driven, history.duration, 0.0)
    speed = rig.rolling_speed * history.speed_factor
    rate = {"time": 1.0, "distance": speed, "sliding distance": speed * np.abs(history.creepage)}[when]
    return np.cumsum(running * rate)
