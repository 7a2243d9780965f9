"""Yield and shakedown against published values and the equations of equilibrium."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write
from scipy.optimize import brentq

from twindisc_cli.commands import check, contact
from twindisc_cli.definition import load
from twindisc_cli.physics import shakedown

LINE = {"a": 1.0, "b": np.inf}


def test_limits_of_a_line_that_johnson_prints() -> None:
    """First yield at 3.3 k (Tresca), shakedown at 4.0 k; from T/N = 0.367 on the surface decides."""
    first, last = shakedown.limits([0.0], **LINE)
    assert first == pytest.approx([1 / 0.300], rel=2e-3)
    assert last == pytest.approx([4.0], rel=2e-3)
    fine = np.linspace(0.2, 0.5, 3001)
    surface = fine[shakedown.limits(fine, **LINE)[1] >= 0.999 / fine]
    assert surface[0] == pytest.approx(0.367, abs=0.006)
    assert shakedown.limits([0.5], **LINE)[1] == pytest.approx([2.0], rel=1e-3)
    assert shakedown.limits([-0.5], **LINE)[1] == pytest.approx([2.0], rel=1e-3)


def test_greatest_shear_lies_where_hertz_has_it() -> None:
    """0.300 p0 at 0.786 a below a line, 0.310 p0 at 0.48 a below a circle."""
    z = np.linspace(0.0, 2.0, 4001)
    sigma_x, sigma_z, tau = shakedown.line_stress(0.0, z)
    shear = 0.5 * np.abs(sigma_x - sigma_z)
    assert np.all(tau == 0.0)
    assert (z[np.argmax(shear)], shear.max()) == pytest.approx((0.786, 0.300), abs=1e-3)
    assert shakedown.greatest_shear(1.0, np.inf) == pytest.approx((0.300, 0.785))
    assert shakedown.greatest_shear(2e-4, 2e-4) == pytest.approx((0.310, 0.96e-4))


def test_a_circle_shakes_down_to_4_68_k() -> None:
    """Ponter, Hearle and Johnson (1985); tau_zx = 0.214 p0 at 0.35 a."""
    assert shakedown.orthogonal_shear(1.0, 1.0) == pytest.approx((0.214, 0.35), abs=1e-3)
    assert float(shakedown.limits(0.0, 1.0, 1.0)[1]) == pytest.approx(4.68, rel=2e-3)
    assert shakedown.orthogonal_shear(1.0, 1e4) == pytest.approx((0.25, 0.5), rel=1e-3)


def test_the_stresses_are_in_equilibrium_and_meet_the_surface() -> None:
    """d sigma_x/dx + d tau/dz = 0, d tau/dx + d sigma_z/dz = 0; sigma_z = sigma_x = -p at z = 0."""
    h = 1e-5
    for x, z in ((0.3, 0.4), (-0.7, 0.9), (1.4, 0.2)):
        along, below = (
            [np.array(shakedown.line_stress(x + dx * s, z + dz * s)) for s in (h, -h)] for dx, dz in ((1, 0), (0, 1))
        )
        by_x, by_z = (pair[0] - pair[1] for pair in (along, below))
        assert by_x[0] + by_z[2] == pytest.approx(0.0, abs=1e-9)
        assert by_x[2] + by_z[1] == pytest.approx(0.0, abs=1e-9)
    x = np.array([0.0, 0.5, -0.9])
    sigma_x, sigma_z, tau = shakedown.line_stress(x, 0.0)
    assert sigma_z == pytest.approx(-np.sqrt(1 - x**2))
    assert sigma_x == pytest.approx(sigma_z)
    assert tau == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(("hardness", "state"), [(700, "elastic"), (110, "shakes down"), (60, "beyond shakedown")])
def test_contact_and_check_tell_it(tmp_path: Path, hardness: int, state: str) -> None:
    """744 MPa on discs of 700, 110 and 60 HV: p0/k of 0.56, 3.6 and 6.6 at a small traction."""
    text = VALID.replace("hardness_HV = 700", f"hardness_HV = {hardness}").replace("= 0.6\n", "= 0.1\n")
    test = load(write(tmp_path, text))
    found = contact.run(test, step=3)
    under = found.json["subsurface"]
    assert under["state"] == state
    assert under["p0_over_k"] == pytest.approx(744.9e6 * 3 * np.sqrt(3) / (hardness * 9.80665e6), rel=1e-3)
    assert any("warning: beyond shakedown" in line for line in found.summary) is (state == "beyond shakedown")
    (told,) = [f for f in check.findings(test.experiment) if f.rule == "shakedown"]
    assert told.ok is (state != "beyond shakedown")
    assert found.figure() is not None


def test_t_of_lundberg_and_palmgren() -> None:
    """The table of their shape: a/b = 0.6 of b/a has t with sqrt[(t^2 - 1)(2 t - 1)] = 0.6."""
    t = brentq(lambda t: np.sqrt((t**2 - 1) * (2 * t - 1)) - 0.6, 1, 2)
    assert shakedown.orthogonal_shear(0.6, 1.0)[0] == pytest.approx(np.sqrt(2 * t - 1) / (2 * t * (t + 1)))


def strongest_shear(ratio: float, traction: float, n: int = 240) -> float:
    """Largest |tau_zx| / p0 below an ellipse (a/b, 1), of point forces on n x n elements (Boussinesq, Cerruti)."""
    place = (2.0 * np.arange(n) + 1.0) / n - 1.0
    x, y = ratio * place, place[:, None]
    force = np.sqrt(np.maximum(0.0, 1.0 - place**2 - y**2)) * 4.0 * ratio / n**2
    found = 0.0
    for depth in min(ratio, 1.0) * np.linspace(0.15, 0.9, 16):
        for behind in ratio * np.linspace(-1.2, 1.2, 33):
            apart = behind - x
            at = (depth**2 * apart + traction * depth * apart**2) / (apart**2 + y**2 + depth**2) ** 2.5
            found = max(found, abs(float((1.5 / np.pi * force * at).sum())))
    return found


@pytest.mark.parametrize(("ratio", "traction"), [(2.0, 0.2), (1.0, 0.1), (0.5, 0.25), (4.0, 0.1)])
def test_shakedown_of_an_ellipse_under_traction_goes_by_its_own_shear(ratio: float, traction: float) -> None:
    found = float(shakedown.limits([traction], ratio, 1.0)[1][0])
    assert found == pytest.approx(min(1.0 / strongest_shear(ratio, traction), 1.0 / traction), rel=0.01)


def test_a_wide_ellipse_shakes_down_as_a_line() -> None:
    ratios = np.array([0.0, 0.1, 0.2, 0.3])
    wide, line = shakedown.limits(ratios, 0.02, 1.0)[1], shakedown.limits(ratios, 1.0, np.inf)[1]
    assert wide == pytest.approx(line, rel=0.005)


@pytest.mark.parametrize("ratio", [1e-300, 1e-100, 1e100, 1e300])
def test_no_ellipse_is_too_slender(ratio: float) -> None:
    """A line that rolls along its length flows at its surface, where p0 / k is 1 over T/N."""
    traction = np.array([0.1, 0.3])
    found = shakedown.limits(traction, ratio, 1.0)[1]
    line = shakedown.limits(traction, 1.0, np.inf)[1]
    assert found == pytest.approx(line if ratio < 1.0 else 1.0 / traction, rel=0.005)
