"""Files as twelve makers write them: each is read right, or refused with a block that makes the same call succeed."""

from __future__ import annotations

import json
from pathlib import Path

import makers
import numpy as np
import pytest
from test_import import command

from twindisc_cli.definition import load
from twindisc_cli.model.experiment import Experiment

FILES = makers.messy()


def test_there_are_sixty() -> None:
    assert len(FILES) >= 60
    assert sum(file.understood for file in FILES.values()) >= 45


def imported(
    folder: Path, file: makers.File, capsys: pytest.CaptureFixture[str]
) -> tuple[Experiment | None, list[str], str]:
    """The test that import makes of a file, on the discs that it was measured on; its messages."""
    folder.mkdir(exist_ok=True)
    (folder / file.name).write_bytes(file.data)
    more = sorted(folder.glob("block.toml"))
    code, out, err = command("import", folder / file.name, *more, "-o", folder / "to", "--json", capsys=capsys)
    if code:
        assert code in (2, 3), err
        return None, [], err
    told = json.loads(out)
    path = Path(told["definition"])
    path.write_text(path.read_text(encoding="utf-8").replace("23.5", "30.0"), encoding="utf-8")
    notes = [note for row in told["rows"] for note in (*row["notes"], *row["left_out"])]
    return load(path).experiment, [*notes, *(guess["guess"] for guess in told["guesses"])], err


def check(test: Experiment) -> None:
    """The numbers are those that were measured."""
    samples = test.measured.traction
    assert samples is not None
    np.testing.assert_allclose(np.median(samples.ratio), makers.MU, rtol=0.01)
    np.testing.assert_allclose(samples.ratio.mean(), makers.MU, rtol=0.01)
    assert set(np.round(100.0 * samples.creepage).astype(int)) == {2, 4, 6}
    assert test.rig.normal_load == pytest.approx(makers.LOAD, rel=0.01)
    assert test.rig.rolling_speed == pytest.approx(makers.SPEED, rel=0.01)
    assert test.history.duration[test.history.driven].sum() == pytest.approx(420.0, abs=8.0)


@pytest.mark.parametrize("what", FILES)
def test_a_file_is_read_right_or_its_block_makes_it_so(
    what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = FILES[what]
    test, _, err = imported(tmp_path / "one", file, capsys)
    assert (test is not None) == file.understood, err
    if test is None:
        (tmp_path / "one" / "block.toml").write_text(err[err.index("[measured]") :], encoding="utf-8")
        test, _, err = imported(tmp_path / "one", file, capsys)
    assert test is not None, err
    check(test)


@pytest.mark.parametrize(
    "what", ["LabVIEW, .tdms", "LabVIEW, .lvm", "MATLAB", "Excel, second sheet", "two sheets that fit"]
)
def test_three_commands_to_the_first_figure(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, more = FILES[what], []
    (tmp_path / file.name).write_bytes(file.data)
    if not file.understood:
        more = [tmp_path / "block.toml"]
        more[0].write_text('[measured]\nsheet = "Run 2"\n')
    code, _, err = command("import", tmp_path / file.name, *more, "-o", tmp_path / "mine", capsys=capsys)
    assert code == 0, err
    path = tmp_path / "mine" / "rig.toml"
    path.write_text(path.read_text().replace("23.5", "30.0"))
    code, out, err = command("identify-mu", path, "-o", tmp_path, "--json", capsys=capsys)
    assert code == 0, err
    np.testing.assert_allclose([step["mu"] for step in json.loads(out)["steps"]], makers.MU, rtol=0.01)
    assert (tmp_path / "rig" / "identify-mu.png").is_file()
