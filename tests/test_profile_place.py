"""Profiles as they are recorded: tilted, off zero, off centre, in several traces, with gaps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write
from hypothesis import example, given, settings
from hypothesis import strategies as st

from twindisc_cli.definition import Test, load
from twindisc_cli.errors import MeasurementError
from twindisc_cli.loop.tolerances import known_sensors
from twindisc_cli.measurement.profile import hardly_worn, placed

DEPTH, HALF = 6.0, 0.9
"""Depth [um] and half-width [mm] of a parabolic track."""


def track(
    y: np.ndarray, *, centre: float = 0.0, slope: float = 0.0, offset: float = 0.0, noise: float = 0.0, seed: int = 1
) -> np.ndarray:
    """Recorded height [um] at y [mm]; slope [um/mm], offset [um] at y = 0, white noise [um]."""
    worn = -DEPTH * np.clip(1.0 - ((y - centre) / HALF) ** 2, 0.0, None)
    return worn + slope * y + offset + noise * np.random.default_rng(seed).standard_normal(len(y))


Y = np.linspace(-3.0, 3.0, 301)


def read(folder: Path, *traces: np.ndarray, y: np.ndarray = Y, setting: str = "", gap: str = "") -> Test:
    """A test with these traces; a row of the file may be a gap."""
    rows = "".join(f"{a:.4f},{b:.5f}\n" for trace in traces for a, b in zip(y, trace, strict=True))
    rows = rows.replace(gap, f"{gap.partition(',')[0]},***") if gap else rows
    (folder / "profile.csv").write_text(f"y [mm],height [um]\n{rows}")
    return load(write(folder, f'{VALID}\n[measured]\nprofile = "profile.csv"\n{setting}\n'))


def test_tilt_and_place_are_taken_off_and_told(tmp_path: Path) -> None:
    test = read(tmp_path, track(Y, centre=0.4, slope=2.0, offset=15.0, noise=0.1))
    profile, place = test.experiment.measured.profile, test.experiment.measured.profile_place
    assert profile is not None
    assert place is not None
    np.testing.assert_allclose(profile.height * 1e6, track(profile.y * 1e3), atol=0.5)
    (note,) = [note for note in test.rows[0].notes if note.startswith("levelled")]
    assert "slope 2" in note
    assert "um/mm" in note
    assert "centre 0.4" in note or "centre 0.39" in note
    known = {(name, key): std for name, key, std in known_sensors(test.experiment)}
    assert set(known) == {
        ("profile_tilt", "slope_um_mm"),
        ("profile_tilt", "offset_um"),
        ("lateral_offset", "offset_mm"),
    }
    assert all(0.0 < std < 0.1 for std in known.values())


def test_the_errors_are_the_scatter_of_what_is_taken_off() -> None:
    found = [placed(Y * 1e-3, 1e-6 * track(Y, centre=0.2, slope=1.0, noise=0.2, seed=n)) for n in range(200)]
    assert all(found)
    for name in ("slope", "offset", "centre"):
        values = np.array([getattr(p, name) for p in found])
        told = np.median([getattr(p, f"{name}_std") for p in found])
        assert np.std(values) == pytest.approx(told, rel=0.35), name
    assert np.mean([p.slope for p in found if p]) == pytest.approx(1e-3, rel=0.02)
    assert np.mean([p.centre for p in found if p]) == pytest.approx(0.2e-3, rel=0.02)


@given(
    centre=st.floats(-1.0, 1.0),
    slope=st.floats(-20.0, 20.0),
    offset=st.floats(-100.0, 100.0),
    backwards=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_any_line_and_place_come_off(centre: float, slope: float, offset: float, backwards: bool) -> None:
    height = track(Y, centre=centre, slope=slope, offset=offset)
    found = placed(Y * 1e-3, height * 1e-6)
    assert found is not None
    assert found.slope * 1e3 == pytest.approx(slope, abs=0.02)
    assert found.centre * 1e3 == pytest.approx(centre, abs=0.02)
    assert found.height.min() * 1e6 == pytest.approx(-DEPTH, rel=0.02)


@given(
    count=st.integers(8, 300),
    centre=st.floats(-1.2, 1.2),
    half=st.floats(0.05, 1.5),
    depth=st.floats(-2.0, 1.0),
    noise=st.floats(-3.0, 0.0),
    seed=st.integers(0, 99),
)
@example(count=81, centre=0.48, half=0.55, depth=-0.8, noise=-1.9, seed=77)
@settings(max_examples=150, deadline=None)
def test_whatever_is_worn_wherever_is_put_in_place_or_left(
    count: int, centre: float, half: float, depth: float, noise: float, seed: int
) -> None:
    """Depth and noise as powers of ten [um]."""
    y = np.linspace(-1.0, 1.0, count)
    worn = -(10.0**depth) * np.clip(1.0 - ((y - centre) / half) ** 2, 0.0, None)
    height = worn + 10.0**noise * np.random.default_rng(seed).standard_normal(count)
    one = placed(y * 1e-3, height * 1e-6)
    for found in (one, hardly_worn(y * 1e-3, height * 1e-6, [one] if one else [], 1e-4)):
        assert found is None or (np.isfinite(found.height).all() and found.slope_std >= 0.0)


def test_several_traces_are_averaged(tmp_path: Path) -> None:
    traces = [
        track(Y, centre=c, slope=s, noise=0.1, seed=n) for n, (c, s) in enumerate([(0.2, 1.0), (0.0, -1.0), (0.1, 0.0)])
    ]
    test = read(tmp_path, *traces)
    profile, (count,) = test.experiment.measured.profile, test.rows
    assert profile is not None
    assert count.used == count.read == 903
    assert np.all(np.diff(profile.y) > 0.0)
    assert np.ptp(profile.y) > 5.5e-3
    one = read(tmp_path, traces[0]).experiment.measured.profile
    assert one is not None
    flank = np.abs(profile.y) > 1.3e-3
    assert profile.height[flank].std() < 0.7 * one.height[np.abs(one.y) > 1.3e-3].std()
    told = "".join(count.notes)
    assert "3 traces: their mean is taken, they scatter by 0.1" in told or "they scatter by 0.09" in told


def test_traces_that_share_no_place_have_no_mean(tmp_path: Path) -> None:
    swapped = Y.copy()
    swapped[[60, 240]] = Y[[240, 60]]
    with pytest.raises(MeasurementError, match=r"3 traces share 0 points of the first, at least 8 are needed"):
        read(tmp_path, track(swapped), y=swapped)


def test_gaps_are_left_out(tmp_path: Path) -> None:
    test = read(tmp_path, track(Y), gap="-2.9000,0.00000")
    assert test.rows[0].left_out == {"no number": 1}
    assert test.experiment.measured.profile is not None
    assert len(test.experiment.measured.profile.y) == 300


def test_a_worn_zone_beside_the_contact_is_told(tmp_path: Path) -> None:
    # Hertz: b = 0.2705 mm; the track reaches from 1.1 to 2.9 mm
    far = track(Y, centre=2.0)
    assert read(tmp_path, far).experiment.measured.profile_place is not None
    says = r"the worn zone lies at y = 1\.1\d* to 2\.8\d* mm, the contact at 0 ± 0\.271 mm"
    with pytest.raises(MeasurementError, match=says):
        read(tmp_path, far, setting='profile_place = "as recorded"')
    left = read(tmp_path, track(Y, centre=0.3, slope=0.5), setting='profile_place = "as recorded"').experiment.measured
    assert left.profile is not None
    assert left.profile_place is None
    np.testing.assert_allclose(left.profile.height * 1e6, track(Y, centre=0.3, slope=0.5), atol=1e-4)


def test_a_profile_without_flanks_stays_as_it_is(tmp_path: Path) -> None:
    y = np.linspace(-0.8, 0.8, 81)
    test = read(tmp_path, track(y), y=y)
    assert test.experiment.measured.profile_place is None
    assert any("taken as recorded" in note for note in test.rows[0].notes)
    np.testing.assert_allclose(test.experiment.measured.profile.height * 1e6, track(y), atol=1e-4)  # type: ignore[union-attr]


def stops(folder: Path, *records: np.ndarray) -> Test:
    """A test with a record after each of its first iterations."""
    rows = "".join(
        f"{a:.4f},{b:.5f},{number}\n"
        for number, record in enumerate(records, 1)
        for a, b in zip(Y, record, strict=True)
    )
    (folder / "profile.csv").write_text(f"y [mm],height [um],iteration\n{rows}")
    return load(write(folder, f'{VALID}\n[measured]\nprofile = "profile.csv"\n'))


def test_a_stop_before_wear_can_be_seen_is_levelled_beside_the_later_track(tmp_path: Path) -> None:
    """A shallow track that noise hides is not taken for flank."""
    noise = np.random.default_rng(4).standard_normal(len(Y))
    hidden = 0.01 * track(Y, centre=0.4) + 0.1 * noise + 2.0 * Y + 30.0
    test = stops(tmp_path, hidden, track(Y, centre=0.4, slope=-1.0, noise=0.1)).experiment
    profile = test.measured.profile
    assert profile is not None
    assert test.measured.profile_place is not None
    first = profile.iteration == profile.iteration.min()
    left = profile.height[first] * 1e6 - 0.01 * track(profile.y[first] * 1e3)
    assert np.abs(np.polyfit(profile.y[first] * 1e3, left, 1)) == pytest.approx(0.0, abs=0.03)
    np.testing.assert_allclose(profile.y[first], (Y - 0.4) * 1e-3, atol=2e-5)


def test_nothing_worn_is_levelled_on_its_outer_ends(tmp_path: Path) -> None:
    noise = 0.1 * np.random.default_rng(5).standard_normal(len(Y))
    test = read(tmp_path, noise + 2.0 * Y + 30.0)
    profile, place = test.experiment.measured.profile, test.experiment.measured.profile_place
    assert profile is not None
    assert place is not None
    np.testing.assert_allclose(profile.height * 1e6, noise, atol=0.08)
    assert place.centre == pytest.approx(test.experiment.rig.patch.b)
    assert any("no clear track" in note for note in test.rows[0].notes)
