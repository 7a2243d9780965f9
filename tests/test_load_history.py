"""Loads that change act on one profile: against an integration of its own, conservation, and what may never happen."""

from __future__ import annotations

from dataclasses import replace

import load_integration
import numpy as np
import pytest
import rigs
from numpy.typing import NDArray

from twindisc_cli.laws.law import Law
from twindisc_cli.model import chain
from twindisc_cli.model.experiment import Contact, Options, ProfileSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.integration import Setup, Weights, integrate
from twindisc_cli.model.patch import OwnPaths
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.model.wear_path import (
    CarriedPath,
    LoadHistory,
    carried_paths,
    first_section,
    nearby,
    paths_near,
    wear_path,
)

Floats = NDArray[np.float64]
K, MU = 6e-5, 0.5
both = pytest.mark.parametrize("contact", ["hertz", "half_space"])


def model(creepage: Floats, ratios: Floats, contact: Contact, each: int = 2) -> ForwardModel:
    """Steps of two iterations at these creepages under loads over the rig's."""
    course = replace(rigs.history(creepage, each), load_factor=np.repeat(ratios, each))
    options = Options(contact=contact, wear_coefficient=K, traction="exact")
    return ForwardModel(rigs.experiment(course, options=options))


def predicted(of: ForwardModel, K: float = K, **given: object) -> Prediction:
    base = {"mu": np.array([MU]), "K": np.atleast_1d(K), "convection_W_K": np.array([1.6])}
    return of.predict(base, **given)  # type: ignore[arg-type]


def depths(found: Prediction, at: Floats | slice = slice(None)) -> Floats:
    """Depth [m] of the first set at points (point, strip)."""
    ratio = np.broadcast_to(found.state.normal_load / found.state.nominal_load, found.section.shape)[:1, at]
    paths = found.paths.through(found.section)
    height = paths.profile_scale(ratio).height[..., None]
    return np.asarray((paths.at(lambda path: path.depth, found.section[:1, at], ratio) * height)[0])


@pytest.mark.parametrize(("contact", "steps"), [("hertz", 40), ("half_space", 25)])
def test_loads_up_and_down_are_those_of_a_march_of_the_profile(contact: Contact, steps: int) -> None:
    ratios, creepage = np.array([0.3, 2.0, 0.6, 2.6]), np.array([0.003, 0.01, 0.006, 0.004])
    of = model(creepage, ratios, contact)
    found, at = predicted(of), of.points.of_iteration[1::2]
    widest = 1.1 * 0.5 * np.cbrt(12.0 * found.section[0, -1] / of.experiment.rig.curvature_y)
    y = (widest + 1.3 * float(of.experiment.rig.patch.b) * np.cbrt(ratios.max())) * np.linspace(-1.0, 1.0, 141)
    wear = K / of.circumference_hardness * rigs.SPEED * 168.0
    depth, ratio = load_integration.integrated(
        rigs.rig(), contact, y, loads=rigs.LOAD * ratios, creepage=creepage, mu=MU, wear=wear, steps=steps
    )
    assert depths(found, at).max(axis=1) == pytest.approx(depth, rel=5e-3)
    assert found.state.traction_ratio[0, at] == pytest.approx(ratio, abs=4e-3)


@both
def test_no_wear_comes_back_when_the_load_changes(contact: Contact) -> None:
    """72 N for ten iterations, then four times as much, then a quarter: every strip only loses, and S in all."""
    of = model(np.full(12, 0.02), np.array([*np.ones(10), 4.0, 0.25]), contact, each=1)
    found = predicted(of)
    depth, y = depths(found), found.paths.paths[0].y
    assert np.diff(depth, axis=0).min() > -1e-9 * depth.max()
    assert depth.sum(axis=1) * (y[1] - y[0]) == pytest.approx(found.section[0], rel=1e-9)


