import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from definitions import TRACTION, VALID, changed, write

from twindisc_cli import __version__, plugins
from twindisc_cli.cli import app, main
from twindisc_cli.commands import _runner, close_loop, thermal
from twindisc_cli.definition import dump, load
from twindisc_cli.errors import ValidityError
from twindisc_cli.physics.half_space import DataEdgeError, NoConvergenceError
from twindisc_cli.results import Array, Axis, Dataset, Result

COMMANDS = {"friction-chart", "identify-mu", "simulate-wear", "fit-k", "thermal", "contact", "close-loop"}
COMMANDS |= {"check", "import", "init", "schema", "effects", "campaign", "paper", "compare", "report"}


def exit_code(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    assert isinstance(left.value.code, int)
    return left.value.code


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


class Stub:
    """A command that counts its runs."""

    def __init__(self, *, code: int = 0, error: BaseException | None = None, extra: str = "") -> None:
        self.runs, self.code, self.error, self.extra = 0, code, error, extra

    def run(self, test: object, *_: object, **__: object) -> Result:
        self.runs += 1
        if self.error:
            raise self.error
        axis = Axis("y", np.arange(3.0), "m", "position")
        return Result(
            command="close-loop" if self.extra else "thermal",
            summary=("it is warm",),
            json={"rise_C": np.float64(10.0), "peak_C": None, **({"revised": "revised.toml"} if self.extra else {})},
            dataset=Dataset((axis,), (Array("p", ("y",), np.zeros(3), "Pa", "pressure"),)),
            figure=None,
            exit_code=self.code,
            extra_files={"revised.toml": self.extra} if self.extra else {},
        )


@pytest.fixture
def stub(monkeypatch: pytest.MonkeyPatch) -> Iterator[Stub]:
    command = Stub()
    for module in (thermal, close_loop):
        monkeypatch.setattr(module, "run", lambda *tests, **options: command.run(*tests, **options))
    yield command


def test_every_command_of_the_contract_is_there() -> None:
    assert {command.name for command in app.registered_commands} == COMMANDS


def test_a_run_writes_and_the_next_is_up_to_date(folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, traction=TRACTION)
    assert exit_code("thermal", "small.toml") == 0
    assert "written: results/small/thermal.h5" in capsys.readouterr().out
    assert exit_code("thermal", "small.toml") == 0
    told = capsys.readouterr().out
    assert "up to date: results/small/thermal.h5" in told
    assert "it is warm" in told
    assert stub.runs == 1
    assert exit_code("thermal", "small.toml", "--force") == 0
    assert exit_code("thermal", "small.toml", "-o", "elsewhere") == 0
    assert stub.runs == 3
    assert (folder / "elsewhere/small/thermal.h5").read_bytes() == (folder / "results/small/thermal.h5").read_bytes()


def test_what_is_up_to_date_is_told_without_reading_the_test(
    folder: Path, stub: Stub, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write(folder, traction=TRACTION)
    exit_code("thermal", "small.toml")

    def unread(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(_runner, "load", unread)
    assert exit_code("thermal", "small.toml") == 0
    assert "up to date: results/small/thermal.h5" in capsys.readouterr().out


def test_a_dry_run_says_why_and_computes_nothing(folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(folder, traction=TRACTION)

    def told(*options: str) -> str:
        capsys.readouterr()
        assert exit_code("thermal", "small.toml", "--dry-run", *options) == 0
        return capsys.readouterr().out

    assert told() == "would be made: results/small/thermal.h5: is not there\n"
    assert stub.runs == 0
    exit_code("thermal", "small.toml")
    assert told() == "up to date: results/small/thermal.h5\n"
    assert json.loads(told("--json")) == {"file": "results/small/thermal.h5", "would_be_made": False, "why": None}
    (folder / "traction.csv").write_text(TRACTION.replace("0.58", "0.59"))
    assert told() == "would be made: results/small/thermal.h5: traction.csv was changed\n"
    path.write_text(path.read_text().replace("hardness_HV = 700", "hardness_HV = 701"))
    assert "says something else at material.hardness_HV; traction.csv was changed" in told()
    assert stub.runs == 1


def test_a_depfile_names_what_make_has_to_watch(folder: Path, stub: Stub) -> None:
    write(folder, traction=TRACTION)
    (folder / "Makefile").write_text("results/small/thermal.h5:\n\t@echo made\n-include deps\n")
    for _ in range(2):  # written, and up to date
        os.utime(folder / "small.toml")
        exit_code("thermal", "small.toml", "--depfile", "deps")
        make = ["make", "-s", "results/small/thermal.h5"]
        assert subprocess.run(make, capture_output=True, text=True, check=True).stdout == ""
        later = (folder / "results/small/thermal.h5").stat().st_mtime + 5.0
        os.utime(folder / "traction.csv", (later, later))
        assert subprocess.run(make, capture_output=True, text=True, check=True).stdout == "made\n"
        os.utime(folder / "traction.csv", (1.0, 1.0))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--format", "gif"], "--format knows png, pdf, svg, not gif"),
        (["--format", ""], "not nothing"),
        (["--dpi", "0"], "--dpi"),
    ],
)
def test_a_format_that_is_none_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], options: list[str], says: str
) -> None:
    write(folder)
    assert exit_code("thermal", "small.toml", *options) == 2
    assert says in capsys.readouterr().err


