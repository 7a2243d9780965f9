"""Tables of the site that are made from the program: keys, columns, units, results, exit codes, effects.

What a page asks for by `<!-- table NAME -->` is a function here, so that no table can differ from the program.
"""

from __future__ import annotations

import inspect
import json
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

DOCS = Path(__file__).parent
FORMULAS: Mapping[str, str] = tomllib.loads((DOCS / "formulas.toml").read_text(encoding="utf-8"))


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(cell) for cell in line) + " |" for line in lines) + "\n"


def _cell(cell: object) -> str:
    return " ".join(re.sub(r"(?<!\\)\|", r"\\|", str(cell)).split())


# ------------------------------------------------------------------------------------------ the definition


def keys() -> str:
    """Every key of a test definition, table by table, from its JSON schema."""
    from twindisc_cli.commands.schema import run

    schema = json.loads(run())
    parts = list(_tables(schema, schema, ""))
    return "\n".join(parts)


def _tables(schema: dict[str, Any], part: dict[str, Any], path: str) -> Iterator[str]:
    """The table of one TOML table, then those of the tables in it."""
    required = set(part.get("required", ()))
    rows, inner = [], []
    for key, value in part["properties"].items():
        node = _resolved(schema, value)
        here = f"{path}.{key}" if path else key
        if here == "effects":
            text = "one table for each declared effect, with its parameters: [the catalogue](effects/index.md)"
            rows.append([f"`{key}`", "table", "", "", text])
            continue
        if "properties" in node and key != "disc2" and not _is_uncertain(node) and "ColumnTable" not in str(value):
            inner.append((node, here))
        elif "properties" in _resolved(schema, node.get("items", {})):
            inner.append((_resolved(schema, node["items"]), f"{here}[]"))
        elif "properties" in _resolved(schema, _of_any(node)):
            inner.append((_resolved(schema, _of_any(node)), f"{here}.NAME"))
        default = "required" if key in required else _default(value)
        about = value.get("description") or node.get("description", "")
        rows.append([f"`{key}`", _kind(schema, node), _range(schema, node), default, about])
    title = f"### `[{path}]`" if path else "### The top of the file"
    yield f"{title}\n\n{part.get('description', '')}\n\n{table(('key', 'type', 'range', 'default', 'meaning'), rows)}"
    for node, here in inner:
        yield from _tables(schema, node, here)


