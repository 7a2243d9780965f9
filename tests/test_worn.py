"""The law of a worn patch against ellipse and rectangle, and against the solvers on profiles it was not made with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import rigs
from rigs import solve_rolling

from twindisc_cli.model import worn
from twindisc_cli.model.experiment import Contact, Options
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.patch import Patch
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.physics.half_space.normal import solve_gap

CREEPAGE = (0.001, 0.002, 0.003)
MU = 0.6


def test_an_ellipse_is_not_square_and_a_rectangle_is() -> None:
    y = (2.0 * np.arange(4000) + 1.0) / 4000 - 1.0
    round_one, square_one = np.sqrt(1.0 - y**2), np.ones_like(y)
    assert worn.squareness(round_one) == pytest.approx(0.0, abs=1e-4)
    assert worn.squareness(np.stack([round_one, square_one]))[1] == pytest.approx(1.0, abs=1e-12)


def test_where_all_strips_slide_at_once_the_stiffness_is_the_ellipse() -> None:
    """On Hertz's ellipse q goes as h^2; a line load that is even on a rectangle does so too."""
    y = (2.0 * np.arange(50) + 1.0) / 50 - 1.0
    even = worn.unevenness(
        np.stack([np.sqrt(1.0 - y**2), np.ones(50)]), np.stack([3.0 * (1.0 - y**2), np.full(50, 2.0)])
    )
    assert even == pytest.approx(0.0, abs=1e-7)
    assert worn.stiffening(np.array([0.1, 3.0]), even) == pytest.approx(1.0, abs=1e-7)
    half_and_half = worn.unevenness(np.ones(50), np.repeat([1.0, 3.0], 25))
    assert half_and_half == pytest.approx(np.sqrt(4.0 / 3.0 - 1.0)), "means of 1/q and q are 2/3 and 2"


def test_nothing_departs_without_slip_and_in_full_slip() -> None:
    ends = worn.departure(np.array([0.0, 3.6, 50.0]), 0.3, 1.0)
    assert ends == pytest.approx(0.0, abs=1e-12)


def rolled(
    crown: float, wear_coefficient: float, *, contact: Contact = "half_space", effects: Any = None
) -> tuple[ForwardModel, Prediction]:
    """A crowned disc worn in full sliding, then driven for a moment at each CREEPAGE."""
    history = rigs.history([0.02, *CREEPAGE], [10] + [1] * len(CREEPAGE))
    history = replace(history, duration=np.where(history.step > 0, 1e-3, history.duration))
    options = Options(contact=contact, traction="exact", wear_coefficient=wear_coefficient)
    model = ForwardModel(replace(rigs.experiment(history, options=options), rig=rigs.rig(crown=crown)))
    return model, model.predict({"mu": np.array([MU]), "K": np.array([wear_coefficient])}, effects)


def at_the_end(model: ForwardModel, found: Prediction) -> tuple[np.ndarray, Patch]:
    """T/N at CREEPAGE, and the patch then."""
    known = found.state.traction_ratio[0, model.points.of_iteration[-len(CREEPAGE) :]]
    return known, found.paths.patch(found.section[:, -1:], np.ones((1, 1)))


def by_the_solvers(model: ForwardModel, found: Prediction, n: int) -> np.ndarray:
    """T/N at CREEPAGE of the full normal contact and the rolling solver on the worn profile, n elements along."""
    rig, path = model.experiment.rig, found.paths.paths[0]
    depth = found.paths.at(lambda path: path.depth, found.section[:, -1:])[0, 0]
    patch = at_the_end(model, found)[1]
    along = 1.1 * float(patch.a.item())
    across = 1.08 * float(
        path.y[np.flatnonzero(path.line_load[np.searchsorted(path.section, found.section[0, -1])])[-1]]
    )
    x, y = along * ((2.0 * np.arange(n) + 1.0) / n - 1.0), across * ((2.0 * np.arange(n) + 1.0) / n - 1.0)
    gap = 0.5 * rig.curvature_x * x**2 + (0.5 * rig.curvature_y * y**2 + np.interp(y, path.y, depth))[:, None]
    pressed = solve_gap(x=x, y=y, gap=gap, normal_load=rig.normal_load, effective_modulus=rig.effective_modulus)
    given = {"mu": MU, "shear_modulus": rig.shear_modulus, "poisson": rig.poisson_ratio, "tolerance": 1e-4}
    return (
        np.array([solve_rolling(x=x, y=y, pressure=pressed.pressure, creepage_x=v, **given).force_x for v in CREEPAGE])
        / rig.normal_load
    )


@pytest.mark.parametrize(("crown", "wear_coefficient"), [(0.03, 6e-5), (0.03, 1e-3), (0.012, 5e-4)])
def test_the_traction_of_a_worn_track_is_the_solver_s(crown: float, wear_coefficient: float) -> None:
    """Carried to the limit of the grids, whose own error is some 0.002; by the ellipse T/N is up to 0.015 low."""
    model, found = rolled(crown, wear_coefficient)
    coarse, fine = (by_the_solvers(model, found, n) for n in (56, 112))
    assert at_the_end(model, found)[0] == pytest.approx(2.0 * fine - coarse, abs=0.003)