def test_a_profile_moves_no_more_than_what_wears() -> None:
    """Strips and what is recorded lie on one grid, whose extent is a whole number of strips but for rounding."""
    y = np.linspace(-0.3e-3, 0.3e-3, 161)
    profile = ProfileSamples(y, np.zeros_like(y), np.full(161, 2), np.full(161, 6))
    of = model(np.array([0.02, 0.03, 0.02]), np.array([1.0, 2.0, 0.5]), "half_space")
    of = ForwardModel(replace(of.experiment, measured=replace(of.experiment.measured, profile=profile)))
    here = predicted(of).profile
    deepest = float(np.abs(here).max())
    assert deepest > 0.5e-6
    for share in np.geomspace(1e-7, 1e-5, 20):
        assert np.abs(predicted(of, K * (1.0 + share)).profile - here).max() < 2.0 * share * deepest


def test_a_trial_that_wears_far_too_much_is_followed_all_the_same() -> None:
    y = np.linspace(-0.3e-3, 0.3e-3, 161)
    profile = ProfileSamples(y, np.zeros_like(y), np.full(161, 2), np.full(161, 6))
    of = model(np.array([0.02, 0.03, 0.02]), np.array([1.0, 2.0, 0.5]), "hertz")
    of = ForwardModel(replace(of.experiment, measured=replace(of.experiment.measured, profile=profile)))
    far, near = (np.abs(predicted(of, times * K).profile).max() for times in (1e9, 1.0))
    assert np.isfinite(far)
    assert far > 10.0 * near


@pytest.mark.parametrize("ratios", [(1.0, 1.0, 1.0), (1.0, 2.0, 0.5)])
def test_a_law_that_takes_k_below_zero_wears_nothing(ratios: tuple[float, ...]) -> None:
    of = model(np.array([0.02, 0.03, 0.02]), np.array(ratios), "hertz")
    course = of.experiment.history
    end = float(course.end_time[-1])
    law = Law("wear", "time", at=(0.0, 0.5 * end, end), value=(-1.0, -0.5, 1.0))
    found = predicted(ForwardModel(replace(of.experiment, laws={"wear_over_time": law})))
    assert np.all(np.diff(found.section[0], prepend=0.0) >= 0.0)
    assert found.section[0, -1] > 0.0


@pytest.fixture
def integrated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every history is integrated, in the place of a path near it."""
    monkeypatch.setattr(chain, "paths_near", carried_paths)


loads_of_three = pytest.mark.parametrize("ratios", [(1.0, 2.0, 0.5), (1.0, 3.0, 0.5), (2.0, 0.5, 1.0)])


def slopes_over_wear(of: ForwardModel) -> Floats:
    """Change of the last T/N per relative change of K, by steps of a ten-thousandth and of a hundredth of that."""
    shares = np.array([0.0, 1e-4, 1e-6])
    ratio = predicted(of, K * (1.0 + shares)).state.traction_ratio[:, -1]
    return np.asarray((ratio[1:] - ratio[0]) / shares[1:])


@pytest.mark.usefixtures("integrated")
@loads_of_three
def test_derivatives_by_the_track_are_those_of_larger_steps(ratios: tuple[float, ...]) -> None:
    """Steps in K of a ten-thousandth and of a hundredth of that, after K has been integrated alone; and of a tenth."""
    of = model(np.array([0.004, 0.006, 0.004]), np.array(ratios), "half_space")
    predicted(of)
    slopes = slopes_over_wear(of)
    less, more = predicted(of, K * np.array([0.9, 1.1])).state.traction_ratio[:, -1]
    assert slopes[1] == pytest.approx(slopes[0], rel=0.01)
    assert slopes[0] == pytest.approx((more - less) / 0.2, rel=0.3)


@loads_of_three
def test_derivatives_by_paths_near_are_those_of_integrations(
    ratios: tuple[float, ...], request: pytest.FixtureRequest
) -> None:
    """Over a tenth, places of the lattice differ by what single strips make of an integration: as much as is asked."""
    of = model(np.array([0.004, 0.006, 0.004]), np.array(ratios), "half_space")
    near = slopes_over_wear(of)
    assert near[1] == pytest.approx(near[0], rel=0.01)
    request.getfixturevalue("integrated")
    assert near[0] == pytest.approx(slopes_over_wear(of)[0], rel=0.3)


@both
def test_a_history_of_one_load_is_the_path(contact: Contact) -> None:
    """Integrated as a history, under the rig's load or twice that, the path is that of the table, scaled."""
    rig, section = rigs.rig(), 12.0 * first_section(rigs.rig())
    path = wear_path(rig, contact=contact, section=section)
    for ratio in (1.0, 2.0):
        (own,) = carried_paths(Setup(rig, contact), [LoadHistory(np.array([0.3, 1.0]) * section, np.full(2, ratio))])
        at, load = np.array([[0.2, 0.7]]) * section, np.full((1, 2), ratio)
        scaled = path.contact_scale(load)
        for name, size in (("a", scaled.along), ("b", scaled.across), ("area", scaled.along * scaled.across)):
            here, there = (of.read(lambda p, s, name=name: p.at(getattr(p, name), s), at, load) for of in (own, path))
            assert here == pytest.approx(there * size, rel=6e-3)
        deepest = path.read(lambda p, s: p.at(p.depth.max(axis=1), s), at, load) * path.profile_scale(load).height
        assert own.read(lambda p, s: p.at(p.depth.max(axis=1), s), at, load) == pytest.approx(deepest, rel=3e-3)


