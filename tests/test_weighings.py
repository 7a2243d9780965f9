"""Weighings as laboratories write them, logs in several files, and what a .toml beside them says, on made-up tests."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import suros
from suros import RADIUS, REVOLUTIONS, RPM, Truth
from test_import import command

from twindisc_cli.commands import fit_k
from twindisc_cli.definition import load
from twindisc_cli.definition.write import relocate
from twindisc_cli.errors import DefinitionError, MeasurementError

TRUTH = Truth(k_disc1=2e-4)
LOG, WEIGHED = suros.run(TRUTH, np.random.default_rng(1))
BLOCKS = suros.raw_log(LOG)
STOPS = np.array([2, 4, 6, 8, 10])
PER_REVOLUTION_KM = 2e-3 * np.pi * RADIUS
BLOCK = """\
[measured]
balance_mg = 0.3
provenance = "synthetic"
[rig]
disc1 = { rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10 }
disc2 = { rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10 }
[material]
youngs_modulus_GPa = 209
hardness_HV = 280
density_kg_m3 = 7850
[model]
traction = "exact"
"""


def mass_table(when: str) -> str:
    """The same weighings, counted in one way."""
    if when == "iteration":
        rows = "\n".join(f"{n:g},{disc:g},{mg:.1f}" for n, disc, mg in WEIGHED)
        return f"iteration,disc,mass loss [mg]\n{rows}\n"
    header, factor = {
        "revolutions": ("revolutions", 1.0),
        "thousands": ("cycles [x1000]", 1e-3),
        "minutes": ("time [min]", 1.0 / RPM),
        "kilometres": ("distance [km]", PER_REVOLUTION_KM),
    }[when]
    rows = "\n".join(f"{n * factor:.8g},{a:.4f},{b:.4f}" for n, a, b in suros.weights(WEIGHED))
    return f"{header},weight disc 1 [g],weight disc 2 [g]\n{rows}\n"


def imported(folder: Path, mass: str, capsys: pytest.CaptureFixture[str], block: str = BLOCK) -> tuple[int, Path, str]:
    """The definition that import writes of the log with a table of masses."""
    (folder / "rig.txt").write_text(suros.raw_text([row for rows in BLOCKS for row in rows]))
    (folder / "mass.csv").write_text(mass)
    (folder / "block.toml").write_text(block)
    files = (folder / name for name in ("rig.txt", "mass.csv", "block.toml"))
    code, out, err = command("import", *files, "-o", folder / "to", capsys=capsys)
    return code, folder / "to" / "rig.toml", out + err


@pytest.mark.parametrize("when", ["iteration", "revolutions", "thousands", "minutes", "kilometres"])
def test_a_weighing_lies_where_the_counter_says(when: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, path, told = imported(tmp_path, mass_table(when), capsys)
    assert code == 0, told
    test = load(path).experiment
    mass = test.measured.mass
    assert mass is not None
    turned = np.cumsum(test.history.revolutions)[mass.iteration - 1]
    np.testing.assert_allclose(turned, np.tile(REVOLUTIONS * STOPS, 2), rtol=2e-3)
    assert mass.disc.tolist() == [1] * 5 + [2] * 5
    loss = [mg for disc in (1, 2) for _, own, mg in WEIGHED if own == disc]
    np.testing.assert_allclose(1e6 * mass.loss, loss, atol=0.15)
    np.testing.assert_allclose(1e6 * mass.uncertainty, 0.3 * np.sqrt(2.0))
    if when == "iteration":
        assert tomllib.loads(path.read_text())["history"] == {"revolutions_per_iteration": 2500, "steps": "measured"}
        assert "is taken for the end of the history: 2500 revolutions each" in told


@pytest.mark.parametrize("when", ["iteration", "minutes"])
def test_k_is_that_of_the_discs(when: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, path, _ = imported(tmp_path, mass_table(when), capsys)
    k = fit_k.run(load(path)).json["K_of_discs"]
    assert k["1"] == pytest.approx(TRUTH.k_disc1, rel=0.01)
    assert k["2"] == pytest.approx(TRUTH.k, rel=0.01)


def test_what_is_said_beside_the_files_is_in_the_definition(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, path, told = imported(tmp_path, mass_table("minutes"), capsys)
    assert code == 0, told
    written = tomllib.loads(path.read_text())
    assert written["material"] == {
        "youngs_modulus_GPa": 209, "poisson_ratio": 0.3, "hardness_HV": 280, "density_kg_m3": 7850,
    }  # fmt: skip
    assert written["measured"]["provenance"] == "synthetic"
    assert written["model"] == {"traction": "exact"}
    assert "key material.hardness_HV" not in told
    assert "key material.poisson_ratio" in told
    code, _, told = imported(tmp_path / "to", mass_table("minutes"), capsys, "[measured]\nbalnce_mg = 0.3\n")
    assert (code, "did you mean balance_mg?" in told) == (2, True)


def test_two_discs_are_cylinders_and_a_balance_is_as_good_as_its_last_digit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """At 7.2 kN a crowned disc would be pressed with 4 GPa."""
    code, path, told = imported(tmp_path, mass_table("revolutions"), capsys, '[test]\nname = "rig"\n')
    assert code == 0, told
    test = load(path).experiment
    assert test.rig.is_line
    assert float(test.rig.patch.p0) < 2e9
    assert "balance_mg = 0.1: the last digit of the weighings" in told


@pytest.mark.parametrize("goes_on", [True, False])
def test_logs_in_order_are_one(goes_on: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, path, _ = imported(tmp_path, mass_table("minutes"), capsys)
    whole, more = load(path).experiment, tmp_path / "more"
    more.mkdir()
    names = []
    for number, rows in enumerate(BLOCKS):
        start = 0.0 if goes_on else rows[0][0]
        names.append(more / f"block{number:02d}.txt")
        names[-1].write_text(suros.raw_text([(row[0] - start, *row[1:]) for row in rows]))
    (tmp_path / "block.toml").write_text(BLOCK.replace("balance_mg = 0.3\n", ""))
    code, out, err = command("import", *names, tmp_path / "block.toml", "-o", tmp_path / "all", capsys=capsys)
    assert code == 0, err
    assert ("how long it paused is not known" in out) != goes_on
    parts = load(tmp_path / "all" / "block00.toml")
    assert parts.rows[0].used == 250
    one, other = whole.measured.traction, parts.experiment.measured.traction
    assert one is not None
    assert other is not None
    np.testing.assert_allclose(other.time, one.time, atol=1e-6)
    np.testing.assert_allclose(other.ratio, one.ratio, atol=1e-9)
    text = (tmp_path / "all" / "block00.toml").read_text()
    moved = tomllib.loads(relocate(text, source=tmp_path / "all", target=more))
    assert moved["measured"]["log"] == [name.name for name in names]
    code, _, err = command("import", names[1], names[0], "-o", tmp_path / "wrong", capsys=capsys)
    assert (code, "is the order right?" in err) == ((3, True) if goes_on else (0, False))


def stamped(rows: list[tuple[float, ...]], begin: float) -> str:
    lines = []
    for time, *others in rows:
        at = round(begin + time)
        lines.append(f"{at // 3600 % 24:02d}:{at // 60 % 60:02d}:{at % 60:02d};" + ";".join(f"{v:.4f}" for v in others))
    return "\n".join(["Time;Upper speed [rpm];Lower speed [rpm];Torque [N m];Load [kN]", *lines]) + "\n"


def test_time_stamps_say_how_long_was_paused_between_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The second begins after midnight, 3600 s later than it would without a pause."""
    one, two = tmp_path / "one.txt", tmp_path / "two.txt"
    one.write_text(stamped(BLOCKS[0], 23.7 * 3600))
    two.write_text(stamped(BLOCKS[2], 23.7 * 3600 + 3600))
    code, _, err = command("import", one, two, "-o", tmp_path / "to", capsys=capsys)
    assert code == 0, err
    history = load(tmp_path / "to" / "one.toml").experiment.history
    lasted = 3600 + BLOCKS[2][0][0] - BLOCKS[0][-1][0] + suros.IDLE * suros.SPACING
    assert float(history.duration[~history.driven].sum()) == pytest.approx(lasted, abs=2 * suros.SPACING)


