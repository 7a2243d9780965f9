"""contact: the paper's Fig. 4 against CONTACT, patches from profiles, effects, and bad input.

CONTACT: open-source release 2025-07-23, rev 2707; mu = 0.6, creepage 0.2 %, N = 72 N, G = 79.3 GPa, nu = 0.3.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from definitions import changed, write

from twindisc_cli.commands import contact
from twindisc_cli.definition import load
from twindisc_cli.errors import DefinitionError
from twindisc_cli.model.contact_fields import stiffness_difference
from twindisc_cli.model.experiment import Measured, ProfileSamples
from twindisc_cli.physics.half_space import DataEdgeError

STEEL = "youngs_modulus_GPa = 206.18"  # G = 79.3 GPa
STEPS = "steps = [{ creepage_percent = 2.0 }, { creepage_percent = 0.2 }, { creepage_percent = 1.0 }] #"


def definition(steps=STEPS, **lines):
    """The small test with other steps; the friction is 0.6 throughout."""
    text = changed(youngs_modulus_GPa=STEEL, **lines)
    head, rest = text.split("steps = [")
    return f"{head}{steps}\n{rest.split(']', 1)[1]}"


def read(folder, text):
    return load(write(folder, text))


@pytest.fixture(scope="module")
def figure_4(tmp_path_factory):
    return contact.run(read(tmp_path_factory.mktemp("contact"), definition()))


def test_the_step_most_in_partial_slip_is_shown(figure_4):
    point = figure_4.json["operating_point"]
    assert point["origin"].startswith("step 2")
    assert (point["mu"], point["creepage_percent"]) == pytest.approx((0.6, 0.2))


def test_exact_theory_of_figure_4(figure_4):
    """CONTACT, exact, in the limit: T/N 0.3251, sticking over 0.655, peak traction 397.5 MPa."""
    found = figure_4.json["exact"]
    assert found["T_over_N"] == pytest.approx(0.3251, abs=0.001)
    assert abs(found["T_over_N"] - 0.3251) < found["T_over_N_error"] < 0.002
    assert found["stick_fraction"] == pytest.approx(0.655, rel=0.01)
    assert found["peak_traction_MPa"] == pytest.approx(397.5, rel=0.01)
    assert figure_4.json["exact_table"]["T_over_N"] == pytest.approx(0.3251, abs=0.001)


def test_simplified_theories_of_figure_4(figure_4):
    """CONTACT on 400 by 400: FASTSIM (parabolic) 0.31603, sticking over 0.7535; FaStrip 0.32861, over 0.6452."""
    assert figure_4.json["fastsim"]["T_over_N"] == pytest.approx(0.31603, abs=0.003)
    assert figure_4.json["fastsim"]["stick_fraction"] == pytest.approx(0.7535, abs=0.005)
    assert figure_4.json["fastrip"]["T_over_N"] == pytest.approx(0.32861, abs=5e-4)
    assert figure_4.json["fastrip"]["stick_fraction"] == pytest.approx(0.6452, abs=2e-3)


@pytest.mark.parametrize("theory", ["exact", "fastsim", "fastrip"])
def test_the_patch_is_hertz(figure_4, theory):
    found = figure_4.json[theory]
    size = (found["a_mm"], found["b_mm"], found["p0_MPa"])
    assert size == pytest.approx((0.170591, 0.270524, 744.92), rel=5e-4)


def test_the_stored_fields_are_the_forces(figure_4):
    """Tractions over the patch sum to T, and the power per length to V times creepage times T."""
    data = {array.name: array.values for array in figure_4.dataset.arrays}
    x, y = data["exact_x"], data["exact_y"]
    element = (x[0, 1] - x[0, 0]) * (y[1, 0] - y[0, 0])
    assert data["exact_pressure"].sum() * element == pytest.approx(72.0, rel=1e-3)
    assert data["exact_traction_x"].sum() * element / 72.0 == pytest.approx(0.3267, abs=3e-4)
    share = data["exact_sticks"].sum() / (data["exact_pressure"] > 0.0).sum()
    assert share == pytest.approx(figure_4.json["exact"]["stick_fraction"])
    for theory in ("exact", "fastsim"):
        across = data[f"{theory}_y"].mean(axis=1)
        power = data[f"{theory}_power_per_length"].sum() * (across[1] - across[0])
        assert power == pytest.approx(figure_4.json[theory]["power_W"], rel=0.01)
        sliding = np.hypot(data[f"{theory}_slip_x"], data[f"{theory}_slip_y"])
        assert 0.001 * 9.42 < sliding.max() < 0.02 * 9.42


def test_the_figure_has_maps_and_sections(figure_4):
    figure = figure_4.figure()
    titles = [axes.get_title(loc="left").partition(")}$  ")[2] for axes in figure.axes]
    assert titles[:4] == [
        "exact theory: traction",
        "exact theory: sliding velocity",
        "FASTSIM: traction",
        "FASTSIM: sliding velocity",
    ]
    assert {text.get_text() for text in figure.axes[0].texts} == {"stick", "slip"}


def test_misalignment_turns_the_tractions(tmp_path, figure_4):
    table = "\n[effects.misalignment]\nyaw_mrad = 1.0\ntilt_mrad = 100.0\n"
    found = contact.run(read(tmp_path, definition() + table))
    assert found.json["operating_point"]["lateral_creepage_percent"] == pytest.approx(0.1)
    assert found.json["operating_point"]["spin_rad_m"] == pytest.approx(0.1 / 0.03)
    assert found.json["exact"]["lateral_T_over_N"] > 0.1
    assert found.json["exact"]["T_over_N"] < figure_4.json["exact"]["T_over_N"]
    assert "fastrip" not in found.json


def test_without_partial_slip_the_test_s_own_step_is_shown(tmp_path):
    """All slides: T/N is mu, nothing sticks, in both theories; no other case takes the test's name."""
    found = contact.run(read(tmp_path, definition("steps = [{ creepage_percent = 5.0 }] #")))
    point = found.json["operating_point"]
    assert (point["mu"], point["creepage_percent"], point["illustrative"]) == (0.6, pytest.approx(5.0), False)
    assert "slides all over" in point["origin"]
    for theory in ("exact", "fastsim"):
        assert found.json[theory]["T_over_N"] == pytest.approx(0.6, rel=2e-3)
        assert found.json[theory]["stick_fraction"] == pytest.approx(0.0, abs=1e-12)
    assert "illustrative" not in found.figure().get_suptitle()


