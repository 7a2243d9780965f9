"""Effects of a user's own: a folder beside the data, no fork of the program."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from definitions import TRACTION, VALID, line_of, write

from twindisc_cli import effects, plugins
from twindisc_cli.cli import main
from twindisc_cli.commands import effect_test
from twindisc_cli.definition import dump, load, relocate
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import DefinitionError
from twindisc_cli.loop import effect_checks

EXAMPLE = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8").split("```python\n")[1]
EXAMPLE = EXAMPLE.partition("```")[0]


def exit_code(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    assert isinstance(left.value.code, int)
    return left.value.code


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The working folder, with `mine/energy_hardening.py`; what it adds to the catalogue is forgotten afterwards."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/energy_hardening.py").write_text(EXAMPLE)
    yield tmp_path
    effects.forget_folders()
    plugins.forget_trust()


DECLARED = "\n[effects.energy_hardening]\ngrowth = 0.5\n"


def test_a_definition_names_its_folder(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, VALID + DECLARED, traction=TRACTION)
    assert exit_code("check", "small.toml") == 2
    assert "unknown key" in capsys.readouterr().err
    path = write(folder, VALID + DECLARED + '[loop]\neffects = "mine"\n', traction=TRACTION)
    plugins.trust(folder / "mine")
    assert load(path).experiment.effects == {"energy_hardening": {"growth": 0.5, "energy_kJ": 3.0}}
    assert exit_code("check", "small.toml", "--effects", "mine") == 0


STRANGER = "\nfrom pathlib import Path\nPath('ran').touch()\n"


def test_a_definition_is_no_program(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Python files that only a definition names are run by no command, until the command line says so."""
    (folder / "mine/energy_hardening.py").write_text(EXAMPLE + STRANGER)
    write(folder, VALID + '[loop]\neffects = "mine"\n', traction=TRACTION)
    for command in ("check", "identify-mu", "close-loop", "effects --from", "campaign check", "paper small.toml"):
        assert exit_code(*command.split(), "small.toml") == 2, command
        assert not (folder / "ran").exists(), command
    assert exit_code("check", "small.toml") == 2
    assert "loop.effects: the Python files in mine would be run: --trust" in capsys.readouterr().err
    (folder / "other").mkdir()
    assert exit_code("check", "small.toml", "--effects", "other") == 2
    assert not (folder / "ran").exists()
    assert exit_code("check", "small.toml", "--trust-effects") == 0
    assert (folder / "ran").exists()
    assert exit_code("check", "small.toml", "--force") == 2


@pytest.mark.parametrize(
    ("where", "what", "says"),
    [
        ("import", "import sys; sys.exit(0)", "leaves the program by sys.exit"),
        ("import", "raise OSError('no')", "OSError: no"),
        ("apply", "import sys; sys.exit(0)", "leaves the program by sys.exit"),
        ("apply", "s = 1 / 0", "ZeroDivisionError: division by zero"),
        ("apply", "s = s.replace(nu=0.3)", "TypeError: a state has no nu"),
    ],
)
def test_a_file_that_fails_or_leaves_is_named(
    folder: Path, capsys: pytest.CaptureFixture[str], where: str, what: str, says: str
) -> None:
    place = "from __future__ import annotations\n" if where == "import" else "    return s.replace(mu"
    text = EXAMPLE.replace(place, f"{place}{what}\n" if where == "import" else f"    {what}\n{place}", 1)
    (folder / "mine/energy_hardening.py").write_text(text)
    path = write(folder, VALID + '[loop]\neffects = "mine"\n' + DECLARED, traction=TRACTION)
    says = f"energy_hardening.py:{line_of(text, what)}: {says}"
    assert exit_code("identify-mu", path, "--trust-effects") == 2
    assert says in capsys.readouterr().err
    assert exit_code("campaign", "identify-mu", path, "--trust-effects", "--workers", "1") == 2
    assert says in capsys.readouterr().err


