"""The campaign: which tests, on which processes, through which accidents, and the table of what came out."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import tomli_w
import xarray
from accidents import process_of, square_or_worse
from definitions import TRACTION, VALID, changed, write

from twindisc_cli.campaign import pool
from twindisc_cli.campaign.groups import few
from twindisc_cli.campaign.outcome import outcome_of
from twindisc_cli.campaign.plan import plan, read
from twindisc_cli.campaign.shared import common_of
from twindisc_cli.campaign.table import Row, columns_of, csv_text, header, parquet_bytes, table_of
from twindisc_cli.cli import main
from twindisc_cli.commands._campaign_work import PRELOAD, wear_rate
from twindisc_cli.definition import load
from twindisc_cli.errors import DefinitionError
from twindisc_cli.figures.campaign import figure_of

TWINDISC = (sys.executable, "-m", "twindisc_cli")


def exit_code(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    assert isinstance(left.value.code, int)
    return left.value.code


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def named(folder: Path, *names: str) -> None:
    """Definitions of one measured traction, by their names."""
    for name in names:
        write(folder, VALID.replace('"small"', f'"{name}"'), f"{name}.toml", traction=TRACTION)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def tree(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


# Which tests


def test_globs_files_and_campaign_files_give_each_test_once(folder: Path) -> None:
    named(folder, "b", "a", "c")
    (folder / "map.toml").write_text('base = "a.toml"\n[vary]\nrig.normal_load_N = [50.0, 80.0]\n')
    assert [job.name for job in plan(["c.toml", "[ab].toml", "a.toml"])] == ["c", "a", "b"]
    assert [job.name for job in plan([str(folder / "?.toml"), "map.toml"])] == [
        *"abc", "map-normal_load_N-50", "map-normal_load_N-80",
    ]  # fmt: skip


def test_ranges_and_lists_multiply_and_rows_are_added(folder: Path) -> None:
    write(folder, VALID, "a.toml")
    (folder / "map.toml").write_text(
        'base = "a.toml"\n[vary]\n'
        'rig.normal_load_N = { from = 10.0, to = 1000.0, count = 3, spacing = "log" }\n'
        '"history.steps[2].creepage_percent" = { from = 0.1, to = 0.3, count = 3 }\n'
        '[[variations]]\nname = "soft"\nmaterial.hardness_HV = 300\n"history.steps[*].iterations" = 7\n'
    )
    jobs = plan(["map.toml"])
    found = [read(job).experiment for job in jobs]
    loads = [test.rig.normal_load for test in found]
    assert loads == pytest.approx([10.0] * 3 + [100.0] * 3 + [1000.0] * 3 + [72.0])
    creepage = [test.history.step_creepage[1] for test in found]
    assert creepage == pytest.approx([0.001, 0.002, 0.003] * 3 + [0.01])
    assert jobs[-1].name == found[-1].name == "soft"
    assert found[-1].rig.disc1.hardness == pytest.approx(300 * 9.80665e6)
    assert len(found[-1].history.step) == 21
    assert jobs[1].name == "map-normal_load_N-10-creepage_percent-0.2"


def test_no_definition_is_written_before_its_test_begins(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(folder, VALID, "a.toml")
    text = "rig.normal_load_N = { from = 10.0, to = 20.0, count = 100 }"
    (folder / "map.toml").write_text(f'base = "a.toml"\n[vary]\n{text}\n')
    written: list[str] = []
    dumps = tomli_w.dumps
    monkeypatch.setattr(tomli_w, "dumps", lambda document: written.append("") or dumps(document))
    jobs = plan(["map.toml"])
    assert len(jobs) == 100
    assert not written
    assert [read(job).experiment.rig.normal_load for job in jobs[:2]] == pytest.approx([10.0, 10.0 + 10.0 / 99.0])
    assert len(written) == 2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('base = "x.toml"\nvary.rig.normal_load_N = [1.0]', "map.toml: base: x.toml is not a test definition"),
        ('base = "a.toml"', "nothing is varied"),
        ('base = "a.toml"\nvarry.rig.normal_load_N = [1.0]', "varry: unknown key; a campaign file holds base, vary"),
        ('base = "a.toml"\nvary.rig.normal_load_N = { from = 1.0, to = 2.0 }', "give a list, or { from"),
        ('base = "a.toml"\nvary.rig.normal_load_N = { from = 1, to = 2, count = 1 }', "2 to 1000000 values"),
        ('base = "a.toml"\nvary.rig.normal_load_N = { from = 1, to = 2, count = 1000000000 }', "2 to 1000000 values"),
        ('base = "a.toml"\nvary.rig.normal_load_N = { from = 1, to = 2, count = nan }', "2 to 1000000 values"),
        ('base = "a.toml"\nvary.rig.normal_load_N = { from = "1", to = inf, count = 2 }', "from one number to another"),
        ('base = "a.toml"\nvary.rig.x = { from = 1, to = 2, count = 2, spacing = "lin" }', 'is "linear" or "log"'),
        ('base = "a.toml"\nvary = 3', "vary: is a table of keys"),
        ('base = "a.toml"\nvariations = [3]', "variations: are tables"),
        ('base = "a.toml"\n[vary]\n"rig.normal_load_N.x" = [0.1]', "rig.normal_load_N.x: the base has no x there"),
        ('base = "a.toml"\n[vary]\n"history.steps[0].mu" = [0.1]', "history.steps[0].mu: the base has no item 0"),
        ('base = "a.toml"\n[vary]\n"rig[*].mu" = [0.1]', "rig[*].mu: the base has no items there"),
        ('base = "a.toml"\n[vary]\n"." = [0.1]', ".: the base has no such key"),
        ('base = "a.toml"\nvary.rig.x = { from = -1, to = 2, count = 3, spacing = "log" }', "ends of one sign"),
        ('base = "a.toml"\n[vary]\n"history.steps[9].mu" = [0.1]', "history.steps[9].mu: the base has no item 9"),
        ('base = "a.toml"\nvary.rig.normal_load_N = [1.0, 1.0]', "is the name of two variations"),
    ],
)
def test_a_wrong_campaign_file_is_told(folder: Path, text: str, says: str) -> None:
    named(folder, "a")
    (folder / "map.toml").write_text(text)
    with pytest.raises(DefinitionError) as error:
        plan(["map.toml"])
    assert says in str(error.value)


def test_what_would_write_the_same_files_is_refused_before_anything_runs(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named(folder, "a")
    (folder / "b.toml").write_text((folder / "a.toml").read_text())
    assert exit_code("campaign", "check", "a.toml", "b.toml", "absent.toml", ".") == 2
    told = capsys.readouterr().err
    for line in ("absent.toml: no such file", ".: is a folder", "b.toml: a is also the test of a.toml"):
        assert line in told
    assert exit_code("campaign", "chek", "a.toml") == 2
    assert "did you mean check?" in capsys.readouterr().err
    assert not (folder / "results").exists()


# The processes


def test_what_hangs_or_dies_does_not_stop_the_others() -> None:
    items = [1, "hang", 2, "die", 3, "leave", 4, 5]
    found = dict(pool.each(square_or_worse, items, workers=2, limit=1.5, preload=PRELOAD))
    assert {item: found[item] for item in items if isinstance(item, int)} == {1: 1, 2: 4, 3: 9, 4: 16, 5: 25}
    hang, die, leave = (found[item] for item in ("hang", "die", "leave"))
    assert hang == pool.overrun(1.5)
    assert isinstance(die, pool.Lost)
    assert isinstance(leave, pool.Lost)
    assert (die.exit_code, die.reason) == (1, "killed its worker process (SIGKILL; is there memory enough?)")
    assert leave.reason == "killed its worker process (exit code 3)"


def test_a_worker_is_started_once_and_not_for_every_item() -> None:
    found = list(pool.each(process_of, range(40), workers=2, limit=60.0, preload=PRELOAD))
    assert sorted(item for item, _ in found) == list(range(40))
    assert len({process for _, process in found}) == 2


# The command


def test_a_campaign_writes_what_the_single_commands_write(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    named(folder, "a", "b")
    assert exit_code("campaign", "identify-mu", "*.toml", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["tests"], told["failed"], told["table"]) == (2, [], "results/campaign-identify-mu.csv")
    for name in "ab":
        assert exit_code("identify-mu", f"{name}.toml", "-o", "single") == 0
        assert exit_code("identify-mu", f"{name}.toml") == 0
        assert f"up to date: results/{name}/identify-mu.h5" in capsys.readouterr().out
    single, together = tree(folder / "single"), tree(folder / "results")
    assert {name: together[name] for name in single} == single


def test_a_dry_run_says_what_is_there_and_writes_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    named(folder, "a", "b")
    (folder / "c.toml").write_text("schema = 1\n")
    assert exit_code("campaign", "check", "a.toml", "--workers", 1, "-q") == 0
    before = tree(folder)
    capsys.readouterr()
    assert exit_code("campaign", "check", "[abc].toml", "--dry-run") == 2
    said = capsys.readouterr().out.splitlines()
    assert said[:3] == [
        "3 tests: 1 would be computed, 1 up to date, 1 failed", "would be computed: b: is not there", "up to date: a",
    ]  # fmt: skip
    assert said[3].startswith("failed: c: ")
    assert exit_code("campaign", "check", "[ab].toml", "--dry-run", "--json", "--force") == 0
    assert json.loads(capsys.readouterr().out)["would_be_made"] == {"a": "--force", "b": "is not there"}
    assert tree(folder) == before


def test_what_fails_stands_in_the_table_with_its_error(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    named(folder, "good", "worse")
    write(folder, changed(name='name = "bad"', hardness_HV="hardness_HV = 0"), "bad.toml")
    write(folder, changed(name='name = "bare"\ngroup = "g"'), "bare.toml")
    (folder / "worse.toml").write_text("schema = ")
    assert exit_code("campaign", "identify-mu", "*.toml") == 2
    told = capsys.readouterr()
    assert "4 tests: 1 computed, 0 up to date, 3 failed" in told.out
    assert "failed: bad: bad.toml:15: material.hardness_HV: must be greater than 0, not 0" in told.err
    table = {row["test"]: row for row in rows(folder / "results/campaign-identify-mu.csv")}
    assert {name: row["exit code"] for name, row in table.items()} == {
        "bad": "2", "bare": "3", "good": "0", "worse": "2",
    }  # fmt: skip
    assert table["bare"]["error"] == "bare.toml: no traction was measured; name its file under [measured]"
    assert table["bare"]["group"] == "g"
    assert table["bare"]["step 2 mu [1]"] == ""
    assert float(table["good"]["step 3 mu [1]"]) == pytest.approx(0.58, abs=1e-3)
    assert table["good"]["normal load [N]"] == "72.0"
    (folder / "worse.toml").unlink()
    (folder / "bad.toml").unlink()
    assert exit_code("campaign", "identify-mu", "*.toml") == 3
    assert "2 tests: 0 computed, 1 up to date, 1 failed" in capsys.readouterr().out


def test_a_result_that_cannot_be_written_is_a_failure_of_its_test(folder: Path) -> None:
    named(folder, "a", "b")
    (folder / "results").mkdir()
    (folder / "results/a").write_text("in the way")
    assert exit_code("campaign", "check", "*.toml") == 2
    table = rows(folder / "results/campaign-check.csv")
    assert "cannot be written" in table[0]["error"]
    assert table[1]["error"] == ""


def test_the_limit_stops_a_test_that_takes_too_long(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, changed(name='name = "endless"').replace("iterations = 2", "iterations = 90000"), "endless.toml")
    named(folder, "quick")
    code = exit_code("campaign", "friction-chart", "*.toml", "--limit", "0.2")
    assert code == 4
    assert "failed: endless: took longer than 0.2 s and was stopped; --limit allows more" in capsys.readouterr().err


# Accidents


def campaign(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    command = (*TWINDISC, "campaign", "identify-mu", "*.toml", *arguments)
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def stamps(folder: Path) -> dict[str, int]:
    return {p.parent.name: p.stat().st_mtime_ns for p in folder.glob("*/identify-mu.h5")}


def written(folder: Path, count: int) -> None:
    """Wait until so many tests are there."""
    deadline = time.monotonic() + 300.0
    while len(stamps(folder)) < count and time.monotonic() < deadline:
        time.sleep(0.01)


@pytest.mark.long
def test_what_was_stopped_goes_on_where_it_was(folder: Path) -> None:
    """Killed, then interrupted, the third call ends as an undisturbed one, and nothing there is computed again."""
    named(folder, *(f"t{i}" for i in range(8)))
    results = folder / "results"
    for accident, share, code in ((signal.SIGKILL, 1, -9), (signal.SIGINT, 4, 130)):
        running = campaign(folder)
        written(results, share)
        running.send_signal(accident)
        running.communicate()
        if running.returncode == 0:
            pytest.skip("the run had ended before the signal came")
        assert running.returncode == code
        assert not (results / "campaign-identify-mu.csv").exists()
    time.sleep(0.3)
    there = stamps(results)
    assert len(there) >= 4
    last = campaign(folder)
    told, _ = last.communicate()
    assert last.returncode == 0
    assert f"{8 - len(there)} computed, {len(there)} up to date" in told.decode()
    assert {name: stamps(results)[name] for name in there} == there
    campaign(folder, "-o", "undisturbed").communicate()
    assert tree(results) == tree(folder / "undisturbed")


# The table


def test_headers_carry_the_units_of_the_keys() -> None:
    known = {
        "depth_um": "depth [um]",
        "worn_volume_mm3": "worn volume [mm3]",
        "convection_W_K": "convection [W/K]",
        "convection_W_K_std": "convection std [W/K]",
        "rise_C": "rise [K]",
        "peak_C": "peak [degC]",
        "mu": "mu [1]",
        "K_std": "K std [1]",
        "T_over_N": "T over N [1]",
        "rig.normal_load_N": "rig.normal load [N]",
    }
    assert {name: header(name) for name in known} == known


def test_columns_of_every_kind_of_outcome() -> None:
    outcome = {
        "verdict": "effects_found",
        "effects": [
            {
                "effect": "falling_friction",
                "parameters": {"decay_s_m": {"value": 2.0, "std": 0.1, "unit": "s m-1"}},
                "probability": 0.9,
            }
        ],
        "base": {"mu": {"value": 0.6, "std": 0.01, "unit": "1"}},
        "error": {"profile": {"unit": "um", "noise": 0.1}, "temperature": {}},
        "steps": [{"step": 2, "mu": 0.5, "state": "saturated", "creepage_percent": 1.0}],
        "iterations": [{"iteration": 1, "time_s": 3.0}],
        "findings": [{"message": "a"}, {"message": "b"}],
        "validation": None,
    }
    assert columns_of(outcome) == {
        "verdict": "effects_found",
        "effects": "falling_friction",
        "falling_friction decay [s m-1]": 2.0,
        "falling_friction decay std [s m-1]": 0.1,
        "falling_friction probability [1]": 0.9,
        "base mu [1]": 0.6,
        "base mu std [1]": 0.01,
        "error profile noise [um]": 0.1,
        "step 2 mu [1]": 0.5,
        "step 2 state": "saturated",
        "step 2 creepage [%]": 1.0,
        "findings": "a; b",
    }


def test_one_row_a_test_with_gaps_where_a_test_has_nothing() -> None:
    table = table_of(
        [
            Row("a", "a.toml", 0, run_key="k", found={"depth [um]": 6.0, "state": "new"}),
            Row("b", "b.toml", 3, "no data", group="g"),
        ]
    )
    first, second, third = csv_text(table).splitlines()
    assert first == "test,group,exit code,error,depth [um],state,data provenance,run key,definition"
    assert second == "a,,0,,6.0,new,,k,a.toml"
    assert third == "b,g,3,no data,,,,,b.toml"


def test_the_table_opens_in_xarray_with_its_units(folder: Path) -> None:
    named(folder, "a", "b")
    assert exit_code("campaign", "identify-mu", "*.toml") == 0
    path = folder / "results/campaign-identify-mu.h5"
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert list(data["test"].values) == ["a", "b"]
        assert data["step_3_mu"].values == pytest.approx(0.58, abs=1e-3)
        assert data["normal_load"].attrs["units"] == "N"
    with h5py.File(path) as one, h5py.File(folder / "results/a/identify-mu.h5") as other:
        assert one["run_key"].asstr()[0] == other.attrs["run_key"]


def test_parquet_holds_the_same_table() -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    import io

    table = table_of([Row("a", "a.toml", 0, found={"depth [um]": 6.0}), Row("b", "b.toml", 3, "no data")])
    found = parquet.read_table(io.BytesIO(parquet_bytes(table) or b"")).to_pydict()
    assert list(found) == list(table.columns)
    assert found["test"] == ["a", "b"]
    assert found["depth [um]"][0] == 6.0
    assert np.isnan(found["depth [um]"][1])


def test_a_campaign_of_variations_is_called_after_its_file(folder: Path) -> None:
    named(folder, "a")
    (folder / "loads.toml").write_text('base = "a.toml"\n[vary]\nrig.normal_load_N = [50.0, 80.0]\n')
    assert exit_code("campaign", "check", "loads.toml") in (0, 5)
    table = rows(folder / "results/loads-check.csv")
    assert [row["rig.normal load [N]"] for row in table] == ["50.0", "80.0"]
    assert [row["definition"] for row in table] == ["a.toml", "a.toml"]


def test_a_campaign_file_may_be_called_as_it_likes_and_a_mistake_names_no_line_of_the_base(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named(folder, "a")
    text = 'base = "a.toml"\n[vary]\nrig.normal_load_N = [50.0, 80.0]\n'
    (folder / "loads ü.toml").write_text(text)
    assert [job.name for job in plan(["loads ü.toml"])] == ["loads_-normal_load_N-50", "loads_-normal_load_N-80"]
    assert [read(job).experiment.rig.normal_load for job in plan(["loads ü.toml"])] == [50.0, 80.0]
    (folder / "loads.toml").write_text(text.replace("load_N", "lod_N"))
    with pytest.raises(DefinitionError, match=r"^a\.toml: rig\.normal_lod_N: unknown key, did you mean normal_load_N"):
        read(plan(["loads.toml"])[0])


# What the tests say together


def repeats(folder: Path, group: str, levels: list[float]) -> None:
    """Tests in full sliding, where T/N is mu: mu by the level of each, with a hundredth of scatter."""
    rng = np.random.default_rng(1)
    creepage = (2.0, 4.0, 6.0, 8.0)
    steps = "".join(f"  {{ creepage_percent = {c} }},\n" for c in creepage)
    text = f"{VALID[: VALID.index('steps = [')]}steps = [\n{steps}]\n"
    for i, level in enumerate(levels):
        ratio = [level * curve * np.exp(0.01 * rng.standard_normal()) for curve in (0.5, 0.55, 0.54, 0.5)]
        data = "".join(f"{c},{r:.5f}\n" for c, r in zip(creepage, ratio, strict=True))
        (folder / f"{group}{i}.csv").write_text(f"creepage [%],traction ratio [1]\n{data}")
        named = text.replace('"small"', f'"{group}{i}"\ngroup = "{group}"')
        (folder / f"{group}{i}.toml").write_text(f'{named}\n[measured]\ntraction = "{group}{i}.csv"\n')


def test_repeats_are_pooled_and_the_outlier_is_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    repeats(folder, "dry", [1.0, 1.03, 0.96, 1.3, 0.99, 1.01])
    repeats(folder, "oil", [0.2, 0.2, 0.2])
    assert exit_code("campaign", "identify-mu", "*.toml", "--json") == 0
    told = capsys.readouterr()
    dry, oil = json.loads(told.out)["groups"]
    assert (dry["group"], dry["quantity"], dry["outliers"], dry["one_for_all"]) == ("dry", "mu", ["dry3"], False)
    assert (oil["group"], oil["outliers"], oil["one_for_all"]) == ("oil", [], True)
    assert dry["within_percent"] == pytest.approx(1.0, rel=0.5)
    assert dry["between_low_percent"] < 2.6 < dry["between_high_percent"]
    assert dry["low"] < 0.52 < dry["high"]
    assert oil["mean"] == pytest.approx(0.2 * 0.522, rel=0.02)
    assert "one mu for all is refused" in told.err
    assert "outlier: dry3" in told.err
    assert (folder / "results/campaign-identify-mu.png").is_file()


def test_steps_below_saturation_are_not_pooled(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A contact with a twentieth of the theory's slope: T/N of 0.5 in full sliding, and what rises to it."""
    creepage = np.array([0.3, 0.6, 1.0, 2.0, 4.0, 6.0, 8.0])
    steps = "".join(f"  {{ creepage_percent = {c} }},\n" for c in creepage)
    text = f"{VALID[: VALID.index('steps = [')]}steps = [\n{steps}]\n"
    for i, level in enumerate((0.5, 0.51, 0.49)):
        data = "".join(f"{c},{level * np.tanh(c / 0.9):.5f}\n" for c in creepage)
        (folder / f"t{i}.csv").write_text(f"creepage [%],traction ratio [1]\n{data}")
        named = text.replace('"small"', f'"t{i}"\ngroup = "soft"')
        (folder / f"t{i}.toml").write_text(f'{named}\n[measured]\ntraction = "t{i}.csv"\n')
    assert exit_code("campaign", "identify-mu", "*.toml", "--json") == 0
    (soft,) = json.loads(capsys.readouterr().out)["groups"]
    assert soft["mean"] == pytest.approx(0.5, rel=0.01)


