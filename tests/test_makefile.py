"""`make run`: a new definition is picked up, nothing is done twice, what was deleted is made again."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MEASURED = ("ambient", "cryogenic")
PROGRAM = """#!/bin/sh
# Stands for the program: notes what it was asked, and makes the files of every definition named.
echo "$@" >> asked
if [ "$1" = paper ]; then
  mkdir -p results/paper
  for file in paper.h5 before_and_after.png fig02.png fig04.png fig05.png fig06.png fig07.png fig08.png fig09.png \\
    fig11.png fig12.png fig13.png fig14.png; do : > results/paper/$file; done
  exit
fi
for word in "$@"; do [ "$word" = -o ] && folder=yes && continue; [ "$folder" = yes ] && where=$word && break; done
for file in "$@"; do [ "$file" = --validate ] && break; case $file in configs/*)
  name=$(basename $file .toml); mkdir -p $where/$name
  : > $where/$name/$1.h5; : > $where/$name/$1.png
  if [ $1 = close-loop ]; then : > $where/$name/$1.html; : > $where/$name/revised.toml; fi;;
esac; done
"""
Run = Callable[..., list[str]]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    if shutil.which("make") is None or not (ROOT / "Makefile").exists():
        pytest.skip("no make, or no Makefile: this is not a checkout")
    for folder in ("configs", "data", "results", "twindisc_cli", ".venv"):
        (tmp_path / folder).mkdir()
    shutil.copy(ROOT / "Makefile", tmp_path)
    program = tmp_path / "program"
    program.write_text(PROGRAM)
    program.chmod(0o755)
    for name in ("pyproject.toml", "constraints.txt", "twindisc_cli/cli.py", ".venv/.runtime"):
        (tmp_path / name).touch()
    for name in ("ambient", "cryogenic"):
        (tmp_path / f"configs/{name}.toml").write_text("[thermal]\n[measured]\nprofile = 'p.csv'\n")
    (tmp_path / "configs/third.toml").write_text("[measured]\ntraction = 't.csv'\n")
    age(tmp_path)

    def make(*options: str) -> list[str]:
        (tmp_path / "asked").write_text("")
        done = subprocess.run(
            ["make", "run", "TWINDISC=./program", *options], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return (tmp_path / "asked").read_text().splitlines()

    return make


def age(folder: Path) -> None:
    """What is there was made an hour earlier."""
    for path in folder.rglob("*"):
        if path.is_file():
            os.utime(path, (path.stat().st_mtime - 3600.0,) * 2)


def test_every_command_runs_once_where_the_definition_has_what_it_needs(run: Run, tmp_path: Path) -> None:
    asked = run()
    every = ("friction-chart", "identify-mu", "contact", "check", "close-loop")
    wanted = {f"{command} configs/{name}.toml" for command in every for name in ("cryogenic", "third")}
    wanted |= {f"{command} configs/ambient.toml" for command in every[:-1]}
    wanted |= {f"{c} configs/{name}.toml" for c in ("thermal", "fit-k", "simulate-wear") for name in MEASURED}
    wanted |= {"close-loop configs/ambient.toml --validate configs/cryogenic.toml"}
    assert sorted(line for line in asked if not line.startswith("paper")) == sorted(
        f"{line} -o results" for line in wanted
    )
    assert run() == []
    for figure in ("loop_third", "fig02", "fig14", "before_and_after"):
        assert (tmp_path / f"results/figures/{figure}.png").exists()


def test_two_at_a_time_make_the_same(run: Run) -> None:
    one = sorted(run("-j2"))
    assert len(one) == len(set(one))
    assert run("-j2") == []


def test_a_missing_figure_of_the_folder_asks_the_program_nothing(run: Run, tmp_path: Path) -> None:
    run()
    age(tmp_path)
    figure = tmp_path / "results/figures/fig02.png"
    figure.unlink()
    assert run() == []
    assert figure.exists()


def test_a_new_definition_is_picked_up_and_the_others_are_not_forced(run: Run, tmp_path: Path) -> None:
    run()
    age(tmp_path)
    (tmp_path / "configs/fourth.toml").write_text("[thermal]\n")
    (tmp_path / "data/fourth.csv").touch()
    asked = run()
    assert any(line.startswith("thermal configs/fourth.toml") for line in asked)
    assert (tmp_path / "results/fourth/identify-mu.h5").exists()
    assert run() == []


@pytest.mark.parametrize(
    "name", ["results/third/check.png", "results/third/close-loop.html", "results/ambient/fit-k.h5"]
)
def test_what_was_deleted_is_made_again_by_its_command_alone(run: Run, tmp_path: Path, name: str) -> None:
    run()
    age(tmp_path)
    (tmp_path / name).unlink()
    (line,) = run()
    assert line.startswith(f"{Path(name).stem} configs/{Path(name).parent.name}.toml ")
    assert (tmp_path / name).exists()


def test_a_changed_definition_is_read_again_without_force(run: Run, tmp_path: Path) -> None:
    run()
    age(tmp_path)
    (tmp_path / "configs/third.toml").touch()
    asked = run()
    assert asked
    assert not any("--force" in line for line in asked)
