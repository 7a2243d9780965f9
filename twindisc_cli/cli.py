"""The command line: twindisc COMMAND TEST.toml. Nothing heavy is imported before a command is called."""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, cast

import typer

from twindisc_cli import __version__
from twindisc_cli.errors import DefinitionError, TwindiscError, bug

INTERRUPTED = 130
LINEAR_ALGEBRA_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""The matrices here are small: more threads would only wait for each other."""
UsageError = cast(type[Exception], typer.BadParameter.__bases__[0])
"""What typer raises for every mistake on the command line; it does not export it by name."""

app = typer.Typer(
    name="twindisc",
    help="Friction, wear, temperature and missing physics of twin-disc tests.",
    rich_markup_mode=None,
    add_completion=False,
    pretty_exceptions_enable=False,
)

TestFile = Annotated[Path, typer.Argument(metavar="TEST.toml", help="The test definition.", show_default=False)]
Folder = Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where results go.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print exactly one JSON object on stdout.")]
Force = Annotated[bool, typer.Option("--force", help="Run even where the result is up to date.")]
RESULTS = Path("results")


def _run(command: str, test: Path, output: Path, as_json: bool, force: bool, **options: float | None) -> None:
    from twindisc_cli.commands import _runner

    given = {name: value for name, value in options.items() if value is not None}
    raise typer.Exit(_runner.run_command(command, test, _runner.Output(output, as_json, force), **given))


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"twindisc {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command("friction-chart")
def friction_chart(test: TestFile, output: Folder = RESULTS, as_json: AsJson = False, force: Force = False) -> None:
    """Apparent friction over creepage for a family of mu, the 98 % line, and the measured points."""
    _run("friction-chart", test, output, as_json, force)


@app.command("identify-mu")
def identify_mu(test: TestFile, output: Folder = RESULTS, as_json: AsJson = False, force: Force = False) -> None:
    """The coefficient of friction behind each measured T/N, with its interval."""
    _run("identify-mu", test, output, as_json, force)


@app.command("simulate-wear")
def simulate_wear(test: TestFile, output: Folder = RESULTS, as_json: AsJson = False, force: Force = False) -> None:
    """Profile, contact patch and dissipated energy after each iteration of the history."""
    _run("simulate-wear", test, output, as_json, force)


@app.command("fit-k")
def fit_k(test: TestFile, output: Folder = RESULTS, as_json: AsJson = False, force: Force = False) -> None:
    """Archard's wear coefficient from the measured profile, by bisection and by least squares."""
    _run("fit-k", test, output, as_json, force)


@app.command("thermal")
def thermal(test: TestFile, output: Folder = RESULTS, as_json: AsJson = False, force: Force = False) -> None:
    """Temperature of the disc over the test, and the flash temperature of the contact."""
    _run("thermal", test, output, as_json, force)


