"""What every command shares: read the tests, skip what is up to date, run, write, tell.

The command modules are imported only when they are called, so that a command pays for nothing but itself.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from twindisc_cli.definition import Test, dump, load, relocate
from twindisc_cli.errors import DefinitionError, MeasurementError, Problem, TwindiscError, ValidityError
from twindisc_cli.physics.half_space import ContactError
from twindisc_cli.results import Result
from twindisc_cli.results.files import write_all
from twindisc_cli.results.store import Origin, images, plain, put, up_to_date

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Output:
    """Where results go, and how they are told."""

    folder: Path
    as_json: bool = False
    force: bool = False


def run_command(command: str, path: Path, output: Output, **options: float) -> int:
    """Run a command on one test, with the command's own options. The exit code."""
    test = load(path)
    return _deliver(command, [test], options, output, lambda: _module(command).run(test, **options))


def quiet(command: str, test: Test, folder: Path) -> tuple[Result, dict[str, bytes]]:
    """Run a command on one test and tell nothing: the result, and its files by name, made for a folder."""
    module = _module(command)
    further = (None, lambda _what, _fraction: None)
    compute = (lambda: module.run([test], *further)) if command == "close-loop" else (lambda: module.run(test))
    return _made([test], single_origin(command, test), folder, compute)


def single_origin(command: str, test: Test) -> Origin:
    """The origin of a command's result on one test, as `run_command` and `run_close_loop` have it."""
    return origin_of([test], {"validate": False, "fitted": 1} if command == "close-loop" else {})


def run_close_loop(paths: Sequence[Path], validate: Path | None, output: Output, *, quick: bool = False) -> int:
    """Run close-loop on several tests, and predict one that is not fitted. The exit code."""
    *tests, last = load_all([*paths, *([validate] if validate else [])])
    unseen = last if validate else None
    fitted = tests if validate else [*tests, last]
    _refuse_equal_names([*tests, last])

    def compute() -> Result:
        with progress_bar() as progress:
            result: Result = _module("close-loop").run(fitted, unseen, progress, quick=quick)
            return result

    options = {"validate": validate is not None, "fitted": len(fitted), **({"quick": True} if quick else {})}
    return _deliver("close-loop", [*tests, last], options, output, compute)


def load_all(paths: Sequence[Path]) -> list[Test]:
    """Load several tests; the mistakes of all of them come in one go."""
    tests: list[Test] = []
    errors: list[DefinitionError | MeasurementError] = []
    for path in paths:
        try:
            tests.append(load(path))
        except (DefinitionError, MeasurementError) as error:
            errors.append(error)
    if errors:
        first = min(errors, key=lambda error: error.exit_code)
        raise type(first)([problem for error in errors for problem in error.problems])
    return tests


def run_effects(name: str | None, as_json: bool) -> int:
    """Tell the catalogue of effects, or one of them. The exit code."""
    result: Result = _module("effects").run(name)
    if as_json:
        tell_json(result.json)
    else:
        sys.stdout.write("".join(f"{line}\n" for line in result.summary))
    return result.exit_code


def write_effect(path: Path, name: str | None, output: Path | None) -> int:
    """Write a law of a definition as an effect file, to a file or to the terminal. The exit code."""
    text: str = _module("effects").from_law(path, name)
    if output is None:
        sys.stdout.write(text)
    else:
        write_all({output: text.encode()})
        sys.stdout.write(f"written: {output}\n")
    return 0


def tell_json(value: Mapping[str, Any]) -> None:
    """Print the one JSON object of a run."""
    sys.stdout.write(json.dumps(plain(value), indent=2, ensure_ascii=False) + "\n")


def _module(command: str) -> Any:
    return import_module(f"twindisc_cli.commands.{command.replace('-', '_')}")


def _refuse_equal_names(tests: Sequence[Test]) -> None:
    names = [test.experiment.name for test in tests]
    for place, name in enumerate(names):
        if name in names[:place]:
            raise DefinitionError(Problem(f"two tests are called {name}; give each its own", str(tests[place].path)))


def origin_of(tests: Sequence[Test], options: Mapping[str, Any]) -> Origin:
    """What a result of these tests is made from."""
    several = len(tests) > 1
    return Origin(
        name=tests[0].experiment.name,
        configs=tuple(dump(test.resolved) for test in tests),
        inputs={
            f"{test.experiment.name}: {name}" if several else name: digest
            for test in tests
            for name, digest in test.inputs.items()
        },
        provenance=tests[0].experiment.measured.provenance,
        options=options,
    )


def _deliver(
    command: str, tests: Sequence[Test], options: Mapping[str, Any], output: Output, compute: Callable[[], Result]
) -> int:
    """Tell the stored outcome where it is up to date; else compute, write and tell."""
    origin = origin_of(tests, options)
    folder = output.folder / origin.name
    stored = None if output.force else up_to_date(folder / f"{command}.h5", origin.run_key(command))
    if stored:
        _tell(stored.summary, stored.json, stored.files, folder, output, "up to date")
        return stored.exit_code
    result, files = _made(tests, origin, folder, compute)
    _tell(result.summary, result.json, put(folder, files), folder, output, "written")
    return result.exit_code


def _made(
    tests: Sequence[Test], origin: Origin, folder: Path, compute: Callable[[], Result]
) -> tuple[Result, dict[str, bytes]]:
    """A result, and its files by name, made for a folder; a failure says which definition it is of."""
    from twindisc_cli.commands._base import with_data

    test = tests[0]
    try:
        result = with_data(compute(), tests)
        extra = {name: _content(name, text, test, folder) for name, text in result.extra_files.items()}
        return result, images(result, origin, extra)
    except ContactError as error:
        raise ValidityError(str(error)).of(test.path) from error
    except TwindiscError as error:
        raise error.of(test.path) from error


def _content(name: str, content: str | bytes, test: Test, folder: Path) -> bytes:
    """The bytes of an extra file; a definition is made to find its data from its new folder."""
    if isinstance(content, bytes):
        return content
    if name.endswith(".toml"):
        content = relocate(content, source=test.path.parent, target=folder)
    return content.encode()


def _tell(
    summary: Sequence[str], outcome: Mapping[str, Any], files: Sequence[Path], folder: Path, output: Output, state: str
) -> None:
    """Summary and paths to the terminal; with --json the object to stdout and the rest to stderr."""
    told = sys.stderr if output.as_json else sys.stdout
    lines = [*summary, *(f"{state}: {path}" for path in files)]
    told.write("".join(f"{line}\n" for line in lines))
    if output.as_json:
        revised = outcome.get("revised")
        tell_json({**outcome, "revised": str(folder / revised)} if isinstance(revised, str) else outcome)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Return progress(what, fraction): a bar on stderr where that is a terminal, nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda _what, _fraction: None
        return
    from rich.console import Console
    from rich.progress import Progress as Bars

    with Bars(console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=1.0)
        yield lambda what, fraction: bars.update(task, description=what, completed=fraction)
