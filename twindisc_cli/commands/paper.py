"""paper: the figures of Chevalier, Cloupet and Quillien (2006) one by one, and the numbers in them.

The folder `paper` gets a picture for each figure of the paper that is no sketch; with a revised definition of the test
in air a sheet that sets the paper's model beside the revised one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from twindisc_cli.commands.friction_chart import FAMILY
from twindisc_cli.definition import Test
from twindisc_cli.identify.chart import Chart, friction_chart
from twindisc_cli.identify.friction import SATURATED
from twindisc_cli.identify.paper import Paper, PaperTest, reproduce
from twindisc_cli.identify.wear_history import WearHistory
from twindisc_cli.model.contact_fields import Field, exact_field, fastsim_field, hertz_patch
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.physics.half_space.rolling import Creepage
from twindisc_cli.quantities import CELSIUS, UNITS
from twindisc_cli.report.words import listed, number, plain_name
from twindisc_cli.results import Array, Axis, Dataset, Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MU, CREEPAGE = 0.6, 0.002
"""The case of Figs. 4 and 5 (2.2)."""
CREEPAGES = 300
Numbers = Mapping[str, Mapping[str, float]]


def run(
    air: Test,
    nitrogen: Test,
    revised: Test | None = None,
    *,
    progress: Callable[[str, float], None] = lambda what, fraction: None,
) -> Result:
    """Reproduce the paper from its two tests; `revised` is the one in air with what a closed loop added."""
    progress("paper: wear", 0.1)
    paper = reproduce(air.experiment, nitrogen.experiment, revised.experiment if revised else None)
    progress("paper: contact", 0.5)
    rig = paper.air.experiment.rig
    patch = hertz_patch(rig, rig.normal_load)
    driven = Creepage(CREEPAGE)
    fields = exact_field(patch, rig, mu=MU, creepage=driven), fastsim_field(patch, rig, mu=MU, creepage=driven)
    progress("paper: figures", 0.8)
    charts = _charts(paper.air.experiment)
    result = _numbers(paper, charts, fields)
    return Result(
        command="paper",
        summary=_summary(paper),
        json={"numbers": result},
        dataset=_dataset(paper, result),
        figure=None,
        figures=_figures(paper, charts, fields, revised.experiment if revised else None),
    )


def _charts(test: Experiment) -> tuple[Chart, Chart]:
    """The chart of mu = 0.6 and of the family, on the test's unworn discs."""
    plain = replace(test, effects={}, laws={}, options=replace(test.options, traction="fastsim"))
    largest = 1.05 * float(np.abs(test.history.creepage).max())
    creepage = np.unique(np.concatenate([np.linspace(0.0, 0.015, CREEPAGES)[1:], np.linspace(0.015, largest, 40)]))
    one, many = (friction_chart(plain, mu=mu, creepage=creepage) for mu in (np.array([MU]), FAMILY))
    return one, many


def _figures(
    paper: Paper, charts: tuple[Chart, Chart], fields: tuple[Field, Field], revised: Experiment | None
) -> dict[str, Callable[[], Figure]]:
    from twindisc_cli.figures.paper import before_and_after, drawn

    figures = drawn(paper, charts, fields)
    if revised is not None:
        added = listed([plain_name(name) for name in paper.added])
        figures["before_and_after"] = lambda: before_and_after(paper, what=added)
    return figures


# ------------------------------------------------------------------------------------------- numbers of each figure


def _numbers(paper: Paper, charts: tuple[Chart, Chart], fields: tuple[Field, Field]) -> Numbers:
    """The numbers that each figure shows, in the units that their names carry."""
    return {
        "setup": _of_the_setup(paper),
        "fig02": _of_traction(paper),
        "fig04": _of_contact(paper, fields[0]),
        "fig05": {**_of_contact(paper, fields[1]), **_difference(paper, fields)},
        "fig06": _of_one_mu(charts[0]),
        "fig07": _of_chart(charts[1]),
        "fig08": _of_loading(paper),
        "fig09": _of_profiles(paper),
        "fig11": _of_bisection(paper),
        "fig12": _of_wear(paper),
        "fig13": _of_warming(paper),
        "fig14": _of_prediction(paper),
        **({"before_and_after": _of_revision(paper)} if paper.air.after else {}),
    }


