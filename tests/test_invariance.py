"""What may change no answer: a pause, a roll without creepage, files that are not asked, a wander beyond the table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from definitions import changed, write

from twindisc_cli.definition import load
from twindisc_cli.identify.mass import identify_from_mass
from twindisc_cli.identify.steps import identify_friction
from twindisc_cli.identify.wear import identify_wear
from twindisc_cli.identify.wear_history import wear_history
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, Start
from twindisc_cli.model.forward import ForwardModel

GIVEN = "friction_coefficient = 0.5\nwear_coefficient = {k}"
ROUND = "y [mm],height [um]{head}\n" + "\n".join(
    f"{y:.3f},{-0.15 * max(0.0, 1.0 - (y / 0.3) ** 2):.4f}{{stop}}" for y in np.linspace(-1.0, 1.0, 201)
)
"""A track 0.15 um deep and 0.6 mm wide."""


def experiment(folder: Path, steps: str, *, k: float = 1e-4, more: str = "", **data: str) -> Experiment:
    density = "hardness_HV = 700\ndensity_kg_m3 = 7850"
    text = changed(friction_coefficient=GIVEN.format(k=k), hardness_HV=density)
    begin, end = text.index("steps = ["), text.index("[model]")
    return load(write(folder, f"{text[:begin]}steps = [{steps}]\n\n{text[end:]}\n{more}", **data)).experiment


def worn(test: Experiment, k: float = 1e-4) -> Floats:
    """Depth [m], width [m] and volume [m3] after each iteration, (iteration, 3)."""
    mu = np.full(len(test.history.step_begin), 0.5)
    history = wear_history(ForwardModel(test), mu=mu, wear_coefficient=k)
    return np.array([(track.depth, track.width, v) for track, v in zip(history.track, history.volume, strict=True)])


@pytest.mark.parametrize(
    "idle",
    [
        "{ pause_s = 60.0 }",
        "{ creepage_percent = 0.0, normal_load_N = 72.0 }",
        "{ creepage_percent = 0.0, normal_load_N = 1000.0 }",
    ],
)
def test_what_does_not_slide_leaves_the_track_as_it_is(tmp_path: Path, idle: str) -> None:
    """A track that another load than the rig's has worn: it had become 70 % deeper in a pause."""
    test = experiment(tmp_path, f"{{ creepage_percent = 1.0, iterations = 2, normal_load_N = 500.0 }}, {idle}")
    before, after = worn(test)[-2:]
    assert after == pytest.approx(before, rel=1e-4)


@pytest.mark.parametrize("slides", ["creepage_percent = 1.0", "creepage_percent = 0.05, yaw_mrad = 20.0"])
def test_a_given_k_wears_by_the_energy_whatever_profile_is_beside_it(tmp_path: Path, slides: str) -> None:
    """W = K E / H: where a profile shows far less wear, what goes beyond it had been left out without a word."""
    more = "[effects.running_in_wear]\nexcess = 20.0\nsettling_cycles = 1e6"
    steps = f"{{ {slides}, iterations = 8 }}"
    alone = experiment(tmp_path, steps, k=3e-3, more=more)
    beside = experiment(tmp_path, steps, k=3e-3, more=more, profile=ROUND.format(head="", stop=""))
    assert worn(beside, 3e-3) == pytest.approx(worn(alone, 3e-3), rel=1e-9)


def test_friction_under_a_given_k_is_the_same_whatever_profile_is_beside_it(tmp_path: Path) -> None:
    more = "[effects.running_in_wear]\nexcess = 20.0\nsettling_cycles = 1e6"
    steps = "{ creepage_percent = 4.0, iterations = 10 }, { creepage_percent = 0.1 }"
    data = {"traction": "creepage [%],traction ratio [1]\n4.0,0.5\n0.1,0.2\n"}
    alone = experiment(tmp_path, steps, k=1e-3, more=more, **data)
    beside = experiment(tmp_path, steps, k=1e-3, more=more, **data, profile=ROUND.format(head="", stop=""))
    mu, same = (identify_friction(ForwardModel(test)).mu for test in (alone, beside))
    assert same == pytest.approx(mu, rel=1e-9)