def wear_row(i: int, energy: float, k: float, std: float, group: str = "") -> Row:
    found = {"K [1]": k, "K std [1]": std, "T gamma / A [N/mm2]": energy, "wear rate [um/km]": 50.0 * k * energy}
    return Row(f"t{i}", f"t{i}.toml", 0, group=group, provenance="synthetic", found=found)


def test_a_k_less_certain_than_its_size_is_not_pooled() -> None:
    """Five tests of one K, and one that says nothing: mean, scatters and p are those of the five."""
    values = [1.0e-4, 1.1e-4, 0.9e-4, 1.05e-4, 0.95e-4]
    sure = [wear_row(i, 1.0 + i, k, 0.1 * k, "g") for i, k in enumerate(values)]
    (five,) = outcome_of(table_of(sure)).groups
    (six,) = outcome_of(table_of([*sure, wear_row(5, 6.0, 3e-4, 100.0, "g")])).groups
    assert six.summary == five.summary
    assert five.pooled.within == pytest.approx(0.1)


def test_a_number_that_no_computer_holds_is_a_text() -> None:
    asked = [{"rig.mu": 10**400}, {"rig.mu": 10**20}, {"rig.mu": 3}]
    rows = [Row(f"t{i}", "t.toml", 2, asked=values, error="refused") for i, values in enumerate(asked)]
    assert table_of(rows).columns["rig.mu"][0] == str(10**400)
    assert table_of(rows[1:]).numbers("rig.mu") == pytest.approx([1e20, 3.0])


