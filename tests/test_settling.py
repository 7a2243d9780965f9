"""Passes to a fixed point: linear maps in closed form, and a disc whose heat transfer grows with its warming."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import ROOM, experiment, history

from twindisc_cli.laws.law import Law
from twindisc_cli.model.chain import SETTLED
from twindisc_cli.model.experiment import Options, Thermal
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.settling import MEMORY, SHORT, Passes


def test_a_map_that_swings_further_each_pass_ends_at_its_fixed_point() -> None:
    """x = A x + b with eigenvalues beyond one, each row its own: as many passes as eigenvalues are enough."""
    rng = np.random.default_rng(1)
    turn = np.linalg.qr(rng.standard_normal((5, 5)))[0]
    eigenvalues = np.array([[-3.0, -1.5, 0.9, 0.0, 0.0], [-2.0, 0.5, 0.0, 0.0, 0.0]])
    matrices = np.einsum("ij,sj,kj->sik", turn, eigenvalues, turn)
    known = rng.standard_normal((2, 5))
    exact = np.linalg.solve(np.eye(5) - matrices, known[..., None])[..., 0]
    passes, x = Passes(), np.zeros((2, 5))
    for _ in range(MEMORY + 2):
        x = passes.next(x, np.einsum("sij,sj->si", matrices, x) + known)
    np.testing.assert_allclose(x, exact, atol=1e-8)


@pytest.mark.parametrize("exponent", [0.25, 1.0, 2.0, 3.0, 4.0])
def test_a_hot_disc_gives_off_what_it_takes_in(exponent: float) -> None:
    """After hours P = (hS)_0 ((T_0 + w) / (T_0 + 10 K))^n w, for exponents at which a colder disc of one pass is a
    hotter one of the next."""
    test = experiment(
        history((0.03,), 4, duration=20000.0),
        options=Options(friction_coefficient=0.5),
        thermal=Thermal(ROOM, 100.0, ROOM),
        effects={"nonlinear_convection": {"exponent": exponent, "onset_K": 5.0}},
    )
    prediction = ForwardModel(test).predict({"mu": np.array([0.5]), "convection_W_K": np.array([0.2])})
    warming = float(prediction.state.warming[0, -1])
    given_off = 0.2 * ((5.0 + warming) / 15.0) ** exponent * warming
    assert given_off == pytest.approx(float(prediction.state.power[0, -1]), rel=1e-5)


def test_passes_forget_what_had_another_number_of_values() -> None:
    """Temperatures that are not known in some passes, and are in others."""
    passes, few, many = Passes(), np.array([[1.0, 2.0]]), np.array([[1.0, 2.0, 3.0, 4.0]])
    passes.next(few, 0.5 * few)
    assert passes.next(many, 0.5 * many) == pytest.approx((1.0 - 0.5 * SHORT) * many)
    assert passes.next(many, 0.5 * many).shape == many.shape


HEATED = Thermal(ROOM, 100.0, ROOM)
OVER_ENERGY = Law("mu", "energy", "exponential", {"size": -0.4, "origin_kJ": 0.0, "scale_kJ": 2.0})
OVER_THE_INDEX = Law("mu", "wear_index", "linear", {"size": 0.3, "begin_N_mm2": 1.0, "end_N_mm2": 20.0})


@pytest.mark.parametrize(
    ("effects", "law", "thermal", "convection"),
    [
        ({}, None, None, np.nan),
        ({}, OVER_ENERGY, None, np.nan),
        ({}, OVER_THE_INDEX, None, np.nan),
        ({"temperature_dependent_friction": {"per_kelvin": -0.005}}, None, HEATED, 1.0),
        ({"nonlinear_convection": {"exponent": 1.0, "onset_K": 5.0}}, None, HEATED, 1.0),
    ],
    ids=["nothing", "energy", "wear index", "temperature", "convection"],
)
def test_where_nothing_wears_the_passes_end_where_another_changes_nothing(
    effects: dict[str, dict[str, float]], law: Law | None, thermal: Thermal | None, convection: float
) -> None:
    """One pass is enough where nothing is fed back, and no test of it stops before what is fed back has settled."""
    test = experiment(
        history((0.01, 0.03), 4),
        options=Options(friction_coefficient=0.5),
        thermal=thermal,
        effects=effects,
        laws={"law": law} if law else {},
    )
    model, base = ForwardModel(test), {"mu": np.array([0.5]), "convection_W_K": np.array([convection])}
    first = model.predict(base)
    again = model.predict(base, near=first.state, within=1e-12)
    for name in ("traction_ratio", "power", "energy", "wear_index", "temperature"):
        np.testing.assert_allclose(getattr(again.state, name), getattr(first.state, name), rtol=1e-6)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"temperature_dependent_friction": {"per_kelvin": -0.01}},
        {"temperature_dependent_wear": {"per_kelvin": 0.02}, "falling_friction": {"ratio": 0.6, "decay_s_m": 2.0}},
        {"nonlinear_convection": {"exponent": 2.0, "onset_K": 5.0}},
    ],
    ids=["wear", "friction that falls with temperature", "wear that grows with it", "convection"],
)
def test_the_pass_that_is_left_out_would_have_changed_nothing(effects: dict[str, dict[str, float]]) -> None:
    """The worn patch, the friction and the temperature feed each other: passes to the last digit change no channel."""
    test = experiment(
        history((0.002, 0.01, 0.03), 4),
        options=Options(friction_coefficient=0.5),
        thermal=HEATED,
        effects=effects,
    )
    base = {"mu": np.array([0.5]), "convection_W_K": np.array([1.0]), "K": np.array([2e-4])}
    usual, last = (ForwardModel(test).predict(base, within=within) for within in (SETTLED, 1e-13))
    for name in ("traction_ratio", "power", "energy", "wear_index", "temperature"):
        np.testing.assert_allclose(getattr(usual.state, name), getattr(last.state, name), rtol=3e-7)
    np.testing.assert_allclose(usual.section, last.section, rtol=3e-7)


def test_passes_that_begin_from_what_is_not_finite_settle_all_the_same() -> None:
    """After a pass without a finite change none says anything of the next."""
    test = experiment(
        history((0.002, 0.01, 0.03), 4),
        options=Options(friction_coefficient=0.5),
        thermal=HEATED,
        effects={"temperature_dependent_friction": {"per_kelvin": -0.01}},
    )
    model, base = ForwardModel(test), {"mu": np.array([0.5]), "convection_W_K": np.array([1.0]), "K": np.array([2e-4])}
    usual = model.predict(base)
    hot = usual.state.replace(temperature=np.full_like(usual.state.temperature, np.inf))
    with np.errstate(invalid="ignore"):  # as fits predict, whose parameters may heat a test without end
        again = model.predict(base, near=hot)
    for name in ("traction_ratio", "energy", "temperature"):
        np.testing.assert_allclose(getattr(again.state, name), getattr(usual.state, name), rtol=1e-6)
