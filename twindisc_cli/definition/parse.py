"""TOML text -> checked definition, or every mistake in it with its line and the nearest valid name."""

from __future__ import annotations

import copy
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from twindisc_cli import effects
from twindisc_cli.definition.lines import Key, locate
from twindisc_cli.definition.rules import broken
from twindisc_cli.definition.schema import (
    COLUMN_NAME,
    LAW_NAME,
    MEASURED_FILES,
    TEST_NAME,
    BlockTable,
    DefinitionBase,
    FileTable,
    definition_model,
)
from twindisc_cli.errors import DefinitionError, Problem, nearest
from twindisc_cli.loop import channels
from twindisc_cli.plugins import UntrustedError, is_trusted
from twindisc_cli.quantities import split_key
from twindisc_cli.reading import read_toml

_SYNTAX = re.compile(r"(.*) \(at (?:line (\d+), column \d+|end of document)\)")
_PAIR = re.compile(r"""^\s*[\w.-]+\s*=\s*(?![\[{]|\"{3}|'{3})""")
_KEY = re.compile(r"""^\s*([\w."'-]+)\s*=""")
_TABLE_TWICE = re.compile(r"Cannot (?:declare|mutate immutable namespace) (\(.*\))(?: twice)?")
_INLINE_TWICE = re.compile(r"Duplicate inline table key '(.*)'")
_DECIMAL_COMMA = re.compile(r"^(\s*([\w.-]+)\s*=\s*[-+]?\d+),(\d+)(\s*(?:#.*)?)$")
_LARGEST = 10**300  # larger whole numbers are no floats
_ENDLESS = re.compile(r"[0-9_]{1000}")
_MOST_SYNTAX_ERRORS = 20  # then the file is not a definition
NAMED: Key = ("laws",)
"""The table whose tables have names of the user's choice."""
_NAMES = {
    TEST_NAME: "must be letters, digits, '.', '_' or '-', and begin with a letter or digit",
    LAW_NAME: "must be letters, digits or '_', and begin with a letter",
    COLUMN_NAME: "must be the name of a column, with its unit in [ ] where it has one",
}
"""What is wrong with a name, by its pattern."""


@dataclass(frozen=True)
class _Source:
    """A document that parses: its tables, and where they stand. `mended` keys had a syntax error of their own."""

    file: str
    raw: Mapping[str, Any]
    lines: Mapping[Key, int]
    mended: frozenset[str]

    def problem(self, key: Key, what: str) -> Problem:
        """A problem at a key, or where the nearest table that holds it begins."""
        line = next((self.lines[key[:n]] for n in range(len(key), 0, -1) if key[:n] in self.lines), 1)
        return Problem(what, self.file, line, _dotted(key))


def parse(text: str, file: str) -> DefinitionBase:
    """Check a whole document; DefinitionError lists every mistake, in the order of the lines."""
    try:
        return _parse(text, file)
    except RecursionError:
        raise DefinitionError(Problem("is nested too deeply for a test definition", file)) from None


def parse_block(text: str, file: str) -> Mapping[str, Any]:
    """The tables of a block, which says how measured files are read; DefinitionError lists what is wrong in it."""
    try:
        source, problems = _read(text, file)
    except RecursionError:
        raise DefinitionError(Problem("is nested too deeply for a block", file)) from None
    try:
        BlockTable.model_validate(source.raw)
    except ValidationError as error:
        problems.extend(_schema_problems(source, error, _meant(error, BlockTable), BlockTable))
    if problems:
        raise DefinitionError(_in_order(problems))
    return source.raw


def _parse(text: str, file: str) -> DefinitionBase:
    source, problems = _read(text, file)
    problems.extend(_add_folders(source))
    meant: Mapping[Key, str] = {}
    model = definition_model()
    try:
        definition = model.model_validate(source.raw)
    except ValidationError as error:
        meant = _meant(error, model)
        problems.extend(_schema_problems(source, error, meant, model))
    for key, what in broken(_corrected(source.raw, meant)):
        if key[-1] not in source.mended:
            problems.append(source.problem(key, what))
    if problems:
        raise DefinitionError(_in_order(problems))
    return definition


def _add_folders(source: _Source) -> Iterator[Problem]:
    """The effects and channels of the folders that [loop] names are known from here on, or these are none.

    DefinitionError where one would be run that nobody but the definition names.
    """
    loop = source.raw.get("loop")
    for kind, add in (("effects", effects.add_folder), ("channels", channels.add_folder)):
        folder = loop.get(kind) if isinstance(loop, Mapping) else None
        if isinstance(folder, str) and folder:
            place = Path(source.file).parent / folder
            try:
                if place.is_dir() and not is_trusted(place):
                    what = f"the Python files in {folder} would be run: --trust-effects says that you know what they do"
                    raise UntrustedError(source.problem(("loop", kind), what))
                add(place)
            except UntrustedError:
                raise
            except (DefinitionError, OSError, ValueError):
                yield source.problem(("loop", kind), f"{folder} is not a folder of {kind.removesuffix('s')} files")