def _resolved(schema: dict[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    """A node of the schema behind its references, without `or null`; of a table or a number the richer."""
    if "$ref" in node:
        return _resolved(schema, schema["$defs"][node["$ref"].rpartition("/")[2]])
    options = [option for option in node.get("anyOf", ()) if option.get("type") != "null"]
    if not options:
        return node
    found = [_resolved(schema, option) for option in options]
    return next((option for option in found if "properties" in option), {**found[0], "or": found[1:]})


def _of_any(node: dict[str, Any]) -> dict[str, Any]:
    """What a table with free keys holds."""
    free = node.get("patternProperties") or {}
    more = node.get("additionalProperties")
    return next(iter(free.values()), more if isinstance(more, dict) else {})


def _kind(schema: dict[str, Any], node: dict[str, Any]) -> str:
    options = [node, *node.get("or", ())]
    return " or ".join(dict.fromkeys(_plain_kind(schema, option) for option in options))


def _plain_kind(schema: dict[str, Any], node: dict[str, Any]) -> str:
    if "enum" in node or "const" in node:
        return ", ".join(f"`{value}`" for value in node.get("enum", [node.get("const")]))
    if _is_uncertain(node):
        return "number, `{ value, std }`"
    if node.get("type") == "array":
        return f"list of {_plain_kind(schema, _resolved(schema, node.get('items', {})))}"
    return {"object": "table", "string": "text"}.get(node.get("type", ""), node.get("type", "value"))


def _is_uncertain(node: dict[str, Any]) -> bool:
    """Whether it is a number that may come with its standard deviation."""
    return set(node.get("properties", ())) == {"value", "std"}


def _range(schema: dict[str, Any], node: dict[str, Any]) -> str:
    """The bounds of a number, or the pattern of a text."""
    node = next((n for n in (node, *node.get("or", ())) if n.get("type") in ("number", "integer", "string")), node)
    if _is_uncertain(node):
        node = _resolved(schema, node["properties"]["value"])
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    bounds = ", ".join(f"{sign} {node[key]:g}" for key, sign in signs.items() if key in node)
    return bounds or (f"`{node['pattern']}`" if "pattern" in node else "")


def _default(value: dict[str, Any]) -> str:
    default = value.get("default")
    return "" if default is None or isinstance(default, dict) else f"`{json.dumps(default)}`"


# ------------------------------------------------------------------------------------------ measured files


def columns() -> str:
    """The columns of every measured file, as their readers ask for them."""
    rows = []
    for file, wanted in _readers().items():
        for column in wanted:
            units = ", ".join(f"`{unit}`" for unit in column.quantity.units)
            rows.append(
                [
                    f"`{file}`",
                    f"`{column.name}`",
                    units,
                    "" if file in ("log", "mass") else "required" if column.required else "optional",
                    ", ".join(column.also) or "",
                ]
            )
    return table(("file", "column", "units", "", "also understood"), rows)


class _AskedError(Exception):
    """A reader asked for its columns."""


def _readers() -> dict[str, list[Any]]:
    """What each reader looks for, caught where it asks for its table."""
    from twindisc_cli.measurement import channels, log, profile, weighings
    from twindisc_cli.model.experiment import Disc, Rig

    rig = Rig(Disc(0.03, float("inf"), 2e11, 0.3, 7e9), Disc(0.03, 0.03, 2e11, 0.3, 7e9), 72.0, 9.42)
    readers: dict[str, tuple[Any, Callable[[], Any]]] = {
        "traction": (channels, lambda: channels.read_traction(b"", "", rig=rig, history=None)),
        "profile": (profile, lambda: profile.read_profile(b"", "", rig=rig, history=None)),  # type: ignore[arg-type]
        "temperature": (channels, lambda: channels.read_temperature(b"", "", history=None)),  # type: ignore[arg-type]
    }
    found = {name: _asked_for(module, read) for name, (module, read) in readers.items()}
    found["mass"] = list({column.name: column for way in weighings._ways() for column in way}.values())
    found["log"] = list({column.name: column for way in log._ways(rig) for column in way}.values())
    return found


def _asked_for(module: Any, read: Callable[[], Any]) -> list[Any]:
    def ask(_data: bytes, _file: str, wanted: Sequence[Any], *_: Any, **__: Any) -> None:
        raise _AskedError(wanted)

    with patch.object(module, "read_table", ask):
        try:
            read()
        except _AskedError as asked:
            return list(asked.args[0])
    raise RuntimeError(f"{module.__name__} reads without asking for columns")


def covariates() -> str:
    """What laws may run over."""
    from twindisc_cli.laws.covariates import COVARIATES

    rows = [[f"`{name}`", f"`{c.key(name)}`", c.symbol, c.unit, c.label] for name, c in COVARIATES.items()]
    return table(("covariate", "key with its unit", "symbol", "unit", "what it is"), rows)


def quantities() -> str:
    """What laws may change."""
    from twindisc_cli.laws.quantities import QUANTITIES

    rows = [
        [f"`{name}`", q.label, "times (1 + change)" if q.kind == "factor" else f"plus change [{q.unit}]", q.stage,
         q.channel, ", ".join(f"`{c}`" for c in q.covariates)]
        for name, q in QUANTITIES.items()
    ]  # fmt: skip
    return table(("quantity", "what it is", "a law makes of it", "stage", "shows first in", "searched over"), rows)


def shapes() -> str:
    """The formulas of laws."""
    from twindisc_cli.laws.shapes import SHAPES

    rows = [[f"`{name}`", " ".join((getattr(s, "text", "") or s.__doc__ or "").split())] for name, s in SHAPES.items()]
    return table(("shape", "formula"), rows)


# ------------------------------------------------------------------------------------------ results


def exit_codes() -> str:
    """The exit codes, from the failures that carry them."""
    from twindisc_cli import errors
    from twindisc_cli.cli import INTERRUPTED, TERMINATED

    kinds = [kind for kind in vars(errors).values() if inspect.isclass(kind) and issubclass(kind, errors.TwindiscError)]
    said: dict[int, list[str]] = {}
    for kind in kinds[1:]:
        said.setdefault(kind.exit_code, []).append((kind.__doc__ or "").strip())
    rows: list[list[object]] = [[0, "Done, or up to date."], [1, "A bug in twindisc."]]
    rows += [[code, " ".join(texts)] for code, texts in sorted(said.items()) if code > 1]
    rows.append([errors.NEGATIVE_FINDING, "Done, and the finding is negative: `check` found a contradiction, or "
                 "`close-loop` a residual that nothing known explains."])  # fmt: skip
    rows.append([f"{INTERRUPTED}, {TERMINATED}", "Interrupted, or asked to end; nothing half-written is left."])
    return table(("exit code", "meaning"), rows)


def outcome(answer: Mapping[str, Any]) -> str:
    """The keys of a command's JSON, each with its type and an example."""
    return table(("key", "type", "example"), list(_keys_of(answer, "")))


def attributes() -> str:
    """The attributes at the root of every result file."""
    rows = [
        ["`Conventions`", "the conventions of names and units that the file follows"],
        ["`title`", "command and test"],
        ["`schema`", "version of this format"],
        ["`twindisc_version`", "what wrote the file"],
        ["`run_key`", "sha256 of version, resolved definition and inputs; an unchanged run is up to date"],
        ["`provenance`", "where the data come from"],
    ]
    return table(("attribute", "what it is"), rows)


@cache
def _of_the_paper() -> Mapping[str, Mapping[str, float]]:
    from twindisc_cli.commands.paper import run
    from twindisc_cli.definition import load

    air, nitrogen = (load(DOCS.parent / f"configs/{name}.toml") for name in ("ambient", "cryogenic"))
    found: Mapping[str, Mapping[str, float]] = run(air, nitrogen).json["numbers"]
    return found


def numbers(figure: str) -> str:
    """The numbers of a figure of the paper: by the program, as printed, expected by hand, and why they differ."""
    stored = tomllib.loads((DOCS.parent / "tests/reproduction.toml").read_text(encoding="utf-8"))[figure]
    rows = [
        [
            name.replace("_", " "),
            f"{_of_the_paper()[figure][name]:.4g}",
            f"{entry['printed']:.4g}" if "printed" in entry else "",
            f"{entry['value']:.4g}",
            entry["stated"],
            entry.get("differs", ""),
        ]
        for name, entry in stored.items()
    ]
    return table(("number", "twindisc", "printed", "expected", "the paper says", "why they differ"), rows)


def _keys_of(answer: Mapping[str, Any], path: str) -> Iterator[list[object]]:
    for key, value in answer.items():
        here = f"{path}.{key}" if path else key
        if isinstance(value, Mapping) and value:
            yield from _keys_of(value, here)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            merged = {name: part for one in reversed(value) for name, part in one.items()}
            yield from _keys_of(merged, f"{here}[]")
        else:
            yield [f"`{here}`", _json_kind(value), f"`{_short(value)}`"]


def _json_kind(value: Any) -> str:
    if isinstance(value, list):
        return f"list of {_json_kind(value[0])}" if value else "list"
    names = {bool: "true or false", int: "number", float: "number", str: "text", dict: "object"}
    return names.get(type(value), "null")


def _short(value: Any) -> str:
    """A value as JSON, numbers with four digits, cut where it is long."""
    rounded = json.loads(json.dumps(value), parse_float=lambda text: float(f"{float(text):.4g}"))
    text = json.dumps(rounded, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def variables(path: Path) -> str:
    """The axes and arrays of a result file."""
    import h5py

    with h5py.File(path) as file:
        rows = [
            [f"`{name}`", ", ".join(_axes(item)), _text(item.attrs.get("units")), _text(item.attrs.get("long_name"))]
            for name, item in sorted(file.items())
            if isinstance(item, h5py.Dataset)
        ]
    return table(("variable", "axes", "unit", "what it is"), rows)


def _axes(item: Any) -> list[str]:
    names = [dim[0].name.rpartition("/")[2] if len(dim) else "" for dim in item.dims]
    return [f"`{name}`" for name in names if name] or ["an axis"]


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value if value is not None else "")


# ------------------------------------------------------------------------------------------ effects


def effects() -> str:
    """The catalogue with the formula of each effect, and what it leaves behind."""
    from twindisc_cli.effects import catalogue

    rows = []
    for name, effect in sorted(catalogue().items(), key=lambda item: (item[1].channel, item[0])):
        what = effect.explanation.partition("\n")[0].partition(": ")[2]
        left = left_behind(effect.explanation)
        rows.append(
            [
                f"[`{name}`]({name}.md)<br>{what}",
                formula(name),
                f"*{effect.channel}*: {left}",
                f"![What {name} does]({name}.png)",
            ]
        )
    return table(("effect", "formula", "what it leaves behind, when it is missing", "a test without and with it"), rows)


def formula(name: str) -> str:
    """The formula of an effect for a cell of a table: without the number of an equation, one equation a line."""
    tex = re.sub(r"\\tag\{[^}]*\}", "", FORMULAS[name]).replace("|", r"\vert ")
    return "<br>".join(f"${part.strip()}$" for part in tex.split(r", \qquad"))


def left_behind(explanation: str) -> str:
    """What an effect's file says that it leaves behind."""
    found = re.search(r"Leaves behind, when it is missing: (.*?)\nValid for:", explanation, re.DOTALL)
    return " ".join(found[1].split()) if found else ""