def test_wear_after_the_last_profile_is_followed(tmp_path: Path) -> None:
    """By the profile of an early stop the track is 12 times as large at the end: T/N in partial slip knows that."""
    steps = "{ creepage_percent = 1.0 }, { creepage_percent = 8.0, iterations = 10 }, { creepage_percent = 0.1 }"
    test = experiment(tmp_path, steps, profile=ROUND.format(head=",iteration", stop=",1"))
    model, base = ForwardModel(test), BaseParameters(np.array([0.5]), K=np.array([1e-4]))
    fitted, free = (m.predict(base, profiled=False).state.traction_ratio[0, -1] for m in (model, model.unbounded))
    assert fitted == pytest.approx(free, rel=1e-4)


@pytest.mark.parametrize("std", [0.19, 0.3, 0.45, 0.6])
def test_a_wander_wider_than_the_table_spreads_the_track_as_far(tmp_path: Path, std: float) -> None:
    """A small patch: depth of what is a normal distribution but for the patch's own variance, at most b^2 / 5 more."""
    steps = "{ creepage_percent = 2.0, iterations = 4, normal_load_N = 4.0 }"
    test = experiment(tmp_path, steps, more=f"[effects.lateral_wander]\nstd_mm = {std}")
    depth, _, volume = worn(test)[-1]
    section = volume / (2.0 * np.pi * test.rig.disc2.rolling_radius)
    b = float(test.rig.patch.b) * (4.0 / 72.0) ** (1.0 / 3.0)
    narrow, wide = (section / np.sqrt(2.0 * np.pi * (1e-6 * std**2 + own)) for own in (0.0, 0.4 * b**2))
    assert wide < depth < narrow


@pytest.mark.parametrize("more", ["", "[effects.lateral_wander]\nstd_mm = 0.3"])
@pytest.mark.parametrize("bumps", [0.0, 2e-7])
def test_a_load_is_the_same_whether_the_rig_or_the_step_states_it(tmp_path: Path, more: str, bumps: float) -> None:
    """Wander and heights of recorded new discs are no lengths that a load scales: depths had been up to 2.4 times."""
    y = np.linspace(-2e-3, 2e-3, 801)
    start = Start(y, np.stack([np.zeros_like(y), bumps * np.cos(2.0 * np.pi * y / 4e-4)])) if bumps else None
    test = experiment(tmp_path, "{ creepage_percent = 2.0, iterations = 4, normal_load_N = 4.0 }", more=more)
    test = replace(test, measured=replace(test.measured, start=start))
    same = replace(test, rig=replace(test.rig, normal_load=4.0), history=replace(test.history, load_factor=np.ones(1)))
    assert worn(test)[-1, [0, 2]] == pytest.approx(worn(same)[-1, [0, 2]], rel=0.01)


@pytest.mark.parametrize(
    "more",
    [
        "[effects.running_in_wear]\nexcess = 3.0\nsettling_cycles = 8000.0",
        "[effects.severe_wear_transition]\nratio = 5.0\ncritical_N_mm2 = 3.0\nwidth = 0.2",
    ],
)
def test_the_k_of_volume_and_of_weight_is_what_the_declared_effects_multiply(tmp_path: Path, more: str) -> None:
    """Wear by a known K: W H / E had been up to 3.6 times that, so that this K wore "28 % of the volume"."""
    k, steps = 1e-3, "{ creepage_percent = 1.0, iterations = 3 }, { creepage_percent = 3.0, iterations = 3 }"
    test = experiment(tmp_path, steps, k=k, more=more)
    made = wear_history(ForwardModel(test), mu=np.array([0.5, 0.5]), wear_coefficient=k)
    rows = [f"{y * 1e3},{z * 1e6}" for y, z in zip(made.y, made.height[-1], strict=True)]
    lost = made.volume[[2, 5]] * test.rig.disc2.density * 1e6
    data = {
        "profile": "\n".join(["y [mm],height [um]", *rows]),
        "mass": f"iteration,mass loss [mg],uncertainty [mg]\n3,{lost[0]},0.001\n6,{lost[1]},0.001\n",
    }
    model = ForwardModel(experiment(tmp_path, steps, k=k, more=more, **data))
    assert identify_wear(model, np.array([0.5, 0.5])).allowed == pytest.approx(k, rel=2e-3)
    assert identify_from_mass(model, np.array([0.5, 0.5])).of_disc[2][0] == pytest.approx(k, rel=2e-3)