def test_a_step_can_be_chosen(tmp_path):
    test = read(tmp_path, definition())
    point = contact.run(test, step=3).json["operating_point"]
    assert (point["creepage_percent"], point["illustrative"]) == (pytest.approx(1.0), False)
    with pytest.raises(DefinitionError, match="1 to 3"):
        contact.run(test, step=4)


@pytest.mark.parametrize(("given", "told"), [({"creepage": 3.0}, "creepage 3 %"), ({"mu": 0.4}, "mu 0.4")])
def test_one_of_them_is_enough(tmp_path, given, told):
    found = contact.run(read(tmp_path, definition()), **given)
    assert f"an illustrative case, {told} as asked for" in found.summary[0]


def test_another_creepage_or_mu_is_called_illustrative(tmp_path, figure_4):
    test = read(tmp_path, definition("steps = [{ creepage_percent = 5.0 }] #"))
    found = contact.run(test, creepage=0.2, mu=0.6)
    assert found.json["operating_point"]["illustrative"]
    assert found.json["exact"] == figure_4.json["exact"]
    assert "illustrative" in found.summary[0]
    assert "illustrative" in found.figure().get_suptitle()


def test_without_known_friction_there_is_no_case(tmp_path):
    unknown = definition().replace("friction_coefficient = 0.6\n", "")
    with pytest.raises(DefinitionError, match="--mu"):
        contact.run(read(tmp_path, unknown))


def test_an_unworn_sphere_under_half_space_is_hertz(tmp_path, figure_4):
    found = contact.run(read(tmp_path, definition() + 'contact = "half_space"\n')).json["exact"]
    for key in ("a_mm", "b_mm", "p0_MPa"):
        assert found[key] == pytest.approx(figure_4.json["exact"][key], rel=0.01)
    assert found["T_over_N"] == pytest.approx(0.3251, abs=0.0015)


def worn(test, *, reach):
    """The test with a measured profile whose unworn shape is undone by a smooth flat of 0.6 mm, as CONTACT's."""
    y = np.linspace(-reach, reach, 801)
    depth, smooth = 1.5e-6, 1.5e-7
    gap = smooth * np.log1p(np.exp((y**2 / 0.06 - depth) / smooth))
    height = -(gap - (y**2 / 0.06 - depth))
    ones = np.ones(len(y), dtype=np.int64)
    profile = ProfileSamples(y=y, height=height, disc=2 * ones, iteration=ones)
    return replace(test, experiment=replace(test.experiment, measured=Measured(profile=profile)))


