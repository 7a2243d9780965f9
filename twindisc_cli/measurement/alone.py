"""A file that is no whole test: a profile, a temperature or weighings alone, as the table that it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from twindisc_cli.measurement.content import Content
from twindisc_cli.measurement.guess import Guess
from twindisc_cli.measurement.header import Column
from twindisc_cli.measurement.rows import RowCount
from twindisc_cli.measurement.sheet import Floats, Ints
from twindisc_cli.measurement.table import read_table
from twindisc_cli.measurement.units import COUNT, LENGTH, MASS, NUMBER, TEMPERATURE, TIME
from twindisc_cli.quantities import UNITS

_COLUMNS = {
    "y": (LENGTH, "mm"),
    "height": (LENGTH, "um"),
    "temperature": (TEMPERATURE, "degC"),
    "time": (TIME, "s"),
    "mass loss": (MASS, "mg"),
    "mass 1": (MASS, "mg"),
    "mass 2": (MASS, "mg"),
    "mass": (MASS, "mg"),
    "uncertainty": (MASS, "mg"),
    "distance": (LENGTH, "m"),
    "sliding distance": (LENGTH, "m"),
    "cycles": (NUMBER, "1"),
    "revolutions": (NUMBER, "1"),
}
"""What a column is, and the unit in which it is written; any other is a count."""


@dataclass(frozen=True)
class Alone:
    """The columns of a table as they are written, by header, and what became of the rows."""

    columns: Mapping[str, Floats | Ints]
    rows: RowCount


def alone(content: Content, file: str, guess: Guess) -> Alone:
    """The table in a file, in the units of our own tables; MeasurementError where it cannot be read."""
    wanted = [Column(name, _COLUMNS[name][0] if name in _COLUMNS else COUNT) for name in guess.columns]
    table = read_table(content, file, wanted, guess.columns, gaps=True)
    table.check()
    columns: dict[str, Floats | Ints] = {}
    for name in guess.columns:
        unit = UNITS[_COLUMNS[name][1]] if name in _COLUMNS else None
        columns[f"{name} [{unit.name}]" if unit and unit.name != "1" else name] = (unit or UNITS["1"]).of_si(
            table.columns[name]
        )
    guessed = [
        f"{named.column} taken for {name}{f', in {named.unit}' if named.unit else ''}"
        for name, named in guess.columns.items()
        if named.column != name
    ]
    unused = (f"not read: {', '.join(guess.unused)}",) if guess.unused else ()
    notes = (*table.notes, *guessed, *unused)
    return Alone(columns, replace(table.count(), notes=tuple(dict.fromkeys(notes))))
