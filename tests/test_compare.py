"""compare and report: results of several tests overlaid, and all results of one gathered."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas
import pytest

from twindisc_cli.cli import main

DEFINITION = """schema = 1
[test]
name = "{name}"
[rig]
normal_load_N = {load}
rolling_speed_m_s = 9.42
disc1 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = inf }}
disc2 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }}
[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700
[history]
revolutions_per_iteration = 3000
steps = [{{ creepage_percent = 1.0 }}, {{ creepage_percent = 2.0 }}, {{ creepage_percent = 5.0 }}]
[model]
wear_coefficient = 1e-4
[measured]
traction = "{name}.csv"
"""
MU = {"soft": (50.0, 0.4), "hard": (100.0, 0.5)}


def left(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return int(end.value.code or 0)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """identify-mu and simulate-wear of two tests that slide all over, with mu 0.4 and 0.5."""
    home = tmp_path_factory.mktemp("compared")
    for name, (load, mu) in MU.items():
        (home / f"{name}.toml").write_text(DEFINITION.format(name=name, load=load))
        rows = "".join(f"{v},{mu}\n" for v in (2.0, 5.0))
        (home / f"{name}.csv").write_text(f"creepage [%],traction ratio [1]\n1.0,{mu}\n{rows}")
        for command in ("identify-mu", "simulate-wear"):
            assert left([command, str(home / f"{name}.toml"), "-q", "-o", str(home / "results")]) == 0
    return home / "results"


def test_tests_are_overlaid_with_what_differs(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(results / name) for name in MU]
    assert left(["compare", *folders, "--json", "--xlsx", "-o", str(results)]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tests"] == list(MU)
    assert said["differs"] == {"rig.normal_load_N": ["50", "100"]}
    assert {"creep_curve", "friction", "profile", "depth", "wear"} <= {q["name"] for q in said["quantities"]}
    table = pandas.read_csv(results / "compare/friction.csv")
    for name, (_, mu) in MU.items():
        mine = table[table["test"] == name]
        assert mine["creepage [%]"].to_numpy() == pytest.approx([1.0, 2.0, 5.0])
        assert mine["coefficient of friction [1]"].to_numpy() == pytest.approx(mu, abs=1e-9)
        assert mine["what differs"].iloc[0] == f"{name}: normal load {MU[name][0]:g} N"
    sheet = pandas.read_excel(results / "compare/compare.xlsx", sheet_name="friction", engine="openpyxl")
    assert sheet.shape == table.shape
    assert (results / "compare/depth.png").stat().st_size > 10_000


def test_worn_volume_follows_the_energy(results: Path) -> None:
    assert left(["compare", *(str(results / name) for name in MU), "-q", "-o", str(results)]) == 0
    table = pandas.read_csv(results / "compare/wear.csv")
    hardness = 700 * 9.80665e6
    expected = 1e-4 * table["dissipated energy [kJ]"] * 1e3 / hardness * 1e9
    assert table["worn volume [mm3]"].to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-3)


@pytest.mark.parametrize(("over", "header", "last"), [
    ("", "time [min]", 9000 * 2 * np.pi * 0.03 / 9.42 / 60.0),
    ("cycles", "revolutions [1]", 9000.0),
    ("km", "rolled distance [km]", 9000 * 2 * np.pi * 0.03e-3),
])  # fmt: skip
def test_histories_run_over_time_cycles_or_distance(results: Path, over: str, header: str, last: float) -> None:
    folders = [str(results / name) for name in MU]
    assert left(["compare", *folders, *(["--over", over] if over else []), "-q", "-o", str(results)]) == 0
    assert pandas.read_csv(results / "compare/depth.csv")[header].max() == pytest.approx(last, rel=1e-6)


def test_tests_of_one_name_are_called_after_their_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = DEFINITION.partition("[measured]")[0].format(name="one", load=100.0)
    text = text.replace("wear_coefficient", "friction_coefficient = 0.4\nwear_coefficient")
    for place, steps in (("a", "2.0 }"), ("b", "2.0, iterations = 7 }")):
        (tmp_path / f"{place}.toml").write_text(text.replace("2.0 }", steps))
        assert (
            left(["simulate-wear", str(tmp_path / f"{place}.toml"), "-q", "-o", str(tmp_path / place / "results")]) == 0
        )
    folders = [str(tmp_path / place / "results/one") for place in "ab"]
    capsys.readouterr()
    assert left(["compare", *folders, "--json", "-o", str(tmp_path / "both")]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tests"] == ["a/results/one", "b/results/one"]
    assert said["differs"] == {"history.steps[2].iterations": ["1", "7"]}
    depth = pandas.read_csv(tmp_path / "both/compare/depth.csv")
    assert depth.groupby("test")["what differs"].unique().map(list).to_dict() == {
        "a/results/one": ["a/results/one: iterations 1 in step 2"],
        "b/results/one": ["b/results/one: iterations 7 in step 2"],
    }


def test_what_cannot_be_compared_is_said(results: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert left(["compare", str(results / "soft")]) == 2
    assert "one test alone" in capsys.readouterr().err
    assert left(["compare", str(tmp_path / "nothing"), str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert "no such result" in err
    assert "holds no result" in err
    broken = tmp_path / "identify-mu.h5"
    broken.write_bytes((results / "soft/identify-mu.h5").read_bytes()[:-10])
    assert left(["compare", str(broken), str(results / "hard")]) == 2
    assert "run its command again" in capsys.readouterr().err
    assert left(["compare", str(results / "soft"), str(results / "hard"), "--over", "miles"]) == 2


def test_a_report_gathers_all_commands_on_one_page_and_two_for_print(results: Path) -> None:
    assert left(["report", str(results / "soft"), "-q"]) == 0
    page = (results / "soft/report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 2
    assert "http://" not in page and "https://" not in page
    for title in ("Which μ is behind each measured T/N?", "How deep and wide does the track become?"):
        assert title in page
    pdf = (results / "soft/report.pdf").read_bytes()
    assert pdf.startswith(b"%PDF")
    assert len(re.findall(rb"/Type /Page\b", pdf)) == 2
    assert left(["report", str(results.parent / "soft.toml"), "-q", "-o", str(results)]) == 0
    assert (results / "soft/report.pdf").read_bytes() == pdf


def test_a_report_keeps_the_columns_of_a_table(results: Path) -> None:
    """identify-mu says a line of a step in columns: a browser would run them together."""
    assert left(["report", str(results / "soft"), "-q"]) == 0
    page = (results / "soft/report.html").read_text(encoding="utf-8")
    table = page[page.index("<pre>step  creepage") : page.index("</pre>")]
    assert all("  " in line.strip() for line in table.splitlines())
    assert "<li>step" not in page


def test_a_report_says_what_was_made_from_another_definition(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = DEFINITION.partition("[measured]")[0].format(name="one", load=100.0)
    text = text.replace("wear_coefficient", "friction_coefficient = 0.4\nwear_coefficient")
    path, results = tmp_path / "one.toml", str(tmp_path / "results")

    def warned(what: str) -> list[str]:
        capsys.readouterr()
        assert left(["report", what, "-o", results]) == 0
        page = (tmp_path / "results/one/report.html").read_text(encoding="utf-8")
        lines = re.findall(
            r"(\S+): warning: made from another definition or other data than (.*)", capsys.readouterr().out
        )
        assert page.count("warning: made from another definition") == len(lines)
        return [" / ".join(line) for line in lines]

    path.write_text(text)
    for command in ("simulate-wear", "check"):
        left([command, str(path), "-q", "-o", results])
    assert warned(str(path)) == warned(f"{results}/one") == []
    path.write_text(f"# a remark\n{text}")
    assert warned(str(path)) == []
    path.write_text(text.replace("wear_coefficient = 1e-4", "wear_coefficient = 2e-4"))
    again = "the test as it is now: run {0} again"
    assert warned(str(path)) == [f"{name} / {again.format(name)}" for name in ("check", "simulate-wear")]
    left(["check", str(path), "-q", "-o", results])
    assert warned(str(path)) == ["simulate-wear / the test as it is now: run simulate-wear again"]
    assert warned(f"{results}/one") == ["simulate-wear / check: run simulate-wear again"]


def test_a_report_names_the_results_that_it_leaves_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = DEFINITION.partition("[measured]")[0].format(name="one", load=100.0)
    path, results = tmp_path / "one.toml", tmp_path / "results"
    path.write_text(text.replace("wear_coefficient", "friction_coefficient = 0.4\nwear_coefficient"))
    for command in ("simulate-wear", "check"):
        left([command, str(path), "-q", "-o", str(results)])
    (results / "one/simulate-wear.png").unlink()
    assert left(["report", str(results / "one")]) == 0
    assert "simulate-wear: left out, its result simulate-wear.png beside it is gone" in capsys.readouterr().out


def test_a_report_of_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert left(["report", str(tmp_path)]) == 2
    assert "holds no result of a command" in capsys.readouterr().err
    (tmp_path / "t.toml").write_text("[test]\n")
    assert left(["report", str(tmp_path / "t.toml")]) == 2
    assert "neither the folder" in capsys.readouterr().err


PAUSED = """\
schema = 1
{history}
[test]
name = "{name}"
[rig]
normal_load_N = 72.0
mean_speed_rpm = 60.0
disc1 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = inf }}
disc2 = {{ rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }}
[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700
{steps}
[model]
wear_coefficient = 1e-4
friction_coefficient = 0.5
[measured]
log = "log.csv"
"""
STEPS = """\
[history]
revolutions_per_iteration = 60
steps = [{ creepage_percent = 2.0, iterations = 2 }, { pause_s = 100.0 }, { creepage_percent = 2.0, iterations = 2 }]
"""


def test_the_rolled_distance_stands_still_in_pauses(tmp_path: Path) -> None:
    """Two minutes at one turn a second, a pause, two minutes more; as planned, and as read from the log."""
    runs = (np.abs(np.arange(340.0) - 169.5) > 50.0).astype(float)
    rows = [f"{n},{60.6 * on:.4f},{59.4 * on:.4f},{1.08 * on:.4f},{72 * on:g}" for n, on in enumerate(runs)]
    header = "time [s],speed 1 [rpm],speed 2 [rpm],torque [N m],normal load [N]"
    (tmp_path / "log.csv").write_text("\n".join([header, *rows]) + "\n")
    for name, history, steps in (("planned", "", STEPS), ("measured", 'history = "measured"', "")):
        (tmp_path / f"{name}.toml").write_text(PAUSED.format(name=name, history=history, steps=steps))
        assert left(["simulate-wear", str(tmp_path / f"{name}.toml"), "-q", "--no-figure", "-o", str(tmp_path)]) == 0
    folders = [str(tmp_path / name) for name in ("planned", "measured")]
    assert left(["compare", *folders, "--over", "km", "-q", "-o", str(tmp_path)]) == 0
    table = pandas.read_csv(tmp_path / "compare/depth.csv")
    for _, of_test in table.groupby("test"):
        assert of_test["rolled distance [km]"].max() == pytest.approx(240 * 2 * np.pi * 0.03e-3, rel=0.02)
