"""Differences from CONTACT's own examples of a locomotive wheel: `python tests/bench.py CONTACT`.

Its exact theory and FASTSIM, a third body with friction that falls with the local slip, its modified FASTSIM, flash
temperatures and friction that follows them. Each row is the largest difference over a creep curve of 30 points, of T/N
or of what the row names. CONTACT's grid of 40 elements is 0.003 mu N above the limit itself; the law is the limit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rigs import solve_rolling

from twindisc_cli.physics import exact, fastsim, kalker, polach, third_body
from twindisc_cli.physics.flash import Flash, Solid, flash_temperature
from twindisc_cli.physics.half_space import rolling

Floats = NDArray[np.float64]
REFERENCE = Path(__file__).parent / "reference"
LOAD, A, B, G, NU, SPEED = 106.7e3, 6.304e-3, 12.61e-3, 82e9, 0.28, 10.0
MU, LAYER = 0.33, 1.25e-3 / 8.2e9
STEEL = Solid(conductivity=50.0, density=7850.0, specific_heat=450.0)
STIFFNESS = G * A * B * np.asarray(kalker.coefficients(A / B, NU).c11)
ELEMENTS = 42
ITS_C11 = 3.849
"""By which CONTACT's FASTSIM begins, between Kalker's printed values; the exact theory has 3.740."""


def columns(name: str) -> Floats:
    """The columns of a table of tests/reference."""
    lines = [line for line in (REFERENCE / name).read_text().splitlines() if not line.startswith("#")]
    return np.asarray(np.loadtxt(lines, delimiter=",", skiprows=1).T)


def curve(number: int) -> tuple[Floats, Floats]:
    """Creepage and T/N of one of CONTACT's four creep curves."""
    series, creepage, force = columns("contact_tractcurv.csv")
    return creepage[series == number], force[series == number] / LOAD


def falling(slip: Floats) -> Floats:
    """mu of the curve with the third body."""
    return np.asarray(0.14 + 0.19 * 2.0 ** (-SPEED * slip / 1.25))


def solved(creepage: Floats, **given: object) -> Floats:
    """T/N by the solver on CONTACT's own number of elements."""
    return np.array([case.force_x for case in solutions(creepage, **given)]) / LOAD


def solutions(creepage: Floats, **given: object) -> list[rolling.Rolling]:
    """The solver's cases on 42 elements a side."""
    at = (2.0 * np.arange(ELEMENTS) + 1.0) / ELEMENTS - 1.0
    pressure = 1.5 * LOAD / (np.pi * A * B) * np.sqrt(np.maximum(0.0, 1.0 - at**2 - at[:, None] ** 2))
    case = {"x": A * at, "y": B * at, "pressure": pressure, "shear_modulus": G, "poisson": NU, **given}
    return [solve_rolling(creepage_x=float(v), **case) for v in creepage]


def by_law(creepage: Floats, mu: Floats | float) -> Floats:
    """T/N by the exact theory's law, with one mu over the patch."""
    return np.asarray(mu * exact.saturation(STIFFNESS * creepage / (mu * LOAD), A / B, NU))


