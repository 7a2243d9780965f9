"""Power of the strips in partial slip: closed forms of FaStrip's strips and of Carter, the balance, and the solver."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import experiment, history, solve_rolling

from table_makers import worn as making
from table_makers.strips import semi_width
from twindisc_cli.model.experiment import Contact, Floats, Options
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.integration import Loaded
from twindisc_cli.model.partial_slip import power_over_load
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.model.wear_path import grid
from twindisc_cli.model.wear_path.local import _LocalWeights
from twindisc_cli.physics import fastrip
from twindisc_cli.physics.half_space import rolling
from twindisc_cli.physics.half_space.normal import NormalContact


def ellipse(ratio: float, count: int = 401) -> tuple[Floats, Floats, Floats]:
    """Strips of an ellipse with b = 1: y, half-length, line load."""
    y = (2.0 * np.arange(count) + 1.0) / count - 1.0
    return y, ratio * np.sqrt(1.0 - y**2), 0.75 * (1.0 - y**2)


def test_strips_of_a_slender_patch_stand_alone() -> None:
    """A strip transmits mu q (1 - (1 - k / (1 - y^2)^1/2)^2), and all of them FaStrip's force."""
    y, length, load = ellipse(1e-3)
    for xi in (0.1, 0.5, 1.0, 1.5, 2.0):
        k = xi / fastrip.FULL_SLIP
        alone = 1.0 - np.maximum(1.0 - k / np.sqrt(1.0 - y**2), 0.0) ** 2
        found = power_over_load(y, length, load, np.array([xi]))
        assert np.abs(load * (found - alone / fastrip.saturation(xi))).max() < 3e-3 * load.max()


def test_all_strips_of_a_rectangle_are_alike() -> None:
    y, _, _ = ellipse(0.3)
    even = np.full_like(y, 2.0)
    assert power_over_load(y, even, even, np.array([[0.3], [1.0], [1.9]])) == pytest.approx(1.0, abs=1e-9)


def test_where_all_slides_power_goes_as_load() -> None:
    y, length, load = ellipse(0.7)
    assert np.all(power_over_load(y, length, load, np.array([1.001 * fastrip.FULL_SLIP])) == 1.0)
    assert np.abs(power_over_load(y, length, load, np.array([0.98 * fastrip.FULL_SLIP])) - 1.0).max() < 2e-3


def two_patches() -> tuple[Floats, Floats, Floats]:
    """Two patches side by side, of which the mirror image is the same."""
    y = np.linspace(-1.0, 1.0, 201)
    length = 0.3 * np.sqrt(np.maximum(0.0, 1.0 - ((np.abs(y) - 0.55) / 0.35) ** 2))
    return y, length, length**2


@pytest.mark.parametrize("strips", [ellipse(0.05), ellipse(2.0), two_patches()], ids=["slender", "wide", "two"])
def test_the_power_of_all_strips_is_the_power(strips: tuple[Floats, Floats, Floats]) -> None:
    y, length, load = strips
    found = power_over_load(y, length, load, np.array([0.0, 0.3, 1.0, 1.7])[:, None])
    assert (found @ load) == pytest.approx(load.sum(), rel=1e-12)
    assert np.all(found >= 0.0)


@pytest.mark.parametrize("strips", [ellipse(0.6), two_patches()], ids=["one", "two"])
def test_one_side_of_a_track_is_half_of_it(strips: tuple[Floats, Floats, Floats]) -> None:
    middle, xi = len(strips[0]) // 2, np.array([0.4, 1.2])[:, None]
    side = [values[middle:] for values in strips]
    whole, half = power_over_load(*strips, xi), power_over_load(*side, xi, mirrored=True)
    assert half == pytest.approx(whole[:, middle:], rel=1e-9)


def solved(pressed: NormalContact, of: making.Rig, xi: Floats) -> tuple[Floats, Floats]:
    """Line load (strip,) and power (creepage, strip) over their sums, by the solver."""

    def rolled(bound: Floats, creepage: float) -> rolling.Rolling:
        return solve_rolling(
            x=pressed.x, y=pressed.y, pressure=bound, mu=1.0, shear_modulus=of.shear_modulus,
            poisson=of.poisson_ratio, creepage_x=creepage, tolerance=1e-4,
        )  # fmt: skip

    per_creepage = rolled(np.where(pressed.patch, 1e20, 0.0), 1.0).force_x / of.normal_load
    power = np.array([rolled(pressed.pressure, float(v) / per_creepage).dissipation for v in xi])
    load = pressed.pressure.sum(axis=1)
    return load / load.sum(), power / power.sum(axis=-1, keepdims=True)


OUTERMOST = 0.975
"""Places over the half-width beyond which a patch comes to its end."""


