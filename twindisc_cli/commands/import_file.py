"""import: files as rigs write them -> tidy tables and a definition that runs, with what was guessed of them.

The definition names the rig's own files, so that every guess is a key in it; the tables beside it are what is read.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from twindisc_cli.definition import Test, load_text, parse_block, path_from, test_name
from twindisc_cli.definition.schema import MEASURED_FILES
from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.measurement.alone import alone
from twindisc_cli.measurement.content import Content, read_bytes
from twindisc_cli.measurement.guess import Guess, first_temperature, guess, last_digit, spanned, typical
from twindisc_cli.measurement.header import Named, plain
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.quantities import CELSIUS
from twindisc_cli.results.files import write_all

BALL_MM = 9.525
"""Radius of the ball of most ball-on-disc rigs, 3/4 inch."""
WIDTH_MM = 10.0
"""Width of the track of SUROS."""
_FINEST_MG = 0.01
"""Finest digit of a balance that takes discs; more of them are those of a computation."""
_READING = ("columns", "sheet", "skip", "ignore")
"""Keys of [measured] in a .toml beside the files that say how these are read."""
_OWN = ("test", "rig", "material", "thermal", "measured")
"""Tables that are written key by key."""
_STEEL = {"youngs_modulus_GPa": 206.0, "poisson_ratio": 0.3, "hardness_HV": 700.0}


@dataclass(frozen=True)
class Imported:
    """What was written, what became of the rows, and what was guessed: each with the key that overrules it."""

    summary: tuple[str, ...]
    json: Mapping[str, object]


@dataclass
class _Draft:
    """A definition in the making: its lines, what was given of its tables, and the guesses in them by key."""

    given: Mapping[str, Mapping[str, Any]]
    lines: list[str] = field(default_factory=list)
    guesses: dict[str, str] = field(default_factory=dict)

    def key(self, table: str, name: str, value: str, why: str = "") -> None:
        """A line of a table; with a reason it is a guess. What was given takes its place."""
        if name in self.given.get(table, {}):
            value, why = _toml(self.given[table][name]), ""
        message = f"{name} = {value}"
        self.lines.append(f"{message:<44} # guess: {why}" if why else message)
        if why:
            self.guesses[f"{table}.{name}"] = f"{message}: {why}"

    def rest(self, table: str, *own: str) -> None:
        """What else was given of a table."""
        self.lines += [f"{k} = {_toml(v)}" for k, v in self.given.get(table, {}).items() if k not in own]


def run(files: Sequence[Path], folder: Path, *, force: bool) -> Imported:
    """Read the files of one test, write tables and definition to a folder; nothing is written where one is not read.

    A .toml among the files says of the others how they are read, as [measured] of a definition does, and of the rig
    what no file says.
    """
    stated = _stated(files)
    given = _given(files, stated.get("measured", {}))
    named = [file for file in files if file in given]
    path = folder / f"{test_name(named[0].stem)}.toml"
    _refuse_overwriting([path], files, force=force)
    declared = _declared(files)
    looks = {file: guess(given[file], str(file), declared) for file in named}
    given = {file: replace(content, sheet=looks[file].sheet) for file, content in given.items()}
    if not any(result.kind in ("log", "traction") for result in looks.values()):
        return _alone(looks, given, folder, force=force)
    draft = _draft(looks, given, stated)
    text = "\n".join(draft.lines) + "\n"
    given.clear()  # large files are not kept while they are read again
    test = _loaded(text, path.name, [file for file in files if _is_block(file)])
    text = _seen_from(folder, _with_iterations(draft, text, test), named)
    tables = {folder / name: content.encode() for name, content in _tables(test.experiment)}
    _refuse_overwriting(list(tables), named, force=force)
    write_all({path: text.encode(), **tables})
    return _imported(test, draft, path, list(tables))


def _loaded(text: str, name: str, blocks: Sequence[Path]) -> Test:
    """The test of a definition that is not written yet, whose lines nobody can look up."""
    try:
        return load_text(text, Path(name), as_recorded=True)
    except DefinitionError as error:
        file = str(blocks[0]) if len(blocks) == 1 else name
        raise type(error)([replace(problem, file=file, line=0) for problem in error.problems]) from None


def _seen_from(folder: Path, text: str, files: Sequence[Path]) -> str:
    """The definition with paths that lead from its folder to the files."""
    paths = {_quoted(file): json.dumps(path_from(folder, file), ensure_ascii=False) for file in files}
    quoted = re.compile("|".join(re.escape(path) for path in paths))
    is_named = re.compile(rf"(?:{'|'.join(MEASURED_FILES)}) = ")
    lines = (quoted.sub(lambda m: paths[m[0]], li) if is_named.match(li) else li for li in text.split("\n"))
    return "\n".join(lines)


def _with_iterations(draft: _Draft, text: str, test: Test) -> str:
    """The definition that says how long an iteration is, where weighings count in them."""
    length = test.experiment.history.per_iteration
    if length is None or np.isnan(length):
        return text
    head = _Draft({})
    head.lines += ["[history]"]
    head.key("history", "revolutions_per_iteration", f"{length:.6g}", "the last iteration weighed ends with the log")
    draft.guesses |= head.guesses
    lines = "\n".join([*head.lines, 'steps = "measured"', "", "[rig]"])
    return text.replace('history = "measured"\n', "", 1).replace("[rig]", lines, 1)


def _refuse_overwriting(targets: Sequence[Path], files: Sequence[Path], *, force: bool) -> None:
    """What is there is kept unless forced, and a file that is imported always."""
    clash = [str(file) for file in files if file.resolve() in {target.resolve() for target in targets}]
    if clash:
        raise DefinitionError(Problem("would be overwritten; choose another folder", clash[0]))
    if there := [str(target) for target in targets if target.exists() and not force]:
        raise DefinitionError(Problem("exists already; choose another folder, or overwrite it with --force", there[0]))


def _is_block(file: Path) -> bool:
    """Whether a file says how others are read."""
    return file.suffix.casefold() == ".toml"


def _stated(files: Sequence[Path]) -> Mapping[str, Mapping[str, Any]]:
    """The tables of all .toml among the files, one over the other."""
    stated: dict[str, dict[str, Any]] = {}
    for file in files:
        for name, table in (_block(file) if _is_block(file) else {}).items():
            if isinstance(table, dict):
                stated[name] = {**stated.get(name, {}), **table}
    return stated


def _given(files: Sequence[Path], measured: Mapping[str, Any]) -> dict[Path, Content]:
    """The measured files, read as [measured] of the .toml beside them says."""
    tables = {Path(t["file"]).name: t for t in measured.values() if isinstance(t, dict) and "file" in t}
    given = {}
    for file in files:
        if not _is_block(file):
            table = {**tables.get(file.name, {}), **{key: measured[key] for key in _READING if key in measured}}
            cells = {key: _cells(table[key]) for key in ("skip", "ignore") if key in table}
            given[file] = Content(read_bytes(file), table.get("sheet"), cells.get("skip"), cells.get("ignore", ()))
    if not given:
        raise DefinitionError("name a measured file, too; a .toml only says how it is read")
    return given


def _cells(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def _block(file: Path) -> Mapping[str, Any]:
    """The tables of a .toml."""
    try:
        tables = parse_block(read_bytes(file).decode("utf-8-sig"), str(file))
    except UnicodeDecodeError as error:
        raise DefinitionError(Problem(f"not TOML: {error}", str(file))) from None
    if not any(isinstance(table, dict) for table in tables.values()):
        raise DefinitionError(Problem("must hold a table such as [measured]", str(file)))
    return tables


def _declared(files: Sequence[Path]) -> dict[str, Named]:
    """What the .toml among the files say of columns."""
    declared: dict[str, Named] = {}
    for file in files:
        columns = _block(file).get("measured", {}).get("columns", {}) if _is_block(file) else {}
        declared |= {key.replace("_", " "): Named(**table) for key, table in columns.items()}
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
        contents[target] = _csv(table.columns).encode()
        rows.append(table.rows)
        lines += [
            *table.rows.lines,
            f"written: {target}; in a definition, under [measured]:",
            f'{result.kind} = "{target.name}"',
        ]
    _refuse_overwriting(list(contents), list(looks), force=force)
    write_all(contents)
    return Imported(
        summary=tuple(lines),
        json={
            "definition": None,
            "tables": [str(file) for file in contents],
            "rows": [count.json() for count in rows],
            "guesses": [],
        },
    )


def _imported(test: Test, draft: _Draft, path: Path, tables: Sequence[Path]) -> Imported:
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


def _draft(
    looks: Mapping[Path, Guess], given: Mapping[Path, Content], stated: Mapping[str, Mapping[str, Any]]
) -> _Draft:
    """The definition of the files."""
    kinds = _kinds(looks)
    (first, *_), draft = kinds["traction"], _Draft(stated)
    draft.lines += ["schema = 1"]
    draft.lines += [] if "history" in stated else ['history = "measured"']
    draft.lines += ["", "[test]"]
    draft.key("test", "name", f'"{test_name(next(iter(looks)).stem)}"')
    draft.rest("test", "name")
    _rig(draft, first, looks, given)
    _material(draft, "mass" in kinds)
    if "temperature" in kinds or "thermal" in stated:
        _thermal(draft, kinds.get("temperature", [first])[0], looks, given)
    _measured(draft, looks, given, kinds)
    more = {name: table for name, table in stated.items() if name not in _OWN}
    draft.lines += ["", tomli_w.dumps(more).rstrip()] if more else []
    return draft


def _kinds(looks: Mapping[Path, Guess]) -> dict[str, list[Path]]:
    """The files by what they are; several logs follow on each other, of anything else there is one."""
    kinds: dict[str, list[Path]] = {}
    for file, result in looks.items():
        own = kinds.setdefault("traction" if result.kind == "log" else result.kind, [])
        if own and not (result.kind == "log" and looks[own[0]].kind == "log"):
            what = f"is a {result.kind} as {own[0]} is; import one test at a time"
            raise DefinitionError(Problem(what, str(file)))
        own.append(file)
    logs = kinds["traction"]
    if "temperature" not in kinds and all("temperature" in looks[file].columns for file in logs):
        kinds["temperature"] = logs
    return kinds


def _rig(draft: _Draft, file: Path, looks: Mapping[Path, Guess], given: Mapping[Path, Content]) -> None:
    """Load and speed as recorded, discs as many rigs have them."""
    result = looks[file]
    load, speed, radius = typical(given[file], str(file), result)
    untold, own = "no file says it", draft.given.get("rig", {})
    draft.lines += ["", "[rig]"]
    draft.key("rig", "normal_load_N", _rounded(load, 1000.0), "" if np.isfinite(load) else untold)
    if "mean_speed_rpm" in own or (result.has_turning and "rolling_speed_m_s" not in own):
        draft.key("rig", "mean_speed_rpm", _rounded(speed / radius * 30.0 / np.pi, 1.0))
    else:
        draft.key("rig", "rolling_speed_m_s", _rounded(speed, 1.0), "" if np.isfinite(speed) else untold)
    ball = result.kind == "log" and not result.has_turning and not {"speed 1", "torque"} & set(result.columns)
    rests = "; T/N of the torque rests on it, in the table, too" if "torque" in result.columns else ""
    for name, shape, why in zip(("disc1", "disc2"), *_discs(1e3 * radius, looks, given, is_ball=ball), strict=True):
        draft.key("rig", name, f"{{ {shape} }}", f"{why}{rests}")
    draft.rest("rig", "normal_load_N", "rolling_speed_m_s", "mean_speed_rpm", "disc1", "disc2")


def _discs(
    radius: float, looks: Mapping[Path, Guess], given: Mapping[Path, Content], *, is_ball: bool
) -> tuple[tuple[str, str], tuple[str, str]]:
    """The keys of both discs, which no file holds, and why; radius [mm] of those that turn.

    A profile that is narrower than the cylinders would be is that of a crowned disc.
    """
    along, across = "rolling_radius_mm = {:.4g}".format, "transverse_radius_mm = {:.4g}".format
    if is_ball:
        shapes = (f"{along(np.inf)}, {across(np.inf)}", f"{along(BALL_MM)}, {across(BALL_MM)}")
        return shapes, ("a ball of 3/4 inch on a flat disc",) * 2
    profile = next((file for file, result in looks.items() if result.kind == "profile"), None)
    if profile is not None and (span := spanned(given[profile], str(profile), looks[profile]) * 1e3) < WIDTH_MM:
        why = f"no file says it; the profile spans {span:.3g} mm, so that one of them is crowned"
        return (f"{along(radius)}, {across(np.inf)}", f"{along(radius)}, {across(radius)}"), (why, why)
    cylinder = f"{along(radius)}, {across(np.inf)}, width_mm = {WIDTH_MM}"
    return (cylinder, cylinder), ("no file says it; cylinders of the size of SUROS",) * 2


def _rounded(value: float, unknown: float) -> str:
    return repr(float(f"{value:.4g}") if np.isfinite(value) else unknown)


def _material(draft: _Draft, weighed: bool) -> None:
    draft.lines += ["", "[material]"]
    for name, value in _STEEL.items():
        draft.key("material", name, repr(value), "hardened steel")
    own = draft.given.get("material", {})
    each = all("density_kg_m3" in own.get(disc, {}) for disc in ("disc1", "disc2"))
    if weighed and not each:
        draft.key("material", "density_kg_m3", "7800.0", "steel")
    draft.rest("material", *_STEEL, *(["density_kg_m3"] if weighed and not each else []))


def _thermal(draft: _Draft, file: Path, looks: Mapping[Path, Guess], given: Mapping[Path, Content]) -> None:
    """The room as warm as the disc before it has run."""
    columns = looks[file].columns
    first = first_temperature(given[file], str(file), columns) - CELSIUS if "temperature" in columns else np.nan
    draft.lines += ["", "[thermal]"]
    why = "the first temperature recorded" if np.isfinite(first) else "no file says it"
    draft.key("thermal", "environment_temperature_C", _rounded(first, 20.0), why)
    own = ["environment_temperature_C", "heat_capacity_J_K"]
    if "volume_mm3" not in draft.given.get("thermal", {}):
        draft.key("thermal", "heat_capacity_J_K", "100.0", "no file says it; of the disc")
    draft.rest("thermal", *own)


def _measured(
    draft: _Draft, looks: Mapping[Path, Guess], given: Mapping[Path, Content], kinds: Mapping[str, Sequence[Path]]
) -> None:
    """The files where they are, with the columns that are not called as they are here."""
    draft.lines += ["", "[measured]"]
    warm = kinds.get("temperature", ())
    for kind, files in kinds.items():
        tables = [_file_table(file, given[file]) for file in files]
        key = looks[files[0]].kind if kind == "traction" else kind
        draft.key("measured", key, tables[0] if len(tables) == 1 else f"[{', '.join(tables)}]")
    for result in looks.values():
        if result.unused:
            draft.guesses[f"measured.{result.kind}.ignore"] = f"not read: {', '.join(result.unused)}"
    if "mass" in kinds:
        _balance(draft, kinds["mass"][0], looks, given)
    named: dict[str, str] = {}
    for file, result in looks.items():
        for name, column in result.columns.items():
            if name != "temperature" or file in warm:
                _column(draft, file, name, name in result.by_unit, column, named)
    of_files = [key for key, value in draft.given.get("measured", {}).items() if isinstance(value, dict)]
    draft.rest("measured", *_READING, "balance_mg", *of_files)


def _column(draft: _Draft, file: Path, name: str, by_unit: bool, column: Named, named: dict[str, str]) -> None:
    """The line of a column that is not called as it is here; named: what was said of columns before."""
    cell = str(column.column)
    if name == plain(cell) and not column.unit and column.sign == 1:
        return
    if named.setdefault(name, cell) != cell:
        what = (
            f"{name} is called {cell} here and {named[name]} in another file; rename one of them, or import them apart"
        )
        raise DefinitionError(Problem(what, str(file)))
    key = f"columns.{name.replace(' ', '_')}"
    if f"measured.{key}" not in draft.guesses:
        unit = f", unit = {_text(column.unit)}" if column.unit else ""
        unit += ", sign = -1" if column.sign < 0 else ""
        draft.key("measured", key, f"{{ column = {_text(cell)}{unit} }}", "by its unit" if by_unit else "by its name")


def _balance(draft: _Draft, file: Path, looks: Mapping[Path, Guess], given: Mapping[Path, Content]) -> None:
    """The balance as exact as its last digit, where the table does not say and digits are those of a balance."""
    columns, stated = looks[file].columns, draft.given.get("measured", {})
    digit = last_digit(given[file], str(file), columns) * 1e6
    if "balance_mg" in stated:
        draft.key("measured", "balance_mg", "")
    elif "uncertainty" not in columns and digit >= _FINEST_MG:
        draft.key(
            "measured", "balance_mg", f"{digit:.3g}", "the last digit of the weighings; of one, standard deviation"
        )


def _toml(value: Any) -> str:
    """A value as TOML writes it in a line."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_toml(each)}' for key, each in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(_toml(each) for each in value)}]"
    return str(value).lower() if isinstance(value, bool) else _text(value) if isinstance(value, str) else str(value)


