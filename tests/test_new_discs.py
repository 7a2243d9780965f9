"""Wear that begins at the measured profiles of the new discs, and what each disc loses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write
from rigs import RADIUS, rig

from twindisc_cli.commands import simulate_wear
from twindisc_cli.definition import load
from twindisc_cli.errors import MeasurementError
from twindisc_cli.model.experiment import Contact, Start
from twindisc_cli.model.wear_path import wear_path

Y = np.linspace(-3e-3, 3e-3, 1201)
HV = 9.80665e6
both = pytest.mark.parametrize("contact", ["hertz", "half_space"])


def risen(height: np.ndarray) -> Start:
    return Start(Y, np.stack([np.zeros_like(Y), height]))


@both
def test_a_disc_that_is_rounder_than_nominal_wears_as_one_of_that_crown(contact: Contact) -> None:
    """-y^2 / 2 (1/r - 1/R) beside a crown R is a crown r."""
    sharper = 0.8 * RADIUS
    start = risen(-0.5 * Y**2 * (1.0 / sharper - 1.0 / RADIUS))
    found = wear_path(rig(), contact=contact, section=2e-9, start=start)
    wanted = wear_path(rig(crown=sharper), contact=contact, section=2e-9)
    for section in (0.0, 5e-10, 2e-9):
        at = np.array([section])
        for name in ("a", "b", "area", "stiffness"):
            one, two = (path.at(getattr(path, name), at) for path in (found, wanted))
            assert one == pytest.approx(two, rel=0.008), (name, section)
        depths = [path.at(path.depth, at).max() for path in (found, wanted)]
        assert depths[0] == pytest.approx(depths[1], rel=0.01)


def test_a_groove_is_not_worn_before_the_track_is_as_deep() -> None:
    depth = 2e-6
    groove = risen(-depth * (np.abs(Y - 1e-4) < 4e-5))
    path = wear_path(rig(), contact="half_space", section=2e-9, start=groove)
    inside, beside = np.abs(path.y - 1e-4) < 2.5e-5, np.abs(path.y + 1e-4) < 2.5e-5
    worn = path.depth[:, beside].mean(axis=1)
    early, late = np.searchsorted(worn, 0.5 * depth), -1
    assert np.all(path.depth[early, inside] == 0.0)
    assert worn[early] > 0.3 * depth
    left = path.depth[late, inside].mean() - worn[late]
    assert left == pytest.approx(-depth, abs=0.1 * depth)
    assert path.depth.sum(axis=1) * (path.y[1] - path.y[0]) == pytest.approx(path.section, rel=1e-9)


def recorded(folder: Path, model: str, centre: float = 0.0, crown: float = 0.0) -> Path:
    """Both discs when new, with a wave, and disc 2 after the test, worn by a parabola."""
    y = np.linspace(-2.0, 2.0, 401)
    wave = {1: 0.4 * np.cos(7.0 * y), 2: 0.6 * np.sin(5.0 * y) - crown * 0.5 * y**2 / 30.0 * 1e3}
    worn = -8.0 * np.maximum(0.0, 1.0 - ((y - centre) / 0.8) ** 2)
    rows = [(disc, 0, wave[disc] + 1.0 + 0.3 * y) for disc in (1, 2)] + [(2, 5, wave[2] + worn)]
    table = "disc,iteration,y [mm],height [um]\n" + "".join(
        f"{disc},{stop},{at:.4f},{h:.6f}\n" for disc, stop, heights in rows for at, h in zip(y, heights, strict=True)
    )
    text = VALID.replace("[model]\n", f"[model]\n{model}\n")
    text = text.replace("[thermal]", "[material.disc1]\nhardness_HV = 300\n\n[thermal]")
    return write(folder, text, profile=table)


def test_later_profiles_count_from_the_new_disc(tmp_path: Path) -> None:
    measured = load(recorded(tmp_path, "wear_coefficient = 6e-5", centre=0.1)).experiment.measured
    assert measured.profile is not None
    assert measured.start is not None
    assert set(measured.profile.iteration) == {5}
    y, height = measured.profile.y, measured.profile.height
    assert height == pytest.approx(-8e-6 * np.maximum(0.0, 1.0 - (y / 0.8e-3) ** 2), abs=2e-8)
    at = np.abs(measured.start.y) < 1e-3
    wave = 0.4e-6 * np.cos(7e3 * measured.start.y + 0.0)
    line = np.polyfit(measured.start.y, measured.start.height[0] - wave, 1)
    assert np.ptp((measured.start.height[0] - wave - np.polyval(line, measured.start.y))[at]) < 1.5e-7
    shifted = 0.6e-6 * np.sin(5e3 * (measured.start.y + 1e-4))
    line = np.polyfit(measured.start.y, measured.start.height[1] - shifted, 1)
    assert np.ptp((measured.start.height[1] - shifted - np.polyval(line, measured.start.y))[at]) < 1.5e-7


@both
def test_each_disc_loses_the_volume_of_archard(tmp_path: Path, contact: Contact) -> None:
    """W_d = K_d E / H_d to a millionth, from discs with a shape of their own."""
    k1, k2 = 2e-5, 6e-5
    model = f'contact = "{contact}"\nwear_coefficient = {k2}\ndisc1_wear_coefficient = {k1}'
    found = simulate_wear.run(load(recorded(tmp_path, model)))
    arrays = {array.name: array.values for array in found.dataset.arrays}
    y, energy = found.dataset.axes[1].values, 1e3 * found.json["dissipated_energy_kJ"]
    for name, k, hardness in (("disc1_height", k1, 300 * HV), ("height", k2, 700 * HV)):
        volume = -2.0 * np.pi * RADIUS * arrays[name][-1].sum() * (y[1] - y[0])
        assert volume / (k * energy / hardness) == pytest.approx(1.0, rel=1e-6)
    assert arrays["new_height"] == pytest.approx(0.6e-6 * np.sin(5e3 * y), abs=3e-7)
    assert any("new discs" in line for line in found.summary)


def test_a_crown_that_is_left_in_the_profile_of_a_new_disc_is_told(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="take its crown off"):
        load(recorded(tmp_path, "wear_coefficient = 6e-5", crown=1.0))
