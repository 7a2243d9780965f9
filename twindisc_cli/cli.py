"""The command line: twindisc COMMAND TEST.toml. Nothing heavy is imported before a command is called."""

from __future__ import annotations

import functools
import inspect
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, cast

import typer

from twindisc_cli import terminal
from twindisc_cli.commands._output import DPI, FORMATS, Output
from twindisc_cli.errors import DefinitionError, OutputError, TwindiscError, ValidityError, bug
from twindisc_cli.plugins import fault
from twindisc_cli.time_axes import TIME_AXES
from twindisc_cli.version import __version__

INTERRUPTED, TERMINATED = 130, 143
_LEFT = {
    INTERRUPTED: "interrupted; nothing half-written is left",
    TERMINATED: "terminated; nothing half-written is left",
}
_AGAIN = 0.02
"""After how long a signal is sent again [s]: longer than a callback of an import or of a collected object takes."""
LINEAR_ALGEBRA_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""The matrices here are small: more threads would only wait for each other."""
UsageError = cast(type[Exception], typer.BadParameter.__bases__[0])
"""What typer raises for every mistake on the command line; it does not export it by name."""
_HELP = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="twindisc",
    help="Friction, wear, temperature and missing physics of twin-disc tests.",
    rich_markup_mode=None,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings=_HELP,
)

TestFile = Annotated[Path, typer.Argument(metavar="TEST.toml", help="The test definition.", show_default=False)]
Folder = Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where results go.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print exactly one JSON object on stdout.")]
Force = Annotated[bool, typer.Option("--force", help="Run even where the result is up to date.")]
Formats = Annotated[
    str, typer.Option("--format", metavar="png,pdf,svg", help="What the figure is written as, one or several.")
]
Dpi = Annotated[int, typer.Option("--dpi", metavar="N", min=20, max=2400, help="Pixels an inch of the figure.")]
NoFigure = Annotated[bool, typer.Option("--no-figure", help="Write numbers only, in half the time.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but what went wrong.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Say on stderr why the result is made, and how long.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Only say whether the result would be made, and why.")]
Depfile = Annotated[
    Path | None, typer.Option("--depfile", metavar="FILE", help="Write what the result depends on, as a rule for make.")
]
Effects = Annotated[
    Path | None, typer.Option("--effects", metavar="FOLDER", help="A folder of effect files that join the catalogue.")
]
Trust = Annotated[
    bool, typer.Option("--trust-effects", help="Run the Python files in folders that definitions name under [loop].")
]
Over = Annotated[
    str,
    typer.Option(
        "--over", metavar="|".join(TIME_AXES), help="What time is drawn over. [default: as fits]", show_default=False
    ),
]
Panels = Annotated[bool, typer.Option("--panels", help="Write each panel of a figure as a file of its own, too.")]
Style = Annotated[
    Path | None,
    typer.Option("--style", metavar="FILE", exists=True, dir_okay=False, help="A style sheet of matplotlib."),
]
RESULTS = Path("results")
TIMELESS = ("over",)
"""What commands have not whose figures show no time."""


def _command(name: str, *, without: Sequence[str] = ()) -> Callable[[Callable[..., int]], Callable[..., None]]:
    """Register a function as a command that takes, as its `output`, the options that all commands have.

    without: the options that it has not.
    """

    def register(function: Callable[..., int]) -> Callable[..., None]:
        own = [p for p in inspect.signature(function, eval_str=True).parameters.values() if p.name != "output"]
        every = inspect.signature(_Options, eval_str=True).parameters
        common = {key: parameter for key, parameter in every.items() if key not in without}

        @functools.wraps(function)
        def run(**given: Any) -> None:
            output = _Options(**{key: given.pop(key) for key in common}).output()
            raise typer.Exit(function(**given, output=output))

        del run.__wrapped__
        named = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in (*own, *common.values())]
        run.__signature__ = inspect.Signature(named)  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in named}
        app.command(name, context_settings=_HELP)(run)
        return run

    return register


@dataclass(frozen=True)
class _Options:
    """The options that all commands have."""

    folder: Folder = RESULTS
    as_json: AsJson = False
    force: Force = False
    formats: Formats = "png"
    dpi: Dpi = DPI
    no_figure: NoFigure = False
    quiet: Quiet = False
    verbose: Verbose = False
    dry_run: DryRun = False
    depfile: Depfile = None
    effects: Effects = None
    trust_effects: Trust = False
    over: Over = ""
    panels: Panels = False
    style: Style = None

    def output(self) -> Output:
        """What they ask for."""
        chosen = tuple(dict.fromkeys(part.strip().lower() for part in self.formats.split(",")))
        if unknown := [part for part in chosen if part not in FORMATS]:
            raise typer.BadParameter(f"--format knows {', '.join(FORMATS)}, not {unknown[0] or 'nothing'}")
        if self.over and self.over not in TIME_AXES:
            raise typer.BadParameter(f"--over knows {', '.join(TIME_AXES)}, not {self.over}")
        others = {key: value for key, value in vars(self).items() if key != "no_figure"}
        return Output(**others | {"formats": () if self.no_figure else chosen})


def _run(command: str, test: Path, output: Output, **options: float | None) -> int:
    from twindisc_cli.commands._message import tell_unchanged

    given = {name: value for name, value in options.items() if value is not None}
    message = tell_unchanged(command, [test], given, output)
    if message is not None:
        return message
    from twindisc_cli.commands import _runner

    return _runner.run_command(command, test, output, **given)


def _number(value: float | None) -> float | None:
    """A value that is a number: bounds alone let `nan` pass."""
    if value is not None and isnan(value):
        raise typer.BadParameter("expected a number, not nan")
    return value


def _version(wanted: bool) -> None:
    if wanted:
        terminal.say([f"twindisc {__version__}"])
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@_command("friction-chart", without=TIMELESS)
def friction_chart(test: TestFile, output: Output) -> int:
    """Apparent friction over creepage for a family of mu, the 98 % line, and the measured points."""
    return _run("friction-chart", test, output)


@_command("identify-mu")
def identify_mu(test: TestFile, output: Output) -> int:
    """The coefficient of friction behind each measured T/N, with its interval."""
    return _run("identify-mu", test, output)


@_command("simulate-wear")
def simulate_wear(test: TestFile, output: Output) -> int:
    """Profile, contact patch and dissipated energy after each iteration of the history."""
    return _run("simulate-wear", test, output)


@_command("fit-k", without=TIMELESS)
def fit_k(test: TestFile, output: Output) -> int:
    """The wear coefficient from the measured profile, by bisection and by least squares, and what moves it."""
    return _run("fit-k", test, output)


@_command("thermal")
def thermal(test: TestFile, output: Output) -> int:
    """Temperature of the disc over the test, and the flash temperature of the contact."""
    return _run("thermal", test, output)


@_command("contact", without=TIMELESS)
def contact(
    test: TestFile,
    output: Output,
    step: Annotated[
        int | None, typer.Option("--step", metavar="N", help="Step of the test. [default: most in partial slip]")
    ] = None,
    creepage: Annotated[
        float | None,
        typer.Option(
            "--creepage", metavar="PERCENT", min=-200, max=200, callback=_number, help="An illustrative creepage."
        ),
    ] = None,
    mu: Annotated[
        float | None,
        typer.Option("--mu", metavar="MU", min=1e-4, max=100, callback=_number, help="An illustrative mu."),
    ] = None,
) -> int:
    """Pressure, traction and slip over the patch: exact theory beside FASTSIM."""
    return _run("contact", test, output, step=step, creepage=creepage, mu=mu)


@_command("check", without=TIMELESS)
def check(test: TestFile, output: Output) -> int:
    """The definition, the data, and whether geometry, energy and heat agree with each other."""
    return _run("check", test, output)


@_command("close-loop", without=("no_figure",))
def close_loop(
    tests: Annotated[list[Path], typer.Argument(metavar="TEST.toml [MORE.toml ...]", show_default=False)],
    output: Output,
    validate: Annotated[
        Path | None,
        typer.Option("--validate", metavar="OTHER.toml", help="A test that is not fitted but counts in the choice."),
    ] = None,
    predict: Annotated[
        list[Path] | None,
        typer.Option("--predict", metavar="OTHER.toml", help="A test that is predicted and counts in nothing."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="No resampling, and so no probabilities.")] = False,
) -> int:
    """Find what the model lacks, add it, and report the error before and after on held-out data."""
    from twindisc_cli.commands._message import tell_unchanged

    only = [*([validate] if validate else []), *(predict or [])]
    paths = [*tests, *only]
    options = {"validate": validate is not None, "fitted": len(tests), **({"quick": True} if quick else {})}
    options |= {"predict": len(predict)} if predict else {}
    message = tell_unchanged("close-loop", paths, options, output)
    if message is not None:
        return message
    from twindisc_cli.commands import _runner

    return _runner.run_close_loop(paths, options, output)


@_command("paper", without=(*TIMELESS, "no_figure"))
def paper(
    air: Annotated[Path, typer.Argument(metavar="AIR.toml", help="The test in air.", show_default=False)],
    nitrogen: Annotated[Path, typer.Argument(metavar="NITROGEN.toml", help="The one in nitrogen.", show_default=False)],
    output: Output,
    revised: Annotated[
        Path | None,
        typer.Option("--revised", metavar="REVISED.toml", help="What close-loop made of the test in air."),
    ] = None,
) -> int:
    """The figures of the paper by number, from its two tests; with a revised model a sheet before and after."""
    from twindisc_cli.commands import _runner

    return _runner.run_paper([air, nitrogen, *([revised] if revised else [])], output)


@_command("campaign", without=("depfile", "effects", "formats", "dpi", "over", "panels", "style", "no_figure"))
def campaign(
    command: Annotated[str, typer.Argument(metavar="COMMAND", help="What is run on every test.", show_default=False)],
    output: Output,
    tests: Annotated[
        list[str] | None,
        typer.Argument(metavar="[TESTS ...]", help="Definitions, globs, campaign files. [default: configs/*.toml]"),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Processes. [default: all cores]")
    ] = None,
    limit: Annotated[
        float,
        typer.Option("--limit", metavar="SECONDS", min=0.1, callback=_number, help="Stop a test that takes longer."),
    ] = 900.0,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Use a Dask cluster: tcp://host:8786.")
    ] = None,
) -> int:
    """Run a command on many tests, on all cores or a Dask cluster, and gather one table of what comes out."""
    from twindisc_cli.commands.campaign import Means, run

    means = Means(workers=workers, limit=limit, scheduler=scheduler)
    return run(command, tests or ["configs/*.toml"], means, output)


@_command("compare", without=("force", "dry_run", "depfile", "effects", "panels", "no_figure"))
def compare(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULTS...", help="Folders of results (results/my_test), or .h5 files.", show_default=False
        ),
    ],
    output: Output,
    xlsx: Annotated[bool, typer.Option("--xlsx", help="Write the tables as one workbook too.")] = False,
) -> int:
    """Overlay the results of several tests, one figure a quantity, with the table behind each."""
    from twindisc_cli.commands.compare import run

    return run(results, xlsx, output)


@_command("report", without=("force", "dry_run", "depfile", "effects", "formats", "dpi", "over", "panels", "no_figure"))
def report(
    test: Annotated[
        Path,
        typer.Argument(
            metavar="TEST",
            help="A definition, or the folder of its results, where the report goes, too.",
            show_default=False,
        ),
    ],
    output: Output,
) -> int:
    """Gather what all commands found of a test: one HTML page, and a PDF of two pages."""
    from twindisc_cli.commands.report import run

    return run(test, output)


@app.command("effects", context_settings=_HELP)
def effects(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", show_default=False)] = None,
    source: Annotated[
        Path | None, typer.Option("--from", metavar="REVISED.toml", help="Write a law of it as an effect file.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Where the effect file goes.")
    ] = None,
    tested: Annotated[
        Path | None, typer.Option("--test", metavar="FILE.py", help="Test an effect file: is it all that it says?")
    ] = None,
    folder: Effects = None,
    trust_effects: Trust = False,
    as_json: AsJson = False,
) -> None:
    """List the catalogue of physical effects, explain or test one, or write a learnt law as one."""
    from twindisc_cli.commands import _runner

    _runner.know(folder, trusting=trust_effects)
    if tested is not None:
        raise typer.Exit(_runner.test_effect(tested, as_json))
    raise typer.Exit(
        _runner.run_effects(name, as_json) if source is None else _runner.write_effect(source, name, output)
    )


@app.command("init", context_settings=_HELP)
def init(
    test: Annotated[Path, typer.Argument(metavar="[TEST.toml]", show_default=False)] = Path("test.toml"),
    rig: Annotated[
        str, typer.Option("--rig", metavar="RIG", help="crowned, suros (two cylinders) or mtm (ball on disc).")
    ] = "crowned",
    as_json: AsJson = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
) -> None:
    """Write a commented test definition to start from."""
    from twindisc_cli.commands import _runner
    from twindisc_cli.commands.init import run

    run(test, rig=rig, force=force)
    if as_json:
        _runner.tell_json({"written": str(test)})
    else:
        terminal.say([f"written: {test}"])


@app.command("import", context_settings=_HELP)
def import_files(
    files: Annotated[list[Path], typer.Argument(metavar="RIGFILE...", help="Files of one test.", show_default=False)],
    folder: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where they go.")] = Path("imported"),
    as_json: AsJson = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the definition and the tables.")] = False,
) -> None:
    """Make tidy tables and a definition that runs from a rig's own files, and list what was guessed."""
    from twindisc_cli.commands import _runner
    from twindisc_cli.commands.import_file import run

    result = run(files, folder, force=force)
    terminal.say(result.summary, error=as_json)
    if as_json:
        _runner.tell_json(result.json)


