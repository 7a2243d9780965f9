"""Wear that differs from strip to strip, against the closed forms of Hertz's ellipse and conservation of volume.

In full sliding the strips of an ellipse dissipate 3 (1 - x^2) / (4 b) per width, x = y/b, and have the wear index
i = 3 pi / 8 (T gamma / A) (1 - x^2)^(1/2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import experiment, history
from scipy.integrate import quad

from twindisc_cli.laws.law import Law
from twindisc_cli.model.experiment import Contact, Options
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

SOFT, USUAL = 1e-12, 6e-5
"""Wear coefficients with which the track stays unworn, and grows to a few micrometres."""
CREEPAGE = [0.02]
both = pytest.mark.parametrize("contact", ["hertz", "half_space"])


def predict(effects: dict[str, dict[str, float]], k: float, contact: Contact = "hertz", **options: str) -> Prediction:
    """Full sliding at one creepage."""
    test = experiment(history(CREEPAGE, 3), options=Options(contact=contact, wear_coefficient=k))
    base = {"mu": np.array([0.3]), "K": np.array([k]), "convection_W_K": np.array([1.6])}
    given = {name: {key: np.array([value]) for key, value in own.items()} for name, own in effects.items()}
    return ForwardModel(test).predict(base, given, **options)


def severe(ratio: float, critical: float) -> dict[str, dict[str, float]]:
    return {"severe_wear_transition": {"ratio": ratio, "critical_N_mm2": 1e-6 * critical, "width": 0.02}}


def threshold(value: float) -> dict[str, dict[str, float]]:
    return {"wear_threshold": {"threshold_N_mm2": 1e-6 * value}}


def middle(prediction: Prediction) -> float:
    """Wear index of the middle strip at the end [N/m2]."""
    return float(3.0 * np.pi / 8.0 * prediction.state.wear_index[0, -1])


def last_rate(prediction: Prediction) -> float:
    """What is worn at the end per energy."""
    section, energy = prediction.section[0], prediction.state.energy[0]
    return float((section[-1] - section[-2]) / (energy[-1] - energy[-2]))


def profile(prediction: Prediction) -> tuple[np.ndarray, np.ndarray]:
    """y and depth at the end [m]."""
    at = prediction.section[:, -1:]
    return prediction.paths.paths[0].y, prediction.paths.at(lambda path: path.depth, at)[0, 0]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_a_transition_counts_by_the_energy_of_the_strips_above_it(share: float) -> None:
    """Energy within |x| < e is (3 e - e^3) / 2 of all, and e^2 = 1 - (c / i_middle)^2."""
    plain = predict({}, SOFT)
    found = predict(severe(5.0, share * middle(plain)), SOFT)
    e = np.sqrt(1.0 - share**2)
    assert last_rate(found) / last_rate(plain) == pytest.approx(1.0 + 4.0 * (3.0 * e - e**3) / 2.0, rel=0.01)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.9])
def test_a_threshold_is_taken_off_strip_by_strip(share: float) -> None:
    plain = predict({}, SOFT)
    found = predict(threshold(share * middle(plain)), SOFT)
    left = quad(lambda x: 1.5 * (1.0 - x**2) * (1.0 - share / np.sqrt(1.0 - x**2)), 0.0, np.sqrt(1.0 - share**2))[0]
    assert last_rate(found) / last_rate(plain) == pytest.approx(left, rel=0.01)


def test_the_first_wear_is_deeper_where_the_transition_is_passed() -> None:
    """Against the parabola of even wear the track is r times deeper within |x| < e = 0.6."""
    plain = predict({}, SOFT)
    found = predict(severe(5.0, 0.8 * middle(plain)), SOFT)
    y, depth = profile(found)
    x = y / plain.paths.paths[0].b[0]
    factor = depth[np.abs(x) < 0.9] / (1.0 - x[np.abs(x) < 0.9] ** 2)
    x = x[np.abs(x) < 0.9]
    inner, outer = factor[np.abs(x) < 0.5], factor[np.abs(x) > 0.7]
    assert inner.mean() / outer.mean() == pytest.approx(5.0, rel=0.05)


@both
def test_nothing_is_worn_below_the_threshold(contact: Contact) -> None:
    plain = predict({}, USUAL, contact)
    found = predict(threshold(3.0 * middle(predict({}, SOFT, contact))), USUAL, contact)
    assert found.section[0, -1] == 0.0
    assert found.state.energy[0, -1] == pytest.approx(plain.state.energy[0, -1], rel=0.01)


@both
@pytest.mark.parametrize("effects", [severe(4.0, 2e6), threshold(0.7e6)], ids=["severe", "threshold"])
def test_volume_and_energy_balance(contact: Contact, effects: dict[str, dict[str, float]]) -> None:
    """What is missing from the profile is the section, which is the energy times the K of the strips that took it."""
    found = predict(effects, USUAL, contact)
    path, state = found.paths.paths[0], found.state
    y, depth = profile(found)
    assert depth.sum() * (y[1] - y[0]) / found.section[0, -1] == pytest.approx(1.0, rel=1e-6)
    load = path.line_load.sum(axis=1) * (y[1] - y[0])
    assert load == pytest.approx(np.full(len(load), 72.0), rel=1e-2 if contact == "half_space" else 1e-6)
    resists = 2.0 * np.pi * 0.03 * 700.0 * 9.80665e6
    spent = np.diff(state.energy[0], prepend=0.0) * state.wear_factor[0]
    assert found.section[0, -1] / (USUAL * spent.sum() / resists) == pytest.approx(1.0, rel=1e-6)


@both
def test_without_locality_it_is_the_wear_path(contact: Contact) -> None:
    plain, found = predict({}, USUAL, contact), predict(severe(1.0 + 1e-9, 2e6), USUAL, contact)
    assert found.section / plain.section == pytest.approx(np.ones_like(plain.section), rel=1e-6)
    path, own = (prediction.paths.paths[0] for prediction in (plain, found))
    for name in ("depth", "area", "stiffness", "a", "b", "p0"):
        values = path.at(getattr(path, name), own.section)
        assert np.abs(getattr(own, name) - values).max() < 1e-6 * np.abs(values).max()


def test_pressure_that_follows_the_shape_wears_local_differences_away() -> None:
    """What stands proud bears more: the half-space track returns to the shape of even wear, Hertz's cannot."""
    off = {}
    for contact in ("hertz", "half_space"):
        found = predict(severe(4.0, 1.5e6), USUAL, contact)
        counted = predict(severe(4.0, 1.5e6), USUAL, contact, integrated="none")
        _, depth = profile(found)
        even = counted.paths.at(lambda path: path.depth, found.section[:, -1:])[0, 0]
        off[contact] = np.abs(depth - even).max() / even.max()
    assert off["half_space"] < 0.02
    assert off["hertz"] > 3.0 * off["half_space"]