def test_one_k_for_all_is_tested() -> None:
    rng = np.random.default_rng(2)
    same = 1e-4 * np.exp(0.05 * rng.standard_normal(6))
    other = 1e-4 * np.exp(0.05 * rng.standard_normal(6) + 0.4 * rng.standard_normal(6))
    table = table_of(
        [wear_row(i, 5.0, k, 0.05 * k, "same") for i, k in enumerate(same)]
        + [wear_row(10 + i, 5.0, k, 0.05 * k, "other") for i, k in enumerate(other)]
    )
    one, several = outcome_of(table).groups
    assert (one.one_for_all, several.one_for_all) == (True, False)
    assert one.json["mean"] == pytest.approx(1e-4, rel=0.06)
    assert several.json["between_low_percent"] < 40.0 < several.json["between_high_percent"]


def test_a_regime_of_severe_wear_is_found_over_the_energy() -> None:
    rng = np.random.default_rng(3)
    energy = np.geomspace(1.0, 60.0, 24)
    k = np.where(energy < 11.0, 1e-5, 1e-4) * np.exp(0.1 * rng.standard_normal(24))
    table = table_of([wear_row(i, e, v, 0.1 * v) for i, (e, v) in enumerate(zip(energy, k, strict=True))])
    found = outcome_of(table)
    _, severe = found.k
    assert np.exp(severe.low) == pytest.approx(11.0, rel=0.2)
    assert "K has 2 regimes" in "\n".join(found.summary)
    figure = figure_of("fit-k", table, found, (), "synthetic")
    assert figure is not None
    assert "synthetic data" in " ".join(text.get_text() for text in figure().texts)


