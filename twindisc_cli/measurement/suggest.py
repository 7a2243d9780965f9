"""What a column that nobody named may be, by the words in its name and by its unit, and the line that would name it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from twindisc_cli.measurement.units import FORCE, LENGTH, MASS, SPEED, TEMPERATURE, TIME, TORQUE, Quantity, rim_speed

_TURNS = r"(speed|rpm|drehzahl|\bn|vitesse|omega|velocity|motor|disc|disk|roller|scheibe|rolle).{0,12}"
_MASSES = r"(mass|weight|masse|gewicht)"
_WORDS: Mapping[str, str] = {
    "torque": r"torque|moment|couple|drehm|reibm|\bm ?[dtrz]\b|\btrq\b|\bcoppia|\bpar\b",
    "traction ratio": r"\bmu\b|µ|\bcof\b|coeff|reib(wert|zahl)|t/n|adhesion|traction",
    "creepage": r"slip|srr|creep|schlupf|gliss|slide.?roll",
    "normal load": r"\bload\b|normal.?(force|kraft)|\bfn\b|\bfz\b|\blast\b|charge|anpress|carico|carga|force normale",
    "speed 1": rf"{_TURNS}(1|top|upper|oben|drive|wheel|\ba)\b",
    "speed 2": rf"{_TURNS}(2|bottom|lower|unten|brake|rail|\bb)\b",
    "traction force": r"(friction|tangential|traction|reib).{0,3}(force|kraft)|\bft\b|\bfx\b|\bff\b",
    "time": r"\btime\b|zeit|temps|\bt\b|tiempo|tempo|clock|stamp|datum|elapsed|\bsec",
    "temperature": r"temp|\btc ?\d|thermo",
    "y": r"lateral|\bx\b|position|\by\b|axial|distance",
    "height": r"height|\bz\b|depth|profil|raw|hoehe|höhe",
    "mass 1": rf"(?=.*{_MASSES}).*\b(1|top|upper|oben|wheel|rad)\b",
    "mass 2": rf"(?=.*{_MASSES}).*\b(2|bottom|lower|unten|rail|schiene)\b",
    "mass loss": rf"(?=.*{_MASSES}).*(loss|verlust|perte|wear|abtrag)|verlust|loss",
    "mass": _MASSES,
    "revolutions": r"revol|umdreh|drehungen|\bturns\b|\btours\b|\bcycles\b|zyklen",
    "iteration": r"iteration|stop|interval|block|stage",
}  # fmt: skip
_UNITS: Sequence[tuple[Quantity, tuple[str, ...]]] = (
    (TORQUE, ("torque",)),
    (FORCE, ("normal load", "traction force")),
    (TIME, ("time",)),
    (TEMPERATURE, ("temperature",)),
    (SPEED, ("speed 1", "speed 2")),
    (LENGTH, ("y", "height")),
    (MASS, ("mass loss", "mass", "mass 1", "mass 2")),
)
_DEFAULT = {
    "time": "s", "torque": "N m", "normal load": "N", "traction force": "N", "traction ratio": "1", "creepage": "%",
    "speed 1": "rpm", "speed 2": "rpm", "temperature": "degC", "y": "mm", "height": "um", "mass loss": "mg",
    "iteration": "1", "mass": "g", "mass 1": "g", "mass 2": "g", "revolutions": "1",
}  # fmt: skip
_WAYS: Sequence[tuple[str, ...]] = (
    ("time", "speed 1", "speed 2", "torque"),
    ("time", "speed 1", "speed 2", "traction ratio"),
    ("time", "speed 1", "speed 2", "traction force"),
    ("time", "creepage", "traction ratio"),
    ("time", "creepage", "torque"),
    ("time", "creepage", "traction force"),
    ("creepage", "traction ratio"),
    ("y", "height"),
    *((when, *masses) for when in ("iteration", "revolutions", "time")
      for masses in (("mass 1", "mass 2"), ("mass loss",), ("mass",))),
    ("time", "temperature"),
)  # fmt: skip
_ROLLERS = ("speed 1", "speed 2")  # given as speed or as rotation
_TURNING = frozenset(rim_speed(1.0).units) - frozenset(SPEED.units)


@dataclass(frozen=True)
class Cell:
    """A column of a file: the name by which a definition names it, its text and its unit, None where none is written.

    said: the unit that must be said, since it stands in no form that is understood; written: the cell as it
    stands; place: which column it is, from 1.
    """

    name: str
    text: str
    unit: str | None
    unit_to_give: str | None = None
    written: str = ""
    place: int = 0


def looks_like(text: str, unit: str | None) -> str | None:
    """What a column may be by the words in its name, which its unit must not gainsay, else by its unit alone."""
    by_unit = [key for quantity, keys in _UNITS if unit and quantity.knows(unit) for key in keys]
    if unit in _TURNING or (unit and rim_speed(1.0).knows(unit) and not by_unit):
        by_unit = ["speed 1", "speed 2"]
    words = text.replace("_", " ").casefold()
    named = next((key for key, form in _WORDS.items() if re.search(form, words)), None)
    if named and (not by_unit or named in by_unit or (unit in ("", "1", "-", "%", None))):
        return named
    return by_unit[0] if by_unit and unit != "g" else None  # g alone may be an acceleration


def what_else(cells: Iterable[Cell], used: Iterable[str]) -> Mapping[str, list[str]]:
    """The columns that are not used, by what they may be."""
    taken = set(used)
    results: dict[str, list[str]] = {}
    for cell in cells:
        key = looks_like(cell.text, cell.unit) if cell.name not in taken else None
        if key:
            results.setdefault(key, []).append(cell.name)
    return results


def block(cells: Sequence[Cell], known: Mapping[str, str]) -> list[str]:
    """The lines of [measured] that would name the columns of a file, of the set of which most are there.

    known: what is understood, as column by what it is. Empty where no set is whole.
    """
    rest = [cell for cell in cells if cell.name not in known.values()]
    free = {key: [cell for cell in rest if _may_be(cell, key)] for way in (*_WAYS, ("normal load",)) for key in way}
    for way in _WAYS:
        lines, taken, whole = [], set[str](), True
        for key in (*way, *(("normal load",) if way[0] == "time" else ())):
            if key in known:
                continue
            fits = [cell for cell in free[key] if cell.name not in taken]
            if not fits:
                whole &= key == "normal load"
                continue
            taken.add(fits[0].name)
            others = ", ".join(json.dumps(cell.name, ensure_ascii=False) for cell in fits[1:4])
            lines.append(line(key, fits[0], others))
        if whole and lines:
            return lines
    if len(cells) == 2 and all(cell.name.startswith("#") for cell in cells):
        return [line(key, cell) for key, cell in zip(("y", "height"), cells, strict=True)]
    return []


def _may_be(cell: Cell, key: str) -> bool:
    result = looks_like(cell.text, cell.unit)
    pairs = ({"speed 1", "speed 2"}, {"normal load", "traction force"}, {"y", "height"})
    return result == key or (cell.unit is not None and any({result, key} <= pair for pair in pairs))


def line(key: str, cell: Cell, others: str = "") -> str:
    """A line of [measured] that names a column; a unit that is not known is a proposal to be checked."""
    quantity = next((quantity for quantity, keys in _UNITS if key in keys and key not in _ROLLERS), None)
    known = cell.unit and (quantity is None or quantity.knows(cell.unit))
    unit = cell.unit_to_give or (None if known else _DEFAULT[key])
    named = json.dumps(cell.name, ensure_ascii=False)
    message = f", unit = {json.dumps(unit, ensure_ascii=False)}" if unit else ""
    remarks = [*(["check the unit"] if unit and not cell.unit_to_give else []), *([f"or {others}"] if others else [])]
    remark = f"  # {'; '.join(remarks)}" if remarks else ""
    return f"columns.{key.replace(' ', '_')} = {{ column = {named}{message} }}{remark}"