def test_quiet_says_nothing_and_verbose_says_why(folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder)
    exit_code("thermal", "small.toml", "-q")
    assert capsys.readouterr() == ("", "")
    exit_code("thermal", "small.toml", "-v", "--force")
    assert "thermal.h5 is made again: --force" in capsys.readouterr().err


def test_changed_data_or_definition_run_again_but_a_remark_does_not(folder: Path, stub: Stub) -> None:
    path = write(folder, traction=TRACTION)
    exit_code("thermal", path)
    path.write_text("# a remark\n" + path.read_text())
    exit_code("thermal", path)
    assert stub.runs == 1
    (folder / "traction.csv").write_text(TRACTION.replace("0.58", "0.59"))
    exit_code("thermal", path)
    assert stub.runs == 2
    path.write_text(path.read_text().replace("hardness_HV = 700", "hardness_HV = 701"))
    exit_code("thermal", path)
    assert stub.runs == 3


@pytest.mark.parametrize("code", [0, 5])
def test_json_is_one_object_and_the_same_when_up_to_date(
    folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str], code: int
) -> None:
    stub.code = code
    write(folder)
    for _ in range(2):
        assert exit_code("thermal", "small.toml", "--json") == code
        assert json.loads(capsys.readouterr().out) == {"rise_C": 10.0, "peak_C": None, "rows": []}
    assert stub.runs == 1


def test_a_revised_definition_finds_its_data_and_its_path_is_told(
    folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(folder, traction=TRACTION)
    stub.extra = dump(load(path).resolved, {"creepage_offset": {}})
    assert exit_code("close-loop", path, "-o", "out", "--json") == 0
    revised = json.loads(capsys.readouterr().out)["revised"]
    assert revised == "out/small/revised.toml"
    test = load(folder / revised).experiment
    assert test.measured.traction is not None
    assert "creepage_offset" in test.effects


def test_close_loop_fits_some_and_predicts_one(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[list[str], str | None, list[str]]] = []
    command = Stub(extra=VALID)

    def run(tests, validate, progress, *, quick, predict):  # type: ignore[no-untyped-def]
        progress("half", 0.5)
        only = [t.experiment.name for t in predict]
        seen.append(([t.experiment.name for t in tests], validate and validate.experiment.name, only))
        return command.run(tests)

    monkeypatch.setattr(close_loop, "run", run)
    for name in "abc":
        write(folder, VALID.replace("small", name), f"{name}.toml")
    assert exit_code("close-loop", "a.toml") == 0
    assert exit_code("close-loop", "a.toml", "b.toml", "--validate", "c.toml") == 0
    assert exit_code("close-loop", "a.toml", "b.toml", "c.toml") == 0
    assert exit_code("close-loop", "a.toml", "--validate", "b.toml", "--predict", "c.toml") == 0
    assert exit_code("close-loop", "a.toml", "--predict", "b.toml", "--predict", "c.toml") == 0
    assert seen == [
        (["a"], None, []), (["a", "b"], "c", []), (["a", "b", "c"], None, []),
        (["a"], "b", ["c"]), (["a"], None, ["b", "c"]),
    ]  # fmt: skip
    assert exit_code("close-loop", "a.toml", "a.toml") == 2


def test_mistakes_of_several_tests_come_in_one_go(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, changed(hardness_HV="hardness_HV = -1"), "a.toml")
    write(folder, VALID, "b.toml", traction="")
    assert exit_code("close-loop", "a.toml", "b.toml", "--validate", "c.toml") == 2
    told = capsys.readouterr().err.splitlines()
    assert [line.split(":")[0] for line in told] == ["a.toml", "traction.csv", "c.toml"]


# Exit codes


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["thermal"], "Missing argument 'TEST.toml'. See `twindisc thermal --help`."),
        (["thermal", "--forse", "small.toml"], "No such option"),
        (["termal", "small.toml"], "No such command 'termal'. Did you mean 'thermal'?"),
        (["thermal", "absent.toml"], "absent.toml: no such file; here are small.toml"),
        (["thermal", "small.toml", "more.toml"], "unexpected extra argument"),
    ],
)
def test_usage_errors_leave_with_2(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str
) -> None:
    write(folder)
    assert exit_code(*arguments) == 2
    told = capsys.readouterr()
    assert says in told.err
    assert not told.out
    assert not (folder / "results").exists()


