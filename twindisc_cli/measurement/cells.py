"""Numbers as rigs write them: decimal point or comma, thousands in groups, other minus signs."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

_OTHER = str.maketrans({"−": "-", "\u2013": "-", "\u00a0": None, "\u202f": None, "'": None, "’": None})
_GROUPED = {mark: re.compile(rf"[-+]?[1-9]\d{{0,2}}(?:\{mark}\d{{3}})+") for mark in ".,"}
_GROUPED_TWICE = {mark: re.compile(rf"[-+]?[1-9]\d{{0,2}}(?:\{mark}\d{{3}}){{2,}}") for mark in ".,"}
_DECIMAL = {mark: re.compile(rf"[-+]?\d*\{mark}\d*(?:[eE][-+]?\d+)?") for mark in ".,"}
_BOTH = {".": re.compile(r"[-+]?\d{1,3}(?:,\d{3})+\.\d*"), ",": re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+,\d*")}


@dataclass(frozen=True)
class Marks:
    """The sign before the decimals, None where either may stand there, and that between thousands, None without.

    either: a number, read with decimals, in which a comma may as well part thousands, as it may in all; "" where none.
    """

    decimal: str | None = None
    thousands: str | None = None
    either: str = ""


ANY = Marks()


def marks_of(cells: Iterable[str]) -> Marks:
    """How numbers are written, from some of them.

    A sign is one between thousands where the other is there for decimals, or where it stands in a number twice.
    """
    decimal, grouped = set[str](), dict[str, str]()
    for cell in dict.fromkeys(cell.strip().translate(_OTHER) for cell in cells):
        for mark, other in ((".", ","), (",", ".")):
            if _BOTH[mark].fullmatch(cell):
                return Marks(mark, other)
            if _GROUPED_TWICE[mark].fullmatch(cell):
                return Marks(other, mark)
            if _GROUPED[mark].fullmatch(cell):
                grouped.setdefault(mark, cell)
            elif mark in cell and _DECIMAL[mark].fullmatch(cell):
                decimal.add(mark)
    for mark, other in ((".", ","), (",", ".")):
        if decimal == {mark}:
            return Marks(mark, other if other in grouped else None)
    return Marks(either=grouped.get(",", "")) if not decimal else ANY


def number(cell: str, marks: Marks) -> float:
    """The number in a cell, NaN where there is none."""
    text = cell.translate(_OTHER)
    if "_" in text:  # Python reads 0_35 as 35
        return np.nan
    if marks.thousands:
        text = text.replace(marks.thousands, "")
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return np.nan
