"""init: a commented test definition to start from, of one of the common rigs."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from twindisc_cli.definition import test_name
from twindisc_cli.errors import DefinitionError, Problem, did_you_mean
from twindisc_cli.results.files import write_all

RIGS = ("crowned", "suros", "mtm")
"""A straight disc on a crowned one (the template itself), two cylinders, a ball on a flat disc."""


def run(path: Path, *, rig: str, force: bool) -> None:
    """Write the definition of a rig to `path`, which names the test; an existing file is kept unless forced."""
    rig = rig.casefold()
    if rig not in RIGS:
        raise DefinitionError(f"--rig: {rig} is not known{did_you_mean(rig, RIGS)}; choose {', '.join(RIGS)}")
    if path.is_dir():
        raise DefinitionError(Problem("is a folder; name the file to write", str(path)))
    if path.exists() and not force:
        raise DefinitionError(Problem("exists already; choose another name, or overwrite it with --force", str(path)))
    write_all({path: _template(rig).replace('name = "mytest"', f'name = "{test_name(path.stem)}"').encode()})


def _template(rig: str) -> str:
    """The template, with a rig's own tables in the places of those that it has."""
    folder = files("twindisc_cli.definition")
    template = (folder / "template.toml").read_text(encoding="utf-8")
    if rig == "crowned":
        return template
    own = {_head(table): table for table in _tables((folder / "rigs" / f"{rig}.toml").read_text(encoding="utf-8"))[1:]}
    return "".join(own.get(_head(table), table) for table in _tables(template))


def _tables(text: str) -> list[str]:
    """What stands above the first table, and each table, also one that is a remark, with what follows it."""
    return re.split(r"(?m)^(?=(?:# )?\[)", text)


def _head(table: str) -> str:
    return table.partition("]")[0].removeprefix("# ")
