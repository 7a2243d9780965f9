"""Results of another version of the program: found, said, and made again, whatever it calls itself."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from definitions import TRACTION, write

import twindisc_cli
from twindisc_cli.cli import main
from twindisc_cli.results.recorded import recorded


def told(*arguments: str, capsys: pytest.CaptureFixture[str]) -> tuple[str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 0
    return capsys.readouterr()


def test_what_an_altered_program_made_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of the same number, with one file more: `--dry-run`, the run, `--json` and a campaign say so, and once only."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path, traction=TRACTION)
    other, package = tmp_path / "other", Path(twindisc_cli.__file__).parent
    shutil.copytree(package, other / "twindisc_cli", ignore=shutil.ignore_patterns("__pycache__"))
    (other / "twindisc_cli/physics/new.py").touch()
    command = [sys.executable, "-P", "-m", "twindisc_cli", "check", "small.toml", "--no-figure"]
    settings = {**os.environ, "PYTHONPATH": str(other)}
    for folder in ("results", "many", "machine"):
        subprocess.run([*command, "-o", folder], env=settings, cwd=tmp_path, check=True, capture_output=True)
    before = recorded(tmp_path / "results/small/check.h5")
    again = "made by another version: made again"
    assert told("check", "small.toml", "--no-figure", "--dry-run", capsys=capsys)[0] == (
        f"would be made: results/small/check.h5: {again}\n"
    )
    assert told("check", "small.toml", "--no-figure", capsys=capsys)[1] == f"results/small/check.h5: {again}\n"
    assert "up to date: results/small/check.h5" in told("check", "small.toml", "--no-figure", capsys=capsys)[0]
    after = recorded(tmp_path / "results/small/check.h5")
    assert not isinstance(before, str)
    assert not isinstance(after, str)
    assert before.version == after.version
    assert before.run_key != after.run_key
    out, err = told("check", "small.toml", "--no-figure", "-o", "machine", "--json", capsys=capsys)
    assert json.loads(out)
    assert again in err
    campaign = ("campaign", "check", "small.toml", "-o", "many", "--workers", "1")
    assert f"1 tests: 1 computed (1 {again}), 0 up to date" in told(*campaign, capsys=capsys)[0]
    assert "1 tests: 0 computed, 1 up to date" in told(*campaign, capsys=capsys)[0]