def _of_the_setup(paper: Paper) -> dict[str, float]:
    test = paper.air.experiment
    rig, turning = test.rig, test.rig.disc2.rolling_radius
    cold = paper.nitrogen.experiment.thermal
    return {
        "diameter_mm": 2e3 * turning,
        "crown_radius_mm": rig.disc2.transverse_radius * 1e3,
        "rolling_speed_m_s": rig.rolling_speed,
        "speed_rpm": 60.0 * rig.rolling_speed / (2.0 * np.pi * turning),
        "normal_load_N": rig.normal_load,
        "hardness_HV": rig.disc2.hardness / UNITS["HV"].factor,
        "revolutions_of_an_iteration": float(test.history.revolutions[0]),
        "nitrogen_C": cold.environment_temperature - CELSIUS if cold else np.nan,
    }


def _of_traction(paper: Paper) -> dict[str, float]:
    air, cold = paper.air.friction, paper.nitrogen.friction
    steady = air.ratio[[state == SATURATED for state in air.state]]
    low = cold.ratio[cold.creepage < 0.0299]
    at_5 = [float(np.interp(0.05, test.creepage, test.ratio)) for test in (air, cold)]
    at_3 = [float(np.interp(0.03, test.creepage, test.ratio)) for test in (air, cold)]
    return {
        "ambient_lowest_steady_ratio": float(steady.min()),
        "ambient_highest_steady_ratio": float(steady.max()),
        "ambient_mean_steady_ratio": float(steady.mean()),
        "cryogenic_lowest_ratio": float(low.min()),
        "cryogenic_highest_ratio_below_3_percent": float(low.max()),
        "cryogenic_over_ambient_at_3_percent": at_3[1] / at_3[0],
        "cryogenic_over_ambient_at_5_percent": at_5[1] / at_5[0],
        "ambient_over_cryogenic_below_3_percent": float(np.mean(steady) / np.mean(low)),
        "greatest_creepage_percent": 100.0 * float(air.creepage.max()),
        "ambient_steps_in_partial_slip": sum(state != SATURATED for state in air.state),
    }


def _of_contact(paper: Paper, field: Field) -> dict[str, float]:
    return {
        "traction_ratio": field.force_x / paper.air.experiment.rig.normal_load,
        "stick_fraction": field.stick_fraction,
        "peak_traction_MPa": float(np.hypot(*field.traction).max()) * 1e-6,
    }


def _difference(paper: Paper, fields: tuple[Field, Field]) -> dict[str, float]:
    exact, simple = (field.force_x / (MU * paper.air.experiment.rig.normal_load) for field in fields)
    peak = [float((field.pressure).max()) for field in fields]
    return {
        "difference_from_exact_over_mu": simple - exact,
        "parabolic_over_elliptic_peak": peak[1] / peak[0],
    }


def _of_one_mu(one: Chart) -> dict[str, float]:
    return {
        "full_slip_percent": 100.0 * float(one.full_slip[0]),
        "light_line_percent": 100.0 * float(one.light_line[0]),
    }


def _of_chart(many: Chart) -> dict[str, float]:
    return {
        "lowest_mu": float(many.mu[0]),
        "highest_mu": float(many.mu[-1]),
        "full_slip_percent_at_lowest_mu": 100.0 * float(many.full_slip[0]),
        "full_slip_percent_at_highest_mu": 100.0 * float(many.full_slip[-1]),
    }


def _of_loading(paper: Paper) -> dict[str, float]:
    air, cold = (test.before.history for test in (paper.air, paper.nitrogen))
    return {
        "ambient_iterations": len(air.time),
        "cryogenic_iterations": len(cold.time),
        "seconds_of_an_iteration": float(air.time[0]),
        "ambient_energy_kJ": float(air.energy[-1]) * 1e-3,
        "cryogenic_energy_kJ": float(cold.energy[-1]) * 1e-3,
        "ambient_energy_above_3_percent_percent": _energy_above(air, 0.03),
        "cryogenic_energy_above_3_percent_percent": _energy_above(cold, 0.03),
    }


def _energy_above(history: WearHistory, creepage: float) -> float:
    """The share of the energy dissipated at more than a creepage [1], in percent."""
    of_iteration = np.diff(history.energy, prepend=0.0)
    return 100.0 * float(np.sum(of_iteration[history.creepage > creepage * (1.0 + 1e-9)]) / history.energy[-1])


def _of_profiles(paper: Paper) -> dict[str, float]:
    return {
        f"{name}_{size}": value
        for name, test in (("ambient", paper.air), ("cryogenic", paper.nitrogen))
        for size, value in (("depth_um", test.recorded.depth * 1e6), ("width_mm", test.recorded.width * 1e3))
    }


