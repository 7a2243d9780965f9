"""The figures that `make run` makes of the paper hold the paper's numbers, stored in reproduction.toml."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twindisc_cli.definition import load

HERE = Path(__file__).parent
STORED: dict[str, dict[str, dict[str, Any]]] = tomllib.loads((HERE / "reproduction.toml").read_text(encoding="utf-8"))
NUMBERS = [(figure, number) for figure, numbers in STORED.items() for number in numbers]
AIR, NITROGEN = "ambient", "cryogenic"


@cache
def told(name: str, command: str, **options: float) -> Any:
    """What a command says about a shipped test."""
    test = load(HERE.parent / "configs" / f"{name}.toml")
    return import_module(f"twindisc_cli.commands.{command.replace('-', '_')}").run(test, **options).json


def fig02() -> dict[str, float]:
    air, nitrogen = (told(name, "identify-mu")["steps"] for name in (AIR, NITROGEN))
    steady = [step["traction_ratio"] for step in air if step["state"] == "saturated"]
    low = [step["traction_ratio"] for step in nitrogen if step["creepage_percent"] < 3.0]
    at_5 = [next(s["traction_ratio"] for s in steps if s["creepage_percent"] == 5.0) for steps in (air, nitrogen)]
    return {
        "ambient_lowest_steady_ratio": min(steady),
        "ambient_highest_steady_ratio": max(steady),
        "cryogenic_lowest_ratio": min(low),
        "cryogenic_highest_ratio_below_3_percent": max(low),
        "cryogenic_over_ambient_at_5_percent": at_5[1] / at_5[0],
        "ambient_steps_in_partial_slip": sum(step["state"] == "partial_slip" for step in air),
    }


def paper_contact() -> Any:
    """The paper's mu = 0.6 and 0.2 %, which no step of the test ran at."""
    return told(NITROGEN, "contact", mu=0.6, creepage=0.2)


def fig04() -> dict[str, float]:
    exact = paper_contact()["exact"]
    return {
        "traction_ratio": exact["T_over_N"],
        "stick_fraction": exact["stick_fraction"],
        "peak_traction_MPa": exact["peak_traction_MPa"],
    }


def fig05() -> dict[str, float]:
    contact = paper_contact()
    ratio = contact["fastsim"]["T_over_N"]
    return {
        "traction_ratio": ratio,
        "difference_from_exact_over_mu": (ratio - contact["exact"]["T_over_N"]) / 0.6,
    }


def fig06() -> dict[str, float]:
    chart = told(AIR, "friction-chart")
    return {
        line: float(np.interp(0.6, chart["mu"], chart[key]))
        for line, key in (
            ("full_slip_percent", "full_slip_creepage_percent"),
            ("light_line_percent", "light_line_creepage_percent"),
        )
    }


def fig07() -> dict[str, float]:
    chart = told(AIR, "friction-chart")
    full = chart["full_slip_creepage_percent"]
    return {
        "lowest_mu": chart["mu"][0],
        "highest_mu": chart["mu"][-1],
        "full_slip_percent_at_lowest_mu": full[0],
        "full_slip_percent_at_highest_mu": full[-1],
    }


def fig08() -> dict[str, float]:
    air, nitrogen = (told(name, "simulate-wear") for name in (AIR, NITROGEN))
    return {
        "ambient_iterations": len(air["iterations"]),
        "cryogenic_iterations": len(nitrogen["iterations"]),
        "seconds_of_an_iteration": air["iterations"][0]["time_s"],
        "ambient_energy_kJ": air["dissipated_energy_kJ"],
        "cryogenic_energy_kJ": nitrogen["dissipated_energy_kJ"],
    }


def fig09() -> dict[str, float]:
    return {
        f"{name}_{size}": told(name, "fit-k")[f"measured_{size}"]
        for name in (AIR, NITROGEN)
        for size in ("depth_um", "width_mm")
    }


def fig11() -> dict[str, float]:
    fit = told(AIR, "fit-k")
    return {
        "ambient_K": fit["K"],
        "ambient_last_Er_percent": fit["bisection"][-1]["Er_percent"],
        "printed_K_over_allowed": fit["stated"]["reported"]["times_allowed"],
    }


def fig12() -> dict[str, float]:
    wear = told(NITROGEN, "simulate-wear")
    early = [i for i in wear["iterations"] if i["time_s"] <= 2000.0][-1]
    return {"cryogenic_volume_before_2000_s_percent": 100.0 * early["worn_volume_mm3"] / wear["worn_volume_mm3"]}


def fig13() -> dict[str, float]:
    nitrogen = told(NITROGEN, "thermal")
    at = {round(i["time_s"]): i["temperature_C"] for i in nitrogen["iterations"]}
    return {
        "ambient_rise_C": told(AIR, "thermal")["rise_C"],
        "cryogenic_rise_C": nitrogen["rise_C"],
        "cryogenic_fall_C": at[4620] - at[4200],
    }


def fig14() -> dict[str, float]:
    wear, fit = told(NITROGEN, "simulate-wear"), told(NITROGEN, "fit-k")
    assert wear["wear_coefficient"] == pytest.approx(told(AIR, "fit-k")["K"], rel=0.01)
    return {
        "cryogenic_depth_um": wear["depth_um"],
        "cryogenic_width_over_measured": wear["width_mm"] / fit["measured_width_mm"],
    }


FIGURES: dict[str, Callable[[], dict[str, float]]] = {
    figure.__name__: figure for figure in (fig02, fig04, fig05, fig06, fig07, fig08, fig09, fig11, fig12, fig13, fig14)
}


@pytest.mark.parametrize(("figure", "number"), NUMBERS, ids=[f"{figure}: {number}" for figure, number in NUMBERS])
def test_a_number_of_the_paper(figure: str, number: str) -> None:
    stored = STORED[figure][number]
    assert FIGURES[figure]()[number] == pytest.approx(stored["value"], abs=stored["within"], rel=0.0)


def test_every_figure_and_number_is_stored_with_the_statement_it_rests_on() -> None:
    assert {figure: set(find()) for figure, find in FIGURES.items()} == {f: set(n) for f, n in STORED.items()}
    assert all(entry["stated"] for numbers in STORED.values() for entry in numbers.values())