def _in_order(problems: list[Problem]) -> list[Problem]:
    return sorted(problems, key=lambda problem: problem.line)


def _read(text: str, file: str) -> tuple[_Source, list[Problem]]:
    """Parse; where a plain `key = value` line has a syntax error, note it, leave the line out and go on."""
    lines = text.replace("\r\n", "\n").split("\n")
    problems: list[Problem] = []
    mended: set[str] = set()
    while True:
        try:
            raw = _bounded(read_toml("\n".join(lines)))
        except tomllib.TOMLDecodeError as error:
            problem, repaired = _syntax_problem(error, lines, file)
            problems.append(problem)
            number = problem.line - 1
            if repaired is None or len(problems) >= _MOST_SYNTAX_ERRORS:
                raise DefinitionError(_in_order(problems)) from None
            mended.add(lines[number].partition("=")[0].strip())
            lines[number] = repaired
        except ValueError:  # Python refuses to read integers of thousands of digits
            number = next((n for n, line in enumerate(lines, start=1) if _ENDLESS.search(line)), 0)
            raise DefinitionError(Problem("a number has thousands of digits", file, number)) from None
        else:
            return _Source(file, raw, locate("\n".join(lines)), frozenset(mended)), problems


def _bounded(value: Any) -> Any:
    """The same values; integers that no floating-point number can hold are infinite."""
    if isinstance(value, dict):
        return {key: _bounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_bounded(item) for item in value]
    too_large = isinstance(value, int) and abs(value) > _LARGEST
    return (math.inf if value > 0 else -math.inf) if too_large else value


def _syntax_problem(error: tomllib.TOMLDecodeError, lines: Sequence[str], file: str) -> tuple[Problem, str | None]:
    """The problem, and a line to put in its place, or None where what follows cannot be trusted."""
    match = _SYNTAX.fullmatch(str(error))
    what, at = (match[1], match[2]) if match else (str(error), None)
    number = int(at) if at else len(lines)
    line = lines[number - 1]
    if comma := _DECIMAL_COMMA.match(line):
        written = comma[1].rpartition("=")[2].strip()
        what = f"TOML takes a decimal point: write {written}.{comma[3]}"
        return Problem(what, file, number, comma[2]), f"{comma[1]}.{comma[3]}{comma[4]}"
    if twice := _twice(what, lines, number):
        key, what = twice
        return Problem(what, file, number, key), "" if _PAIR.match(line) else None
    problem = Problem(f"not TOML: {what[:1].lower()}{what[1:]}", file, number)
    return problem, "" if _PAIR.match(line) and at else None


def _twice(what: str, lines: Sequence[str], number: int) -> tuple[str, str] | None:
    """The key or table that stands twice by a message of tomllib on a line, from 1, and what to say of it."""
    if table := _TABLE_TWICE.fullmatch(what):
        name = ".".join(re.findall(r"'([^']*)'", table[1]))
        return f"[{name}]", "this table is there already, above: write all of its keys in one place"
    if inner := _INLINE_TWICE.fullmatch(what):
        return inner[1], "stands twice in this table in { }: leave one of the two out"
    pair = _KEY.match(lines[number - 1])
    if what != "Cannot overwrite a value" or not pair:
        return None
    for above in range(number - 1, 0, -1):
        line = lines[above - 1]
        if line.lstrip().startswith("["):
            break
        if (same := _KEY.match(line)) and same[1] == pair[1]:
            return pair[1], f"stands twice in this table, first in line {above}: leave one of the two out"
    return pair[1], "has a value already: leave one of the two out"


def _corrected(raw: Mapping[str, Any], meant: Mapping[Key, str]) -> Mapping[str, Any]:
    """The tables with misspelt keys under the names they most probably meant, for the rules between keys."""
    corrected = copy.deepcopy(dict(raw))
    for key, guess in meant.items():
        table: Any = corrected
        for part in key[:-1]:
            table = table[part]
        table[guess] = table.pop(key[-1])
    return corrected


def _meant(error: ValidationError, model: type[BaseModel]) -> Mapping[Key, str]:
    """What unknown keys most probably mean, where it can be guessed."""
    unknown = [tuple(each["loc"]) for each in error.errors(include_url=False) if each["type"] == "extra_forbidden"]
    return {key: guess for key in unknown if (guess := _guess(key, model))}


