"""friction-chart and identify-mu on the shipped tests, and on bad input."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from definitions import TRACTION, VALID, changed, outcome, shipped, write
from matplotlib.figure import Figure

from twindisc_cli.cli import main
from twindisc_cli.commands import contact, friction_chart, identify_mu
from twindisc_cli.definition import Test, load
from twindisc_cli.errors import MeasurementError
from twindisc_cli.identify.chart import friction_chart as chart
from twindisc_cli.physics import fastsim

NAMES = ("ambient", "cryogenic", "eurosprinter", "mtm_running_in")


@pytest.fixture(scope="module")
def ambient() -> Test:
    return shipped("ambient")


def test_chart_of_the_rig(ambient):
    found = outcome("ambient", "friction-chart").json
    apparent, mu = np.asarray(found["apparent_friction"]), np.asarray(found["mu"])
    creepage = np.asarray(found["creepage_percent"]) / 100.0
    assert apparent.shape == (14, 200)
    assert mu == pytest.approx(0.05 * np.arange(1, 15))
    assert np.all(np.diff(apparent, axis=1) >= 0.0)
    # full sliding at mu = 0.6 above about 1 % creepage (paper, 2.3); G = 79.23 GPa, C11 = 3.9388 (CONTACT rev 2707)
    full = np.asarray(found["full_slip_creepage_percent"])
    slope = 206e9 / 2.6 * 0.170638e-3 * 0.270599e-3 * 3.9388 / 72.0
    assert full == pytest.approx(100.0 * mu * fastsim.FULL_SLIP / slope, rel=1e-3)
    assert full[11] == pytest.approx(1.02, abs=0.01)
    assert apparent == pytest.approx(mu[:, None] * fastsim.saturation(slope * creepage / mu[:, None]), rel=2e-3)


def test_the_light_line_is_where_the_chart_reaches_98_percent(ambient):
    mu = np.array([0.1, 0.4, 0.7])
    once = chart(ambient.experiment, mu=mu, creepage=np.array([0.01]))
    again = [chart(ambient.experiment, mu=mu[[i]], creepage=once.light_line[[i]]).apparent for i in range(3)]
    assert np.ravel(again) == pytest.approx(0.98 * mu, rel=1e-9)


def test_only_the_first_points_in_air_are_not_saturated(ambient):
    states = [point["state"] for point in outcome("ambient", "friction-chart").json["measured"]]
    assert states == ["partial_slip"] * 2 + ["saturated"] * 10
    states = [point["state"] for point in outcome("cryogenic", "friction-chart").json["measured"]]
    assert states == ["saturated"] * 12


def test_declared_effects_bend_the_chart(ambient):
    mu, creepage = np.array([0.3, 0.6]), np.geomspace(1e-4, 0.1, 30)
    plain = chart(ambient.experiment, mu=mu, creepage=creepage)
    layered = chart(
        replace(ambient.experiment, effects={"third_body_layer": {"slope_ratio": 0.5}}), mu=mu, creepage=creepage
    )
    half = chart(ambient.experiment, mu=mu, creepage=0.5 * creepage)
    assert layered.apparent == pytest.approx(half.apparent, rel=1e-9)
    assert layered.light_line == pytest.approx(2.0 * plain.light_line, rel=1e-6)
    assert layered.full_slip == pytest.approx(2.0 * plain.full_slip, rel=0.01)


def test_mu_of_the_reconstruction_is_found_again(ambient):
    # the mu that the traction data were rebuilt from, rounded there to three digits of T/N (data/README.md)
    expected = [0.45, 0.52, 0.55, 0.57, 0.58, 0.60, 0.60, 0.61, 0.62, 0.62, 0.61, 0.60]
    steps = outcome("ambient", "identify-mu").json["steps"]
    assert [step["mu"] for step in steps] == pytest.approx(expected, abs=2e-3)
    assert [step["naive_mu"] for step in steps][:2] == pytest.approx([0.334, 0.491])
    for step in steps:
        assert step["mu_low"] < step["mu"] < step["mu_high"]


def test_every_interval_says_that_it_is_of_90_percent(ambient):
    result = outcome("ambient", "identify-mu")
    assert result.json["interval_percent"] == 90.0
    said = [*result.summary, *(a.long_name for a in result.dataset.arrays), *figure_words(result.figure())]
    levels = [line for line in said if "interval" in line]
    assert len(levels) >= 6
    assert all("90 %" in line for line in levels)
    assert any("90 % interval" in words for words in figure_words(outcome("ambient", "friction-chart").figure()))


def figure_words(figure: Figure) -> list[str]:
    """Titles and legends of a figure."""
    legends = [text.get_text() for axes in figure.axes for text in axes.get_legend().get_texts()]
    return [axes.get_title(loc="left") for axes in figure.axes] + legends


def test_an_effect_of_an_unknown_temperature_is_left_out_and_that_is_said(tmp_path, capsys):
    warm = "\n[effects.temperature_dependent_friction]\nper_kelvin = -0.01\n"
    known = changed(heat_capacity_J_K="heat_capacity_J_K = 100.0\nconvection_W_K = 0.1")
    found = {}
    for name, text in (("plain", VALID), ("unknown", VALID + warm), ("known", known + warm)):
        with pytest.raises(SystemExit):
            path = write(tmp_path, text, traction=TRACTION)
            main(["identify-mu", str(path), "--json", "--force", "-o", str(tmp_path)])
        out, err = capsys.readouterr()
        found[name] = [step["mu"] for step in json.loads(out)["steps"]]
        assert ("temperature_dependent_friction is left out" in err) is (name == "unknown")
    assert found["unknown"] == pytest.approx(found["plain"], rel=1e-9)
    assert found["known"][2] > 1.02 * found["plain"][2]


@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_test_has_its_chart_and_its_mu(name):
    for command in ("friction-chart", "identify-mu"):
        result = outcome(name, command)
        figure = result.figure()
        said = " ".join(text.get_text() for text in figure.texts)
        assert f"{shipped(name).experiment.measured.provenance} data" in said


def test_a_traction_above_the_elastic_limit_is_explained(tmp_path):
    text = "creepage [%],traction ratio [1]\n0.5,0.49\n1,2.4\n2,0.58\n"
    result = identify_mu.run(load(write(tmp_path, traction=text)))
    step = result.json["steps"][1]
    assert step["state"] == "above_elastic_limit"
    assert step["mu"] is None
    for cause in ("creepage", "stiffness", "load"):
        assert cause in step["message"]
        assert cause in "\n".join(result.summary)
    result.figure()


def test_without_traction_there_is_no_mu_but_there_is_a_chart(tmp_path):
    test = load(write(tmp_path))
    with pytest.raises(MeasurementError, match="traction"):
        identify_mu.run(test)
    result = friction_chart.run(test)
    assert result.json["measured"] == []
    result.figure()


def test_what_only_changes_wear_has_no_part_in_the_chart_of_the_unworn_discs(tmp_path):
    terms = "[effects.wear_threshold]\nthreshold_N_mm2 = 2.0\n[effects.wear_partition]\ndisc1_share = 0.4\n"
    terms += '[laws.k]\nquantity = "wear"\ncovariate = "time_s"\nat = [0.0, 100.0]\nfactor = [0.9, 1.1]\n'
    mu, creepage = np.array([0.2, 0.6]), np.array([1e-3, 5e-3, 2e-2])
    plain, wearing = (
        chart(load(write(tmp_path, VALID + more)).experiment, mu=mu, creepage=creepage) for more in ("", terms)
    )
    for name in ("apparent", "light_line", "full_slip"):
        np.testing.assert_array_equal(getattr(wearing, name), getattr(plain, name))


def test_steps_below_full_sliding_and_intervals_without_ends_are_named():
    lines = identify_mu.run(shipped("ambient")).summary
    assert any("T/N of steps 1 to 3, which is below it at a small creepage" in line for line in lines)
    lines = identify_mu.run(shipped("lewis2004")).summary
    assert any(line.startswith("no interval in steps 1 to 8: a single row without") for line in lines)


def test_a_traction_near_the_elastic_limit_has_no_upper_end_and_why(tmp_path):
    """The rows of step 1 scatter across what linear theory allows; contact warns of the step."""
    text = changed(friction_coefficient="", revolutions_per_iteration="revolutions_per_iteration = 4200")
    rows = "".join(f"0.5,{t}\n" for t in (0.9, 1.1, 1.0)) + "1,0.55\n1,0.56\n2,0.58\n2,0.59\n"
    test = load(write(tmp_path, text, traction="creepage [%],traction ratio [1]\n" + rows))
    lines = identify_mu.run(test).summary
    assert any(
        line.startswith("no upper end in step 1: within its error T/N reaches the elastic limit") for line in lines
    )
    assert any(line.startswith("warning: mu of step 1 is hardly known") for line in contact.run(test, step=1).summary)
