"""What every command shares: read the tests, skip what is up to date, run, write, tell.

The command modules are imported only when they are called, so that a command pays for nothing but itself.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

from twindisc_cli import terminal
from twindisc_cli.commands._message import tell, write_depfile
from twindisc_cli.commands._output import Output
from twindisc_cli.definition import Test, dump, load, relocate
from twindisc_cli.effects import add_folder
from twindisc_cli.errors import DefinitionError, MeasurementError, OutputError, Problem, TwindiscError, ValidityError
from twindisc_cli.physics.half_space import ContactError
from twindisc_cli.plugins import forget_trust, trust
from twindisc_cli.results import Result
from twindisc_cli.results.files import write_all
from twindisc_cli.results.origin import Origin, Source
from twindisc_cli.results.recorded import made_by_another, recorded, up_to_date, why
from twindisc_cli.results.store import images, plain, put
from twindisc_cli.version import __version__

Progress = Callable[[str, float], None]
LINE_EVERY = 10.0
"""Seconds between lines that say how far a command is, where they go to a file: a log stays short."""
READ = 0.05
"""How far a command is once it has read its tests."""


def run_command(command: str, path: Path, output: Output, **options: float) -> int:
    """Run a command on one test, with the command's own options. The exit code."""
    with _read(command, [path], output) as (tests, progress):
        progress(command, READ)
        return _deliver(command, tests, options, output, lambda: _module(command).run(tests[0], **options))


def quiet(command: str, test: Test, folder: Path) -> tuple[Result, dict[str, bytes]]:
    """Run a command on one test and tell nothing: the result, and its files by name, made for a folder."""
    module = _module(command)
    further = (None, lambda _what, _fraction: None)
    compute = (lambda: module.run([test], *further)) if command == "close-loop" else (lambda: module.run(test))
    return _made([test], single_origin(command, test), Output(folder), folder, compute)


def single_origin(command: str, test: Test) -> Origin:
    """The origin of a command's result on one test, as `run_command` and `run_close_loop` have it."""
    return origin_of([test], {"validate": False, "fitted": 1} if command == "close-loop" else {})


def run_close_loop(paths: Sequence[Path], options: Mapping[str, Any], output: Output) -> int:
    """Run close-loop on several tests: those `fitted`, the one to `validate` with if any, those to predict."""
    with _read("close-loop", paths, output) as (tests, progress):
        fitted, only = tests[: options["fitted"]], tests[options["fitted"] :]
        validate = only[0] if options["validate"] else None
        predict = only[1:] if validate else only
        _refuse_equal_names(tests)

        def compute() -> Result:
            quick = bool(options.get("quick"))
            result: Result = _module("close-loop").run(fitted, validate, progress, quick=quick, predict=predict)
            return result

        return _deliver("close-loop", tests, options, output, compute)


def run_paper(paths: Sequence[Path], output: Output) -> int:
    """Draw the figures of the paper from its two tests, and a revised one where a third is given. The exit code."""
    with _read("paper", paths, output) as (tests, progress):

        def compute() -> Result:
            result: Result = _module("paper").run(tests[0], tests[1], *tests[2:], progress=progress)
            return result

        return _deliver("paper", tests, {"revised": len(tests) > 2}, output, compute, name="paper")


@contextmanager
def _read(command: str, paths: Sequence[Path], output: Output) -> Iterator[tuple[list[Test], Progress]]:
    """The tests of a command, and the bar that shows how far it is."""
    with progress_bar(quiet=output.quiet) as progress:
        progress(f"{command}: reading", 0.0)
        know(output.effects, trusting=output.trust_effects)
        yield load_all(paths), progress


def know(folder: Path | None, *, trusting: bool) -> None:
    """The effects of a folder are known from here on, and definitions may name it, or any folder where one trusts them.

    folder: which the command line names; trusting: whether files in others that definitions name may be run.
    """
    forget_trust()
    if folder is not None:
        add_folder(folder)
        trust(folder)
    if trusting:
        trust()


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
    return _reported(_module("effects").run(name), as_json)


def _reported(result: Result, as_json: bool) -> int:
    if as_json:
        tell_json(result.json)
    else:
        terminal.say(result.summary)
    return result.exit_code


def test_effect(path: Path, as_json: bool) -> int:
    """Tell whether an effect file is all that it says. The exit code."""
    from twindisc_cli.commands.effect_test import run

    with progress_bar() as progress:
        result = run(path, progress)
    return _reported(result, as_json)


def write_effect(path: Path, name: str | None, output: Path | None) -> int:
    """Write a law of a definition as an effect file, to a file or to the terminal. The exit code."""
    text: str = _module("effects").from_law(path, name)
    if output is None:
        terminal.say_text(text)
    else:
        write_all({output: text.encode()})
        terminal.say([f"written: {output}"])
    return 0


def tell_json(value: Mapping[str, Any]) -> None:
    """Print the one JSON object of a run."""
    terminal.say_json(plain(value))


def _module(command: str) -> Any:
    return import_module(f"twindisc_cli.commands.{command.replace('-', '_')}")


def _refuse_equal_names(tests: Sequence[Test]) -> None:
    names = [test.experiment.name for test in tests]
    for place, name in enumerate(names):
        if name in names[:place]:
            raise DefinitionError(
                Problem(f"two tests are called {name}; give each a name of its own", str(tests[place].path))
            )


