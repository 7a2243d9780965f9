"""The figures that `twindisc paper` draws hold the paper's numbers, stored in reproduction.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from definitions import outcome, shipped, with_wear_coefficient

from twindisc_cli.commands import paper, simulate_wear
from twindisc_cli.results import Result

STORED: dict[str, dict[str, dict[str, Any]]] = tomllib.loads(
    (Path(__file__).parent / "reproduction.toml").read_text(encoding="utf-8")
)
NUMBERS = [(figure, number) for figure, numbers in STORED.items() for number in numbers]
AIR, NITROGEN = "ambient", "cryogenic"


@cache
def reproduced() -> Result:
    return paper.run(shipped(AIR), shipped(NITROGEN))


def numbers() -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = reproduced().json["numbers"]
    return found


@pytest.mark.parametrize(("figure", "number"), NUMBERS, ids=[f"{figure}: {number}" for figure, number in NUMBERS])
def test_a_number_of_the_paper(figure: str, number: str) -> None:
    stored = STORED[figure][number]
    assert numbers()[figure][number] == pytest.approx(stored["value"], abs=stored["within"], rel=0.0)


@pytest.mark.parametrize(("figure", "number"), NUMBERS, ids=[f"{figure}: {number}" for figure, number in NUMBERS])
def test_what_is_off_the_printed_number_says_why(figure: str, number: str) -> None:
    stored = STORED[figure][number]
    if "printed" in stored:
        agrees = abs(numbers()[figure][number] - stored["printed"]) <= stored["printed_within"]
        assert agrees == ("differs" not in stored), "the reason belongs to a number that differs, and to no other"


def test_every_figure_and_number_is_stored_with_the_statement_it_rests_on() -> None:
    assert {figure: set(found) for figure, found in numbers().items()} == {f: set(n) for f, n in STORED.items()}
    assert all(entry["stated"] for stored in STORED.values() for entry in stored.values())


def test_the_commands_say_the_same_numbers_as_the_figures() -> None:
    found = numbers()
    wear, fit = outcome(AIR, "simulate-wear").json, outcome(AIR, "fit-k").json
    assert found["fig11"]["ambient_K"] == pytest.approx(fit["bisection"][-1]["K"], rel=1e-9)
    assert found["fig08"]["ambient_energy_kJ"] == pytest.approx(wear["dissipated_energy_kJ"], rel=1e-3)
    rise = outcome(NITROGEN, "thermal").json["rise_C"]
    assert found["fig13"]["cryogenic_rise_C"] == pytest.approx(rise, rel=1e-3)
    nitrogen = with_wear_coefficient(shipped(NITROGEN), found["fig11"]["ambient_K"])
    depth = simulate_wear.run(nitrogen).json["depth_um"]
    assert found["fig14"]["cryogenic_depth_um"] == pytest.approx(depth, rel=2e-3)