def creep_curves(at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """The four curves of the example `tractcurv`."""
    creepage, known = curve(1)
    yield at_most("exact theory, solver: T/N", np.abs(solved(creepage, mu=MU) - known).max(), 0.003)
    yield at_most("  law", np.abs(by_law(creepage, MU) - known).max(), 0.004)
    creepage, known = curve(2)
    local = solved(creepage, mu=falling, layer_compliance=LAYER)
    yield at_most("third body, mu falling with local slip, solver: T/N", np.abs(local - known).max(), 0.003)
    layer = third_body.compliance_ratio(LAYER, stiffness=STIFFNESS, a=np.asarray(A), b=np.asarray(B))
    mu = falling(creepage)
    xi = third_body.slope_factor(layer) * STIFFNESS * creepage / (mu * LOAD)
    law = mu * third_body.saturation(xi, layer, exact.saturation(xi, A / B, NU))
    yield at_most("  law with a third body, mu falling with the rigid slip", np.abs(law - known).max(), 0.008)
    top = f"{law.max():.4f} at {100.0 * creepage[law.argmax()]:.3g} %"
    yield row("  its maximum", top, f"{known.max():.4f} at {100.0 * creepage[known.argmax()]:.3g} %")
    creepage, known = curve(3)
    simple = MU * fastsim.saturation(G * A * B * ITS_C11 * creepage / (MU * LOAD))
    yield at_most("FASTSIM, closed form: T/N", np.abs(simple - known).max(), 0.003)
    yield from modified_fastsim(at_most, row)


def modified_fastsim(at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """Its flexibility grows with creepage, which the program has not: two slope factors, fitted, stand in."""
    from scipy.optimize import least_squares

    creepage, known = curve(4)
    mu = np.asarray(0.1368 + 0.2232 * 2.0 ** (-SPEED * creepage / 0.99))

    def law(logs: Floats) -> Floats:
        adhesion, slip = np.exp(logs)
        xi = adhesion * G * A * B * ITS_C11 * creepage / (mu * LOAD)
        return np.asarray(mu * fastsim.saturation(xi) * polach.correction(xi, slip))

    best = least_squares(lambda logs: law(logs) - known, np.log([0.5, 0.5]), bounds=(np.log(0.02), 0.0))
    adhesion, slip = np.exp(best.x)
    yield at_most("modified FASTSIM by two slope factors, fitted: T/N", np.abs(best.fun).max(), 0.01)
    yield row(
        "  slopes in the areas of adhesion and of slip", f"{adhesion:.3f}, {adhesion * slip:.3f}", "(0.54 at first)"
    )


def summed_heat(case: rolling.Rolling, own_element: float) -> float:
    """The hottest place [K] of two discs that share the heat of their slip, summed along each row as CONTACT does.

    own_element: share of its own heat that an element has at its centre. It is half an element's way; CONTACT's
    m_temperature.f90 takes it twice.
    """
    heat = (case.traction * case.slip).sum(axis=0) * SPEED
    half, apart = 0.5 * (case.x[1] - case.x[0]), case.x - case.x[:, None]
    ahead = np.maximum(apart, half)
    weight = np.where(apart > half, np.sqrt(ahead + half) - np.sqrt(ahead - half), 0.0)
    weight += np.where(np.abs(apart) < half, own_element * np.sqrt(half), 0.0)
    return float((heat @ weight.T).max() / (STEEL.effusivity * np.sqrt(np.pi * SPEED)))


def temperatures(at_most: Callable[..., object], row: Callable[..., object]) -> Iterator[object]:
    """The hottest place of the patch, and friction that follows the temperature at each place."""
    slopes, creepages, forces, hottest = columns("contact_temperature.csv")
    creepage, known, rise = creepages[slopes == 0.0], forces[slopes == 0.0] / LOAD, hottest[slopes == 0.0]
    cases = solutions(creepage[1:], mu=MU)
    own = np.array([[summed_heat(case, share) for case in cases] for share in (2.0, 1.0)])
    slides, rise = creepage[1:] > 0.0033, rise[1:]
    yield at_most(
        "hottest place where all slides, heat of the solver summed by CONTACT",
        100.0 * worst(own[0][slides], rise[slides]),
        2.0,
        "%",
    )
    yield at_most("  in partial slip", np.abs(own[0] - rise)[~slides].max(), 0.3, "K")
    excess = 100.0 * (own[0] / own[1] - 1.0)[slides]
    yield row("  higher by its elements' own heat, taken twice", f"{excess.min():.3g} to {excess.max():.3g} %")
    flash = flash_of(known, creepage).maximum[1:]
    for least in (0.01, 0.0035):
        of = creepage[1:] > least
        name = f"  taken once: flash temperature by power alone, from {100.0 * least:g} %"
        yield row(name, f"{100.0 * worst(flash[of], own[1][of]):.3g} %")
    for slope in dict.fromkeys(slopes[slopes != 0.0]):
        known, mu = forces[slopes == slope] / LOAD, np.full_like(creepage, MU)
        for _ in range(200):
            mu = 0.5 * mu + 0.5 * (MU + slope * flash_of(by_law(creepage, mu), creepage).mean)
        name = f"mu {1e3 * slope:+.3g} per 1000 K of each place, by the mean flash temperature: T/N"
        yield row(name, f"{np.abs(by_law(creepage, mu) - known).max():.3g}")


def flash_of(ratio: Floats, creepage: Floats) -> Flash:
    """The flash temperatures of the wheel at T/N."""
    power = ratio * LOAD * creepage * SPEED
    return flash_temperature(power=power, creepage=creepage, a=A, b=B, speed=SPEED, solid=STEEL)


def worst(values: Floats, expected: Floats) -> float:
    """Largest relative difference."""
    return float(np.abs(values / expected - 1.0).max())


SECTIONS = {"CONTACT: creep curves": creep_curves, "CONTACT: temperatures": temperatures}