def _schema_problems(
    source: _Source, mistakes: ValidationError, meant: Mapping[Key, str], model: type[BaseModel]
) -> Iterator[Problem]:
    """One problem per mistake: a misspelt key is not also reported as missing."""
    spelt = {(*key[:-1], guess) for key, guess in meant.items()}
    for error in mistakes.errors(include_url=False):
        key: Key = tuple(part for part in error["loc"] if part != "[key]")
        if error["type"] == "extra_forbidden":
            yield source.problem(key, _unknown(key, meant.get(key), model))
        elif error["type"] != "missing":
            yield source.problem(key, _wrong(error))
        elif key not in spelt and key[-1] not in source.mended:
            yield source.problem(key, "is missing")


def _wrong(error: ErrorDetails) -> str:
    """What is wrong with a value, in one line."""
    given = error.get("input")
    context = error.get("ctx", {})
    kind = error["type"]
    kinds = {
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "string_type": "must be a text in quotes",
        "list_type": "must be a list in [ ]",
        "model_type": "must be a table",
        "dict_type": "must be a table",
        "finite_number": "must be a finite number",
        "too_short": "must not be empty",
        "string_too_short": "must name a file; leave the key out where nothing was measured",
        "string_pattern_mismatch": _NAMES.get(context.get("pattern", ""), ""),
    }
    if kind == "value_error":
        what = str(context["error"])
    elif kind == "literal_error":
        guess = nearest(str(given), re.findall(r"'([^']*)'", context["expected"]))
        what = f"must be {context['expected']}" + (f", did you mean '{guess}'?" if guess else "")
    elif kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        (word, bound), *_ = context.items()
        words = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
        what = f"must be {words[word]} {bound:g}"
    else:
        what = kinds.get(kind, error["msg"])
    return f"{what}, not {_shown(given)}"


def _shown(value: object) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(value)
    text = {"True": "true", "False": "false"}.get(text, text)
    return text if len(text) <= 40 else text[:37] + "..."


def _guess(key: Key, model: type[BaseModel]) -> str | None:
    """The sibling that an unknown key most probably meant; None where it has its place in another table."""
    name, siblings = str(key[-1]), _keys(model, key[:-1])
    if _inside(key, model) or _table_of(key, model) is not None:
        return None
    return nearest(name, siblings) or next((s for s in siblings if _same_quantity(name, s)), None)


def _table_of(key: Key, model: type[BaseModel]) -> Key | None:
    """The other table in which an unknown key is known."""
    return next((table for table, names in _every_table(model) if key[-1] in names and table != key[:-1]), None)


def _inside(key: Key, model: type[BaseModel]) -> list[str]:
    """The tables inside the one of an unknown key in which it is known."""
    return [name for name in _keys(model, key[:-1]) if key[-1] in _keys(model, (*key[:-1], name))]


def _unknown(key: Key, guess: str | None, model: type[BaseModel]) -> str:
    """What to tell about an unknown key."""
    table, inner = _table_of(key, model), _inside(key, model)
    if inner:
        return f"unknown key here; it belongs in {' or '.join(inner)}: {inner[0]} = {{ {key[-1]} = ..., ... }}"
    if table is not None:
        return f"unknown key here; it belongs {f'in [{_dotted(table)}]' if table else 'at the top of the file'}"
    if guess is None:
        return f"unknown key; known here: {', '.join(_keys(model, key[:-1]))}"
    unit = ", with the value in that unit" if _same_quantity(str(key[-1]), guess) else ""
    return f"unknown key, did you mean {guess}{unit}?"


def _same_quantity(name: str, guess: str) -> bool:
    """Whether two keys differ in their unit only, as normal_load_kN and normal_load_N do."""
    stem = split_key(guess)[0]
    return stem != guess and name.startswith(stem)


def _keys(model: type[BaseModel], path: Key) -> list[str]:
    """The valid keys of the table at a path."""
    if path[:1] == ("measured",) and path[1:2] and path[1] in (*MEASURED_FILES, *channels.further_channels()):
        return list(FileTable.model_fields)
    for place, part in enumerate(path):
        if isinstance(part, int) or path[:place] == NAMED:
            continue
        field = next((f for n, f in model.model_fields.items() if part in (n, f.alias)), None)
        inner = _inner_model(field.annotation) if field else None
        if inner is None:
            return []
        model = inner
    return [f.alias or name for name, f in model.model_fields.items()]


def _inner_model(annotation: object) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for a in get_args(annotation) if (m := _inner_model(a))), None)


@cache
def _every_table(model: type[BaseModel]) -> tuple[tuple[Key, list[str]], ...]:
    """The tables of the schema that stand on their own, with their keys."""
    names = _keys(model, ())
    inner = {name: _keys(model, (name,)) for name in names if name not in ("effects", "channels", *NAMED)}
    return (((), names), *(((name,), keys) for name, keys in inner.items() if keys))


def _dotted(key: Key) -> str:
    """history.steps[2].mu for ("history", "steps", 1, "mu"): items counted from 1, as the user counts steps."""
    text = ""
    for part in key:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text
