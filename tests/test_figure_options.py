"""What figures are drawn over, panels as files of their own, and style sheets of the user's."""

from __future__ import annotations

import io
import tomllib
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from definitions import VALID, outcome, shipped
from matplotlib.colors import to_hex
from PIL import Image

from twindisc_cli.cli import main
from twindisc_cli.definition import load
from twindisc_cli.errors import DefinitionError
from twindisc_cli.figures.style import BLUE, house_style, name_axes, page
from twindisc_cli.figures.time_axis import TimeAxis, time_axis, time_drawn_over
from twindisc_cli.results.drawn import drawn_files

SPEED, TURN = 2.0 * np.pi * 0.03 * 50.0, 0.02
"""Rolling speed [m/s] and duration of a revolution [s] of 3000 rpm on discs of 30 mm."""


def exit_code(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return int(end.value.code or 0)


@pytest.fixture
def paused(tmp_path: Path) -> TimeAxis:
    """A test of two steps of 4200 revolutions, with 100 s of standing between them."""
    steps = "steps = [{ creepage_percent = 1.0 }, { pause_s = 100 }, { creepage_percent = 2.0 }]\n"
    text = VALID[: VALID.index("steps = [")] + steps + VALID[VALID.index("[model]") :]
    (tmp_path / "paused.toml").write_text(text)
    return TimeAxis(load(tmp_path / "paused.toml").experiment, "cycles")


def test_revolutions_and_distance_grow_while_the_discs_turn_only(paused: TimeAxis) -> None:
    ends = np.array([0.0, 42.0, 84.0, 184.0, 226.0, 268.0])
    assert paused.drawn(ends) == pytest.approx([0.0, 2100.0, 4200.0, 4200.0, 6300.0, 8400.0])
    assert replace(paused, over="km").drawn(ends) == pytest.approx(1e-3 * SPEED * TURN * paused.drawn(ends))
    assert replace(paused, over="min").drawn(ends) == pytest.approx(ends / 60.0)
    assert replace(paused, over="km").axis_label == "rolled distance [km]"


@pytest.mark.parametrize(("command", "panels"), [("simulate-wear", "def"), ("thermal", "abc")])
@pytest.mark.parametrize(("over", "label"), [("", "time [s]"), ("min", "time [min]"), ("cycles", "revolutions [1]")])
def test_figures_of_time_are_drawn_over_what_is_asked(command: str, panels: str, over: str, label: str) -> None:
    test = shipped("ambient").experiment
    with house_style(), time_drawn_over(over):
        draw = outcome("ambient", command).figure
        assert draw is not None
        figure = draw()
        last = float(time_axis(test).drawn(test.history.end_time[-1]))
    for letter in panels:
        axes = figure.axes["abcdef".index(letter)]
        assert axes.get_xlabel() == label
        assert max(line.get_xdata()[-1] for line in axes.lines if len(line.get_xdata()) > 2) == pytest.approx(last)


def test_an_unknown_axis_of_time_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(["thermal", "a.toml", "--over", "miles"]) == 2
    assert "s, min, h, cycles, km, not miles" in capsys.readouterr().err


def test_every_panel_is_a_file_that_says_where_its_data_are_from() -> None:
    red = np.array([213, 94, 0])
    with house_style():
        draw = outcome("ambient", "contact").figure
        assert draw is not None
        files = drawn_files("contact", draw(), ("png",), 100, panels=True)
        whole = drawn_files("contact", draw(), ("png",), 100, panels=False)
    assert list(whole) == ["contact.png"]
    assert files["contact.png"] == whole["contact.png"]
    assert list(files) == ["contact.png", *(f"contact-{letter}.png" for letter in "abcdefg")]
    images = [np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int) for data in files.values()]
    for image in images[1:]:
        assert image.shape[0] < 0.5 * images[0].shape[0]
        stamp = image[-25:, : image.shape[1] // 2]
        assert np.any(np.abs(stamp - red).sum(axis=2) < 30)


def test_a_panel_is_as_it_is_on_the_page() -> None:
    with house_style():
        figure, (left, right) = page(1, 2, height=3.0, title="two", provenance="measured")
        left.plot([0, 1], [0, 1])
        right.plot([0, 1], [1, 0])
        name_axes(left, "a", "b", "rising")
        name_axes(right, "c", "d", "falling")
        assert list(drawn_files("two", figure, ("svg",), 100, panels=True)) == ["two.svg", "two-a.svg", "two-b.svg"]
        assert [left.get_visible(), right.get_visible()] == [False, True]
        assert right.get_title(loc="left") == "falling"


def test_a_style_sheet_is_put_over_the_style_of_the_house(tmp_path: Path) -> None:
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("font.size: 12\naxes.prop_cycle: cycler(color=['k', 'r'])\nfigure.dpi: 20  # stays as asked\n")
    with house_style(sheet):
        assert matplotlib.rcParams["font.size"] == 12.0
        assert matplotlib.rcParams["axes.grid"]
        assert to_hex(BLUE) == "#000000"
        assert matplotlib.rcParams["figure.dpi"] != 20
    with house_style():
        assert to_hex(BLUE) == "#0072b2"


@pytest.mark.parametrize(("text", "message"), [
    ("font.size: 8\naxes.gird: True\n", "2: axes.gird: matplotlib has no such setting, did you mean axes.grid?"),
    ("\naxes.grid: perhaps\n", "2: axes.grid: Cannot convert 'perhaps' to bool"),
    ("\x89PNG\xff", "no text"),
])  # fmt: skip
def test_what_is_no_style_sheet_is_said_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_bytes(text.encode("latin-1"))
    with pytest.raises(DefinitionError) as error, house_style(sheet):
        pass
    assert message in str(error.value)


def test_another_style_axis_or_panels_make_the_result_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(VALID.replace("[history]", "convection_W_K = 1.6\n\n[history]"))
    Path("mine.mplstyle").write_text("font.size: 12\n")
    name = tomllib.loads(VALID)["test"]["name"]
    for options in ([], ["--over", "km"], ["--over", "min"], ["--panels"], ["--style", "mine.mplstyle"]):
        assert exit_code(["thermal", "small.toml", *options, "--dry-run"]) == 0
        assert "would be made" in capsys.readouterr().out
        assert exit_code(["thermal", "small.toml", *options, "-q"]) == 0
        assert exit_code(["thermal", "small.toml", *options, "--dry-run"]) == 0
        assert "up to date" in capsys.readouterr().out
    assert not list(Path("results", name).glob("thermal-?.png"))
    Path("mine.mplstyle").write_text("font.size: 11\n")
    assert exit_code(["thermal", "small.toml", "--style", "mine.mplstyle", "--dry-run"]) == 0
    assert "would be made" in capsys.readouterr().out