@app.command("contact")
def contact(
    test: TestFile,
    step: Annotated[
        int | None, typer.Option("--step", metavar="N", help="Step of the test. [default: most in partial slip]")
    ] = None,
    creepage: Annotated[
        float | None, typer.Option("--creepage", metavar="PERCENT", help="Another creepage: an illustrative case.")
    ] = None,
    mu: Annotated[
        float | None, typer.Option("--mu", metavar="MU", min=1e-4, help="Another mu: an illustrative case.")
    ] = None,
    output: Folder = RESULTS,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Pressure, traction and slip over the patch: exact theory beside FASTSIM."""
    _run("contact", test, output, as_json, force, step=step, creepage=creepage, mu=mu)


@app.command("check")
def check(test: TestFile, output: Folder = RESULTS, as_json: AsJson = False, force: Force = False) -> None:
    """The definition, the data, and whether geometry, energy and heat agree with each other."""
    _run("check", test, output, as_json, force)


@app.command("close-loop")
def close_loop(
    tests: Annotated[list[Path], typer.Argument(metavar="TEST.toml [MORE.toml ...]", show_default=False)],
    validate: Annotated[
        Path | None, typer.Option("--validate", metavar="OTHER.toml", help="A test that is only predicted.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="No resampling, and so no probabilities.")] = False,
    output: Folder = RESULTS,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Find what the model lacks, add it, and report the error before and after on held-out data."""
    from twindisc_cli.commands import _runner

    raise typer.Exit(_runner.run_close_loop(tests, validate, _runner.Output(output, as_json, force), quick=quick))


@app.command("campaign")
def campaign(
    command: Annotated[str, typer.Argument(metavar="COMMAND", help="What is run on every test.", show_default=False)],
    tests: Annotated[
        list[str] | None,
        typer.Argument(metavar="[TESTS ...]", help="Definitions, globs, campaign files. [default: configs/*.toml]"),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Processes. [default: all cores]")
    ] = None,
    limit: Annotated[
        float, typer.Option("--limit", metavar="SECONDS", min=0.1, help="Stop a test that takes longer.")
    ] = 900.0,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Use a Dask cluster: tcp://host:8786.")
    ] = None,
    output: Folder = RESULTS,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Run a command on many tests, on all cores or a Dask cluster, and gather one table of what comes out."""
    from twindisc_cli.commands._runner import Output
    from twindisc_cli.commands.campaign import Means, run

    means = Means(workers=workers, limit=limit, scheduler=scheduler)
    raise typer.Exit(run(command, tests or ["configs/*.toml"], means, Output(output, as_json, force)))


@app.command("effects")
def effects(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", show_default=False)] = None,
    source: Annotated[
        Path | None, typer.Option("--from", metavar="REVISED.toml", help="Write a law of it as an effect file.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Where the effect file goes.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the catalogue of physical effects, explain one, or write a learnt law as one."""
    from twindisc_cli.commands import _runner

    raise typer.Exit(
        _runner.run_effects(name, as_json) if source is None else _runner.write_effect(source, name, output)
    )


@app.command("init")
def init(
    test: Annotated[Path, typer.Argument(metavar="[TEST.toml]", show_default=False)] = Path("test.toml"),
    as_json: AsJson = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
) -> None:
    """Write a commented test definition to start from."""
    from twindisc_cli.commands import _runner
    from twindisc_cli.commands.init import run

    run(test, force=force)
    if as_json:
        _runner.tell_json({"written": str(test)})
    else:
        typer.echo(f"written: {test}")


@app.command("schema")
def schema() -> None:
    """Print the JSON schema of a test definition, for editors."""
    from twindisc_cli.commands.schema import run

    typer.echo(run(), nl=False)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for threads in LINEAR_ALGEBRA_THREADS:
        os.environ.setdefault(threads, "1")
    try:
        code = app(given or ["--help"], prog_name="twindisc", standalone_mode=False) or 0
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except (KeyboardInterrupt, typer.Abort):
        code = _failed(given, INTERRUPTED, ["interrupted; nothing half-written is left"])
    except UsageError as error:
        code = _failed(given, DefinitionError.exit_code, [_usage(error)])
    except TwindiscError as error:
        code = _failed(given, error.exit_code, [str(problem) for problem in error.problems])
    except Exception as error:
        if os.environ.get("TWINDISC_DEBUG"):
            traceback.print_exception(error)
        code = _failed(given, 1, [bug(error)])
    sys.exit(code)


def _failed(given: Sequence[str], code: int, problems: Sequence[str]) -> int:
    """Tell what went wrong on stderr, and with --json on stdout as the one object there."""
    sys.stderr.write("".join(f"{problem}\n" for problem in problems))
    if "--json" in given:
        sys.stdout.write(json.dumps({"exit_code": code, "error": list(problems)}, ensure_ascii=False) + "\n")
    return code


def _usage(error: Exception) -> str:
    """A mistake on the command line, in one line."""
    context = getattr(error, "ctx", None)
    what = getattr(error, "format_message", error.__str__)().rstrip(".")
    return f"{what}{'' if what.endswith('?') else '.'} See `{context.command_path if context else 'twindisc'} --help`."
