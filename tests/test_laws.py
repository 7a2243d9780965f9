"""Laws: each formula against its closed form, a law against the effect it repeats, curves, and what is not known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rigs import Floats, Instruments, Plant, history

from twindisc_cli.laws.covariates import COVARIATES
from twindisc_cli.laws.law import Law, formula_text
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.laws.trial import bins, curve, formula
from twindisc_cli.model.experiment import Experiment, Measured
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

COURSE = history((0.02, 0.09, 0.004), 3)
BASE = {"mu": np.array([0.6]), "K": np.array([1e-3]), "convection_W_K": np.array([1.6])}
CHANNELS = ("traction", "profile", "temperature")


@cache
def recorded() -> Experiment:
    return Instruments().record(Plant(COURSE), np.random.default_rng(0))


def predicted(**changes: object) -> Prediction:
    return ForwardModel(replace(recorded(), **changes)).predict(BASE)  # type: ignore[arg-type]


@cache
def plain() -> Prediction:
    return predicted()


def same(one: Prediction, two: Prediction, tolerance: float = 1e-9) -> bool:
    return all(
        np.allclose(getattr(one, c), getattr(two, c), rtol=0.0, atol=tolerance * max(float(np.ptp(getattr(two, c))), 1))
        for c in CHANNELS
    )


# ------------------------------------------------------------------------------------------------ formulas

FORMULAS: dict[str, tuple[dict[str, float], Callable[[float], float]]] = {
    "step": ({"at": 3.0}, lambda x: float(x > 3.0)),
    "window": ({"begin": 2.0, "end": 5.0}, lambda x: float(2.0 < x <= 5.0)),
    "linear": ({"begin": 2.0, "end": 6.0}, lambda x: min(max((x - 2.0) / 4.0, 0.0), 1.0)),
    "exponential": ({"origin": 1.0, "scale": 2.0}, lambda x: float(np.exp(-(x - 1.0) / 2.0)) if x > 1.0 else 1.0),
    "power": ({"reference": 4.0, "exponent": 0.5}, lambda x: float(np.sqrt(x / 4.0)) - 1.0),
    "logistic": ({"at": 3.0, "width": 0.7}, lambda x: 1.0 / (1.0 + float(np.exp(-(x - 3.0) / 0.7)))),
    "bump": ({"at": 3.0, "width": 0.7}, lambda x: float(np.exp(-((x - 3.0) ** 2) / (2.0 * 0.49)))),
    "sine": ({"period": 5.0, "phase": 0.4}, lambda x: float(np.sin(2.0 * np.pi * x / 5.0 + 0.4))),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_formula_has_its_closed_form(shape: str) -> None:
    parameters, closed = FORMULAS[shape]
    x = np.array([0.2, 1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 9.0])
    form = SHAPES[shape]
    assert set(parameters) == {*form.along, *form.pure}
    assert form.value(x, **parameters) == pytest.approx([closed(float(each)) for each in x], abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_law_is_its_size_times_its_shape(shape: str) -> None:
    """In the keys of the definition: percent of creepage, kJ, the size with the unit of what is shifted."""
    parameters, closed = FORMULAS[shape]
    pure = SHAPES[shape].pure
    keyed = {name if name in pure else f"{name}_percent": value for name, value in parameters.items()}
    law = Law("temperature", "creepage", shape, {"size_K": -2.5, **keyed})
    for x in (0.5, 2.2, 4.9, 7.0):
        assert float(law.change(np.array(x))) == pytest.approx(-2.5 * closed(x), abs=1e-12)
    assert "K" in formula_text(law)


def test_a_factor_is_told_as_one_and_its_change() -> None:
    law = Law("mu", "energy", "exponential", {"size": -0.18, "origin_kJ": 0.0, "scale_kJ": 1.4})
    assert formula_text(law) == "1 - 0.18 exp(-E / 1.4 kJ)"


@pytest.mark.parametrize("x", [-1.0, 0.25, 1.0])
def test_the_text_of_a_line_says_that_it_is_constant_beyond_its_ends(x: float) -> None:
    law = Law("mu", "direction", "linear", {"begin": -0.5, "end": 0.5, "size": 0.17})
    assert formula_text(law) == "1 + 0.17 min(1, max(0, (d + 0.5) / (0.5 + 0.5)))"
    assert 1.0 + 0.17 * min(1.0, max(0.0, x + 0.5)) == pytest.approx(1.0 + float(law.change(np.array([x]))[0]))


def test_a_curve_is_the_line_between_its_places_and_constant_beyond() -> None:
    law = Law("mu", "time", at=(100.0, 200.0, 400.0), value=(1.0, 1.2, 0.8))
    assert law.change(np.array([0.0, 150.0, 300.0, 900.0])) == pytest.approx([0.0, 0.1, 0.0, -0.2])
    shift = Law("environment", "time", at=(100.0, 200.0), value=(-1.0, 3.0))
    assert shift.change(np.array([150.0, 900.0])) == pytest.approx([1.0, 3.0])


# ------------------------------------------------------------------------------------------------ in the model


def test_running_in_as_a_law_is_the_effect_running_in() -> None:
    """mu_0 (1 + e exp(-n / N)): a law of the revolutions and of the time say the same, 50 revolutions a second."""
    effect = predicted(effects={"running_in_friction": {"excess": -0.2, "settling_cycles": 12000.0}})
    cycles = Law("mu", "cycles", "exponential", {"size": -0.2, "origin": 0.0, "scale": 12000.0})
    time = Law("mu", "time", "exponential", {"size": -0.2, "origin_s": 0.0, "scale_s": 240.0})
    for law in (cycles, time):
        assert same(predicted(laws={law.name: law}), effect)
    assert not same(effect, plain())


def test_friction_that_falls_as_a_law_is_the_effect_falling_friction() -> None:
    """mu_0 (A + (1 - A) e^(-B w)) = mu_0 A (1 + (1 - A) / A e^(-B w)): another mu_0, the same model."""
    effect = predicted(effects={"falling_friction": {"ratio": 0.8, "decay_s_m": 4.0}})
    law = Law("mu", "sliding_speed", "exponential", {"size": 0.25, "origin_m_s": 0.0, "scale_m_s": 0.25})
    base = {**BASE, "mu": 0.8 * BASE["mu"]}
    assert same(ForwardModel(replace(recorded(), laws={"falling": law})).predict(base), effect, 1e-6)


def test_a_law_on_trial_is_the_law_that_it_becomes() -> None:
    start = {"size": 0.2, "at_s": 300.0, "width_s": 90.0}
    trial = formula("heat", "time", "bump", start, (0.0, 756.0), 1.0)
    values = {p.name: np.array([start[p.name]]) for p in trial.params}
    tried = ForwardModel(recorded()).predict(BASE, {"a law": values}, {"a law": trial})
    assert same(predicted(laws={"a law": trial.law(start)}), tried)
    assert np.ptp(tried.temperature - plain().temperature) > 0.5


@pytest.mark.parametrize("quantity", ["mu", "environment"])
def test_a_curve_on_trial_is_the_law_that_it_becomes(quantity: str) -> None:
    """A factor is exp of the curve, a shift the curve itself; between the places the factor bends, so few percent."""
    at, mix = np.linspace(0.0, 756.0, 8), 0.03 * np.eye(8)
    trial = curve(quantity, "time", at, mix)
    values = dict(zip([p.name for p in trial.params], [0.5, -1.0, 0.3, 0.0, 0.8, -0.2, 0.1, 1.0], strict=True))
    columns = {name: np.array([value]) for name, value in values.items()}
    tried = ForwardModel(recorded()).predict(BASE, {"a law": columns}, {"a law": trial})
    law = trial.law(values)
    f = mix @ np.array(list(values.values()))
    assert law.value == pytest.approx(np.exp(f) if quantity == "mu" else f)
    assert same(predicted(laws={"a law": law}), tried, 1e-3)


def test_bins_add_up_to_a_change_everywhere() -> None:
    """Every point is in one bin: to first order the bins' changes add up to one change of the whole."""
    edges = np.array([0.0, 84.0, 300.0, 500.0, 756.0])
    trial, model = bins("heat", "time", edges), ForwardModel(recorded())
    rows = model.predict(
        {key: np.repeat(value, 4) for key, value in BASE.items()},
        {"a bin": {"level": np.full(4, 1e-3), "bin": np.arange(4.0)}}, {"a bin": trial},
    ).temperature  # fmt: skip
    everywhere = Law("heat", "time", at=(0.0, 1.0), value=(1.001, 1.001))
    whole = predicted(laws={"all": everywhere}).temperature
    parts = np.sum(rows - plain().temperature, axis=0)
    assert parts == pytest.approx((whole - plain().temperature)[0], abs=1e-6)
    assert np.all(np.abs(rows - plain().temperature).max(axis=1) > 1e-4)


