"""A definition back to TOML."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from itertools import takewhile
from pathlib import Path
from typing import Any

import tomli_w

from twindisc_cli.definition.schema import MEASURED_FILES
from twindisc_cli.laws.law import Law
from twindisc_cli.loop.channels import further_channels

_FOLDERS = (("loop", "effects"), ("loop", "channels"))
"""Keys that name a folder, with their tables."""


def dump(
    resolved: Mapping[str, Any],
    effects: Mapping[str, Mapping[str, float]] | None = None,
    laws: Mapping[str, Mapping[str, Any]] | None = None,
) -> str:
    """TOML of a resolved definition; `effects` and `laws` are declared in it beside those it has."""
    document = dict(resolved)
    for name, more in (("effects", effects), ("laws", laws)):
        if more:
            document[name] = {**document.get(name, {}), **{key: dict(table) for key, table in more.items()}}
    return tomli_w.dumps(document)


def law_table(law: Law, *, digits: int) -> dict[str, Any]:
    """A law as its table in a definition, with so many significant digits."""

    def rounded(values: Iterable[float]) -> list[float]:
        return [float(f"{value:.{digits}g}") for value in values]

    table: dict[str, Any] = {"quantity": law.quantity, "covariate": law.covariate}
    if law.shape is None:
        table |= {"at": rounded(law.at), law.of.kind: rounded(law.value)}
    else:
        table |= {
            "shape": law.shape,
            "parameters": dict(zip(law.parameters, rounded(law.parameters.values()), strict=True)),
        }
    if law.valid is not None:
        table["valid"] = rounded(law.valid)
    return {**table, "transfer": law.transfer}


def relocate(text: str, *, source: Path, target: Path, effects: Path | None = None) -> str:
    """The same definition for another folder: relative paths in it lead from `target` to the same files.

    effects: a folder of effects, relative to where the program runs, that it shall name where it names none.

    Paths lead through the folders that links stand for, as the system itself follows `..`. Of the remarks, those at
    the top stay.
    """
    remarks = "".join(f"{line}\n" for line in takewhile(lambda line: line.startswith("#"), text.split("\n")))
    document = tomllib.loads(text)
    files = (("measured", key) for key in (*MEASURED_FILES, *further_channels()))
    for table, key in (*files, *_FOLDERS):
        named = document.get(table, {}).get(key)
        if named is not None:
            document[table][key] = _moved(named, source, target)
    if effects is not None:
        document.setdefault("loop", {}).setdefault("effects", path_from(target, effects))
    return remarks + tomli_w.dumps(document)


def _moved(named: Any, source: Path, target: Path) -> Any:
    """A file, or a table or a list that names files, with paths that lead from `target`."""
    if isinstance(named, list):
        return [_moved(one, source, target) for one in named]
    if isinstance(named, dict):
        return {**named, "file": path_from(target, source / named["file"])}
    return path_from(target, source / named)


def test_name(stem: str) -> str:
    """The name of a test that is called after a file."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", stem).lstrip("._-") or "test"


def path_from(folder: Path, file: Path) -> str:
    """A path that leads from a folder to a file, with `/` between its parts."""
    there = file.parent.resolve() / file.name
    try:
        return Path(os.path.relpath(there, folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return there.as_posix()
