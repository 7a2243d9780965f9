"""Recorded surfaces: stops, samples between strips, and nothing lost between path, discs and load."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import RADIUS, experiment, history, rig
from score.hidden import Hidden
from score.rig import March, Rig

from twindisc_cli.effects._state import State, Surface
from twindisc_cli.model.experiment import Contact, ProfileSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.patch import WeightedPaths, weighted_paths
from twindisc_cli.model.points import operating_points
from twindisc_cli.model.surface import Stops, recorded_sections, worn_surface
from twindisc_cli.model.wear_path import WearPath, wear_path

HISTORY = history((0.02, 0.05), 2)
POINTS = operating_points(experiment(HISTORY))
ACROSS = np.linspace(-1.2e-3, 1.2e-3, 241)
RECORD = ProfileSamples(
    np.tile(ACROSS, 3), np.zeros(3 * len(ACROSS)), np.repeat([2, 1, 2], len(ACROSS)), np.repeat([4, 4, 1], len(ACROSS))
)


def paths_of(contact: Contact = "hertz", load: float = 72.0) -> WeightedPaths:
    none = np.zeros((1, 1))

    def path(kind: Contact, wander: float, crown: float) -> WearPath:
        return wear_path(rig(load=load), contact=kind, section=2e-9, wander=wander)

    return weighted_paths(path, contact, none, none, none + 1.0)


def state_with(load_ratio: np.ndarray, share: float = 0.0) -> State:
    """A state in which only load and share matter; load_ratio (set, point)."""
    model = ForwardModel(experiment(HISTORY))
    base = {"mu": np.array([0.6]), "K": np.array([0.0]), "convection_W_K": np.array([1.0])}
    state = model.predict(base).state
    return state.replace(normal_load=72.0 * load_ratio, disc1_share=np.array([[share]]))


def section_lost(surface: Surface) -> np.ndarray:
    """Missing section (set, stop) [m2]."""
    return -np.asarray(np.trapezoid(surface.height, surface.y, axis=-1))


def test_stops_are_the_recorded_discs_and_iterations() -> None:
    stops = Stops.of(RECORD, POINTS)
    assert stops.disc.tolist() == [1, 2, 2]
    assert POINTS.time[stops.point] == pytest.approx([4 * 84.0, 84.0, 4 * 84.0])
    assert stops.disc[stops.stop].tolist() == RECORD.disc.tolist()
    assert POINTS.iteration[stops.point[stops.stop]].tolist() == (RECORD.iteration - 1).tolist()


def test_a_line_is_sampled_as_a_line_and_held_at_its_ends() -> None:
    stops = Stops(np.array([2, 2]), np.array([0, 0]), np.repeat([0, 1], 5), np.array([-9.0, -1.0, 0.25, 0.9, 9.0] * 2))
    y = np.linspace(-1.0, 1.0, 41)
    height = np.array([[3.0 * y, 1.0 - y]])
    found = stops.sample(Surface(y=y, height=height, edge=np.ones((1, 2, 1)), depth=np.ones((1, 2, 1))))
    assert found == pytest.approx(np.array([[-3.0, -3.0, 0.75, 2.7, 3.0, 2.0, 2.0, 0.75, 0.1, 0.0]]))


def test_the_section_of_a_recorded_segment() -> None:
    """A chord w cuts w^3 / (12 R) from a circle, whatever the order of the samples."""
    wide, deep = 0.9e-3, np.minimum(ACROSS**2 - 0.45e-3**2, 0.0) / (2.0 * RADIUS)
    order = np.random.default_rng(3).permutation(len(ACROSS))
    record = ProfileSamples(
        np.concatenate([ACROSS[order], ACROSS]), np.concatenate([deep[order], 0.5 * deep]),
        np.full(2 * len(ACROSS), 2), np.repeat([4, 2], len(ACROSS)),
    )  # fmt: skip
    expected = wide**3 / (12.0 * RADIUS)
    assert recorded_sections(record) == pytest.approx([0.5 * expected, expected], rel=1e-3)
    last = record.iteration == 4
    assert recorded_sections(record, last) == pytest.approx([expected], rel=1e-3)


@pytest.mark.parametrize("load_ratio", [1.0, 0.6, 1.4])
@pytest.mark.parametrize("share", [0.0, 0.35])
def test_both_discs_together_lose_the_section(load_ratio: float, share: float) -> None:
    count = len(POINTS.time)
    section = np.linspace(0.0, 1.2e-9, count)[None]
    ratio = np.full((1, count), load_ratio)
    stops = Stops.of(RECORD, POINTS)
    surface = worn_surface(paths_of(), state_with(ratio, share), section, stops)
    expected = section[:, stops.point] * np.where(stops.disc == 1, share, 1.0 - share)
    assert section_lost(surface) == pytest.approx(expected, rel=2e-3)


def test_another_load_stretches_the_same_profile() -> None:
    """h(y; N, S) of the rig under half the load is the path of that load."""
    count = len(POINTS.time)
    section = np.full((1, count), 5e-10)
    stops = Stops.of(RECORD, POINTS)
    scaled = worn_surface(paths_of(), state_with(np.full((1, count), 0.5)), section, stops)
    own = worn_surface(paths_of(load=36.0), state_with(np.ones((1, count))), section, stops)
    ours, theirs = (-stops.sample(surface) for surface in (scaled, own))
    assert ours == pytest.approx(theirs, abs=0.01 * theirs.max())
    assert scaled.edge == pytest.approx(own.edge, rel=0.03)
    assert scaled.depth == pytest.approx(own.depth, rel=5e-3)


def test_unworn_is_flat_and_worn_is_flat_outside_the_track() -> None:
    count = len(POINTS.time)
    stops = Stops.of(RECORD, POINTS)
    plain = worn_surface(paths_of(), state_with(np.ones((1, count))), np.zeros((1, count)), stops)
    assert np.all(plain.height == 0.0)
    worn = worn_surface(paths_of(), state_with(np.ones((1, count))), np.full((1, count), 5e-10), stops)
    outside = np.abs(worn.y) > 1.3 * worn.edge.max()
    assert outside.any()
    assert np.all(np.abs(worn.height[..., outside]) < 1e-3 * worn.depth.max())
    assert np.all(worn.height <= 0.0)


def test_a_wave_across_the_track_grows_no_further_than_the_discs_give_way() -> None:
    """d(z) = c l (1 - exp(-z / l)), l = 2 p / (E* q), of one wave (Johnson 1985, Eq. 13.4); in a deep track d = c l."""
    y = np.linspace(-1e-3, 1e-3, 256, endpoint=False)
    wave = np.cos(2.0 * np.pi * y / 0.5e-3)
    give, q, c = 8e-3, 2.0 * np.pi / 0.5e-3, 0.1
    for depth in (1e-8, 1e-6, 1e-4):
        one = np.ones((1, 1, 1))
        surface = Surface(y, -depth * np.ones((1, 1, 256)), edge=one, depth=depth * one, give=give * one)
        left = surface.eased(c * depth * wave[None, None])
        expected = c * give / q * -np.expm1(-depth * q / give)
        assert left[0, 0] == pytest.approx(expected * wave, abs=1e-9 * expected)


def test_wear_that_varies_across_the_track_is_held_back_as_in_another_simulation() -> None:
    """The score's rig presses its discs together anew at every wear step: the deviation from an even K, within 15 %."""
    quick = Rig(
        load=72.0, rpm=3000.0, radius=RADIUS, crown=(1e9, RADIUS), creepage=(0.01,), iterations=(5,), revolutions=4200,
        capacity=100.0, environment=20.0, contact="half_space", law="fastsim", declared_law="fastsim", mu=0.6,
        wear=7e-5, convection=1.6, creepage_error=(0.0,), presses=40, strips=20,
    )  # fmt: skip
    even, uneven = (
        March(quick, hidden).run() for hidden in ((), (Hidden(wear_across=lambda x: 1.0 + 0.3 * np.cos(7.85 * x)),))
    )
    depth = even.profiles[5][1]
    own, inside = uneven.profiles[5][1] - depth, depth > 0.02 * depth.max()
    change = 0.3 * np.cos(7.85 * even.y / quick.edge)
    change -= (change @ depth) / depth.sum()
    ellipse = quick.ellipse()
    pressure = quick.load / (np.pi * ellipse.a * ellipse.b)
    surface = Surface(
        even.y, -depth[None, None], np.full((1, 1, 1), quick.edge), np.full((1, 1, 1), depth.max()),
        np.full((1, 1, 1), 2.0 * pressure / quick.contact_modulus),
    )  # fmt: skip
    eased = surface.eased((change * depth)[None, None])[0, 0]
    size = np.sqrt(np.mean(own[inside] ** 2))
    assert np.sqrt(np.mean((own - eased)[inside] ** 2)) < 0.15 * size
    assert np.sqrt(np.mean((own - change * depth)[inside] ** 2)) > 0.3 * size