def test_sliding_distance_is_the_way_slid_in_each_step() -> None:
    """The sum of |creepage| V duration over the history, at the end of each iteration."""
    state, points = plain().state, ForwardModel(recorded()).points
    course = recorded().history
    slid = np.cumsum(np.abs(course.creepage) * recorded().rig.rolling_speed * course.duration)
    assert COVARIATES["sliding_distance"].of(state)[0, points.of_iteration] == pytest.approx(slid, rel=1e-9)


def test_friction_that_falls_with_the_distance_slid() -> None:
    """mu falls in proportion to the way slid, and the traction in full sliding with it."""
    whole = float(plain().state.sliding_distance[0, -1])
    law = Law("mu", "sliding_distance", at=(0.0, whole), value=(1.0, 0.5))
    found, before = predicted(laws={law.name: law}).state, plain().state
    expected = 1.0 - 0.5 * before.sliding_distance[0] / whole
    assert found.mu[0] / before.mu[0] == pytest.approx(expected, rel=1e-9)


def test_pressure_is_the_load_over_hertzs_patch() -> None:
    """Of new discs, at twice the load 2^(1/3) times as large."""
    course = recorded().history
    loads = np.where(course.step % 2 == 0, 1.0, 2.0)
    test = replace(recorded(), history=replace(course, load_factor=loads), measured=Measured())
    state = ForwardModel(test).predict({"mu": np.array([0.4])}).state
    points = ForwardModel(test).points
    patch = test.rig.patch
    expected = test.rig.normal_load / float(patch.area) * np.cbrt(loads[points.iteration]) * 1e-6
    assert COVARIATES["pressure"].of(state)[0] == pytest.approx(expected, rel=1e-3)


