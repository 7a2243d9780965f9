"""report: all results of a test on one page, and on two for print."""

from __future__ import annotations

import tomllib
from pathlib import Path

from twindisc_cli.commands._message import tell
from twindisc_cli.commands._output import Output
from twindisc_cli.definition import Test, load
from twindisc_cli.errors import DefinitionError, Problem, TwindiscError
from twindisc_cli.reading import LARGEST_DEFINITION, read_regular
from twindisc_cli.report.gathered import Part, damaged, key_numbers, parts_of, render, results_in
from twindisc_cli.results.files import write_all
from twindisc_cli.results.recorded import Recorded, recorded


def run(test: Path, output: Output) -> int:
    """Gather what the commands found of a test; it is given by its definition or by the folder of its results."""
    from twindisc_cli.figures.gathered import pages
    from twindisc_cli.figures.style import house_style

    folder = test if test.is_dir() else output.folder / _name(test)
    results = results_in(folder)
    parts = parts_of(folder, results, None if test.is_dir() else _as_it_is(test))
    name, description, provenance = _about(folder, parts[0])
    with house_style(output.style):
        files = {
            folder / "report.pdf": pages(name, description, provenance, parts, key_numbers(parts)),
            folder / "report.html": render(name, description, provenance, parts).encode(),
        }
    write_all(files)
    answer = {"test": name, "commands": [part.command for part in parts], "files": [str(path) for path in files]}
    warnings = [*(f"{part.command}: {part.warning}" for part in parts if part.warning), *damaged(results)]
    summary = [f"{name}: {', '.join(part.command for part in parts)}", *warnings]
    tell(summary, answer, list(files), output, "written")
    return 0


def _name(definition: Path) -> str:
    """What a definition calls its test."""
    try:
        text = read_regular(definition, largest=LARGEST_DEFINITION).decode("utf-8-sig")
        return str(tomllib.loads(text)["test"]["name"])
    except (ValueError, KeyError, TypeError) as error:
        what = "is neither the folder of a test's results nor a definition with a name under [test]"
        raise DefinitionError(Problem(what, definition)) from error


def _as_it_is(definition: Path) -> Test | None:
    """The test that a definition describes; None where it cannot be read now."""
    try:
        return load(definition)
    except TwindiscError:
        return None


def _about(folder: Path, part: Part) -> tuple[str, str, str]:
    """Name, description and provenance of the test that a result is of."""
    result = recorded(folder / f"{part.command}.h5")
    assert isinstance(result, Recorded)  # it was read from there
    definition = tomllib.loads(result.configs[0])
    about, measured = definition["test"], definition.get("measured", {})
    return str(about["name"]), str(about.get("description", "")), str(measured.get("provenance", "measured"))