@pytest.mark.usefixtures("integrated")
def test_local_wear_that_is_the_same_everywhere_is_carried_like_any() -> None:
    of = model(np.full(4, 0.01), np.array([1.0, 3.0, 0.5, 1.5]), "half_space")
    none = {"severe_wear_transition": {"ratio": 1.0 + 1e-9, "critical_N_mm2": 3.0, "width": 0.03}}
    effects = {name: {key: np.array([value]) for key, value in values.items()} for name, values in none.items()}
    assert depths(predicted(of, effects=effects)) == pytest.approx(depths(predicted(of)), abs=2e-10)


def test_local_wear_and_loads_conserve_what_is_worn() -> None:
    of = model(np.full(4, 0.01), np.array([1.0, 3.0, 0.5, 1.5]), "half_space")
    mild = {"wear_threshold": {"threshold_N_mm2": np.array([0.7])}}
    found = predicted(of, effects=mild)
    depth, y = depths(found), found.paths.paths[0].y
    assert depth.sum(axis=1) * (y[1] - y[0]) == pytest.approx(found.section[0], rel=1e-6)
    assert np.diff(depth, axis=0).min() > -1e-9 * depth.max()
    plain = depths(predicted(of))[-1]
    assert not np.allclose(depth[-1] / depth[-1].max(), plain / plain.max(), atol=0.01)


def test_paths_of_a_prediction_nearby_serve_others() -> None:
    """A K a tenth larger, read off the path of the first, against its own integration."""
    of = model(np.full(3, 0.01), np.array([1.0, 3.0, 0.5]), "hertz")
    first = predicted(of)
    near, own = predicted(of, 1.1 * K, integrated=first.paths), predicted(of, 1.1 * K)
    assert depths(near)[-1].max() == pytest.approx(depths(own)[-1].max(), rel=5e-3)
    again = predicted(of, integrated=first.paths)
    assert depths(again)[-1] == pytest.approx(depths(first)[-1], rel=1e-6, abs=1e-12)


def test_local_wear_begins_on_paths_of_one_wear_coefficient() -> None:
    """A threshold read off the path where nothing is local, at creepages that slip in part, against its own."""
    of = model(np.array([0.002, 0.004, 0.003]), np.array([1.0, 3.0, 0.5]), "half_space")
    effects = {"wear_threshold": {"threshold_N_mm2": np.array([0.2])}}
    begun = predicted(of, effects=effects, integrated=predicted(of).paths)
    own = predicted(of, effects=effects)
    assert 0.0 < own.section[0, -1] < 0.99 * predicted(of).section[0, -1]
    assert begun.section[0, -1] == pytest.approx(own.section[0, -1], rel=0.05)