def test_effects_hold_for_all_some_or_one_test_of_a_group() -> None:
    named = (["falling_friction", "load_error"], ["falling_friction"], ["falling_friction", "misalignment"], [])
    rows = [
        Row(f"t{i}", f"t{i}.toml", 0, group="g" if i < 3 else "", found={
            "verdict": "effects_found", "effects": "; ".join(names), **{f"{n} probability [1]": 0.9 for n in names},
        })
        for i, names in enumerate(named)
    ]  # fmt: skip
    table = table_of(rows)
    found = outcome_of(table)
    holds = {effect.name: (effect.group, effect.holds, effect.of) for effect in found.effects}
    assert holds == {
        "falling_friction": ("g", "all", 3), "load_error": ("g", "one", 3), "misalignment": ("g", "one", 3),
    }  # fmt: skip
    assert "group g: falling_friction in 3 of 3 tests, probability 90 to 90 %" in found.summary
    assert "group g: load_error in 1 of 3 tests: t0, probability 90 to 90 %" in found.summary
    assert few(["a", "b", "c", "d"], 9) == few(["a", "b"], 2) == ""
    figure = figure_of("close-loop", table, found, (), "")
    assert figure is not None
    figure()


LOADED = """steps = [
  { creepage_percent = 5.0, iterations = 2 },
  { pause_s = PAUSE },
  { creepage_percent = 5.0, iterations = 1, normal_load_N = 144.0, rolling_speed_m_s = 3.0 },
]
"""
"""Two blocks of full sliding, the second under twice the load, whose patch is 2^(2/3) times as large."""