@both
def test_each_set_marches_for_itself_or_all_after_the_first(contact: Contact) -> None:
    test = experiment(history([0.01, 0.02], 3), options=Options(contact=contact, wear_coefficient=USUAL))
    base = {"mu": np.full(2, 0.3), "K": np.full(2, USUAL), "convection_W_K": np.full(2, 1.6)}
    effects = {"wear_threshold": {"threshold_N_mm2": np.array([0.5, 0.505])}}
    each, first = (ForwardModel(test).predict(base, effects, integrated=integrated) for integrated in ("each", "first"))
    shared, own = first.section[:, -1] / each.section[:, -1], each.section[1, -1] / each.section[0, -1]
    assert shared == pytest.approx([1.0, 1.0], rel=1e-3)
    assert shared[0] == pytest.approx(1.0, rel=1e-6)
    assert own < 0.999
    alone = {"wear_threshold": {"threshold_N_mm2": np.array([0.505])}}
    single = ForwardModel(test).predict({key: value[:1] for key, value in base.items()}, alone)
    assert each.section[1, -1] / single.section[0, -1] == pytest.approx(1.0, rel=2e-5), "it may begin a pass later"


def test_without_heat_a_local_law_acts_as_well() -> None:
    test = replace(experiment(history([0.02], 2), options=Options(wear_coefficient=USUAL)), thermal=None)
    base = {"mu": np.array([0.3]), "K": np.array([USUAL])}
    found = ForwardModel(test).predict(base, {"wear_threshold": {"threshold_N_mm2": np.array([0.5])}})
    assert 0.0 < found.section[0, -1] < ForwardModel(test).predict(base).section[0, -1]


