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
from twindisc_cli.measurement.units import COUNT, LENGTH, MASS, TEMPERATURE, TIME

_COLUMNS = {
    "y": (LENGTH, "y [mm]", 1e3, 0.0),
    "height": (LENGTH, "height [um]", 1e6, 0.0),
    "temperature": (TEMPERATURE, "temperature [degC]", 1.0, -273.15),
    "time": (TIME, "time [s]", 1.0, 0.0),
    "mass loss": (MASS, "mass loss [mg]", 1e6, 0.0),
    "mass 1": (MASS, "mass 1 [mg]", 1e6, 0.0),
    "mass 2": (MASS, "mass 2 [mg]", 1e6, 0.0),
    "distance": (LENGTH, "distance [m]", 1.0, 0.0),
    "trace": (COUNT, "trace", 1.0, 0.0),
}
"""What a column is, the header under which it is written, and the factor and offset from SI."""


@dataclass(frozen=True)
class Alone:
    """The columns of a table as they are written, by header, and what became of the rows."""

    columns: Mapping[str, Floats | Ints]
    rows: RowCount


def alone(content: Content, file: str, found: Guess) -> Alone:
    """The table in a file, in the units of our own tables; MeasurementError where it cannot be read."""
    wanted = [Column(name, _COLUMNS[name][0] if name in _COLUMNS else COUNT) for name in found.columns]
    table = read_table(content, file, wanted, found.columns, gaps=True)
    table.check()
    columns: dict[str, Floats | Ints] = {}
    for name in found.columns:
        _, header, factor, offset = _COLUMNS.get(name, (COUNT, name, 1.0, 0.0))
        columns[header] = table.columns[name] * factor + offset
    guessed = [f"{named.column} taken for {name}" for name, named in found.columns.items() if named.column != name]
    notes = (*table.notes, *guessed)
    return Alone(columns, replace(table.count(), notes=tuple(dict.fromkeys(notes))))