def test_worn_profile(tmp_path):
    """CONTACT, exact, finest grid: peak 723 MPa, T/N 0.3738, sticking over 0.610 of a patch 0.355 mm wide each way."""
    test = worn(read(tmp_path, definition() + 'contact = "half_space"\n'), reach=1e-3)
    found = contact.run(test)
    assert found.json["exact"]["T_over_N"] == pytest.approx(0.3738, abs=0.003)
    assert found.json["exact"]["stick_fraction"] == pytest.approx(0.6104, abs=0.01)
    assert found.json["exact"]["p0_MPa"] == pytest.approx(723.0, rel=0.01)
    assert found.json["exact"]["b_mm"] == pytest.approx(0.355, abs=0.004)
    assert "measured profile" in found.json["patch"]
    assert "fastrip" not in found.json


def test_a_profile_narrower_than_the_patch_is_an_error(tmp_path):
    test = worn(read(tmp_path, definition() + 'contact = "half_space"\n'), reach=0.2e-3)
    with pytest.raises(DataEdgeError):
        contact.run(test)


def test_a_profile_with_the_noise_of_a_stylus_is_smoothed_as_far_as_it_needs(tmp_path):
    """A tenth of a micrometre of white noise, 5 um apart: p0 comes within a tenth of that without noise."""
    test = worn(read(tmp_path, definition() + 'contact = "half_space"\n'), reach=1.5e-3)
    profile = test.experiment.measured.profile
    noise = 1e-7 * np.random.default_rng(1).standard_normal(len(profile.y))
    rough = Measured(profile=replace(profile, height=profile.height + noise))
    noisy = contact.run(replace(test, experiment=replace(test.experiment, measured=rough)))
    assert "against its roughness" in noisy.json["patch"]
    smooth = contact.run(test).json["exact"]["p0_MPa"]
    assert noisy.json["exact"]["p0_MPa"] == pytest.approx(smooth, rel=0.1)


def test_stiffness_difference_of_aluminium_on_steel(tmp_path):
    """CONTACT's example: G 23 and 82 GPa, nu 0.31 and 0.28 give G 35.924 GPa, nu 0.3034, K 0.100."""
    rig = read(tmp_path, definition()).experiment.rig
    soft = replace(rig.disc1, youngs_modulus=2.0 * 1.31 * 23e9, poisson_ratio=0.31)
    stiff = replace(rig.disc2, youngs_modulus=2.0 * 1.28 * 82e9, poisson_ratio=0.28)
    pair = replace(rig, disc1=soft, disc2=stiff)
    assert (pair.shear_modulus, pair.poisson_ratio) == pytest.approx((35.924e9, 0.3034), rel=1e-3)
    assert stiffness_difference(pair) == pytest.approx(0.100, abs=5e-4)
    assert stiffness_difference(rig) == 0.0


def test_a_step_is_shown_as_it_begins(tmp_path):
    # mu_0 (1 - exp(-n / 500) / 2), n the revolutions before the step
    table = "\n[effects.running_in_friction]\nexcess = -0.5\nsettling_cycles = 500.0\n"
    test = read(tmp_path, definition(revolutions_per_iteration="revolutions_per_iteration = 400") + table)
    found = [contact.run(test, step=step).json["operating_point"]["mu"] for step in (1, 2)]
    assert found == pytest.approx([0.3, 0.6 * (1.0 - 0.5 * np.exp(-400.0 / 500.0))], rel=2e-4)


@pytest.mark.parametrize("effect", ["", "\n[effects.falling_friction]\nratio = 0.3\ndecay_s_m = 20.0\n"])
def test_a_step_of_its_own_speed_is_a_rig_of_that_speed(tmp_path, effect):
    slow, step = "rolling_speed_m_s = 1.0", "creepage_percent = 0.3"
    own = contact.run(read(tmp_path, definition(f"steps = [{{ {step}, {slow} }}] #") + effect)).json
    rig = contact.run(read(tmp_path, definition(f"steps = [{{ {step} }}] #", mean_speed_rpm=slow) + effect)).json
    assert own["operating_point"]["rolling_speed_m_s"] == 1.0
    for theory in ("exact", "fastsim"):
        assert own[theory] == pytest.approx(rig[theory], rel=1e-9)


def test_a_step_of_a_blink_behind_a_night_is_found(tmp_path: Path) -> None:
    """Ten revolutions after a pause of twelve hours: the step had been said to roll without creepage."""
    text = changed(revolutions_per_iteration="revolutions_per_iteration = 10")
    text = text.replace("{ creepage_percent = 1.0, iterations = 2 }", "{ pause_s = 43200.0 }")
    result = contact.run(load(write(tmp_path, text)), step=3)
    assert result.json["operating_point"]["creepage_percent"] == pytest.approx(2.0)