@both
def test_the_track_of_a_prediction_serves_any_number_of_sets_nearby(contact: Contact) -> None:
    test = experiment(history(CREEPAGE, 3), options=Options(contact=contact, wear_coefficient=USUAL))
    base = {"mu": np.array([0.3]), "K": np.array([USUAL]), "convection_W_K": np.array([1.6])}
    effects = severe(5.0, 0.8 * middle(predict({}, SOFT))) | {"half_space_contact": {"share": 0.5}}
    given = {name: {key: np.array([value]) for key, value in own.items()} for name, own in effects.items()}
    once = ForwardModel(test).predict(base, given)
    three = {key: np.repeat(value, 3) for key, value in base.items()}
    again = ForwardModel(test).predict(three, given, integrated=once.paths.first)
    np.testing.assert_allclose(again.section, np.tile(once.section, (3, 1)), rtol=1e-6)
    np.testing.assert_allclose(again.traction, np.tile(once.traction, (3, 1)), rtol=1e-6)


# ------------------------------------------------------------------------------------------------ by place and passes

HALF_WIDTH = 0.27052405
"""Of the unworn patch [mm]."""


def by(covariate: str, at: list[float], factor: list[float]) -> dict[str, Law]:
    return {"local": Law("wear", covariate, at=tuple(at), value=tuple(factor))}


def worn_under(laws: dict[str, Law], k: float, contact: Contact = "hertz") -> Prediction:
    options = Options(contact=contact, wear_coefficient=k)
    model = ForwardModel(experiment(history(CREEPAGE, 3), options=options, laws=laws))
    return model.predict({"mu": np.array([0.3]), "K": np.array([k]), "convection_W_K": np.array([1.6])})


@pytest.mark.parametrize("share", [0.2, 0.6])
def test_a_hardened_band_counts_by_the_energy_dissipated_on_it(share: float) -> None:
    """K falls to a fifth from the edges of the patch to the band |y| < e b; energy goes as 1 - y^2 / b^2."""
    at, factor = np.array([-1.0, -share, share, 1.0]), [1.0, 0.2, 0.2, 1.0]
    found, plain = worn_under(by("place", list(at * HALF_WIDTH), factor), SOFT), worn_under({}, SOFT)
    mean = quad(lambda x: 1.5 * (1.0 - x**2) * np.interp(x, at, factor), 0.0, 1.0, points=[share])[0]
    assert last_rate(found) / last_rate(plain) == pytest.approx(mean, rel=0.003)


@both
def test_a_band_wears_less_than_what_lies_beside_it(contact: Contact) -> None:
    """On one side of the track only: nothing where K is nil, and all that is worn is the energy times K."""
    found = worn_under(by("place", [-1e-4, 1e-4], [0.0, 1.0]), USUAL, contact)
    y, depth = profile(found)
    assert np.all(depth[y < -1e-6] == 0.0)
    assert depth[y > 1e-6].max() > 5e-8
    assert depth.sum() * (y[1] - y[0]) / found.section[0, -1] == pytest.approx(1.0, rel=1e-6)
    spent = np.diff(found.state.energy[0], prepend=0.0) * found.state.wear_factor[0]
    resists = 2.0 * np.pi * 0.03 * 700.0 * 9.80665e6
    assert found.section[0, -1] / (USUAL * spent.sum() / resists) == pytest.approx(1.0, rel=1e-6)


@both
@pytest.mark.parametrize("covariate", ["place", "passes"])
def test_one_factor_all_over_is_another_k(contact: Contact, covariate: str) -> None:
    twice = by(covariate, [-9.0, 9.0], [2.0, 2.0])
    found, plain = worn_under(twice, 0.5 * USUAL, contact), worn_under({}, USUAL, contact)
    assert found.section[0, -1] / plain.section[0, -1] == pytest.approx(1.0, rel=1e-6)
    depths = [profile(prediction)[1].max() for prediction in (found, plain)]
    assert depths[0] / depths[1] == pytest.approx(1.0, rel=1e-6)


def test_passes_are_revolutions_while_the_track_is_as_wide_as_the_patch() -> None:
    running_in = [0.0, 6000.0], [5.0, 1.0]
    passes, cycles = (worn_under(by(over, *running_in), SOFT) for over in ("passes", "cycles"))
    assert passes.section[0, -1] / cycles.section[0, -1] == pytest.approx(1.0, rel=0.01)


@both
def test_strips_that_the_track_reaches_later_run_in_later(contact: Contact) -> None:
    """K is nil until a strip has been passed so often: what the track has only just reached is not worn."""
    fresh, wide = 2000.0, []
    for over in ("passes", "cycles"):
        found = worn_under(by(over, [fresh - 1.0, fresh + 1.0], [0.0, 1.0]), 50.0 * USUAL, contact)
        y, depth = profile(found)
        wide.append(np.sqrt(np.sum(depth * y**2) / np.sum(depth)))
    assert wide[0] < 0.995 * wide[1]
