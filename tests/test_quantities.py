"""Units: each factor against its definition, there and back; what keys, headers and readers make of a unit."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import twindisc_cli
from twindisc_cli.quantities import QUANTITIES, SUFFIXES, UNITS, for_reading, split_key

DEFINED = {
    ("1", "thousands"): 1e-3,
    ("degC", "K"): 274.15,
    ("degF", "degC"): -155.0 / 9.0,
    ("h", "min"): 60.0,
    ("kgf", "N"): 9.80665,
    ("lbf", "N"): 4.4482216152605,
    ("HV", "MPa"): 9.80665,
    ("km h-1", "m min-1"): 1000.0 / 60.0,
    ("rpm", "Hz"): 1.0 / 60.0,
    ("Hz", "rad s-1"): 2.0 * math.pi,
    ("kJ", "J"): 1000.0,
    ("mg", "ug"): 1000.0,
    ("mm", "um"): 1000.0,
    ("N mm", "mN m"): 1.0,
    ("um mm-1", "um km-1"): 1e6,
}
"""One of the first in the second, by their definitions."""


@pytest.mark.parametrize(("one", "other"), DEFINED)
def test_a_unit_is_as_it_is_defined(one: str, other: str) -> None:
    assert UNITS[one].si == UNITS[other].si
    assert float(UNITS[other].of_si(UNITS[one].to_si(1.0))) == pytest.approx(DEFINED[one, other], rel=1e-12)


@pytest.mark.parametrize("name", UNITS)
def test_there_and_back(name: str) -> None:
    values = np.array([-3.0, 0.0, 0.5, 400.0])
    assert UNITS[name].of_si(UNITS[name].to_si(values)) == pytest.approx(values, rel=1e-12, abs=1e-12)


def test_no_two_units_end_a_key_alike() -> None:
    assert len(SUFFIXES) == sum(bool(unit.suffix) for unit in UNITS.values())


@pytest.mark.parametrize(
    ("key", "stem", "unit"),
    [
        ("depth_um", "depth", "um"),
        ("wear_index_N_mm2", "wear_index", "N/mm2"),
        ("conductivity_W_mK", "conductivity", "W/(m K)"),
        ("nusselt_per_length_1_m", "nusselt_per_length", "1/m"),
        ("rise_C", "rise", "K"),
        ("peak_C", "peak", "degC"),
        ("T_over_N", "T_over_N", "1"),
        ("mu", "mu", "1"),
    ],
)
def test_a_key_ends_in_its_unit(key: str, stem: str, unit: str) -> None:
    plain, found = split_key(key)
    assert (plain, found.solidus) == (stem, unit)


def test_units_for_readers() -> None:
    assert [for_reading(name) for name in ("N mm-2", "um", "degC", "1", "W m-1 K-1")] == [
        "N mm⁻²", "µm", "°C", "", "W m⁻¹ K⁻¹",
    ]  # fmt: skip


def test_a_quantity_on_an_axis() -> None:
    energy, temperature = QUANTITIES["energy"], QUANTITIES["temperature"]
    assert (energy.axis_label, energy.si, float(energy.drawn(2500.0))) == ("dissipated energy [kJ]", "J", 2.5)
    assert temperature.difference.name == "K"
    assert float(temperature.drawn(300.0)) == pytest.approx(26.85)


def test_the_zero_of_celsius_stands_in_one_place() -> None:
    """A conversion beside the table would be a second owner of the same fact."""
    files = Path(twindisc_cli.__file__).parent.rglob("*.py")
    holders = [file.name for file in files if re.search(r"(?<!-)273\.15", file.read_text(encoding="utf-8"))]
    assert holders == ["quantities.py"]