@pytest.mark.parametrize("pause", ["60", "600"])
def test_the_wear_rate_is_per_distance_rolled_and_patch_under_the_load_of_each_step(folder: Path, pause: str) -> None:
    """T gamma / A = sum mu N v s / sum A s; in a pause nothing rolls, and the energy of fit-k ends with the profile."""
    before, _, rest = VALID.partition("steps = [")
    text = before + LOADED.replace("PAUSE", pause) + rest.partition("\n]\n")[2]
    profile = "y [mm],height [um],iteration\n" + "".join(
        f"{y:.2f},{-max(0.0, 1.0 - (y / 0.4) ** 2):.4f},2\n" for y in np.linspace(-1.0, 1.0, 101)
    )
    test = load(write(folder, text, profile=profile))
    area = test.experiment.rig.patch.area * np.array([1.0, np.cbrt(4.0)])
    force, rolled = 0.6 * 0.05 * np.array([72.0, 144.0]), 2.0 * np.pi * 0.03 * 4200 * np.array([2.0, 1.0])
    for command, key, blocks in (("simulate-wear", "wear_coefficient", 2), ("fit-k", "K", 1)):
        energy = force[:blocks] @ rolled[:blocks]
        found = wear_rate(test, {key: 7e-5, "dissipated_energy_kJ": 1e-3 * energy})
        index = energy / (area[:blocks] @ rolled[:blocks])
        assert found["T gamma / A [N/mm2]"] == pytest.approx(1e-6 * index), command
        assert found["wear rate [um/km]"] == pytest.approx(1e9 * 7e-5 * index / (700.0 * 9.80665e6)), command


