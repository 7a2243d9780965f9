"""import: files as rigs write them -> tidy tables and a definition that runs, with what was guessed of them.

The definition names the rig's own files, so that every guess is a key in it; the tables beside it are what is read.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from twindisc_cli.definition import Test, load_text
from twindisc_cli.definition.schema import ColumnsTable
from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.measurement.alone import alone
from twindisc_cli.measurement.content import Content, read_bytes
from twindisc_cli.measurement.guess import Guess, first_temperature, guess, typical
from twindisc_cli.measurement.header import Named, plain
from twindisc_cli.model.experiment import Floats, Ints, Measured
from twindisc_cli.quantities import CELSIUS
from twindisc_cli.results.files import write_all

BALL_MM = 9.525
_STEEL = {"youngs_modulus_GPa": 206.0, "poisson_ratio": 0.3, "hardness_HV": 700.0}


@dataclass(frozen=True)
class Imported:
    """What was written, what became of the rows, and what was guessed: each with the key that overrules it."""

    summary: tuple[str, ...]
    json: Mapping[str, object]


@dataclass
class _Draft:
    """A definition in the making: its lines, and the guesses in them by key."""

    lines: list[str] = field(default_factory=list)
    guesses: dict[str, str] = field(default_factory=dict)

    def key(self, table: str, name: str, value: str, why: str = "") -> None:
        """A line of a table; with a reason it is a guess."""
        message = f"{name} = {value}"
        self.lines.append(f"{message:<44} # guess: {why}" if why else message)
        if why:
            self.guesses[f"{table}.{name}"] = f"{message}: {why}"


def run(files: Sequence[Path], folder: Path, *, force: bool) -> Imported:
    """Read the files of one test, write tables and definition to a folder; nothing is written where one is not read.

    A .toml among the files says of the others how they are read, as [measured] of a definition does.
    """
    given = _given(files)
    named = [file for file in files if file in given]
    path = folder / f"{_name(named[0])}.toml"
    if path.exists() and not force:
        raise DefinitionError(Problem("exists already; choose another folder, or overwrite it with --force", str(path)))
    declared = _declared(files)
    looks = {file: guess(given[file], str(file), declared) for file in named}
    given = {file: replace(content, sheet=looks[file].sheet) for file, content in given.items()}
    if not any(result.kind in ("log", "traction") for result in looks.values()):
        return _alone(looks, given, folder, force=force)
    draft = _draft(looks, given)
    text = "\n".join(draft.lines) + "\n"
    test = load_text(text, Path(path.name))
    for file in named:
        text = text.replace(_quoted(file), _quoted(Path(os.path.relpath(file, folder))))
    tables = {folder / name: content.encode() for name, content in _tables(test.experiment.measured)}
    _write({path: text.encode(), **tables}, named)
    return _told(test, draft, path, list(tables))


def _write(contents: Mapping[Path, bytes], files: Sequence[Path]) -> None:
    """Write tables; none of them may be a file that is imported."""
    clash = [str(file) for file in files if file.resolve() in {table.resolve() for table in contents}]
    if clash:
        raise DefinitionError(Problem("would be overwritten by a table; choose another folder", clash[0]))
    write_all(contents)


def _given(files: Sequence[Path]) -> dict[Path, Content]:
    """The measured files, read as the .toml beside them says."""
    tables = [_block(file) for file in files if file.suffix == ".toml"]
    said = {Path(t["file"]).name: t for table in tables for t in table.values() if isinstance(t, dict) and "file" in t}
    given = {}
    for file in files:
        if file.suffix != ".toml":
            table = said.get(file.name, {})
            cells = {key: _cells(table[key]) for key in ("skip", "ignore") if key in table}
            cells |= {key: _cells(t[key]) for t in tables for key in ("skip", "ignore") if key in t}
            sheet = table.get("sheet", next((t["sheet"] for t in tables if "sheet" in t), None))
            given[file] = Content(read_bytes(file), sheet, cells.get("skip"), cells.get("ignore", ()))
    if not given:
        raise DefinitionError("name a measured file, too; a .toml only says how it is read")
    return given


def _cells(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def _block(file: Path) -> Mapping[str, Any]:
    """The table [measured] of a .toml."""
    try:
        table = tomllib.loads(read_bytes(file).decode("utf-8-sig")).get("measured", {})
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DefinitionError(Problem(f"not TOML: {error}", str(file))) from None
    if not isinstance(table, dict):
        raise DefinitionError(Problem("must hold a table [measured]", str(file)))
    return table


def _declared(files: Sequence[Path]) -> dict[str, Named]:
    """What the .toml among the files say of columns, checked as in a definition."""
    declared: dict[str, Named] = {}
    for file in files:
        if file.suffix == ".toml":
            try:
                columns = ColumnsTable.model_validate(_block(file).get("columns", {}))
            except ValueError as error:
                raise DefinitionError(Problem(f"measured.columns: {error}", str(file))) from None
            tables = columns.model_dump(exclude_none=True)
            declared |= {key.replace("_", " "): Named(**table) for key, table in tables.items()}
    return declared


def _alone(looks: Mapping[Path, Guess], given: Mapping[Path, Content], folder: Path, *, force: bool) -> Imported:
    """Files without a traction among them: each as the table that it is, and the lines that name it in a definition."""
    contents: dict[Path, bytes] = {}
    lines, rows = [], []
    for file, result in looks.items():
        table = alone(given[file], str(file), result)
        target = folder / f"{result.kind}.csv"
        if target in contents:
            raise DefinitionError(Problem(f"is a second {result.kind}; import one at a time", str(file)))
        if target.exists() and not force:
            raise DefinitionError(Problem("exists already; overwrite it with --force", str(target)))
        contents[target] = _csv(table.columns).encode()
        rows.append(table.rows)
        lines += [
            *table.rows.lines,
            f"written: {target}; in a definition, under [measured]:",
            f'{result.kind} = "{target.name}"',
        ]
    _write(contents, list(looks))
    return Imported(
        summary=tuple(lines),
        json={
            "definition": None,
            "tables": [str(file) for file in contents],
            "rows": [count.json() for count in rows],
            "guesses": [],
        },
    )


def _name(file: Path) -> str:
    return re.sub(r"[^A-Za-z0-9._-]+", "_", file.stem).lstrip("._-") or "test"


def _told(test: Test, draft: _Draft, path: Path, tables: Sequence[Path]) -> Imported:
    lines = [line for count in test.rows for line in count.lines]
    lines += [f"guess: {what} (key {key})" for key, what in draft.guesses.items()]
    return Imported(
        summary=(*lines, *(f"written: {file}" for file in (path, *tables))),
        json={
            "definition": str(path),
            "tables": [str(table) for table in tables],
            "rows": [count.json() for count in test.rows],
            "guesses": [{"key": key, "guess": what} for key, what in draft.guesses.items()],
        },
    )


def _draft(looks: Mapping[Path, Guess], given: Mapping[Path, Content]) -> _Draft:
    """The definition of the files."""
    kinds: dict[str, Path] = {}
    for file, result in looks.items():
        kind = "traction" if result.kind == "log" else result.kind
        if kind in kinds:
            what = f"is a {result.kind} as {kinds[kind]} is; import one test at a time"
            raise DefinitionError(Problem(what, str(file)))
        kinds[kind] = file
    if "temperature" not in kinds and "temperature" in looks[kinds["traction"]].columns:
        kinds["temperature"] = kinds["traction"]
    draft = _Draft()
    draft.lines += ["schema = 1", 'history = "measured"']
    draft.lines += ["", "[test]", f'name = "{_name(next(iter(looks)))}"']
    _rig(draft, kinds["traction"], looks[kinds["traction"]], given)
    _material(draft, "mass" in kinds)
    if "temperature" in kinds:
        _thermal(draft, kinds["temperature"], looks[kinds["temperature"]], given)
    _measured(draft, looks, given, kinds.get("temperature"))
    return draft


def _rig(draft: _Draft, file: Path, result: Guess, given: Mapping[Path, Content]) -> None:
    """Load and speed as recorded, discs as many rigs have them."""
    load, speed, radius = typical(given[file], str(file), result)
    untold = "no file says it"
    draft.lines += ["", "[rig]"]
    draft.key("rig", "normal_load_N", _rounded(load, 1000.0), "" if np.isfinite(load) else untold)
    if result.has_turning:
        draft.key("rig", "mean_speed_rpm", _rounded(speed / radius * 30.0 / np.pi, 1.0))
    else:
        draft.key("rig", "rolling_speed_m_s", _rounded(speed, 1.0), "" if np.isfinite(speed) else untold)
    ball = result.kind == "log" and not {"speed 1", "torque"} & set(result.columns)
    mm = f"{radius * 1e3:.4g}"
    shapes = (("inf", "inf"), (str(BALL_MM), str(BALL_MM))) if ball else ((mm, "inf"), (mm, mm))
    why = "a ball of 3/4 inch on a flat disc" if ball else f"{untold}; the size of SUROS, one of them crowned"
    for name, (along, across) in zip(("disc1", "disc2"), shapes, strict=True):
        draft.key("rig", name, f"{{ rolling_radius_mm = {along}, transverse_radius_mm = {across} }}", why)


def _rounded(value: float, unknown: float) -> str:
    return repr(float(f"{value:.4g}") if np.isfinite(value) else unknown)


def _material(draft: _Draft, weighed: bool) -> None:
    draft.lines += ["", "[material]"]
    for name, value in _STEEL.items():
        draft.key("material", name, repr(value), "hardened steel")
    if weighed:
        draft.key("material", "density_kg_m3", "7800.0", "steel")


def _thermal(draft: _Draft, file: Path, result: Guess, given: Mapping[Path, Content]) -> None:
    """The room as warm as the disc before it has run."""
    first = first_temperature(given[file], str(file), result.columns) - CELSIUS
    draft.lines += ["", "[thermal]"]
    why = "the first temperature recorded" if np.isfinite(first) else "no file says it"
    draft.key("thermal", "environment_temperature_C", _rounded(first, 20.0), why)
    draft.key("thermal", "heat_capacity_J_K", "100.0", "no file says it; of the disc")


def _measured(draft: _Draft, looks: Mapping[Path, Guess], given: Mapping[Path, Content], warm: Path | None) -> None:
    """The files where they are, with the columns that are not called as they are here; warm: that of temperatures."""
    draft.lines += ["", "[measured]"]
    for file, result in looks.items():
        draft.key("measured", result.kind, _file_table(file, given[file]))
        if file == warm and result.kind == "log":
            draft.key("measured", "temperature", _file_table(file, given[file]))
        if result.unused:
            draft.guesses[f"measured.{result.kind}.ignore"] = f"not read: {', '.join(result.unused)}"
    named: dict[str, str] = {}
    for file, result in looks.items():
        for name, column in result.columns.items():
            if name == "temperature" and file != warm:
                continue
            cell = str(column.column)
            if name == plain(cell) and not column.unit and column.sign == 1:
                continue
            if named.setdefault(name, cell) != cell:
                what = f"{name} is called {cell} here and {named[name]} in another file; import them one by one"
                raise DefinitionError(Problem(what, str(file)))
            key = f"columns.{name.replace(' ', '_')}"
            if f"measured.{key}" not in draft.guesses:
                why = "by its unit" if name in result.by_unit else "by its name"
                unit = f", unit = {_text(column.unit)}" if column.unit else ""
                unit += ", sign = -1" if column.sign < 0 else ""
                draft.key("measured", key, f"{{ column = {json.dumps(cell, ensure_ascii=False)}{unit} }}", why)


def _file_table(file: Path, content: Content) -> str:
    """A file as a definition names it, with what was said of how it is read."""
    said = {"sheet": content.sheet, "skip": content.skip, "ignore": content.ignore or None}
    message = [f"{key} = {_text(value)}" for key, value in said.items() if value is not None]
    return f"{{ file = {_quoted(file)}, {', '.join(message)} }}" if message else _quoted(file)


def _text(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _quoted(file: Path) -> str:
    return json.dumps(file.as_posix(), ensure_ascii=False)


def _tables(measured: Measured) -> Iterator[tuple[str, str]]:
    """The tables that are read, by file name."""
    if (t := measured.traction) is not None:
        yield "traction.csv", _csv({
            "time [s]": t.time, "step": t.step + 1, "creepage [%]": 100.0 * t.creepage, "traction ratio [1]": t.ratio,
            "uncertainty [1]": t.uncertainty,
        })  # fmt: skip
    if (p := measured.profile) is not None:
        yield "profile.csv", _csv({"y [mm]": 1e3 * p.y, "height [um]": 1e6 * p.height, "disc": p.disc})
    if (warm := measured.temperature) is not None:
        yield "temperature.csv", _csv({"time [s]": warm.time, "temperature [degC]": warm.temperature - CELSIUS})
    if (m := measured.mass) is not None:
        yield "mass.csv", _csv({"iteration": m.iteration, "mass loss [mg]": 1e6 * m.loss, "disc": m.disc})


def _csv(columns: Mapping[str, Floats | Ints]) -> str:
    """The columns that hold numbers."""
    kept = {name: values for name, values in columns.items() if np.isfinite(values).all()}
    rows = zip(*kept.values(), strict=True)
    return "\n".join([",".join(kept), *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n"
