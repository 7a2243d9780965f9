"""How the outcome of a command is reported, and what of it is known without the tests; it imports nothing heavy."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from twindisc_cli import terminal
from twindisc_cli.commands._output import Output
from twindisc_cli.reading import LARGEST_DEFINITION, read_regular, read_toml


def tell(summary: Sequence[str], outcome: Mapping[str, Any], files: Sequence[Path], output: Output, state: str) -> None:
    """Summary and paths to the terminal; with --json the object to stdout and the rest to stderr."""
    if not output.quiet:
        terminal.say([*summary, *(f"{state}: {path}" for path in files)], error=output.as_json)
    if output.as_json:
        revised = outcome.get("revised")
        here = {"revised": str(files[0].parent / revised)} if isinstance(revised, str) else {}
        terminal.say_json({**outcome, **here})


def tell_unchanged(command: str, paths: Sequence[Path], options: Mapping[str, Any], output: Output) -> int | None:
    """Tell the stored outcome where not a byte has changed since, and give its exit code; None where one has."""
    from twindisc_cli.results.recorded import unchanged

    if output.force or output.dry_run:
        return None
    try:
        name = read_toml(read_regular(paths[0], largest=LARGEST_DEFINITION).decode("utf-8-sig"))["test"]["name"]
        if not isinstance(name, str) or not name:
            return None
        stored = unchanged(output.folder / name / f"{command}.h5", paths, {**options, **output.options})
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None  # reading the test in earnest will say what is wrong
    if stored is None:
        return None
    write_depfile(output, stored.files, paths, stored.inputs)
    tell(stored.summary, stored.json, stored.files, output, "up to date")
    return stored.exit_code


def write_depfile(output: Output, files: Sequence[Path], definitions: Sequence[Path], inputs: Sequence[Path]) -> None:
    """Write the rule that make reads: the files of a result depend on the definitions and the files that they name.

    Files that are up to date become newer than what they depend on, so that make is done with them.
    """
    if output.depfile is None:
        return
    for path in files:
        os.utime(path)
    from twindisc_cli.results.files import write_all

    targets, needed = ([_for_make(path) for path in paths] for paths in (files, [*definitions, *inputs]))
    rule = f"{' '.join(targets)}: {' '.join(needed)}\n" + "".join(f"\n{path}:\n" for path in needed)
    write_all({output.depfile: rule.encode("utf-8", "surrogateescape")})


def _for_make(path: Path) -> str:
    """A path as make reads it; an empty rule for each input lets it vanish without stopping make."""
    text = path.as_posix().replace("$", "$$").replace("#", "\\#").replace(":", "\\:")
    return text.replace(" ", "\\ ")