@app.command("schema", context_settings=_HELP)
def schema() -> None:
    """Print the JSON schema of a test definition, for editors."""
    from twindisc_cli.commands.schema import run

    terminal.say_text(run())


class _Terminated(BaseException):
    """Somebody asked this process to end."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for threads in LINEAR_ALGEBRA_THREADS:
        os.environ.setdefault(threads, "1")
    os.environ["MPLBACKEND"] = "agg"
    asked: list[int] = []
    before, hook = _listen(asked), sys.unraisablehook
    sys.unraisablehook = _unraisable
    try:
        code, problems = _done(given)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook
    if asked or code in _LEFT:
        code = asked[0] if asked else code
        problems = [_LEFT[code]]
    sys.exit(_failed(given, code, problems) if problems else code)


def _listen(asked: list[int]) -> dict[int, Any]:
    """Note what a signal asks for, whatever becomes of the exception that it raises; the handlers there were before."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        asked.append(INTERRUPTED)
        raise KeyboardInterrupt

    def terminate(_number: int, _frame: FrameType | None) -> None:
        asked.append(TERMINATED)
        raise _Terminated

    try:
        return {number: signal.signal(number, do) for number, do in ((2, interrupt), (15, terminate))}
    except ValueError:  # signals reach the main thread only
        return {}


