"""Odd surroundings: files that are none, names nobody would give, streams that are gone. Each ends in the right exit
code and a sentence of a few lines that names the user's own file; never in a traceback, a hang or a broken file."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from definitions import TRACTION, VALID, changed, write

from twindisc_cli.cli import main
from twindisc_cli.commands import check, close_loop
from twindisc_cli.definition import dump, load
from twindisc_cli.results import Result

PROFILE = "y [mm],height [um]\n" + "".join(f"{i / 10 - 2:g},{-max(0.0, 5 - (i - 20) ** 2 / 10):g}\n" for i in range(41))


class Hanging(BaseException):
    """No answer within half a minute."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The working folder; a test that hangs is ended after 20 s."""

    def hangs(*_: object) -> None:
        raise Hanging

    monkeypatch.chdir(tmp_path)
    before = signal.signal(signal.SIGALRM, hangs)
    signal.alarm(30)
    yield tmp_path
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def left_with(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    assert isinstance(left.value.code, int)
    return left.value.code


def told_well(text: str, *, lines: int = 3) -> None:
    """A failure in a few lines, without a traceback, without control characters."""
    assert "a bug in twindisc" not in text
    assert "Traceback" not in text
    assert 1 <= len(text.splitlines()) <= lines, text
    assert all(character.isprintable() or character == "\n" for character in text)
    assert all(len(line) <= 400 for line in text.splitlines()), text


# What a path may lead to


def _fifo(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(path.name)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(3 * 2**30)


PLACES: dict[str, Callable[[Path], None]] = {
    "a pipe": _fifo,
    "a socket": _socket,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a terminal": lambda path: path.symlink_to("/dev/tty"),
    "a folder": lambda path: path.mkdir(),
    "a dangling link": lambda path: path.symlink_to("nowhere"),
    "a link to itself": lambda path: path.symlink_to(path.name),
    "a link to its folder": lambda path: path.symlink_to("."),
    "a file as a folder": lambda path: path.symlink_to("/etc/passwd/x"),
    "nothing": lambda path: None,
    "an empty file": lambda path: path.touch(),
    "a file without end": _sparse,
    "a program": lambda path: path.symlink_to(sys.executable),
    "NULs": lambda path: path.write_bytes(bytes(3000)) and None,
    "noise": lambda path: path.write_bytes(bytes(range(256)) * 20) and None,
    "UTF-32": lambda path: path.write_bytes(VALID.encode("utf-32")) and None,
}


@pytest.mark.parametrize("what", PLACES)
def test_a_definition_that_is_none(folder: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    PLACES[what](folder / "odd.toml")
    assert left_with("check", "odd.toml") == 2
    told = capsys.readouterr().err
    told_well(told)
    assert told.startswith("odd.toml:")


@pytest.mark.parametrize("channel", ["traction", "profile", "temperature"])
@pytest.mark.parametrize("what", PLACES)
def test_a_measured_file_that_is_none(
    folder: Path, capsys: pytest.CaptureFixture[str], what: str, channel: str
) -> None:
    PLACES[what](folder / "odd.csv")
    write(folder, VALID + f'\n[measured]\n{channel} = "odd.csv"\n')
    assert left_with("check", "small.toml") == 3
    told = capsys.readouterr().err
    told_well(told)
    assert told.startswith("odd.csv")


LONG = "x" * 300
NAMES = {
    "long": f'"{LONG}.csv"',
    "a NUL": r'"a\u0000b.csv"',
    "control characters": r'"a\u001b[31mb.csv"',
    "a line break": r'"a\nb.csv"',
    "deep": f'"{"a/" * 3000}b.csv"',
    "up": f'"{"../" * 300}b.csv"',
    "a device": '"/dev/null"',
    "the folder": '"."',
    "a home": '"~/none.csv"',
    "a URL": '"https://example.org/none.csv"',
    "a pattern": '"*.csv"',
    "right to left": r'"\u202eabc.csv"',
}


@pytest.mark.parametrize("what", NAMES)
def test_a_measured_file_by_an_odd_name(folder: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    write(folder, VALID + f"\n[measured]\ntraction = {NAMES[what]}\n")
    assert left_with("check", "small.toml") in (2, 3)
    told = capsys.readouterr().err
    assert "a bug in twindisc" not in told
    assert len(told.splitlines()) == 1
    assert told.rstrip("\n").isprintable()


# What a definition may hold

DIGITS = "9" * 5000
NUMBERS = [
    DIGITS,
    f"-{DIGITS}",
    "1e400",
    "-1e400",
    "nan",
    "1e-400",
    "0x" + "f" * 900,
    "1979-05-27T07:32:00Z",
    "00:00:00",
]
NUMBERS += ["9" * 400, '"72"', "[72]", "{ a = 1 }", "true", "[[[[1]]]]", r'"\u001b[2J"', '""']


@pytest.mark.parametrize("value", NUMBERS, ids=lambda value: value[:20])
@pytest.mark.parametrize("key", ["normal_load_N", "hardness_HV", "revolutions_per_iteration", "friction_coefficient"])
def test_a_value_that_is_no_number(folder: Path, capsys: pytest.CaptureFixture[str], key: str, value: str) -> None:
    write(folder, changed(**{key: f"{key} = {value}"}))
    assert left_with("check", "small.toml") == 2
    told_well(capsys.readouterr().err)


TEXTS = {
    "lists in lists": "a = " + "[" * 3000 + "]" * 3000,
    "tables in tables": "a = " + "{a = " * 3000 + "1" + "}" * 3000,
    "lists without end": "a = " + "[" * 3000,
    "a dotted key": ".".join("a" * 3000) + " = 1",
    "a dotted table": "[" + ".".join("a" * 3000) + "]",
    "a key of 100,000 letters": "a" * 100_000 + " = 1",
    "a line of 1,000,000 letters": 'a = "' + "b" * 1_000_000 + '"',
    "10,000 unknown keys": "\n".join(f"a{i} = {i}" for i in range(10_000)),
    "10,000 steps": "[history]\nsteps = [" + "{ creepage_percent = -200 }," * 10_000 + "]",
    "10,000 laws": "\n".join(f'[laws.a{i}]\nquantity = "x"' for i in range(2_000)),
    "an odd key": '"\\u001b[2J\\u202e" = 1',
    "a table that is a value": "rig = 1",
    "a list that is a value": "history = { steps = 1 }",
    "tables in a list": "[[rig]]\n[[rig]]",
    "a quote that is not closed": 'a = """',
    "a carriage return": "a = 1\rb = 2",
    "a vertical tab": "a\x0b = 1",
}


@pytest.mark.parametrize("what", TEXTS)
def test_a_definition_that_holds_odd_things(folder: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    (folder / "odd.toml").write_text(f"{TEXTS[what]}\n")
    assert left_with("check", "odd.toml") == 2
    told_well(capsys.readouterr().err, lines=41)


CELLS = [
    "9" * 5000,
    "1e400",
    "-1e400",
    "1e-400",
    "0x10",
    "١٢",
    "1_0",
    "１",
    "−1",
    "1e",
    "--1",
    '"1',
    "=1+1",
    "\x00",
    "½",
]


@pytest.mark.parametrize("cell", CELLS, ids=lambda cell: repr(cell)[:12])
@pytest.mark.parametrize("channel", ["traction", "profile"])
def test_a_cell_that_is_no_number(folder: Path, capsys: pytest.CaptureFixture[str], channel: str, cell: str) -> None:
    text = TRACTION.replace("0.55", cell) if channel == "traction" else PROFILE.replace("-5\n", f"{cell}\n")
    write(folder, **{channel: text})
    code = left_with("check", "small.toml")
    told = capsys.readouterr().err
    assert code in (0, 3, 5), told
    if code == 3:
        told_well(told, lines=4)


ODD_TABLES = {
    "heights that are all gaps": "y [mm],height [um]\n" + "".join(f"{i},\n" for i in range(20)),
    "a line that ends inside": "y [mm],height [um]\n0.1,1\r2\n0.2,2\n" + "0.3,\r\n" * 3,
    "line ends of all kinds": PROFILE.replace("\n", "\r", 7).replace("\n", "\r\n", 9),
}


@pytest.mark.parametrize("what", ODD_TABLES)
def test_a_table_nobody_would_write(folder: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    write(folder, profile="")
    (folder / "profile.csv").write_bytes(ODD_TABLES[what].encode())
    assert left_with("check", "small.toml") in (0, 3, 5)
    assert "a bug in twindisc" not in capsys.readouterr().err


# Names of folders, and what is written into them

FOLDERS = ["a b", "a'b", 'a"b', "a\\b", "a\nb", "a\tb", "a#b", "a$b", "a=b", "a%b", "a[b]", "a{b}", "a*b", "a?b", "-a"]
FOLDERS += [
    "~",
    "...",
    "a.",
    " a",
    "a ",
    "å",
    "日本",
    "😀",
    "\x1b[31m",
    "\x7f",
    "\u202e",
    "a\\u0000",
    "a\\",
    '"""',
    "'''",
]
FOLDERS += ["a\rb", "a,b", "a;b", "a&b", "a|b", "a`b", "$(a)", "x" * 200, "NUL", "con", "e\u0301", "\ufeff"]


def written_back(tests, *_, **__) -> Result:  # type: ignore[no-untyped-def]
    """close-loop, which writes back the definition that it was given."""
    found = check.run(tests[0])
    return Result(
        command="close-loop",
        summary=found.summary,
        json={"revised": "revised.toml"},
        dataset=found.dataset,
        figure=None,
        extra_files={"revised.toml": f"# remark\n{dump(tests[0].resolved)}"},
    )


@pytest.mark.parametrize("name", FOLDERS, ids=repr)
def test_what_is_written_beside_an_odd_name_finds_its_data(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (folder / name).mkdir()
    write(folder / name, traction=TRACTION)
    monkeypatch.setattr(close_loop, "run", written_back)
    assert left_with("close-loop", f"./{name}/small.toml", "-o", f"./out/{name}", "--json") == 0
    told = capsys.readouterr()
    revised = Path(json.loads(told.out)["revised"])
    assert load(revised).inputs.keys() == {f"../../../{name}/traction.csv"}
    assert revised.read_text().startswith("# remark\n")
    assert all(line.isprintable() for line in told.err.splitlines())


def test_a_name_that_is_no_text_ends_in_a_sentence(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bytes that are no UTF-8 are a file's name all the same; a definition cannot hold them."""
    odd = Path(os.fsdecode(b"a\xff"))
    (folder / odd).mkdir()
    write(folder / odd, traction=TRACTION)
    assert left_with("check", odd / "small.toml") == 0
    assert "up to date" not in capsys.readouterr().out
    monkeypatch.setattr(close_loop, "run", written_back)
    assert left_with("close-loop", odd / "small.toml") == 2
    told_well(capsys.readouterr().err)


@pytest.mark.parametrize("linked", ["definition", "output", "both"])
def test_links_in_the_path_lead_to_the_same_data(folder: Path, monkeypatch: pytest.MonkeyPatch, linked: str) -> None:
    (folder / "deep/er/real").mkdir(parents=True)
    (folder / "far/away/out").mkdir(parents=True)
    write(folder / "deep/er/real", VALID + '\n[measured]\ntraction = "../t.csv"\n')
    (folder / "deep/er/t.csv").write_text(TRACTION)
    (folder / "here").symlink_to("deep/er/real")
    (folder / "out").symlink_to("far/away/out")
    monkeypatch.setattr(close_loop, "run", written_back)
    test = "here/small.toml" if linked != "output" else "deep/er/real/small.toml"
    output = "out" if linked != "definition" else "results"
    assert left_with("close-loop", test, "-o", output) == 0
    assert load(folder / output / "small/revised.toml").experiment.measured.traction is not None


OUTPUTS: dict[str, Callable[[Path], object]] = {
    "a file": lambda path: path.touch(),
    "a pipe": os.mkfifo,
    "a dangling link": lambda path: path.symlink_to("nowhere/at/all"),
    "a link to itself": lambda path: path.symlink_to(path.name),
    "a device": lambda path: path.symlink_to("/dev/full"),
    "the system's": lambda path: path.symlink_to("/proc"),
    "a result that is a folder": lambda path: (path / "small/check.h5").mkdir(parents=True),
    "a figure that is a folder": lambda path: (path / "small/check.png").mkdir(parents=True),
}


@pytest.mark.parametrize("what", OUTPUTS)
def test_a_place_for_results_that_is_none(folder: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    write(folder)
    OUTPUTS[what](folder / "out")
    assert left_with("check", "small.toml", "-o", "out") == 2
    told = capsys.readouterr().err
    told_well(told)
    assert "cannot be written" in told


@pytest.mark.parametrize("length", [250, 300, 5000])
def test_a_name_too_long_for_a_file_is_told(folder: Path, capsys: pytest.CaptureFixture[str], length: int) -> None:
    write(folder, VALID.replace('"small"', f'"{"n" * length}"'))
    code = left_with("check", "small.toml")
    assert code == (0 if length == 250 else 2)
    if code:
        told_well(capsys.readouterr().err)


ARGUMENTS = [["check", ""], ["check", "."], ["check", "-"], ["check", "--", "--json"], ["check", LONG], ["", "x.toml"]]
ARGUMENTS += [
    ["check", "\x1b[2J"],
    ["check", "a\nb"],
    ["check", os.fsdecode(b"\xff")],
    ["ch\u202eeck", "x"],
    ["check", "x" * 99_999],
]
ARGUMENTS += [
    ["contact", "small.toml", "--mu", "nan"],
    ["contact", "small.toml", "--mu", "inf"],
    ["campaign", "check", "?"],
]
ARGUMENTS += [["contact", "small.toml", "--creepage", "1e400"], ["contact", "small.toml", "--creepage", "nan"]]
ARGUMENTS += [["contact", "small.toml", "--step", "9" * 5000], ["contact", "small.toml", "--step", "-1"]]
ARGUMENTS += [["init", ""]]
ARGUMENTS += [["effects", "\x1b[2J"], ["effects", ""], ["init", "/dev/full/x"], ["init", LONG], ["check", "\udcff"]]
ARGUMENTS += [
    ["campaign", "check", "x" * 99_999],
    ["campaign", "check", ""],
    ["campaign", "", ""],
    ["campaign", "check", "../../.."],
]


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=lambda a: repr(" ".join(a))[:40])
def test_a_command_line_nobody_would_type(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    write(folder)
    assert left_with(*arguments) in (2, 4)
    told_well(capsys.readouterr().err, lines=6)


# The process: its streams and its environment

SMALL = f"{sys.executable} -m twindisc_cli check small.toml -o out"
BARE = f"{SMALL} --no-figure"
STREAMS = {
    "stdout is closed": (f"{BARE} >&-", 0),
    "stderr is closed": (f"{BARE} 2>&-", 0),
    "all are closed": (f"{BARE} <&- >&- 2>&-", 0),
    "all are closed in a failure": (f"{BARE} absent.toml --json <&- >&- 2>&-", 2),
    "stdout is full": (f"{BARE} > /dev/full", 2),
    "stderr is full": (f"{BARE} --json 2> /dev/full > told", 0),
    "stderr is full in a failure": (f"{BARE} absent.toml 2> /dev/full", 2),
    "the reader left": (f"{BARE} --json | true; exit ${{PIPESTATUS[0]}}", 0),
    "the reader of a failure left": (f"{BARE} absent.toml --json 2>&1 | true; exit ${{PIPESTATUS[0]}}", 2),
    "the reader of a finding left": (f"{BARE} hot.toml 2>&1 | true; exit ${{PIPESTATUS[0]}}", 2),
    "ASCII only": (f"PYTHONUTF8=0 PYTHONIOENCODING=ascii {BARE}", 0),
    "Latin-1": (f"PYTHONIOENCODING=latin-1 {BARE} --json > told", 0),
    "UTF-16": (f"PYTHONIOENCODING=utf-16 {BARE}", 0),
    "the C locale": (f"LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0 {SMALL}", 0),
    "no environment": (f"env -i {SMALL}", 0),
    "no home": (f"HOME=/nowhere XDG_CACHE_HOME=/nowhere XDG_CONFIG_HOME=/nowhere {SMALL}", 0),
    "no place for temporary files": (f"TMPDIR=/nowhere HOME=/nowhere {SMALL}", 0),
    "a backend that is none": (f"MPLBACKEND=none {SMALL}", 0),
    "a style of the user's": (f"MATPLOTLIBRC=$PWD/matplotlibrc {SMALL}", 0),
    "warnings are errors": (f"PYTHONWARNINGS=error,ignore::DeprecationWarning {SMALL}", 0),
    "threads that are no number": (f"OMP_NUM_THREADS=many {BARE}", 0),
    "a terminal one letter wide": (f"COLUMNS=1 LINES=1 TERM=dumb {BARE}", 0),
    "no rights for the files made": (f"umask 777; {SMALL}", 0),
    "the folder is gone": (f'mkdir gone && cd gone && rmdir "$PWD" && {BARE}', 2),
    "files may not grow": (f"ulimit -f 8; {SMALL}", 2),
    "few files may be open": (f"ulimit -n 16; {SMALL}", 0),
    "hang-ups are ignored": (f"nohup {BARE}", 0),
}


@pytest.mark.parametrize("what", STREAMS)
def test_a_process_in_odd_surroundings(folder: Path, what: str) -> None:
    """`hot.toml` is in no folder: naming it beside small.toml is a mistake on the command line."""
    write(folder, VALID.replace('"small"', '"small"\ndescription = "µ 日本"'), traction=TRACTION)
    (folder / "matplotlibrc").write_text("text.usetex: True\nfont.family: none\nsavefig.bbox: tight\n")
    command, code = STREAMS[what]
    done = subprocess.run(["bash", "-c", command], capture_output=True, check=False, timeout=60)
    told = (done.stdout + done.stderr).decode("latin-1")
    assert done.returncode == code, told
    assert "Traceback" not in told
    assert "Exception ignored" not in told
    if (folder / "told").exists():
        assert json.loads((folder / "told").read_text(encoding="latin-1" if what == "Latin-1" else "utf-8"))
    if code == 0:
        made = {"check.h5"} if BARE in command else {"check.h5", "check.png"}
        assert {p.name for p in (folder / "out/small").iterdir()} == made