def _of_bisection(paper: Paper) -> dict[str, float]:
    fit = paper.fit
    return {
        "ambient_K": fit.bisection.wear_coefficient,
        "ambient_last_Er_percent": fit.bisection.trail[-1][1],
        "printed_K_over_allowed": paper.air.experiment.reported.get("wear_coefficient", np.nan) / fit.allowed,
    }


def _of_wear(paper: Paper) -> dict[str, float]:
    history = paper.nitrogen.before.history
    early = np.flatnonzero(history.time <= 2000.0)[-1]
    return {
        "cryogenic_volume_before_2000_s_percent": 100.0 * float(history.volume[early] / history.volume[-1]),
        "cryogenic_highest_mu": float(history.mu.max()),
        "ambient_over_cryogenic_depth": paper.air.before.track.depth / paper.nitrogen.before.track.depth,
    }


def _of_warming(paper: Paper) -> dict[str, float]:
    cold = paper.nitrogen
    at = [float(np.interp(when, cold.time, cold.warming)) for when in (4200.0, 4620.0)]
    return {
        "ambient_rise_C": float(paper.air.warming.max()),
        "cryogenic_rise_C": float(cold.warming.max()),
        "cryogenic_fall_C": at[1] - at[0],
    }


def _of_prediction(paper: Paper) -> dict[str, float]:
    test = paper.nitrogen
    return {
        "cryogenic_depth_um": test.before.track.depth * 1e6,
        "cryogenic_width_over_measured": test.before.track.width / test.recorded.width,
    }


def _of_revision(paper: Paper) -> dict[str, float]:
    results: dict[str, float] = {}
    for name, test in (("ambient", paper.air), ("cryogenic", paper.nitrogen)):
        for which, worn in (("before", test.before), ("after", test.after)):
            if worn is not None:
                results |= {
                    f"{name}_depth_um_{which}": worn.track.depth * 1e6,
                    f"{name}_width_mm_{which}": worn.track.width * 1e3,
                    f"{name}_profile_rms_um_{which}": worn.missed * 1e6,
                    f"K_{which}": worn.wear_coefficient,
                }
    return results


# ----------------------------------------------------------------------------------------------------------- words


def _summary(paper: Paper) -> tuple[str, ...]:
    lines = [
        f"K = {number(paper.fit.bisection.wear_coefficient)} from the test in air, by bisection; printed in the paper: "
        f"{number(paper.air.experiment.reported.get('wear_coefficient', np.nan))}"
    ]
    for label, test in (("in air", paper.air), ("in nitrogen", paper.nitrogen)):
        lines.append(f"{label}: {_sizes(test)}, warms by {test.warming.max():.3g} K")
    return tuple(lines)


def _sizes(test: PaperTest) -> str:
    """Depth and width before, after and as recorded."""
    models = [test.before, *([test.after] if test.after else [])]
    depth = " -> ".join(f"{worn.track.depth * 1e6:.3g}" for worn in models)
    width = " -> ".join(f"{worn.track.width * 1e3:.3g}" for worn in models)
    return (
        f"depth {depth} µm ({test.experiment.measured.provenance}: {test.recorded.depth * 1e6:.3g}), "
        f"width {width} mm ({test.recorded.width * 1e3:.3g})"
    )


def _dataset(paper: Paper, result: Numbers) -> Dataset:
    """The curves of Figs. 9, 12, 13 and 14, and every number as an attribute FIGURE_NUMBER."""
    axes: list[Axis] = []
    arrays: list[Array] = []
    for name, test in (("ambient", paper.air), ("cryogenic", paper.nitrogen)):
        history = test.before.history
        inside = np.concatenate([[True], np.diff(test.time) > 0.0])
        axes += [
            Axis(f"{name}_y", history.y, "m", "position across the track"),
            Axis(f"{name}_iteration", np.arange(1, len(history.time) + 1), "1", "number of the iteration"),
            Axis(f"{name}_time", test.time[inside], "s", "time"),
        ]
        depth = np.array([track.depth for track in history.track])
        arrays += [
            Array(f"{name}_height", (f"{name}_y",), history.height[-1], "m", "height change of disc 2 at the end"),
            Array(f"{name}_depth", (f"{name}_iteration",), depth, "m", "greatest depth"),
            Array(f"{name}_warming", (f"{name}_time",), test.warming[inside], "K", "warming above the environment"),
        ]
    attrs = {f"{figure}_{name}": float(value) for figure, numbers in result.items() for name, value in numbers.items()}
    return Dataset(axes=tuple(axes), arrays=tuple(arrays), attrs=attrs)
