"""A definition back to TOML."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

_PATHS = ("traction", "rig_log", "profile", "temperature", "mass")


def dump(resolved: Mapping[str, Any], effects: Mapping[str, Mapping[str, float]] | None = None) -> str:
    """TOML of a resolved definition; `effects` are declared in it beside those it has."""
    document = dict(resolved)
    if effects:
        document["effects"] = {**document.get("effects", {}), **{name: dict(table) for name, table in effects.items()}}
    return tomli_w.dumps(document)


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
