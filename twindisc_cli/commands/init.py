"""init: a commented test definition to start from."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.results.files import write_all


def run(path: Path, *, force: bool) -> None:
    """Write the template to `path`, which names the test; an existing file is kept unless forced."""
    if path.is_dir():
        raise DefinitionError(Problem("is a folder; name the file to write", str(path)))
    if path.exists() and not force:
        raise DefinitionError(Problem("exists already; choose another name, or overwrite it with --force", str(path)))
    template = (files("twindisc_cli.definition") / "template.toml").read_text(encoding="utf-8")
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", path.stem).lstrip("._-") or "test"
    write_all({path: template.replace('name = "mytest"', f'name = "{name}"').encode()})