def test_loads_within_a_few_percent_are_one_piece() -> None:
    section = np.linspace(0.1, 1.0, 10)
    wobbling = LoadHistory(section, 1.0 + 0.01 * (-1.0) ** np.arange(10))
    assert not wobbling.changes
    ends, loads = LoadHistory(section, np.where(section < 0.55, 1.0, 2.0) * wobbling.ratio).pieces()
    assert ends == pytest.approx([0.5, 1.0])
    assert loads == pytest.approx([1.0, 2.0], rel=5e-3)


def test_where_nothing_wears_the_first_load_is_that_of_the_first_point() -> None:
    history = LoadHistory(np.zeros(3), np.array([2.0, 1.0, 0.5]))
    assert [len(of) for of in history.pieces()] == [0, 0]
    assert history.first == 2.0


def test_steps_that_are_tests_of_their_own_wear_new_discs_under_their_own_load() -> None:
    of = model(np.full(2, 0.01), np.array([1.0, 4.0]), "hertz")
    apart = ForwardModel(replace(of.experiment, history=replace(of.experiment.history, separate=True)))
    assert not apart.loads_change
    alone = model(np.full(1, 0.01), np.array([4.0]), "hertz")
    assert depths(predicted(apart))[-1].max() == pytest.approx(depths(predicted(alone))[-1].max(), rel=1e-3)


@both
def test_histories_integrated_together_are_what_they_are_alone(contact: Contact) -> None:
    """Two that end nearly alike and one that does not."""
    section = np.array([0.2, 0.6, 1.5]) * 6.0 * first_section(rigs.rig())
    loads = np.array([1.0, 2.0, 0.5])
    histories = [LoadHistory(section * share, loads) for share in (1.0, 1.004, 1.3)]
    together = carried_paths(Setup(rigs.rig(), contact), histories)
    for history, path in zip(histories, together, strict=True):
        (alone,) = carried_paths(Setup(rigs.rig(), contact), [history])
        at, load = history.section[None, :], loads[None, :]
        for name in ("depth", "a", "b", "area", "stiffness"):
            here, there = (
                of.read(lambda p, s, name=name: p.at(getattr(p, name), s), at, load).reshape(3, -1).max(axis=1)
                for of in (path, alone)
            )
            assert here == pytest.approx(there, rel=1e-3), name  # a third of what the strips err by


@pytest.mark.parametrize(("contact", "pieces"), [("hertz", 6), ("half_space", 3)])
def test_paths_near_each_other_are_those_of_their_own_integrations(contact: Contact, pieces: int) -> None:
    """Profile, contact and creep stiffness along histories whose pieces are up to a fifth longer or shorter."""
    rig, random = rigs.rig(), np.random.default_rng(pieces)
    loads = np.array([1.0, 2.0, 0.5, 1.5, 0.7, 2.5])[:pieces]
    for share in np.exp(random.uniform(-0.2, 0.2, (3, pieces))):
        section = np.cumsum(3.0 * first_section(rig) * share)
        history = LoadHistory(section, loads)
        (near,), (own,) = (paths(Setup(rig, contact), [history]) for paths in (paths_near, carried_paths))
        at, load = 0.97 * section[None], loads[None]
        for name, within in (("stiffness", 1e-2), ("area", 2e-2)):
            here, there = (
                of.read(lambda path, s, name=name: path.at(getattr(path, name), s), at, load) for of in (near, own)
            )
            assert here == pytest.approx(there, rel=within), name
        for (here, there), within in (
            ([path.read(lambda p, s: p.at(p.p0, s), at, load).max() for path in (near, own)], own.pressure_error),
            ([path.levels[0].depth[-1].max() for path in (near, own)], own.error),
        ):
            assert here == pytest.approx(there, rel=within)
        worn = np.diff(near.levels[0].depth, axis=0)
        assert worn.min() >= 0.0
        y = near.y
        assert worn.sum(axis=1) * (y[1] - y[0]) == pytest.approx(np.diff(near.levels[0].section), rel=1e-9)