def test_a_wrong_definition_leaves_with_2_and_wrong_data_with_3(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(folder, changed(normal_load_N="normal_load_kN = 72", hardness_HV="hardness_HV = 0"), "bad.toml")
    assert exit_code("check", "bad.toml") == 2
    told = capsys.readouterr().err.splitlines()
    assert told == [
        "bad.toml:7: rig.normal_load_kN: unknown key, did you mean normal_load_N, with the value in that unit?",
        "bad.toml:15: material.hardness_HV: must be greater than 0, not 0",
    ]
    write(folder, traction=TRACTION.replace("0.55", "nan"))
    assert exit_code("check", "small.toml") == 3
    told = capsys.readouterr().err.splitlines()
    (line,) = told
    assert line.startswith("traction.csv:3: traction ratio [1]: is nan; leave the row out where nothing was measured")
    assert 'skip = "nan"' in line
    assert not (folder / "results").exists()


@pytest.mark.parametrize("kind", [ValidityError, NoConvergenceError, DataEdgeError])
def test_no_convergence_leaves_with_4(
    folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str], kind: type[Exception]
) -> None:
    stub.error = kind("the bracket holds no root")
    write(folder)
    assert exit_code("thermal", "small.toml") == 4
    assert capsys.readouterr().err.endswith("the bracket holds no root\n")


