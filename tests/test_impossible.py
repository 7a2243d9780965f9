"""What cannot be, and what hardly anybody would give: a sentence and an exit code, never a traceback or a number."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write

from twindisc_cli.cli import main
from twindisc_cli.commands._runner import quiet
from twindisc_cli.definition import load_text
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import ValidityError

COMMANDS = ("friction-chart", "simulate-wear", "thermal", "contact", "check")
WEARS = VALID.replace("= 100.0", "= 100.0\nconvection_W_K = 2.0") + "wear_coefficient = 7e-5\n"
MU = """
[laws.own]
quantity = "{quantity}"
covariate = "{covariate}"
at = [0.0, 100.0]
{kind} = [{value}, {value}]
"""
STANDS = """steps = [
  { pause_s = 30 },
  { creepage_percent = 0.5, iterations = 2 },
  { creepage_percent = 1.0, yaw_mrad = 1.0 },
  { pause_s = 60 },
  { creepage_percent = -1.0, normal_load_N = 500.0, rolling_speed_m_s = 2.0, yaw_mrad = -1.0 },
]
"""


def told(*arguments: object, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Exit code and what a call says went wrong."""
    with pytest.raises(SystemExit) as left:
        main([str(argument) for argument in arguments])
    return int(left.value.code or 0), capsys.readouterr().err


def with_steps(text: str) -> str:
    """The definition with pauses, yaw, another load and another speed."""
    before, _, rest = text.partition("steps = [")
    return before + STANDS + rest.partition("\n]\n")[2]


# States that cannot be


def test_a_recorded_ratio_that_cannot_be_is_refused_on_the_chart_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The chart begins at the first moment of a step, before those that the test's own history is computed at."""
    monkeypatch.chdir(tmp_path)
    law = MU.format(quantity="traction_ratio", covariate="time_in_step", kind="shift", value="14.0")
    write(tmp_path, WEARS + law.replace("100.0]", "4.0]").replace("14.0]", "-2.0]"))
    code, said = told("friction-chart", "small.toml", capsys=capsys)
    assert code == 4
    assert "small.toml: laws.own: makes T/N 14" in said


def test_a_chart_of_negative_ratios_has_room_for_its_panels() -> None:
    """A torque meter that is off by more than the friction: with zero at the bottom there was no axis."""
    law = MU.format(quantity="traction_ratio", covariate="time", kind="shift", value="-1.0")
    result, files = quiet("friction-chart", load_text(WEARS + law, Path("small.toml")), Path())
    assert result.exit_code == 0
    assert files["friction-chart.png"]


def test_friction_that_vanishes_transmits_nothing() -> None:
    """A law that is zero without a flash, at a creepage of which there is hardly any."""
    law = MU.format(quantity="mu", covariate="flash_temperature", kind="factor", value="0.0")
    test = load_text(WEARS + law, Path("small.toml"))
    with pytest.raises(ValidityError, match="the traction bound mu p must be finite"):
        quiet("contact", test, Path())
    result, _ = quiet("friction-chart", test, Path())
    (apparent,) = (array.values for array in result.dataset.arrays if array.name == "apparent_friction")
    assert np.abs(apparent).max() < 1e-20


@pytest.mark.parametrize(
    ("quantity", "covariate", "kind", "value", "says"),
    [
        ("mu", "time", "factor", "-2.0", "makes the coefficient of friction -1.2"),
        ("mu", "time", "factor", "1e6", "makes the coefficient of friction 6e+05"),
        ("wear", "wear_index", "factor", "-2.0", "makes the factor on the wear coefficient -2"),
        ("wear", "place", "factor", "-2.0", "makes the factor on the wear coefficient -2"),
        ("slope", "time", "factor", "-0.5", "makes the factor on the initial slope of the traction -0.5"),
        ("heat", "time", "factor", "-1.0", "makes the heat into the disc"),
        ("convection", "time", "factor", "-1.0", "makes the convection -2"),
        ("environment", "time", "shift", "-300.0", "makes the absolute temperature of the disc"),
        ("traction_ratio", "time", "shift", "4.0", "makes T/N"),
    ],
)
def test_a_law_that_makes_an_impossible_state_is_refused_by_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], quantity: str, covariate: str, kind: str, value: str, says: str
) -> None:
    path = write(tmp_path, WEARS + MU.format(quantity=quantity, covariate=covariate, kind=kind, value=value))
    for command in COMMANDS:
        code, why = told(command, path, "-o", tmp_path, capsys=capsys)
        assert code == 4, command
        assert f"small.toml: laws.own: {says}" in why
    assert not (tmp_path / "small").exists()


def test_the_one_of_several_that_is_to_blame_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    harmless = MU.format(quantity="mu", covariate="time", kind="factor", value="1.1").replace("own", "harmless")
    text = WEARS + harmless + "[effects.temperature_dependent_friction]\nper_kelvin = 0.15\n"
    code, why = told("thermal", write(tmp_path, text), "-o", tmp_path, capsys=capsys)
    assert code == 4
    assert "small.toml: effects.temperature_dependent_friction: makes the coefficient of friction" in why