@both
@pytest.mark.parametrize("wander", [0.0, 1e-4])
def test_all_loads_together_scale_what_they_wear(contact: Contact, wander: float) -> None:
    """Hertz: under n times the load lengths are n^(1/3), depths n^(2/3), sections n times those before."""
    rig, loads, section = rigs.rig(), np.array([1.0, 2.0, 0.5]), np.array([1.0, 3.0, 7.0]) * first_section(rigs.rig())
    times = 1.37
    (one,), (own,) = (
        carried_paths(Setup(rig, contact, n ** (1.0 / 3.0) * wander), [LoadHistory(n * section, n * loads)])
        for n in (1.0, times)
    )
    scaled = one.under(times)
    assert scaled.ratios == pytest.approx(own.ratios)
    for here, there, before in zip(scaled.levels, own.levels, one.levels, strict=True):
        for name in ("section", "y", "depth", "line_load", "a", "b", "p0", "area", "stiffness", "stiffness_y", "edge"):
            known = getattr(there, name)
            assert getattr(here, name) == pytest.approx(known, abs=2e-3 * np.abs(known).max()), name
        assert here.wander == pytest.approx(there.wander)
        assert here.depth.max() == pytest.approx(times ** (2.0 / 3.0) * before.depth.max())


def test_histories_that_differ_by_all_loads_together_share_a_place() -> None:
    rig, loads, section = rigs.rig(), np.array([1.0, 2.0, 0.5]), np.array([1.0, 3.0, 7.0]) * first_section(rigs.rig())
    nearby._around.cache_clear()
    for times in (1.0, 1.1, 0.83):
        paths_near(Setup(rig, "hertz"), [LoadHistory(times * section, times * loads)])
    assert nearby._around.cache_info().misses == 1


@both
def test_wander_is_the_same_whatever_load_the_others_are_declared_over(contact: Contact) -> None:
    """The same loads as 1.3 times those of a rig, and as those of a rig of 1.3 times the load."""
    creepage, ratios, times = np.array([0.004, 0.03, 0.01]), np.array([1.0, 2.0, 0.5]), 1.3
    one = model(creepage, times * ratios, contact)
    rig = rigs.rig(load=times * rigs.LOAD)
    other = ForwardModel(replace(model(creepage, ratios, contact).experiment, rig=rig))
    wander = {"lateral_wander": {"std_mm": np.array([0.12])}}
    here, there = (predicted(of, effects=wander) for of in (one, other))
    assert here.state.traction_ratio == pytest.approx(there.state.traction_ratio, rel=2e-3)
    assert depths(here).max() == pytest.approx(depths(there).max(), rel=3e-3)
    assert depths(here).max() < 0.97 * depths(predicted(one)).max()


@pytest.mark.parametrize("wander", [0.0, 1e-4])
def test_a_case_that_departs_later_is_what_it_is_from_the_beginning(wander: float) -> None:
    """A second piece that is longer by a tenth, on strips that are wider by a hundredth."""
    rig = rigs.rig()
    first = np.linspace(0.0, 3.0, 40) * first_section(rig)
    nodes = np.stack([np.append(first, first[-1] + share * first) for share in (1.0, 1.1)])
    given = {
        "cases": 2,
        "settled": 1e-4,
        "loads": np.repeat([1.0, 2.0], len(first)),
        "scale": np.array([1.0, 1.01]),
    }
    y = np.linspace(-1.5e-3, 1.5e-3, 161)
    departs = np.where(np.arange(nodes.shape[1] - 1) < len(first) - 1, 1, 2)
    here, there = (
        integrate(Setup(rig, "half_space", wander), y, nodes, **given, apart=apart) for apart in (departs, None)
    )
    assert here.depth[0] == pytest.approx(there.depth[0], abs=1e-6 * there.depth.max())
    assert here.depth == pytest.approx(there.depth, abs=5e-3 * there.depth.max())
    for name in ("a", "b", "p0", "area", "stiffening"):
        assert getattr(here.contact, name) == pytest.approx(getattr(there.contact, name), rel=2e-2), name
    worn = here.depth.sum(axis=-1) * (y[1] - y[0]) * given["scale"][:, None]
    assert worn == pytest.approx(nodes, rel=1e-3, abs=1e-3 * first_section(rig))


