"""The header of a measured file: which column is which, and in which unit, as rigs write it.

A header cell is `name [unit]`, `name (unit)` or `name / unit`, or a bare name whose unit stands in the row below or in
[measured.columns] of the definition, which also gives the name a column has in the file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from twindisc_cli.measurement.units import COUNT, TIME, Quantity

_FORMS = tuple(
    re.compile(form) for form in (r"^(.*?)\s*\[([^\]]*)\]$", r"^(.*?)\s*\(([^)]*)\)$", r"^(.*?)\s*/\s*([^/\s].*)$")
)
_CLOCK = re.compile(r"^(?:(\d{4})-(\d\d)-(\d\d)[T ]|(\d\d)\.(\d\d)\.(\d{4})[T ])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)$")


@dataclass(frozen=True)
class Column:
    """A column a file may have."""

    name: str
    quantity: Quantity
    required: bool = True

    def __str__(self) -> str:
        """The header cell to write."""
        unit = next(iter(self.quantity.units))
        return self.name if self.quantity is COUNT else f"{self.name} [{unit}]"


@dataclass(frozen=True)
class Named:
    """What a definition says of a column: its name in the file, its unit, its sign; None where it says nothing."""

    column: str | None = None
    unit: str | None = None
    sign: int = 1


Naming = Mapping[str, Named]


@dataclass(frozen=True)
class Place:
    """Where a wanted column stands, what it is, its unit as written (None: not said), and its sign."""

    index: int
    column: Column
    unit: str | None
    sign: int = 1
    stamped: bool = False

    @property
    def conversion(self) -> tuple[float, float]:
        """Factor and offset to SI; ValueError where the unit is not known."""
        if self.stamped:
            return 1.0, 0.0
        factor, offset = self.column.quantity.conversion(self.unit)
        return self.sign * factor, self.sign * offset


@dataclass(frozen=True)
class Match:
    """The wanted columns that were found, by name; those that stand there twice; names that mean nothing here."""

    places: Mapping[str, Place]
    doubled: Sequence[str] = ()
    others: Sequence[str] = field(default=())


def plain(name: str) -> str:
    """A name without differences of case, blanks and underscores."""
    return " ".join(name.replace("_", " ").casefold().split())


def match(header: Sequence[str], wanted: Sequence[Column], naming: Naming) -> Match:
    """Find the wanted columns in a header."""
    names = {plain(named.column): name for name, named in naming.items() if named.column}
    names = {column.name: column.name for column in wanted if column.name not in names.values()} | names
    columns = {column.name: column for column in wanted}
    places: dict[str, Place] = {}
    doubled, others = [], []
    for index, cell in enumerate(header):
        text, unit = _parts(cell)
        key = plain(cell) if plain(cell) in names else plain(text)
        name = names.get(key, "")
        if name not in columns:
            others.append(plain(text))
        elif name in places:
            doubled.append(cell)
        else:
            named = naming.get(name, Named())
            written = None if key == plain(cell) and key != plain(text) else unit
            places[name] = Place(index, columns[name], named.unit or written, named.sign)
    return Match(places, doubled, others)


def _parts(cell: str) -> tuple[str, str | None]:
    """Name and unit of a header cell; no unit where none stands there."""
    text = cell.strip()
    for form in _FORMS:
        if found := form.match(text):
            return found[1], found[2]
    return text, None


def is_header(cells: Sequence[str], wanted: Sequence[Column], naming: Naming) -> bool:
    """Whether a line names every column that is needed."""
    found = match(cells, wanted, naming).places
    return all(column.name in found for column in wanted if column.required)


def units_below(row: Sequence[str], places: Mapping[str, Place]) -> dict[str, Place] | None:
    """The places with the units of the row under the header; None where that row is data."""
    filled = {}
    for name, place in places.items():
        cell = row[place.index].strip().strip("[]()") if place.index < len(row) else ""
        try:
            place.column.quantity.conversion(cell)
        except ValueError:
            if cell or place.column.quantity.default is None:
                return None
        if re.fullmatch(r"[-+]?\d+([.,]\d+)?", cell):
            return None
        filled[name] = Place(place.index, place.column, place.unit or cell or None, place.sign)
    return filled


def clock(cell: str) -> float | None:
    """The seconds of a time stamp, with those of its date where it has one; None where it is no time stamp."""
    found = _CLOCK.match(cell.strip())
    if not found:
        return None
    days = 0
    if found[1] or found[6]:
        from datetime import date

        parts = (found[1], found[2], found[3]) if found[1] else (found[6], found[5], found[4])
        try:
            days = date(*(int(part) for part in parts)).toordinal()
        except ValueError:
            return None
    return 86400.0 * days + 3600.0 * int(found[7]) + 60.0 * int(found[8]) + float(found[9].replace(",", "."))


def stamped(row: Sequence[str], places: Mapping[str, Place]) -> dict[str, Place]:
    """The places, with the times that are time stamps in the first row marked as such."""
    return {
        name: Place(p.index, p.column, p.unit, p.sign, stamped=True)
        if p.column.quantity is TIME and p.index < len(row) and clock(row[p.index]) is not None
        else p
        for name, p in places.items()
    }