def origin_of(tests: Sequence[Test], options: Mapping[str, Any]) -> Origin:
    """What a result of these tests is made from."""
    several, history = len(tests) > 1, tests[0].experiment.history
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
        sources=tuple(Source(test.digest, test.inputs) for test in tests),
        turned=(history.end_time, history.revolutions.cumsum()),
    )


def _deliver(
    command: str,
    tests: Sequence[Test],
    options: Mapping[str, Any],
    output: Output,
    compute: Callable[[], Result],
    *,
    name: str = "",
) -> int:
    """Tell the stored outcome where it is up to date; else compute, write and tell. name: of the folder, the test's."""
    origin = origin_of(tests, {**options, **output.options})
    folder = output.folder / (name or origin.name)
    path = folder / f"{command}.h5"
    if output.dry_run:
        return _foretell(path, why(path, command, origin), output)
    definitions = [test.path for test in tests]
    inputs = [test.path.parent / name for test in tests for name in test.inputs]
    stored = None if output.force else up_to_date(path, origin.run_key(command))
    if stored:
        write_depfile(output, stored.files, definitions, inputs)
        tell(stored.summary, stored.json, stored.files, output, "up to date")
        return stored.exit_code
    if not output.quiet and (another := made_by_another(recorded(path))):
        terminal.say([f"{path}: {another}"], error=True)
    say_more = _reporter(output)
    say_more(lambda: f"twindisc {__version__}: {path} {why(path, command, origin) or 'is made again: --force'}")
    result, files = _made(tests, origin, output, folder, compute)
    say_more(lambda: "computed")
    written = put(folder, files)
    say_more(lambda: "written")
    write_depfile(output, written, definitions, inputs)
    tell(result.summary, plain(result.json), written, output, "written")
    return result.exit_code


def _foretell(path: Path, reason: str, output: Output) -> int:
    """Say whether a result would be made, and why; nothing is computed."""
    reason = reason or ("--force" if output.force else "")
    if output.as_json:
        tell_json({"file": str(path), "would_be_made": bool(reason), "why": reason or None})
    else:
        terminal.say([f"would be made: {path}: {reason}" if reason else f"up to date: {path}"])
    return 0


def _reporter(output: Output) -> Callable[[Callable[[], str]], None]:
    """say(what): with --verbose a line on stderr, with the seconds since the start."""
    began = time.perf_counter()

    def say(what: Callable[[], str]) -> None:
        if output.verbose:
            terminal.say([f"{time.perf_counter() - began:7.2f} s  {what()}"], error=True)

    return say


def _made(
    tests: Sequence[Test], origin: Origin, output: Output, folder: Path, compute: Callable[[], Result]
) -> tuple[Result, dict[str, bytes]]:
    """A result, and its files by name, made for a folder; a failure says which definition it is of."""
    from twindisc_cli.commands._base import with_data
    from twindisc_cli.commands._possible import refuse_impossible

    test = tests[0]
    try:
        for each in tests:
            refuse_impossible(each.experiment)
        with _drawing(output) if output.formats else nullcontext():
            result = with_data(compute(), tests)
            files = result.extra_files.items()
            extra = {name: _content(name, text, test, folder, output.effects) for name, text in files}
            return result, images(result, origin, extra, formats=output.formats, dpi=output.dpi, panels=output.panels)
    except ContactError as error:
        raise ValidityError(str(error)).of(test.path) from error
    except TwindiscError as error:
        raise error.of(test.path) from error


@contextmanager
def _drawing(output: Output) -> Iterator[None]:
    """The style of all figures, and what their time is drawn over; the library that draws them is loaded for it."""
    from twindisc_cli.figures.style import house_style
    from twindisc_cli.figures.time_axis import time_drawn_over

    with house_style(output.style), time_drawn_over(output.over):
        yield


def _content(name: str, content: str | bytes, test: Test, folder: Path, effects: Path | None) -> bytes:
    """The bytes of an extra file; a definition is made to find its data, and its effects, from its new folder."""
    if isinstance(content, bytes):
        return content
    if name.endswith(".toml"):
        content = relocate(content, source=test.path.parent, target=folder, effects=effects)
    try:
        return content.encode()
    except UnicodeEncodeError:
        what = "cannot be written: the path to the data holds bytes that are no text; rename that folder"
        raise OutputError(Problem(what, str(folder / name))) from None


def progress_lines() -> Progress:
    """progress(what, fraction): after LINE_EVERY seconds, and no more often, a line on stderr with the time left.

    What is left is taken to go at the pace of what is done; before that is more than READ nothing is said.
    """
    began = last = time.monotonic()

    def progress(what: str, fraction: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < LINE_EVERY or not READ < fraction < 1.0:
            return
        last = now
        gone, left = now - began, (now - began) * (1.0 - fraction) / fraction
        terminal.say([f"{what}: {_rounded(gone)} so far, about {_rounded(left)} left"], error=True)

    return progress


def _rounded(seconds: float) -> str:
    """A time to two digits: `40 s`, `12 min`, `3 h`."""
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"


@contextmanager
def progress_bar(*, quiet: bool = False) -> Iterator[Progress]:
    """Return progress(what, fraction): a bar on stderr where that is a terminal, else now and then a line.

    quiet: neither of them.
    """
    if sys.stderr is None or quiet:
        yield lambda _what, _fraction: None
        return
    if not sys.stderr.isatty():
        yield progress_lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=1.0)
        yield lambda what, fraction: bars.update(task, description=terminal.plain_line(what), completed=fraction)