def test_what_a_definition_gives_by_itself_is_no_laws_fault(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = WEARS.replace("coefficient = 0.6", "coefficient = 2.5")
    lowered = MU.format(quantity="mu", covariate="time", kind="factor", value="0.9")
    assert told("contact", write(tmp_path, text + lowered), "-o", tmp_path, capsys=capsys)[0] == 0


def test_a_line_of_the_chart_that_is_not_reached_has_no_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    soft = WEARS + MU.format(quantity="slope", covariate="time", kind="factor", value="1e-4")
    with pytest.raises(SystemExit):
        main(["friction-chart", str(write(tmp_path, soft)), "-o", str(tmp_path)])
    out = capsys.readouterr().out
    assert "nowhere below 200 % (mu = 0.7)" in out
    assert "inf" not in out


# Pauses, yaw and effects together


@pytest.mark.parametrize("name", ["", *catalogue()])
def test_every_effect_stands_still_in_a_pause_and_goes_on_after_it(tmp_path: Path, name: str) -> None:
    declared = "".join(f"{p.name} = {p.start}\n" for p in catalogue()[name].params) if name else ""
    text = with_steps(WEARS) + (f"[effects.{name}]\n{declared}" if name else "")
    result, _ = quiet("thermal", load_text(text, tmp_path / "small.toml"), tmp_path)
    assert not result.undefined


# Files that are none, and files in disorder


def test_patterns_that_match_no_file_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "set" / "a").mkdir(parents=True)
    code, why = told("campaign", "check", tmp_path / "set/*", capsys=capsys)
    assert code == 2
    assert "but no file" in why
    os.mkfifo(tmp_path / "pipe.toml")
    for path in (tmp_path / "pipe.toml", "/dev/null"):
        code, why = told("campaign", "check", path, capsys=capsys)
        assert code == 2
        assert f"{path}: is a pipe or a device" in why


def test_times_that_fall_from_step_to_step_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.csv").write_text("time [s],step,creepage [%],traction ratio [1]\n1,2,1,0.6\n0,1,0.5,0.15\n")
    code, why = told("import", tmp_path / "rig.csv", "-o", tmp_path / "mine", capsys=capsys)
    assert code == 3
    assert "rig.csv:3: time [s]: time 0 is earlier than the row before" in why


def test_times_that_begin_anew_with_each_step_are_counted_on_by_the_spacing_within(tmp_path: Path) -> None:
    rows = [(t, step, 0.5 * step, 0.3) for step in (1, 2, 3) for t in (0, 10)]
    text = "time [s],step,creepage [%],traction ratio [1]\n" + "".join(f"{t},{n},{v},{r}\n" for t, n, v, r in rows)
    (tmp_path / "rig.csv").write_text(text)
    text = VALID.partition("[history]")[0] + '[measured]\nlog = "rig.csv"\n'
    samples = load_text('history = "measured"\n' + text, tmp_path / "x.toml").experiment.measured.traction
    assert samples is not None
    assert samples.time[-1] - samples.time[0] == pytest.approx(50.0)


def test_a_patch_as_large_as_the_discs_is_beyond_the_theory(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    profile = "y [mm],height [um]\n" + "".join(f"{y / 10},{min(0.0, abs(y) / 10 - 5.0)}\n" for y in range(-90, 91, 3))
    text = VALID.replace("mm = 30.0", "mm = 0.3").replace("normal_load_N = 72.0", "normal_load_N = 72000.0")
    path = write(tmp_path, text, profile=profile)
    for command in ("check", "fit-k"):
        code, why = told(command, path, "-o", tmp_path, capsys=capsys)
        assert code == 4, why
        assert "small.toml: the patch would be" in why


def test_a_cluster_that_asks_for_tls_without_certificates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    path = write(tmp_path, VALID)
    code, why = told("campaign", "check", path, "--scheduler", "tls://127.0.0.1:1", "-o", tmp_path, capsys=capsys)
    assert code == 2
    assert "--scheduler: tls://127.0.0.1:1 asks for TLS" in why


def test_a_key_of_thousands_of_parts_costs_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    began = time.process_time()
    for key in (".".join(["a"] * 20_000), '"a" . ' * 10_000 + "b", "a." * 60 + "a"):
        path = write(tmp_path, f"{VALID}\n{key} = 1\n")
        for command in (("check",), ("campaign", "check")):
            assert "is nested too deeply" in told(*command, path, "-o", tmp_path, capsys=capsys)[1]
    assert time.process_time() - began < 5.0


def test_points_in_texts_remarks_and_numbers_are_no_parts_of_keys(tmp_path: Path) -> None:
    words = "a." * 100
    steps = ", ".join(["{ creepage_percent = 0.5 }"] * 100)
    text = VALID.partition("steps = [")[0] + f"steps = [{steps}] # {words}\n"
    text = text.replace("[test]", f'[test]\ndescription = "{words}"')
    assert load_text(text, tmp_path / "x.toml").experiment.description == words


# The table of a campaign


def test_a_campaign_with_a_density_writes_both_wear_rates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, WEARS.replace("= 700", "= 700\ndensity_kg_m3 = 7800.0"))
    code, why = told("campaign", "simulate-wear", path, "-o", tmp_path, "--workers", "1", capsys=capsys)
    assert code == 0, why
    import h5py

    with h5py.File(tmp_path / "campaign-simulate-wear.h5") as file:
        units = {name: str(file[name].attrs["units"]) for name in file if name.startswith("wear_rate")}
    assert units == {"wear_rate": "um/km", "wear_rate_ug_m_mm2": "ug/m/mm2"}


def test_a_cell_that_a_spreadsheet_would_run_is_a_text(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path, "no = toml =", name="=HYPERLINK(1).toml")
    monkeypatch.chdir(tmp_path)
    code, _ = told("campaign", "check", path.name, "-o", tmp_path, "--workers", "1", capsys=capsys)
    assert code == 2
    row = (tmp_path / "campaign-check.csv").read_text().splitlines()[1]
    assert row.startswith("'=HYPERLINK(1),")
    assert row.endswith(",'=HYPERLINK(1).toml")