def falling(folder: Path, sizes: dict[str, float]) -> list[Row]:
    """Repeats in full sliding with friction that falls with creepage, each by its own size; rows as close-loop's."""
    rng = np.random.default_rng(5)
    creepage = np.tile((2.0, 3.0, 4.5, 6.0, 8.0), 3)
    steps = "".join(f"  {{ creepage_percent = {c} }},\n" for c in creepage[:5])
    text = f"{VALID[: VALID.index('steps = [')]}steps = [\n{steps}]\n"
    for name, size in sizes.items():
        ratio = 0.5 * (1.0 - size * -np.expm1(-creepage / 3.0)) + 0.002 * rng.standard_normal(len(creepage))
        data = "".join(f"{c},{r:.5f}\n" for c, r in zip(creepage, ratio, strict=True))
        (folder / f"{name}.csv").write_text(f"creepage [%],traction ratio [1]\n{data}")
        named = text.replace('"small"', f'"{name}"\ngroup = "dry"')
        (folder / f"{name}.toml").write_text(f'{named}\n[measured]\ntraction = "{name}.csv"\n')
    found = {"verdict": "effects_found", "effects": "falling_friction", "falling_friction probability [1]": 0.9}
    found |= {"falling_friction alternatives": "film_breakdown; mu over creepage"}
    return [Row(n, f"{n}.toml", 0, group="dry", found=found if n == "a" else {"verdict": "unexplained"}) for n in sizes]


def test_what_a_group_lacks_is_looked_for_in_all_of_its_tests(folder: Path) -> None:
    rows = falling(folder, {"a": 0.3, "b": 0.3, "c": 0.0})
    (common,) = common_of(plan(["?.toml"]), rows, lambda _what, _fraction: None)
    (term,) = common.json["terms"]
    assert (term["term"], term["holds"], term["tests"]) == ("falling_friction", "some", ["a", "b"])
    assert term["one_set"] is True
    assert common.summary[0].startswith("group dry, 3 tests: falling_friction in some (2 of 3: a and b; 90 %: ")
    assert (
        common.columns["a"]["falling_friction in group [1]"]
        > 0.9
        > 0.3
        > common.columns["c"]["falling_friction in group [1]"]
    )
    figure = figure_of("close-loop", table_of(rows), outcome_of(table_of(rows)), [common], "synthetic")
    assert figure is not None
    figure()
