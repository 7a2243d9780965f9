"""The benchmark for other programs: the truth is sealed beside the tests, and anybody's answers are counted."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import pytest
from score import benchmark
from score.benchmark import SEALED, judged, main, seal, unsealed
from score.cases import plan
from score.making import Case


def made(cases: list[Case], home: Path, processes: int) -> None:
    """Stands for the maker of tests, which takes a minute each: a definition, and apart from it what is hidden."""
    for case in cases:
        name = f"{case.group}_{case.seed}"
        (home / "tests" / name).mkdir(parents=True)
        (home / "tests" / name / "test.toml").write_text(f'[test]\nname = "{name}"\n')
        (home / "truth").mkdir(exist_ok=True)
        (home / "truth" / f"{name}.json").write_text(json.dumps({"truth": [], "channels": [], "sizes": []}))


@pytest.fixture
def folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three tests with nothing hidden."""
    monkeypatch.setattr(benchmark, "make", made)
    monkeypatch.setattr(benchmark, "plan", lambda tests, seed: plan(tests, seed, ("null",)))
    home = tmp_path_factory.mktemp("benchmark")
    seal(home, tests=3, seed=5, processes=1)
    return home


def test_no_test_holds_its_truth(folder: Path) -> None:
    names = set(unsealed(folder))
    assert {path.name for path in (folder / "tests").iterdir()} == names
    assert len(names) == 3
    assert not [path for path in folder.rglob("*") if "truth" in path.name and path.parent != folder]
    for path in (folder / "tests").rglob("*.toml"):
        assert "[effects" not in path.read_text() and "[laws" not in path.read_text()


def test_answers_are_counted_and_a_missing_one_is_missed(folder: Path, tmp_path: Path) -> None:
    nothing = {"effects": [], "laws": [], "unexplained": [], "error": {}, "base": {}}
    truth = unsealed(folder)
    first = sorted(truth)[0]
    (tmp_path / f"{first}.json").write_text(json.dumps(nothing))
    rows = {row["name"]: row["judged"] for row in judged(folder, tmp_path)}
    assert not rows[first]["failed"] and not rows[first]["alarm"]
    assert all(rows[name]["failed"] for name in truth if name != first)


def test_a_truth_that_was_changed_is_refused(folder: Path) -> None:
    kept = (folder / SEALED).read_bytes()
    (folder / SEALED).write_bytes(zlib.compress(b"{}"))
    with pytest.raises(ValueError, match="is not the truth"):
        unsealed(folder)
    (folder / SEALED).write_bytes(kept)


def test_the_command_line_prints_the_table(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["judge", str(folder), str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "right as a whole: 0 of 3" in said
    assert "nothing missing: alarm" in said