def off(ratio: float, section: float, n: int, xi: Floats) -> tuple[Floats, Floats, Floats]:
    """Error of the power of a strip over the largest, at each creepage: by `power_over_load`, and taken as load.

    The first is that of strips but the OUTERMOST, the second that of these.

    ratio: a/b of the new patch; section: worn, over that of a facet as wide as it.
    """
    from scipy.interpolate import CubicSpline

    of = making.rig_of(ratio)
    contact, gap = making.worn_contact(of, max(section, 1e-6) * grid.first_section(of))
    across = 1.01 * float(semi_width(contact)) + 0.5 * contact.strip_width
    track = making.Profile(of, CubicSpline(contact.y, gap), 1.02 * float(contact.half_length.max()), across)
    pressed = track.pressed(n)
    load, power = solved(pressed, of, xi)
    factor = power_over_load(contact.y, contact.half_length, contact.line_load, xi[:, None])
    on = contact.line_load > 0.0
    found = load * np.array([np.interp(pressed.y, contact.y[on], row[on]) for row in factor])
    found /= found.sum(axis=-1, keepdims=True)
    errors, by_load = (np.abs(p - power) / power.max(axis=-1, keepdims=True) for p in (found, load))
    inside = np.abs(pressed.y) < OUTERMOST * semi_width(contact)
    return errors[:, inside].max(axis=-1), errors[:, ~inside].max(axis=-1), by_load.max(axis=-1)


@pytest.mark.parametrize(("ratio", "section"), [(0.35, 0.0), (1.5, 0.0), (0.35, 2.0), (1.5, 4.0), (1.5, 40.0)])
def test_the_power_of_a_strip_is_the_solvers(ratio: float, section: float) -> None:
    """Patches, new and worn, that it was not made with: 2 % of the largest, where load is 3.5 to 12 % off."""
    inside, outermost, by_load = off(ratio, section, 72, np.array([1.0, 1.5, 2.0]))
    assert inside.max() < 0.02
    assert outermost.max() < 0.03
    assert by_load[0] > 0.03


CREEPAGE = 0.0015
"""Where half of a new patch sticks at mu = 0.3: xi = 1."""


def partly(effects: dict[str, dict[str, float]], contact: Contact = "hertz", k: float = 1e-12) -> Prediction:
    """A test on a patch that slides in part."""
    options = Options(contact=contact, traction="exact", wear_coefficient=k)
    given = {name: {key: np.array([value]) for key, value in own.items()} for name, own in effects.items()}
    base = {"mu": np.array([0.3]), "K": np.array([k]), "convection_W_K": np.array([1.6])}
    return ForwardModel(experiment(history([CREEPAGE], 3), options=options)).predict(base, given)


def rate(prediction: Prediction) -> float:
    """What is worn at the end per energy."""
    section, energy = prediction.section[0], prediction.state.energy[0]
    return float((section[-1] - section[-2]) / (energy[-1] - energy[-2]))


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
@pytest.mark.parametrize("share", [0.7, 0.9, 1.1])
def test_a_threshold_acts_on_what_the_strips_dissipate_in_partial_slip(contact: Contact, share: float) -> None:
    """On a new patch, against the strips of the solver: of their power P, P - c A is left where that is positive."""
    plain = partly({}, contact)
    patch = plain.paths.paths[0]
    a, b = float(patch.a[0]), float(patch.b[0])
    along, across = ((2.0 * np.arange(n) + 1.0) / n - 1.0 for n in (80, 160))
    x, y = a * along, b * across
    pressure = np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2))
    of = experiment(history([CREEPAGE], 1)).rig
    pressure *= of.normal_load / (pressure.sum() * (x[1] - x[0]) * (y[1] - y[0]))
    power = solve_rolling(
        x=x, y=y, pressure=pressure, mu=0.3, shear_modulus=of.shear_modulus, poisson=of.poisson_ratio,
        creepage_x=CREEPAGE,
    ).dissipation  # fmt: skip
    area = 2.0 * a * np.sqrt(1.0 - across**2) / (np.pi * a)
    shares = power / power.sum()
    left = np.maximum(0.0, shares - share * area / area.sum()).sum()
    threshold = {"wear_threshold": {"threshold_N_mm2": share * 1e-6 * float(plain.state.wear_index[0, -1])}}
    assert rate(partly(threshold, contact)) / rate(plain) == pytest.approx(left, abs=0.005)


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
def test_volume_and_energy_balance_in_partial_slip(contact: Contact) -> None:
    plain = partly({}, contact, 1e-3)
    found = partly({"wear_threshold": {"threshold_N_mm2": 0.8e-6 * plain.state.wear_index[0, -1]}}, contact, 1e-3)
    path, state = found.paths.paths[0], found.state
    depth = found.paths.at(lambda path: path.depth, found.section[:, -1:])[0, 0]
    assert depth.sum() * (path.y[1] - path.y[0]) / found.section[0, -1] == pytest.approx(1.0, rel=1e-6)
    spent = np.diff(state.energy[0], prepend=0.0) @ state.wear_factor[0]
    resists = 2.0 * np.pi * 0.03 * 700.0 * 9.80665e6
    assert found.section[0, -1] / (1e-3 * spent / resists) == pytest.approx(1.0, rel=1e-6)
    assert 0.05 < rate(found) / rate(plain) < 0.9


def test_the_march_weighs_strips_by_what_they_dissipate() -> None:
    """K over its mean is that of the strip's own wear index, P over its area, each weighted by P."""
    y, length, load = ellipse(0.6)
    xi = np.full((1, 1, 2), 1.0)
    of = _LocalWeights(np.ones_like(xi), xi, xi, lambda index, place, passes: index, np.full((1, len(y)), np.inf))
    weight = of(0, y, Loaded(load[None], (load / (2.0 * length))[None]))[0]
    power = power_over_load(y, length, load, np.array([1.0]))
    index = power * load / length
    assert weight == pytest.approx(index / ((index * power * load).sum() / load.sum()), rel=1e-2)