def test_what_a_file_prints_is_told_with_its_name(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The standard output holds the one object of --json, whatever is printed."""
    text = EXAMPLE.replace("    return s.replace(mu", "    print('acting', 2)\n    return s.replace(mu", 1)
    (folder / "mine/energy_hardening.py").write_text(text + "\nprint('read')\n")
    write(folder, VALID + DECLARED, traction=TRACTION)
    assert exit_code("identify-mu", "small.toml", "--effects", "mine", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["steps"]
    assert "mine/energy_hardening.py prints: read" in err
    assert "mine/energy_hardening.py prints: acting 2" in err


def test_a_changed_effect_file_makes_the_result_again(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, VALID + DECLARED)
    for state in ("written", "up to date"):
        assert exit_code("check", "small.toml", "--effects", "mine") == 0
        assert f"{state}: results/small/check.h5" in capsys.readouterr().out
    (folder / "mine/energy_hardening.py").write_text(f"{EXAMPLE}\n# another\n")
    exit_code("check", "small.toml", "--effects", "mine", "--dry-run")
    assert "would be made: results/small/check.h5: effects is another" in capsys.readouterr().out


def test_a_revised_definition_finds_the_effects_of_the_command_line(folder: Path) -> None:
    test = load(write(folder))
    target = folder / "results/small"
    target.mkdir(parents=True)
    text = relocate(dump(test.resolved), source=folder, target=target, effects=Path("mine"))
    (target / "revised.toml").write_text(text + DECLARED)
    plugins.trust(folder / "mine")
    assert "energy_hardening" in load(target / "revised.toml").experiment.effects


def test_what_one_test_brought_is_forgotten_for_the_next(folder: Path) -> None:
    effects.add_folder(folder / "mine")
    assert "energy_hardening" in catalogue()
    effects.forget_folders()
    assert "energy_hardening" not in catalogue()


@pytest.mark.parametrize(
    ("file", "text", "says"),
    [
        ("falling_friction.py", EXAMPLE, "falling_friction.py: there is an effect called falling_friction already"),
        ("broken.py", "1 +", "broken.py:1: SyntaxError"),
        ("empty.py", "", "empty.py: declares no effect"),
        ("wrong.py", "\nEFFECT = 1 / 0\n", "wrong.py:2: ZeroDivisionError"),
        ("idle.py", EXAMPLE.replace("1e3 * energy_kJ", "3e3"), "idle.py: declares energy_kJ, which its function never"),
    ],
)
def test_a_file_that_is_no_effect_is_told(folder: Path, file: str, text: str, says: str) -> None:
    (folder / "mine" / file).write_text(text)
    effects.add_folder(folder / "mine")
    with pytest.raises(DefinitionError) as error:
        catalogue()
    assert says in str(error.value)


def test_a_folder_that_is_not_there_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, VALID + '\n[loop]\neffects = "none"\n')
    assert exit_code("check", "small.toml") == 2
    assert "loop.effects: none is not a folder of effect files" in capsys.readouterr().err
    assert exit_code("check", "small.toml", "--effects", "none") == 2


def test_what_lies_beside_a_file_that_is_tested_is_not_run(folder: Path) -> None:
    (folder / "mine/a_plot.py").write_text(STRANGER)
    effect_test.joined(folder / "mine/energy_hardening.py")
    assert "energy_hardening" in catalogue()
    assert not (folder / "ran").exists()


def failed(name: str, text: str, folder: Path, part: str) -> list[str]:
    """The claims that do not hold for a file in one part of the test."""
    (folder / f"{name}.py").write_text(text)
    effect = effect_test.joined(folder / f"{name}.py")
    return [check.what for check in getattr(effect_checks, part)(name, effect) if not check.ok]


@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
@pytest.mark.parametrize(
    ("part", "old", "new", "fails"),
    [
        ("declared", "Valid for:", "For:", "it gives formula, what is left behind, validity"),
        ("declared", "Journal 1 (2000) 1-10", "a paper", "the source has a year, a volume or a section"),
        ("declared", 'start=0.2, lower=-0.9', 'start=0.0, lower=-0.9', "growth: start lies in the bounds and is not"),
        ("declared", "growth: Floats, energy_kJ", "energy_kJ: Floats, growth", "apply takes each parameter as a"),
        ("acting", 'over="energy"', 'seen_in=frozenset({"profile"})', "on, it changes the channels of seen_in and no"),
        ("acting", "1e3 * energy_kJ", "3e3 + 0.0 * energy_kJ", "energy_kJ does something"),
        ("sound", "growth * -np.expm1", "growth / (growth - 2.0) * -np.expm1", "finite anywhere in its bounds"),
    ],
)  # fmt: skip
def test_a_claim_that_does_not_hold_is_found(folder: Path, part: str, old: str, new: str, fails: str) -> None:
    assert old in EXAMPLE
    (told,) = failed("energy_softening", EXAMPLE.replace(old, new), folder, part)
    assert told.startswith(fails)


def test_an_effect_file_is_tested_as_a_whole(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The loop finds it on data made with it, with the parameters that they were made with."""
    assert exit_code("effects", "--test", "mine/energy_hardening.py", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["effect"] == "energy_hardening"
    assert all(check["ok"] for check in told["checks"])
    assert any("made with 0.2" in check["seen"] for check in told["checks"])
