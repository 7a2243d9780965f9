"""The header of a measured file: which column is which, and in which unit, as rigs write it.

A header cell is `name [unit]`, `name (unit)` or `name / unit`, or a bare name whose unit stands in the row below or in
[measured.columns] of the definition, which also gives the name a column has in the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from twindisc_cli.laws.covariates import covariate_of
from twindisc_cli.measurement.units import COUNT, TIME, Quantity, kind_of

_FORMS = tuple(
    re.compile(form) for form in (r"^(.*?)\s*\[([^\]]*)\]$", r"^(.*?)\s*\(([^)]*)\)$", r"^(.*?)\s*/\s*([^/\s].*)$")
)
SHARED = ("time", "step", "disc", "iteration", "uncertainty")
"""Columns that files of several kinds have."""
_FIGURE = re.compile(r"[-+]?\d+([.,]\d+)?(?:[eE][-+]?\d+)?")
_CLOCK = re.compile(
    r"(?:(?P<date>\d{4}-\d\d?-\d\d?|\d{4}/\d\d?/\d\d?|\d\d?[./-]\d\d?[./-]\d{4}|\d\d?[./]\d\d?[./]\d\d)[T ,]\s*)?"
    r"(?P<hour>\d{1,2}):(?P<minute>\d\d)(?::(?P<second>\d\d(?:[.,]\d+)?))?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|[+-]\d\d:?\d\d)?"
)


@dataclass(frozen=True)
class Column:
    """A column a file may have, and other names by which rigs call it.

    gaps: a row of a log is kept where no number stands in this column, as NaN. asked_by: the key of a definition that
    asks for it.
    """

    name: str
    quantity: Quantity
    required: bool = True
    also: tuple[str, ...] = ()
    gaps: bool = False
    asked_by: str = ""

    def __str__(self) -> str:
        """The header cell to write."""
        unit = next(iter(self.quantity.units))
        return self.name if self.quantity is COUNT else f"{self.name} [{unit}]"


def declared(name: str) -> Column:
    """The column of a covariate that is declared as `name [unit]`; that unit holds where the file says none."""
    quantity = covariate_of(name).quantity
    kind = replace(kind_of(quantity.unit), default=quantity.shown.solidus)
    return Column(quantity.label, kind, asked_by="measured.covariates")


@dataclass(frozen=True)
class Named:
    """What a definition says of a column: its name in the file, its unit, its sign; None where it says nothing."""

    column: str | None = None
    unit: str | None = None
    sign: int = 1


Naming = Mapping[str, Named]


@dataclass(frozen=True)
class Place:
    """Where a wanted column stands, what it is, its unit as written (None: not said), and its sign.

    stamped: its cells are time stamps; guessed: it stands there by another name, which nobody has declared.
    """

    index: int
    column: Column
    unit: str | None
    sign: int = 1
    stamped: bool = False
    guessed: bool = False

    @property
    def conversion(self) -> tuple[float, float]:
        """Factor and offset to SI; ValueError where the unit is not known."""
        if self.stamped:
            return 1.0, 0.0
        factor, offset = self.column.quantity.conversion(self.unit)
        return self.sign * factor, self.sign * offset


@dataclass(frozen=True)
class Match:
    """The wanted columns found, by name; those that stand there twice, with their place; names that mean nothing."""

    places: Mapping[str, Place]
    doubled: Sequence[tuple[str, int]] = ()
    others: Sequence[str] = field(default=())


def plain(name: str) -> str:
    """A name without differences of case, blanks and underscores."""
    return " ".join(name.replace("_", " ").casefold().split())


def match(header: Sequence[str], wanted: Sequence[Column], naming: Naming) -> Match:
    """Find the wanted columns in a header: by their own names, else by others that they go by.

    A name that is declared for one file of a test says nothing of another's clock or count where it does not stand.
    """
    there = {plain(text) for n, cell in enumerate(header, start=1) for text in (cell, parts(cell)[0], f"#{n}")}
    naming = {name: n for name, n in naming.items() if name not in SHARED or not n.column or plain(n.column) in there}
    declared = {plain(named.column): name for name, named in naming.items() if named.column}
    free = [column for column in wanted if column.name not in declared.values()]
    columns = {column.name: column for column in wanted}
    places: dict[str, Place] = {}
    doubled: list[tuple[str, int]] = []
    names = {plain(column.name): column.name for column in free} | declared
    others = _place(header, range(len(header)), names, columns, naming, places, doubled)
    absent = [column for column in free if column.name not in places]
    names = {plain(other): column.name for column in absent for other in column.also}
    others = _place(header, others, names, columns, naming, places, None)
    return Match(places, doubled, [plain(parts(header[index])[0]) for index in others])


def _place(
    header: Sequence[str], indices: Iterable[int], names: Mapping[str, str], columns: Mapping[str, Column],
    naming: Naming, places: dict[str, Place], doubled: list[tuple[str, int]] | None,
) -> list[int]:  # fmt: skip
    """Put the cells that have a name into their places; the indices of those that have none.

    doubled takes what stands there twice; without it a second one is left over: its name was only a guess.
    """
    left = []
    for index in indices:
        name, unit = _meaning(header[index], index, names, columns)
        if name not in columns or (name in places and doubled is None):
            left.append(index)
        elif name in places and doubled is not None:
            doubled.append((name, index))
        else:
            named = naming.get(name, Named())
            places[name] = Place(index, columns[name], named.unit or unit, named.sign, guessed=doubled is None)
    return left


def _meaning(cell: str, index: int, names: Mapping[str, str], columns: Mapping[str, Column]) -> tuple[str, str | None]:
    """The column that a header cell names, and the unit in it; empty where it names none."""
    text, unit = parts(cell)
    for key in (f"#{index + 1}", plain(cell), plain(text)):
        if key in names:
            name = names[key]
            known = key == plain(text) or (unit and name in columns and columns[name].quantity.knows(unit))
            return name, unit if known else None
    words = text.split("_")
    for count in (1, 2):
        stem, tail = plain(" ".join(words[:-count])), "/".join(words[-count:])
        name = names.get(stem, "")
        if name in columns and columns[name].quantity.knows(tail):
            return name, tail
    return "", None


def parts(cell: str) -> tuple[str, str | None]:
    """Name and unit of a header cell; no unit where none stands there."""
    text = cell.strip()
    for form in _FORMS:
        if result := form.match(text):
            return result[1], result[2]
    return text, None


def is_header(cells: Sequence[str], wanted: Sequence[Column], naming: Naming) -> bool:
    """Whether a line names every column that is needed."""
    result = match(cells, wanted, naming).places
    of_numbers = any(_FIGURE.fullmatch(cells[place.index].strip()) for place in result.values())
    return all(column.name in result for column in wanted if column.required) and not of_numbers


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
        if _FIGURE.fullmatch(cell):
            return None
        filled[name] = replace(place, unit=place.unit or cell or None)
    return filled


def clock(cell: str) -> float | None:
    """The seconds of a time stamp, with those of its date where it has one; None where it is no time stamp.

    A zone counts, so that a change of clocks is none; of a date with strokes the month comes first where AM or PM is
    said, else the day. Seconds may be left out beside a date, AM or PM.
    """
    result = _CLOCK.fullmatch(cell.strip())
    if not result or not (result["second"] or result["date"] or result["half"]):
        return None
    days = _days(result["date"], month_first=bool(result["half"])) if result["date"] else 0
    if days is None:
        return None
    hour = float(result["hour"])
    if result["half"]:
        hour = hour % 12.0 + (12.0 if result["half"][0] in "Pp" else 0.0)
    zone = result["zone"] or "Z"
    east = 0.0 if zone == "Z" else float(f"{zone[0]}1") * (3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:]))
    seconds = float((result["second"] or "0").replace(",", "."))
    return 86400.0 * days + 3600.0 * hour + 60.0 * int(result["minute"]) + seconds - east


def _days(text: str, *, month_first: bool) -> int | None:
    """The number of a day, None where there is no such day."""
    from datetime import date

    parts = [int(part) for part in re.split(r"[./-]", text)]
    if parts[0] <= 31:
        day, month = (parts[1], parts[0]) if "/" in text and month_first else (parts[0], parts[1])
        parts = [parts[2] if parts[2] > 99 else 2000 + parts[2], month, day]
    try:
        return date(*parts).toordinal()
    except ValueError:
        return None


def stamped(row: Sequence[str], places: Mapping[str, Place]) -> dict[str, Place]:
    """The places, with the times that are time stamps in the first row marked as such."""
    return {
        name: replace(p, stamped=True)
        if p.column.quantity is TIME and p.index < len(row) and clock(row[p.index]) is not None
        else p
        for name, p in places.items()
    }