def _unraisable(lost: sys.UnraisableHookArgs) -> None:
    """A signal that came while a callback ran, out of which nothing can be raised, is sent again a little later."""
    number = {KeyboardInterrupt: signal.SIGINT, _Terminated: signal.SIGTERM}.get(lost.exc_type)
    if number is None:
        sys.__unraisablehook__(lost)
        return
    handler = signal.getsignal(number)

    def again() -> None:
        if signal.getsignal(number) is handler:
            os.kill(os.getpid(), number)

    timer = threading.Timer(_AGAIN, again)
    timer.daemon = True
    timer.start()


def _done(given: Sequence[str]) -> tuple[int, list[str]]:
    """Run the command line: the exit code, and what went wrong."""
    try:
        return int(app(given or ["--help"], prog_name="twindisc", standalone_mode=False) or 0), []
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED, []
    except _Terminated:
        return TERMINATED, []
    except BrokenPipeError:
        return 0, []
    except UsageError as error:
        return DefinitionError.exit_code, [_usage(error)]
    except TwindiscError as error:
        return error.exit_code, error.lines
    except OSError as error:  # what the system refused, wherever it did
        return OutputError.exit_code, [f"{error.filename or 'the system'}: {error.strerror or error}"]
    except SystemExit as error:  # of a file of the user's
        if (own := fault(error)) is None:
            raise
        return own.exit_code, [str(problem) for problem in own.problems]
    except MemoryError:
        return ValidityError.exit_code, ["there is not enough memory for a test of this size"]
    except Exception as error:
        if os.environ.get("TWINDISC_DEBUG"):
            traceback.print_exception(error)
        own = fault(error)
        return (1, [bug(error)]) if own is None else (own.exit_code, [str(problem) for problem in own.problems])


def _failed(given: Sequence[str], code: int, problems: Sequence[str]) -> int:
    """Tell what went wrong on stderr, and with --json on stdout as the one object there."""
    terminal.say_failure(problems)
    if "--json" in given:
        with suppress(OutputError):
            terminal.say_json({"exit_code": code, "error": list(problems)}, indent=None)
    return code


def _usage(error: Exception) -> str:
    """A mistake on the command line, in one line."""
    context = getattr(error, "ctx", None)
    what = getattr(error, "format_message", error.__str__)().rstrip(".")
    return f"{what}{'' if what.endswith('?') else '.'} See `{context.command_path if context else 'twindisc'} --help`."