HEAD = "revolutions,weight disc 2 [g]\n"


@pytest.mark.parametrize(
    ("mass", "message"),
    [
        (HEAD + "5000,174.2\n10000,174.1\n", "the first weight of disc 2 must be that of the new one"),
        (HEAD + "0,174.2\n50000,174.1\n", "50000 lies beyond the end of the test, 25000"),
        (HEAD + "0,174.2\n5000,174.3\n", "the discs grow heavier"),
        (HEAD + "0,174.2\n10000,174.1\n5000,174.0\n", "revolutions 5000 is not after the row before"),
        ("cycles,weight disc 2 [kg]\n0,174.2\n5000,174.0\n", "200 g is not wear; check the unit"),
        ("time,weight disc 2 [g]\n08:00:00,174.2\n09:00:00,174.0\n", "give revolutions or minutes of running"),
        ("iteration,mass loss [mg]\n0,3\n10,5\n", "the new disc has lost nothing yet"),
    ],
)
def test_weighings_that_cannot_be_are_told(
    mass: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, path, told = imported(tmp_path, mass, capsys)
    assert (code, message in told) == (3, True), told
    assert not path.exists()


def test_on_a_history_that_is_given_weighings_lie_at_ends_of_iterations(tmp_path: Path) -> None:
    path = suros.write(tmp_path, TRUTH)
    (tmp_path / "mass.csv").write_text(mass_table("revolutions"))
    mass = load(path).experiment.measured.mass
    assert mass is not None
    assert mass.iteration.tolist() == STOPS.tolist() * 2
    (tmp_path / "mass.csv").write_text(mass_table("revolutions").replace("10000,", "11000,"))
    with pytest.raises(MeasurementError, match="no iteration ends there; the nearest end is at 10000"):
        load(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('steps = "measured"', 'steps = "found"', 'must be a list of steps, or "measured"'),
        ("log = ", "# log = ", "needs a log or a traction under"),
        ('steps = "measured"', 'steps = "measured"\nseparate = true', "follow on each other; remove it"),
    ],
)
def test_steps_that_are_measured(
    old: str, new: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, path, _ = imported(tmp_path, mass_table("iteration"), capsys)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(DefinitionError, match=message):
        load(path)
