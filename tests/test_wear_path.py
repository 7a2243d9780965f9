"""The wear path against geometry, dimensional analysis and conservation of volume."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import RADIUS, rig

from twindisc_cli.model.experiment import Contact
from twindisc_cli.model.integration import Loaded, Setup, integrate
from twindisc_cli.model.patch import weighted_paths
from twindisc_cli.model.wear_path import WearPath, first_section, grid, wear_path
from twindisc_cli.model.wear_path.integrated import integrated_path
from twindisc_cli.model.wear_path.path import edges_of
from twindisc_cli.physics.half_space import OutOfRangeError
from twindisc_cli.physics.half_space.normal import solve_profile

CONTACTS: tuple[Contact, ...] = ("hertz", "half_space")
both = pytest.mark.parametrize("contact", CONTACTS)
SECTION = 3e-9


def facet_depth(section: float) -> float:
    """Depth w^2 / (8 R) [m] of the segment w^3 = 12 S R that a chord w cuts off."""
    return (12.0 * section * RADIUS) ** (2 / 3) / (8.0 * RADIUS)


def facet_section(depth: float) -> float:
    """Section 2/3 w d [m2] of the segment of that depth."""
    return 2.0 / 3.0 * depth * np.sqrt(8.0 * RADIUS * depth)


@both
@pytest.mark.parametrize("wander", [0.0, 1.5e-4])
def test_what_is_worn_off_is_the_section(contact: Contact, wander: float) -> None:
    path = wear_path(rig(), contact=contact, section=SECTION, wander=wander)
    assert path.section[0] == 0.0
    assert path.section[-1] >= SECTION
    spacing = path.y[1] - path.y[0]
    assert path.depth.sum(axis=1) * spacing == pytest.approx(path.section, rel=1e-12)
    assert path.line_load.sum(axis=1) * spacing == pytest.approx(np.full(len(path.section), 72.0), rel=1e-12)


@both
def test_wear_is_symmetric_and_never_comes_back(contact: Contact) -> None:
    path = wear_path(rig(), contact=contact, section=SECTION)
    assert path.depth == pytest.approx(path.depth[:, ::-1], rel=1e-6, abs=1e-13)
    assert np.diff(path.depth, axis=0).min() >= -1e-18
    assert np.diff(path.b).min() >= 0.0, "a worn track is wider"
    assert path.p0[-1] < 0.8 * path.p0[0], "and bears less pressure"


def test_the_unworn_contact_is_that_of_hertz() -> None:
    """a, b, p0: CONTACT open-source release 2025-07-23, revision 2707; C11 3.9388, C22 3.2194, G 79.3 GPa."""
    a, b, p0 = 0.170591303e-3, 0.270524050e-3, 744.92254e6
    path = wear_path(rig(), contact="hertz", section=0.0)
    # E = 206 GPa is G = 79.23 GPa, not 79.3: lengths go with E^(-1/3), pressure with E^(2/3).
    soft = 206.0 / (79.3 * 2.6)
    assert (path.a[0], path.b[0]) == pytest.approx((a / np.cbrt(soft), b / np.cbrt(soft)), rel=1e-6)
    assert path.p0[0] == pytest.approx(p0 * np.cbrt(soft) ** 2, rel=1e-6)
    assert path.stiffness[0] == pytest.approx(soft ** (1 / 3) * 79.3e9 * a * b * 3.9388, rel=2e-3)
    assert path.stiffness_y[0] == pytest.approx(soft ** (1 / 3) * 79.3e9 * a * b * 3.2194, rel=2e-3)


@both
def test_the_unworn_line_load_is_a_parabola(contact: Contact) -> None:
    """Hertz: integrated along rolling, the semi-ellipsoid leaves 3 N / (4 b) (1 - y^2 / b^2)."""
    path = wear_path(rig(), contact=contact, section=0.0)
    b = 0.270524050e-3 * np.cbrt(79.3 * 2.6 / 206.0)
    closed = 0.75 * 72.0 / b * np.maximum(1.0 - (path.y / b) ** 2, 0.0)
    assert path.line_load[0] == pytest.approx(closed, abs=0.015 * closed.max())


def test_a_long_half_space_path_ends_as_a_facet() -> None:
    """Elastic approach becomes small against the depth: the chord w^3 = 12 S R, the depth w^2 / (8 R)."""
    path = wear_path(rig(load=8.0), contact="half_space", section=3e-8)
    deviation = np.abs(path.depth.max(axis=1)[1:] / facet_depth(path.section[1:]) - 1.0)
    assert deviation[-1] < 1e-3
    assert deviation[-1] < 0.3 * np.interp(0.1 * path.section[-1], path.section[1:], deviation)
    half = 0.5 * np.cbrt(12.0 * path.section[-1] * RADIUS)
    facet = np.maximum(half**2 - path.y**2, 0.0) / (2.0 * RADIUS)
    assert path.depth[-1] == pytest.approx(facet, abs=2e-3 * facet.max())
    # the patch is a band as wide as the facet, whose ellipse of like area and proportion has b = half (4 / pi)^(1/2)
    assert path.b[-1] == pytest.approx(half * np.sqrt(4.0 / np.pi), rel=0.015)


def test_a_long_hertz_path_ends_in_its_similar_solution() -> None:
    """With b as wide as the track, du/dS = 3 / (4 b) (1 - y^2 / b^2) and b^3 = beta^3 S:

    u(y) = 9 / (4 beta^3) [(b^2 - y^2) / 2 + y^2 ln(y / b)], whose best circle within b is -8/15 * 9 / (4 beta^3) y^2.
    That this is flat against y^2 / (2 R) gives beta^3 = 2.4 R, and a depth of 9/8 b^2 / (2.4 R).
    """
    path = wear_path(rig(load=4.0), contact="hertz", section=4e-8)
    section = path.section[-1]
    b = np.cbrt(2.4 * RADIUS * section)
    inside = np.clip(np.abs(path.y) / b, 1e-9, 1.0)
    similar = 9.0 * b**2 / (4.0 * 2.4 * RADIUS) * ((1.0 - inside**2) / 2.0 + inside**2 * np.log(inside))
    assert path.b[-1] == pytest.approx(b, rel=0.005)
    assert path.depth[-1] == pytest.approx(similar, abs=0.01 * similar.max())
    assert path.depth[-1].max() / facet_depth(section) == pytest.approx(1.2825, rel=0.01)


def test_a_track_half_a_millimetre_deep_is_still_that_solution() -> None:
    """The track is 24 times as wide as the patch that began it; depth 9/8 b^2 / (2.4 R), b^3 = 2.4 R S."""
    path = wear_path(rig(), contact="hertz", section=facet_section(0.45e-3))
    b = np.cbrt(2.4 * RADIUS * path.section[-1])
    assert path.b[-1] == pytest.approx(b, rel=0.002)
    assert path.depth[-1].max() == pytest.approx(9.0 / 8.0 * b**2 / (2.4 * RADIUS), rel=0.005)
    assert path.depth[-1][[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_track_that_has_nothing_to_do_with_its_load_is_refused() -> None:
    with pytest.raises(OutOfRangeError, match="times as wide as the unworn patch"):
        wear_path(rig(load=1e-5), contact="hertz", section=1e-9)


@both
def test_load_scales_the_path(contact: Contact) -> None:
    """Lengths go with N^(1/3), heights with N^(2/3), the section with N: nothing else has a length."""
    small = wear_path(rig(), contact=contact, section=1e-9)
    large = wear_path(rig(load=8.0 * 72.0), contact=contact, section=8e-9)
    assert large.section == pytest.approx(8.0 * small.section, rel=1e-9)
    assert large.y == pytest.approx(2.0 * small.y, rel=1e-9)
    assert large.depth == pytest.approx(4.0 * small.depth, rel=1e-4, abs=1e-5 * large.depth.max())
    assert large.b == pytest.approx(2.0 * small.b, rel=1e-4)
    assert large.a == pytest.approx(2.0 * small.a, rel=1e-4)
    assert large.p0 == pytest.approx(2.0 * small.p0, rel=1e-3)
    assert large.stiffness == pytest.approx(4.0 * small.stiffness, rel=1e-4)


def test_another_load_is_read_off_the_same_path() -> None:
    one, other = (wear_path(rig(load=n), contact="hertz", section=s) for n, s in ((72.0, 2e-9), (36.0, 1e-9)))
    none = np.zeros((1, 1))
    paths = weighted_paths(lambda contact, wander, crown: one, "hertz", none, none, none + 1.0)
    section = np.array([[0.0, 2e-10, 7e-10]])
    patch = paths.patch(section, np.full((1, 3), 0.5))
    for values, expected in ((patch.stiffness, other.stiffness), (patch.area, other.area), (patch.a, other.a)):
        assert values[0] == pytest.approx(np.interp(section[0], other.section, expected), rel=1e-3)
    assert patch.ratio[0] == pytest.approx(np.interp(section[0], other.section, other.a / other.b), rel=1e-3)


@both
@pytest.mark.parametrize("wander", [5e-5, 2e-4])
def test_wander_spreads_the_first_wear_by_its_variance(contact: Contact, wander: float) -> None:
    """Second moment: that of the patch's line load, b^2 / 5 for a semi-ellipsoid, plus the wander's own."""
    path = wear_path(rig(), contact=contact, section=0.0, wander=wander)
    plain = wear_path(rig(), contact=contact, section=0.0)
    early = np.flatnonzero(path.section > 0.0)[0]
    moments = [float(p.depth[early] @ p.y**2 / p.depth[early].sum()) for p in (plain, path)]
    assert moments[0] == pytest.approx(plain.b[0] ** 2 / 5.0, rel=0.03)
    assert moments[1] - moments[0] == pytest.approx(wander**2, rel=0.03)
    assert path.depth[early].max() < plain.depth[early].max()


def integrated(monkeypatch: pytest.MonkeyPatch, contact: Contact, growth: float) -> WearPath:
    monkeypatch.setattr(grid, "GROWTH", growth)
    integrated_path.cache_clear()
    path = integrated_path(rig(), contact, grid.tier(rig(), 1e-9), 0.0, None)
    integrated_path.cache_clear()
    return path


@both
def test_half_the_step_agrees_as_the_path_says(contact: Contact, monkeypatch: pytest.MonkeyPatch) -> None:
    step = grid.GROWTH
    paths = {part: integrated(monkeypatch, contact, part * step) for part in (2.0, 1.0, 0.25)}
    deepest = {part: path.depth[-1].max() for part, path in paths.items()}
    true = abs(deepest[1.0] / deepest[0.25] - 1.0)
    assert true < 1e-3
    assert paths[1.0].error < 1e-3
    assert true < 3.0 * paths[1.0].error + 1e-6, "the reported error is the true one, to its order"
    assert abs(deepest[2.0] / deepest[0.25] - 1.0) > 1.5 * true, "halving the step pays"
    fine, usual = paths[0.25], paths[1.0]
    off = np.abs(np.interp(usual.section, fine.section, fine.p0) / usual.p0 - 1.0).max()
    assert off < 1.5 * usual.pressure_error + 1e-4, "and so is that of the peak pressure"
    assert usual.pressure_error < 0.02


def test_the_peak_pressure_of_a_worn_track_is_that_of_the_full_solver() -> None:
    """Within 1 %, and without jumps from node to node: it falls as the track widens."""
    path, disc = wear_path(rig(), contact="half_space", section=SECTION), rig()
    assert np.all(np.diff(path.p0) < 0.01 * path.p0[:-1])
    node = int(np.searchsorted(path.section, 1e-9))
    full = solve_profile(
        y=path.y,
        gap=0.5 * disc.curvature_y * path.y**2 + path.depth[node],
        curvature_x=disc.curvature_x,
        normal_load=disc.normal_load,
        effective_modulus=disc.effective_modulus,
    )
    assert path.p0[node] == pytest.approx(full.pressure.max(), rel=0.01)


def test_a_strip_that_has_just_touched_bears_no_peak_pressure() -> None:
    """Under a wide wander new patches come up far from the others, each with a single strip: p0 does not jump."""
    of = rig(crown=45.0 * RADIUS)
    section, wander = 900.0 * first_section(of), 2.2 * float(of.patch.b)
    usual = grid.strips_of(of, section, wander)
    y = np.linspace(usual[0], usual[-1], 2 * len(usual) - 1)
    nodes = grid.nodes_to(of, section, 0.5 * grid.GROWTH)
    p0 = integrate(Setup(of, "half_space", wander), y, nodes).contact.p0[0]
    assert np.abs(np.diff(np.log(p0))).max() < 0.1


def test_a_node_is_read_exactly_and_between_nodes_on_a_line() -> None:
    path = wear_path(rig(), contact="hertz", section=SECTION)
    middle = 0.5 * (path.section[3] + path.section[4])
    at = np.array([[0.0, path.section[3], middle], [path.section[-1], 2.0 * path.section[-1], path.section[4]]])
    depth, b = path.at(path.depth, at), path.at(path.b, at)
    assert depth.shape == (2, 3, len(path.y))
    assert depth[0, 1] == pytest.approx(path.depth[3], rel=1e-12)
    assert depth[0, 2] == pytest.approx(0.5 * (path.depth[3] + path.depth[4]), rel=1e-12)
    assert depth[1, 1] == pytest.approx(path.depth[-1], rel=1e-12), "beyond its end the path stands still"
    assert b == pytest.approx(np.interp(at, path.section, path.b))
    assert np.isnan(path.patch_under(np.array([[np.nan]]), np.ones((1, 1)))).all(), "an unknown section has no patch"


def test_a_sharper_disc_has_a_smaller_first_section() -> None:
    """w^3 / (12 R) with w = 2 b of Hertz: at equal load a sharper crown has the smaller patch."""
    for crown in (0.01, 0.03):
        unworn = wear_path(rig(crown=crown), contact="hertz", section=0.0)
        assert first_section(rig(crown=crown)) == pytest.approx((2.0 * unworn.b[0]) ** 3 / (12.0 * crown), rel=1e-9)


def test_the_worn_zone_ends_where_two_percent_of_the_depth_are_left() -> None:
    """The parabola 1 - u^2 has 2 % left at u = sqrt(0.98), between the strips."""
    y = np.linspace(-1.0, 1.0, 121)
    depth = np.stack([np.zeros_like(y), 3e-6 * np.maximum(1.0 - (y / 0.7) ** 2, 0.0)])
    unworn, worn = edges_of(y, depth, np.array([0.2, 0.3]))
    assert unworn == 0.2
    assert worn == pytest.approx(0.7 * np.sqrt(0.98), rel=1e-3)


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_where_only_strips_out_of_contact_would_wear_all_in_contact_do(contact: Contact) -> None:
    """As by a threshold that only the first strips passed, before they came out of contact: the volume is kept."""
    of, y, nodes = rig(), np.linspace(-1.5e-3, 1.5e-3, 61), np.array([0.0, 1e-10, 3e-10])

    def outside(_step: int, _y: np.ndarray, loaded: Loaded) -> np.ndarray:
        return np.where(loaded.line_load > 0.0, 0.0, 1.0)

    worn = integrate(Setup(of, contact), y, nodes, weights=outside).depth[0]
    assert worn.sum(axis=1) * (y[1] - y[0]) == pytest.approx(nodes, rel=0.02)
