"""A definition back to TOML."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import tomli_w

from twindisc_cli.laws.law import Law

_PATHS = ("traction", "log", "profile", "temperature", "mass")


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


def relocate(text: str, *, source: Path, target: Path) -> str:
    """The same definition for another folder: relative paths of measured data lead from `target` to the same files."""
    lines = text.split("\n")
    inside = False
    for number, line in enumerate(lines):
        if line.startswith("["):
            inside = line.strip() == "[measured]"
        key, _, value = (part.strip() for part in line.partition("="))
        if inside and key in _PATHS:
            path = os.path.relpath(source / value.strip('"'), target)
            lines[number] = f'{key} = "{Path(path).as_posix()}"'
    return "\n".join(lines)