def test_what_changes_no_wear_is_integrated_once() -> None:
    """Convection, where nothing depends on the temperature; with a K that differs there are two paths."""
    of = model(np.array([0.02, 0.03, 0.02]), np.array([1.0, 2.0, 0.5]), "hertz")
    base = {"mu": np.full(3, MU), "K": np.array([K, K, 1.1 * K]), "convection_W_K": np.array([1.6, 1.7, 1.6])}
    paths = of.predict(base, {"wear_threshold": {"threshold_N_mm2": np.full(3, 0.5)}}).paths
    assert isinstance(paths, OwnPaths)
    first, second, third = (own.parts[0] for own in paths.sets)
    assert first is second
    assert first is not third


def test_a_piece_that_wears_many_times_nothing_is_a_piece_that_wears_nothing() -> None:
    """A step of free rolling between two others, a millionth or a hundred millionths of a creepage beside it."""
    rig, loads = rigs.rig(), np.array([1.0, 2.0, 0.5])
    sizes = np.array([[2.0, share, 3.0] for share in (1e-9, 1e-7)]) * first_section(rig)
    asked = [LoadHistory(np.cumsum(own), loads) for own in sizes]
    one, other = paths_near(Setup(rig, "hertz"), asked)
    assert other.levels[0].depth == pytest.approx(one.levels[0].depth, rel=1e-6)
    (own,) = carried_paths(Setup(rig, "hertz"), asked[:1])
    assert one.levels[0].depth[-1].max() == pytest.approx(own.levels[0].depth[-1].max(), rel=own.error)


def test_the_place_that_serves_a_history_depends_on_that_history_alone() -> None:
    """The same path, to the last digit, whatever was asked for before it."""
    rig, loads = rigs.rig(), np.array([1.0, 2.0, 0.5])
    section = np.array([0.2, 0.6, 1.5]) * 6.0 * first_section(rig)
    setup, asked = Setup(rig, "hertz"), [LoadHistory(section * share, loads) for share in (1.0, 1.09, 0.9)]
    orders = []
    for order in ([0, 1, 2], [2, 1, 0]):
        nearby._around.cache_clear()
        found = {number: paths_near(setup, [asked[number]])[0] for number in order}
        orders.append([found[number].levels[1].depth for number in range(3)])
    for one, other in zip(*orders, strict=True):
        assert np.array_equal(one, other)


def test_local_wear_of_histories_integrated_together_is_what_it_is_alone() -> None:
    """Two near each other, the second of which wears more at its edges, the first in the middle; and one far off."""
    rig, loads = rigs.rig(), np.array([1.0, 2.0, 0.5])
    section = np.array([0.2, 0.6, 1.5]) * 6.0 * first_section(rig)
    histories = [LoadHistory(section * share, loads) for share in (1.0, 1.3, 1.004)]
    edges, ends = np.array([-0.5, 0.5, 0.8]), [history.section[-1] for history in histories]

    def worn(chosen: list[int]) -> list[CarriedPath]:
        def weights(cases: list[int], nodes: Floats, y: Floats) -> Weights:
            own = [chosen[case] for case in cases]
            assert nodes[:, -1] == pytest.approx(1.2 * np.array([ends[number] for number in own]))
            return lambda step, across, loaded: 1.0 + edges[own][:, None] * (across / y[-1]) ** 2

        return carried_paths(Setup(rig, "half_space"), [histories[i] for i in chosen], weights=weights)

    alone = [worn([number])[0].levels[0].depth[-1] for number in range(3)]
    for path, own in zip(worn([0, 1, 2]), alone, strict=True):
        assert path.levels[0].depth[-1] == pytest.approx(own, abs=2e-3 * own.max())