def test_a_bug_leaves_with_1_in_one_line(
    folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    stub.error = KeyError("over\nboard")
    write(folder)
    assert exit_code("thermal", "small.toml") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("a bug in twindisc: KeyError: ")
    assert line.endswith("set TWINDISC_DEBUG=1 for the traceback")
    monkeypatch.setenv("TWINDISC_DEBUG", "1")
    assert exit_code("thermal", "small.toml") == 1
    assert "Traceback (most recent call last)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("number", "code", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
@pytest.mark.parametrize("swallowed", [False, True])
def test_a_signal_leaves_with_its_code_and_one_sentence(
    folder: Path,
    stub: Stub,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    number: signal.Signals,
    code: int,
    word: str,
    swallowed: bool,
) -> None:
    """Also where a library turns the exception into another one, as extension modules do while they are imported."""

    def interrupted(*_: object) -> Result:
        try:
            signal.raise_signal(number)
        except BaseException as error:
            if not swallowed:
                raise
            raise ImportError("numpy.core failed") from error
        raise AssertionError

    monkeypatch.setattr(stub, "run", interrupted)
    write(folder)
    before = signal.getsignal(number)
    assert exit_code("thermal", "small.toml") == code
    assert capsys.readouterr().err == f"{word}; nothing half-written is left\n"
    assert not (folder / "results").exists()
    assert signal.getsignal(number) is before


def test_memory_that_is_not_enough_leaves_with_4(folder: Path, stub: Stub) -> None:
    stub.error = MemoryError()
    write(folder)
    assert exit_code("thermal", "small.toml") == 4


def test_with_json_a_failure_is_one_object_too(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, changed(hardness_HV="hardness_HV = 0"))
    assert exit_code("check", "small.toml", "--json") == 2
    told = json.loads(capsys.readouterr().out)
    assert told["exit_code"] == 2
    assert told["error"] == ["small.toml:15: material.hardness_HV: must be greater than 0, not 0"]


def test_results_cannot_go_into_a_file(folder: Path, stub: Stub, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder)
    (folder / "results").write_text("in the way")
    assert exit_code("thermal", "small.toml") == 2
    assert "cannot be written" in capsys.readouterr().err


# init, schema


def test_init_writes_a_definition_that_loads(folder: Path) -> None:
    assert exit_code("init", "my rig (2).toml") == 0
    test = load(folder / "my rig (2).toml").experiment
    assert test.name == "my_rig_2_"
    assert len(test.history.step_creepage) == 6


@pytest.mark.parametrize(
    ("rig", "shape"),
    [
        ("crowned", (0.03, np.inf, 0.03, 0.03)),
        ("suros", (0.0235, np.inf, 0.0235, np.inf)),
        ("MTM", (np.inf, np.inf, 0.009525, 0.009525)),
    ],
)
def test_init_writes_each_rig(
    rig: str, shape: tuple[float, ...], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Radii of the discs along and across; the first commands run on it as it is, and nothing contradicts itself."""
    assert exit_code("init", "new.toml", "--rig", rig) == 0
    of = load(folder / "new.toml").experiment.rig
    radii = [(disc.rolling_radius, disc.transverse_radius) for disc in (of.disc1, of.disc2)]
    assert [*radii[0], *radii[1]] == pytest.approx(shape)
    assert exit_code("check", "new.toml", "--no-figure") == 0
    assert exit_code("friction-chart", "new.toml") == 0
    assert (folder / "results/new/friction-chart.png").is_file()


def test_an_unknown_rig_names_the_nearest(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("init", "new.toml", "--rig", "surros") == 2
    assert "did you mean suros?" in capsys.readouterr().err
    assert not (folder / "new.toml").exists()


def test_init_keeps_what_is_there(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "test.toml").write_text("precious")
    assert exit_code("init") == 2
    assert "exists already" in capsys.readouterr().err
    assert (folder / "test.toml").read_text() == "precious"
    assert exit_code("init", "--force") == 0
    assert exit_code("init", ".") == 2


@pytest.mark.parametrize(("rig", "twice"), [("crowned", 4), ("suros", 1), ("mtm", 1)])
def test_every_optional_key_of_the_template_is_valid(rig: str, twice: int, folder: Path) -> None:
    """With its remarks removed, the template breaks only the rules that forbid two ways at once."""
    exit_code("init", "t.toml", "--rig", rig)
    lines = (folder / "t.toml").read_text().splitlines()
    keys = [line[2:] if line.startswith("# ") and ("=" in line or line.startswith("# [")) else line for line in lines]
    (folder / "t.toml").write_text("\n".join(keys))
    (folder / "my_effects").mkdir()
    plugins.trust(folder / "my_effects")
    with pytest.raises(Exception, match="keep one of them") as error:
        load(folder / "t.toml")
    told = str(error.value).splitlines()
    assert len(told) == twice, told
    assert all("keep one of them" in line or "convection is given by" in line for line in told), told


def test_schema_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("schema") == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Definition"


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("--version") == 0
    assert capsys.readouterr().out == f"twindisc {__version__}\n"


# The process


def test_the_module_is_the_console_script(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "twindisc_cli", "check", "x.toml"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (2, "x.toml: no such file\n")


def test_help_imports_nothing_heavy() -> None:
    code = "import sys, twindisc_cli.cli; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "scipy", "pandas", "h5py", "matplotlib", "pydantic", "rich"} & set(loaded)


def test_a_closed_pipe_is_no_error(folder: Path) -> None:
    write(folder)
    command = f"{sys.executable} -m twindisc_cli schema | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, env={**os.environ})
    assert done.stdout.splitlines()[-1] == "0"
    assert done.stderr == ""


@pytest.mark.parametrize("command", ["contact", "check", "friction-chart"])
def test_a_patch_larger_than_the_discs_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    """E = 1 MPa under 100 kN: Hertz' ellipse of discs of 30 mm would be a fifth of a metre long."""
    soft = {"youngs_modulus_GPa": "youngs_modulus_GPa = 0.001", "normal_load_N": "normal_load_N = 1e5"}
    write(folder, changed(**soft).partition("[measured]")[0])
    assert exit_code(command, "small.toml") == 4
    (line,) = capsys.readouterr().err.splitlines()
    assert "times as large as the discs' radii" in line


def test_without_a_figure_the_numbers_are_the_same(folder: Path) -> None:
    """The run key knows that there is none: asked for again with its figure, the result is made again."""
    path = write(folder, traction=TRACTION)
    assert exit_code("check", path, "-o", "out") == exit_code("check", path, "-o", "bare", "--no-figure") == 0
    assert {p.name for p in (folder / "bare/small").iterdir()} == {"check.h5"}
    with h5py.File(folder / "out/small/check.h5") as one, h5py.File(folder / "bare/small/check.h5") as other:
        assert one["outcome"].attrs["json"] == other["outcome"].attrs["json"]
    assert exit_code("check", path, "-o", "bare") == 0
    assert {p.name for p in (folder / "bare/small").iterdir()} == {"check.h5", "check.png"}


def test_a_signal_that_a_callback_swallows_is_sent_again(tmp_path: Path) -> None:
    """Python raises nothing out of the callback of a collected object: it prints a traceback and goes on."""
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / "mine.py").write_text(
        "import os, signal, time, weakref\n"
        "class Thing: pass\n"
        "thing = Thing()\n"
        "kept = weakref.ref(thing, lambda _: os.kill(os.getpid(), signal.SIGTERM))\n"
        "del thing\n"
        "time.sleep(5.0)\n"
    )
    path = write(tmp_path, VALID + '\n[loop]\neffects = "effects"\n')
    command = [sys.executable, "-m", "twindisc_cli", "check", str(path), "--trust-effects"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 143
    assert "Traceback" not in done.stderr and "terminated" in done.stderr