def _file_table(file: Path, content: Content) -> str:
    """A file as a definition names it, with what was said of how it is read."""
    stated = {"sheet": content.sheet, "skip": content.skip, "ignore": content.ignore or None}
    message = [f"{key} = {_text(value)}" for key, value in stated.items() if value is not None]
    return f"{{ file = {_quoted(file)}, {', '.join(message)} }}" if message else _quoted(file)


def _text(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _quoted(file: Path) -> str:
    return json.dumps(file.as_posix(), ensure_ascii=False)


def _tables(test: Experiment) -> Iterator[tuple[str, str]]:
    """The tables that are read, by file name."""
    measured = test.measured
    if (t := measured.traction) is not None:
        yield "traction.csv", _csv({
            "time [s]": t.time, "step": t.step + 1, "creepage [%]": 100.0 * t.creepage, "traction ratio [1]": t.ratio,
            "uncertainty [1]": t.uncertainty,
        })  # fmt: skip
    if (p := measured.profile) is not None:
        stops = {"iteration": test.history.completed(p.iteration)} if np.ptp(p.iteration) else {}
        yield "profile.csv", _csv({"y [mm]": 1e3 * p.y, "height [um]": 1e6 * p.height, "disc": p.disc, **stops})
    if (warm := measured.temperature) is not None:
        yield "temperature.csv", _csv({"time [s]": warm.time, "temperature [degC]": warm.temperature - CELSIUS})
    if (m := measured.mass) is not None:
        yield "mass.csv", _csv({
            "revolutions": np.cumsum(test.history.revolutions)[m.iteration - 1], "disc": m.disc,
            "mass loss [mg]": 1e6 * m.loss, "uncertainty [mg]": 1e6 * m.uncertainty,
        })  # fmt: skip


def _csv(columns: Mapping[str, Floats | Ints]) -> str:
    """The columns that hold numbers."""
    kept = {name: values for name, values in columns.items() if np.isfinite(values).all()}
    rows = zip(*kept.values(), strict=True)
    return "\n".join([",".join(kept), *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n"