def test_a_covariate_that_is_not_known_changes_nothing() -> None:
    cold = replace(recorded(), thermal=None)
    law = Law("mu", "temperature", "linear", {"size": 0.3, "begin_C": 0.0, "end_C": 40.0})
    one, two = (ForwardModel(replace(cold, laws=laws)).predict(BASE) for laws in ({}, {"warm": law}))
    assert np.array_equal(one.traction, two.traction)
    assert np.array_equal(one.profile, two.profile)
    assert not np.allclose(predicted(laws={"warm": law}).traction, plain().traction)


def test_a_law_across_the_track_ends_where_it_reaches_to() -> None:
    """Half as much again as the worn zone is wide; beyond, the unworn flank stays as it is."""
    law = Law("profile", "y_over_edge", "linear", {"size_um": 3.0, "begin": -100.0, "end": -99.0})
    profile, surface = recorded().measured.profile, plain().state.surface
    assert profile is not None
    assert surface is not None
    change = (predicted(laws={"all": law}).profile - plain().profile)[0]
    place = np.abs(profile.y) / float(np.max(surface.edge))
    reach = COVARIATES["y_over_edge"].reach
    assert change[place < 0.97 * reach] == pytest.approx(3e-6, rel=1e-6)
    assert np.all(change[place > 1.03 * reach] == 0.0)
    assert np.any(place > 1.03 * reach)


CHANGED: dict[str, Callable[[Prediction], Floats]] = {
    "mu": lambda p: p.state.mu,
    "slope": lambda p: p.state.slope,
    "wear": lambda p: p.state.wear_factor,
    "creepage": lambda p: p.state.creepage,
    "convection": lambda p: p.state.convection,
    "environment": lambda p: p.state.environment,
}
SHIFTS = {"creepage": 1e-2, "environment": 1.0}


@pytest.mark.parametrize("name", CHANGED)
def test_a_quantity_is_multiplied_or_shifted_in_its_unit(name: str) -> None:
    change = 0.02
    value = change if name in SHIFTS else 1.0 + change
    law = Law(name, "time", at=(0.0, 1.0), value=(value, value))
    before, after = CHANGED[name](plain()), CHANGED[name](predicted(laws={"all": law}))
    expected = before + change * SHIFTS[name] if name in SHIFTS else before * (1.0 + change)
    assert after == pytest.approx(np.broadcast_to(expected, after.shape), rel=1e-9)


@pytest.mark.parametrize("name", QUANTITIES)
def test_every_quantity_shows_in_its_channel(name: str) -> None:
    of = QUANTITIES[name]
    covariate = of.covariates[0]
    amount = 0.1 if of.kind == "factor" else 0.05
    value = 1.0 + amount if of.kind == "factor" else amount
    places, values = ((-0.5, 0.5), (1.0, value)) if name == "wear_across" else ((-9.0, 9.0), (value, value))
    law = Law(name, covariate, at=places, value=values)
    change = getattr(predicted(laws={"all": law}), of.channel) - getattr(plain(), of.channel)
    assert np.abs(change).max() > 1e-3 * np.ptp(getattr(plain(), of.channel))


def test_wear_across_the_track_is_about_the_mean_that_k_is() -> None:
    even = Law("wear_across", "y_over_edge", at=(-9.0, 9.0), value=(1.4, 1.4))
    assert same(predicted(laws={"even": even}), plain())
    tapered = Law("wear_across", "y_over_edge", at=(-1.0, 1.0), value=(0.7, 1.3))
    lost = [-np.trapezoid(p.state.surface.height[0, -1]) for p in (predicted(laws={"t": tapered}), plain())]
    assert lost[0] == pytest.approx(lost[1], rel=1e-6)
