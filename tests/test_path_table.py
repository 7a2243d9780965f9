"""Wear paths read off the table: dimensional analysis, and the integration on finer strips and steps."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import rig

from table_makers.paths import refined, rig_of
from twindisc_cli.model import path_table
from twindisc_cli.model.experiment import Contact, Disc, Rig, Start
from twindisc_cli.model.integration import Setup, WearIntegration, integrate
from twindisc_cli.model.wear_path import grid, wear_path
from twindisc_cli.model.wear_path.integrated import integrated_path
from twindisc_cli.model.wear_path.provider import remembered
from twindisc_cli.model.wear_path.tabulated import tabulated_path

both = pytest.mark.parametrize("contact", ["hertz", "half_space"])


def fine(of: Rig, contact: Contact, section: float, wander: float) -> tuple[WearIntegration, np.ndarray]:
    """The integration on twice the strips with half the steps, and its nodes."""
    nodes = grid.nodes_to(of, section, 0.5 * grid.GROWTH)
    y = refined(grid.strips_of(of, section, wander), 2)
    return integrate(Setup(of, contact, wander), y, nodes), nodes


@both
def test_rigs_of_one_curvature_ratio_and_wander_have_one_path(contact: Contact) -> None:
    """Hertz's patch takes up load, modulus and size; unequal discs count by their sums of curvatures."""
    glass = {"youngs_modulus": 70e9, "poisson_ratio": 0.22, "hardness": 5e9}
    other = Rig(Disc(0.02, 0.05, **glass), Disc(0.04, 0.04, **glass), normal_load=900.0, rolling_speed=1.0)
    one = rig_of(other.curvature_y / other.curvature_x)
    found = []
    for of in (one, other):
        b, section = float(of.patch.b), 5.0 * grid.first_section(of)
        y = b * np.arange(-60, 61) / 18.0
        integrated = integrate(Setup(of, contact, 0.3 * b), y, grid.nodes_to(of, section, 0.2))
        patch = [integrated.contact.a / of.patch.a, integrated.contact.b / b, integrated.contact.p0 / of.patch.p0]
        found.append([integrated.depth * b / section, *patch, integrated.contact.line_load * b / of.normal_load])
    for values, expected in zip(*found, strict=True):
        assert values == pytest.approx(expected, rel=2e-5, abs=2e-5)


@both
def test_a_path_of_the_table_is_that_of_the_march(contact: Contact) -> None:
    """Between the nodes in every direction but the wander: 0.05 % of the depth, 0.5 % of the area."""
    rng = np.random.default_rng(20261122)
    for _ in range(5):
        of = rig_of(float(np.exp(rng.uniform(-4.0, 2.0))))
        section = float(np.exp(rng.uniform(np.log(0.3), np.log(100.0)))) * grid.first_section(of)
        wander = float(rng.choice(path_table.WANDERS[:6])) * float(of.patch.b)
        integrated, nodes = fine(of, contact, section, wander)
        path = tabulated_path(of, contact, section, wander)
        assert path.depth[-1].max() == pytest.approx(integrated.depth[0, -1].max(), rel=5e-4)
        for name, off in (("area", 5e-3), ("a", 5e-3), ("b", 5e-3)):
            expected = np.interp(path.section, nodes, getattr(integrated.contact, name)[0])
            misses = getattr(path, name) / expected - 1.0
            assert np.sqrt(np.mean(misses**2)) < off, "strips and steps make single nodes of the integration jump"
        assert path.section == pytest.approx(path.depth.sum(axis=1) * (path.y[1] - path.y[0]), rel=1e-12)


def test_a_patch_that_falls_apart_is_that_of_the_march() -> None:
    """Under a wide wander the middle comes free, touches again and comes free: 95 % of the areas within 0.8 %."""
    of = rig_of(float(np.exp(-4.5)))
    section, wander = 230.0 * grid.first_section(of), 2.2 * float(of.patch.b)
    integrated, nodes = fine(of, "half_space", section, wander)
    path = tabulated_path(of, "half_space", section, wander)
    off = np.abs(path.area / np.interp(path.section, nodes, integrated.contact.area[0]) - 1.0)
    assert np.quantile(off, 0.95) < 0.008
    assert path.line_load[:, len(path.y) // 2].min() < 0.02 * path.line_load.max()
    assert path.line_load.min() >= 0.0, "no wear comes back"


@both
def test_the_unworn_patch_is_hertzs(contact: Contact) -> None:
    of = rig(crown=0.013)
    path = tabulated_path(of, contact, grid.first_section(of), 0.0)
    for name in ("a", "b", "p0"):
        assert getattr(path, name)[0] == pytest.approx(float(getattr(of.patch, name)), rel=1e-9)
    assert path.square[0] == 0.0


@pytest.mark.parametrize(
    ("crown", "sections", "wander"), [(3e-4, 1.0, 0.0), (0.03, 5000.0, 0.0), (0.03, 1.0, 0.2)], ids=str
)
def test_beyond_the_table_the_path_is_marched(crown: float, sections: float, wander: float) -> None:
    of = rig(crown=crown)
    size, spread = sections * grid.first_section(of), wander * float(of.patch.b)
    remembered.cache_clear()
    path = wear_path(of, contact="hertz", section=size, wander=spread)
    assert path is integrated_path(of, "hertz", grid.tier(of, size), spread, None)
    plain = wear_path(rig(), contact="hertz", section=1e-9)
    assert plain.error == path_table.ERRORS["hertz"]


def test_a_disc_that_was_measured_new_is_marched() -> None:
    start = Start(np.linspace(-2e-3, 2e-3, 5), np.zeros((2, 5)))
    path = wear_path(rig(), contact="hertz", section=1e-9, start=start)
    assert path.start is start
    plain = wear_path(rig(), contact="hertz", section=1e-9)
    assert path.depth[-1].max() == pytest.approx(plain.depth[-1].max(), rel=1e-3)
