"""The figures of the paper one by one, with its axes and symbols; what it prints is marked, and what differs is said.

L. Chevalier, S. Cloupet, M. Quillien, Tribology International 39 (2006) 1376-1387. Figs. 1, 3 and 10 are sketches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from twindisc_cli.figures.contact import Field, marked_zones
from twindisc_cli.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    SMALL,
    caption,
    family,
    legend,
    measured_points,
    name_axes,
    page,
)
from twindisc_cli.identify.chart import Chart
from twindisc_cli.identify.paper import Paper, PaperTest, Worn
from twindisc_cli.model.experiment import Floats
from twindisc_cli.report.words import number

CREEPAGE, APPARENT, ACROSS = "longitudinal creepage $\\upsilon_x$ [%]", "$T/N$ [1]", "$y$ [mm]"
HEIGHT, TIME = "height change [µm]", "time [s]"
STEADY, COLD, RISE_FROM = (0.55, 0.62), (0.05, 0.07), 3.0
"""T/N in air once steady and in nitrogen below 3 % creepage, and the creepage [%] of its rise (2.1, 2.3)."""
WEAR_BEGINS, FALL, WARMING = 2000.0, 4500.0, 10.0
"""Time of the first wear and of the fall of temperature in nitrogen [s], and warming [K] (3.3)."""
TESTS = (("air", RED, "o", "in air"), ("nitrogen", BLUE, "s", "in nitrogen"))
CLOSE = 1.7
"""End of the enlarged part of the chart [%]."""


def drawn(paper: Paper, charts: tuple[Chart, Chart], fields: Sequence[Field]) -> dict[str, Callable[[], Figure]]:
    """Every figure by its name. charts: of one mu and of a family; fields: exact theory and FASTSIM."""
    one, many = charts
    exact, simple = fields
    return {
        "fig02": partial(_traction, paper),
        "fig04": partial(_contact, paper, exact, 4, "exact theory"),
        "fig05": partial(_contact, paper, simple, 5, "FASTSIM"),
        "fig06": partial(_one_mu, paper, one),
        "fig07": partial(_chart, paper, many),
        "fig08": partial(_loading, paper),
        "fig09": partial(_recorded, paper),
        "fig11": partial(_bisection, paper),
        "fig12": partial(_depth, paper),
        "fig13": partial(_warming, paper),
        "fig14": partial(_predicted, paper),
    }


def _page(paper: Paper, title: str, *, panels: int = 1, height: float = 3.9) -> tuple[Figure, list[Axes]]:
    kinds = dict.fromkeys(test.experiment.measured.provenance for test in _tests(paper).values())
    return page(1, panels, height=height, title=title, provenance=" and ".join(kinds))


def _tests(paper: Paper) -> Mapping[str, PaperTest]:
    return {"air": paper.air, "nitrogen": paper.nitrogen}


def _styled(paper: Paper) -> Iterator[tuple[PaperTest, str, str, str]]:
    """Each test with its colour, marker and label."""
    return ((_tests(paper)[name], colour, marker, label) for name, colour, marker, label in TESTS)


def _kind(test: PaperTest) -> str:
    return test.experiment.measured.provenance


def _is_rebuilt(paper: Paper) -> bool:
    return all(_kind(test) == "reconstructed" for test in _tests(paper).values())


def _rebuilt(figure: Figure, paper: Paper, sentence: str) -> None:
    """Where the data are rebuilt from the text: how they differ from the paper's, below the panels."""
    if _is_rebuilt(paper):
        caption(figure, sentence)


def _points(axes: Axes, paper: Paper, *, bars: bool = True) -> None:
    """T/N of the steps of both tests."""
    for test, colour, marker, label in _styled(paper):
        result = test.friction
        half = np.nan_to_num(result.half) if bars else None
        axes.errorbar(result.creepage * 100.0, result.ratio, yerr=half, linestyle="none", marker=marker, markersize=4.5,
                      color=colour, markerfacecolor="white", elinewidth=0.7, label=f"{label}, {_kind(test)}",
                      zorder=4)  # fmt: skip


def _traction(paper: Paper) -> Figure:
    figure, (axes,) = _page(paper, "Fig. 2: T/N over longitudinal creepage, in air and in liquid nitrogen")
    low, high = RISE_FROM, 1.05e2 * float(np.nanmax(paper.air.friction.creepage))
    axes.fill_between([1.0, high], *STEADY, color=RED, alpha=0.13, linewidth=0.0, label="paper: 0.55 to 0.62")
    axes.fill_between([0.0, low], *COLD, color=BLUE, alpha=0.18, linewidth=0.0, label="paper: 0.05 to 0.07 below 3 %")
    axes.axvline(RISE_FROM, color=GREY, linewidth=0.8, linestyle=":", label="paper: rises from 3 %")
    _points(axes, paper)
    axes.set_xlim(0.0, high)
    axes.set_ylim(0.0, 0.7)
    name_axes(axes, CREEPAGE, APPARENT)
    legend(axes, 3)
    half = float(np.nanmax(paper.air.friction.half))
    _rebuilt(figure, paper, "The paper's points are measured; these are rebuilt from its text, with an assumed "
                            f"interval of ±{half:.2g} (90 %). The creepages of the steps are chosen.")  # fmt: skip
    return figure


def _contact(paper: Paper, field: Field, figure_number: int, theory: str) -> Figure:
    title = f"Fig. {figure_number}: traction and slip by {theory}, $\\mu$ = 0.6, $\\upsilon_x$ = 0.2 %"
    figure, panels = page(2, 2, height=5.2, title=title)
    over, slip, along, sliding = panels
    _map(over, field, 1e-6 * field.traction[0], "$\\tau_x$ [MPa]", "tangential traction $\\tau_x$")
    _map(slip, field, field.slip[0], "$w_x$ [m/s]", "slip $w_x$")
    row = field.x.shape[0] // 2
    order = np.argsort(field.x[row])
    x = 1e3 * field.x[row, order]
    along.plot(x, 0.6e-6 * field.pressure[row, order], color=GREY, linestyle=":", label="$\\mu p$")
    along.plot(x, 1e-6 * field.traction[0, row, order], color=RED, label="$\\tau_x$")
    along.set_ylim(0.0, None)
    name_axes(along, "$x$ [mm]", "traction [MPa]", "along the middle strip")
    legend(along, 2)
    sliding.plot(x, field.slip[0, row, order], color=BLUE)
    name_axes(sliding, "$x$ [mm]", "$w_x$ [m/s]", "slip along the middle strip")
    own = "The paper used CONTACT; this is an own solution on 120 by 120 elements. " if figure_number == 4 else ""
    ratio = field.force_x / paper.air.experiment.rig.normal_load
    sticks = f"sticks over {field.stick_fraction * 100.0:.0f} % of the patch"
    caption(figure, f"{own}T/N = {ratio:.3f}, {sticks}. Rolling is towards positive x.")
    return figure


def _map(axes: Axes, field: Field, values: Floats, unit: str, what: str) -> None:
    """A component over the patch, x upward as it rolls, with the border of stick and slip."""
    x, y = 1e3 * field.x, 1e3 * field.y
    shown = np.where(field.pressure > 0.0, values, np.nan)
    colours = axes.pcolormesh(y.T, x.T, shown.T, shading="nearest", vmin=0.0, rasterized=True)
    bar = axes.figure.colorbar(colours, ax=axes, pad=0.02, aspect=18, shrink=0.9)
    bar.set_label(unit, fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    marked_zones(axes, field)
    axes.set_aspect("equal")
    axes.grid(False)
    name_axes(axes, ACROSS, "$x$ [mm]", what)


def _one_mu(paper: Paper, one: Chart) -> Figure:
    figure, (axes,) = _page(paper, "Fig. 6: apparent friction over creepage for $\\mu$ = 0.6, and the test in air")
    axes.plot(one.creepage * 100.0, one.apparent[0], color=BLACK, label="FASTSIM, $\\mu$ = 0.6")
    axes.axvline(one.full_slip[0] * 100.0, color=GREY, linewidth=0.9, linestyle=":",
                 label=f"full slip from {one.full_slip[0] * 100.0:.2f} % (paper: about 1 %)")  # fmt: skip
    result = paper.air.friction
    measured_points(axes, result.creepage * 100.0, result.ratio, result.half, label=f"in air, {_kind(paper.air)}")
    axes.set_xlim(0.0, float(one.creepage[-1]) * 100.0)
    axes.set_ylim(0.0, 0.7)
    name_axes(axes, CREEPAGE, "apparent friction $\\mu_a$ [1]")
    legend(axes, 3)
    caption(
        figure, "As in the paper, one constant μ comes close and does not pass through the points of small creepage."
    )
    return figure


def _chart(paper: Paper, many: Chart) -> Figure:
    title = "Fig. 7: chart of the apparent friction, $\\mu$ from 0.05 to 0.7, with both tests"
    figure, (whole, near) = _page(paper, title, panels=2)
    reached = many.light_line <= many.creepage[-1]
    for axes in (whole, near):
        for row, colour in zip(many.apparent, family(len(many.mu)), strict=True):
            axes.plot(many.creepage * 100.0, row, color=colour, linewidth=0.9)
        axes.plot(many.light_line[reached] * 100.0, 0.98 * many.mu[reached], color=ORANGE, linewidth=1.6,
                  label="$\\mu_a$ = 98 % of $\\mu$")  # fmt: skip
        _points(axes, paper, bars=False)
        axes.set_ylim(0.0, 0.74)
        legend(axes, 2)
    for mu, row in zip(many.mu[1::2], many.apparent[1::2], strict=True):
        whole.annotate(f"{mu:.1f}", (many.creepage[-1] * 100.0, row[-1]), xytext=(3, 0), fontsize=SMALL, va="center",
                       textcoords="offset points", annotation_clip=False)  # fmt: skip
    whole.set_xlim(0.0, float(many.creepage[-1]) * 100.0)
    near.set_xlim(0.0, CLOSE)
    name_axes(whole, CREEPAGE, "apparent friction $\\mu_a$ [1]", "$\\mu$ numbered at the right")
    name_axes(near, CREEPAGE, "apparent friction $\\mu_a$ [1]", "small creepages, enlarged")
    _rebuilt(figure, paper, "In the paper only the very first point in air lies left of the light line; the rebuilt "
                            "second one, at 94 % of its μ, does too.")  # fmt: skip
    return figure


def _loading(paper: Paper) -> Figure:
    figure, panels = _page(paper, "Fig. 8: creepage and friction coefficient of each iteration", panels=2)
    highest = 1.15 * max(float(np.max(test.before.history.mu)) for test in _tests(paper).values())
    for axes, (name, colour, _, label) in zip(panels, TESTS, strict=True):
        history = _tests(paper)[name].before.history
        order = np.arange(1, len(history.time) + 1)
        axes.bar(order, history.creepage * 100.0, width=0.85, color="#BBD7EA", label="$\\upsilon_x$ (left)")
        name_axes(axes, f"iteration of 4200 revolutions, {label}", CREEPAGE, label)
        axes.set_ylim(0.0, 10.0)
        other = axes.twinx()
        other.step(order, history.mu, where="mid", color=colour, linewidth=1.3)
        other.set_ylim(0.0, highest)
        other.set_ylabel("$\\mu$ [1]")
        other.spines["right"].set_visible(True)
        other.grid(False)
        axes.plot([], [], color=colour, linewidth=1.3, label="$\\mu$ (right)")
        legend(axes, 2)
    _rebuilt(figure, paper, "Steps of five iterations, the last two in air longer, as in the paper; the twelve "
                            "creepages, seven iterations in the last two steps and each μ are rebuilt.")  # fmt: skip
    return figure


def _recorded(paper: Paper) -> Figure:
    figure, (axes,) = _page(paper, "Fig. 9: profiles of disc 2 at the end of both tests")
    for name, colour, _, label in TESTS:
        test = _tests(paper)[name]
        axes.plot(test.y * 1e3, test.height * 1e6, color=colour, label=f"{label}, {_kind(test)}")
        depth, width = (test.experiment.reported.get(key, np.nan) for key in ("depth", "width"))
        axes.axhline(-depth * 1e6, color=colour, linewidth=0.8, linestyle="--",
                     label=f"paper {label}: {depth * 1e6:.2g} µm deep, printed {width * 1e3:.3g} mm wide")  # fmt: skip
    _across(axes, paper)
    legend(axes, 2)
    _rebuilt(figure, paper, "Parabolas of the stated depths. The printed widths are read as 1.8 and 1.51 mm: "
                            "18 mm on 30 mm would be 1.4 mm deep. Form, flanks and the missing roughness are "
                            "assumed.")  # fmt: skip
    return figure


def _across(axes: Axes, paper: Paper) -> None:
    reach = 0.65e3 * max(test.recorded.width for test in _tests(paper).values())
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-1.12e6 * max(test.recorded.depth for test in _tests(paper).values()), 0.6)
    name_axes(axes, ACROSS, HEIGHT)


def _bisection(paper: Paper) -> Figure:
    figure, (result, left) = _page(paper, "Fig. 11: K of the test in air by bisection on the depth", panels=2)
    k, error = np.array(paper.fit.bisection.trail).T
    order = np.arange(1, len(k) + 1)
    low, high = paper.fit.bisection.bracket
    lows, highs = [low], [high]
    for value, off in zip(k, error, strict=True):
        lows.append(value if off > 0.0 else lows[-1])
        highs.append(value if off <= 0.0 else highs[-1])
    result.fill_between(order, np.array(lows[:-1]) * 1e5, np.array(highs[:-1]) * 1e5, color=GREY, alpha=0.25,
                       linewidth=0.0, label="$[K_0, K_1]$")  # fmt: skip
    result.plot(order, k * 1e5, color=BLUE, marker="o", markersize=4.0, label="$K = (K_0 + K_1) / 2$, Eq. 16")
    name_axes(result, "simulation", "$K$ [$10^{-5}$]", f"K = {number(k[-1])}; printed: 9.89e-4")
    left.axhspan(-1.0, 1.0, color=GREEN, alpha=0.25, linewidth=0.0, label="$|E_r|$ < 1 %")
    left.plot(order, error, color=BLUE, marker="o", markersize=4.0, label="$E_r = (U_m - U_s) / U_m$, Eq. 17")
    name_axes(left, "simulation", "$E_r$ [%]", "error of the depth")
    for axes in (result, left):
        axes.set_xticks(order)
        legend(axes, 2)
    caption(figure, f"The paper shows a flow chart; here it runs. Worn volume and dissipated energy allow K = "
                    f"{number(paper.fit.allowed)} (W H / E of the rebuilt profile): the printed 9.89e-4 is "
                    f"{9.89e-4 / paper.fit.allowed:.1f} times that. Us and Um are taken as depths.")  # fmt: skip
    return figure


def _depth(paper: Paper) -> Figure:
    figure, (axes,) = _page(paper, "Fig. 12: depth of the track over time, with the K from air in both tests")
    for test, colour, marker, label in _styled(paper):
        history = test.before.history
        axes.plot(np.insert(history.time, 0, 0.0), np.insert([t.depth * 1e6 for t in history.track], 0, 0.0),
                  color=colour, label=f"simulated {label}")  # fmt: skip
        axes.plot([history.time[-1]], [test.recorded.depth * 1e6], linestyle="none", marker=marker, color=colour,
                  markerfacecolor="white", markersize=7.0, clip_on=False, zorder=5,
                  label=f"{_kind(test)} {label}: {test.recorded.depth * 1e6:.2g} µm")  # fmt: skip
    axes.axvline(WEAR_BEGINS, color=GREY, linewidth=0.8, linestyle=":", label="paper: wear in nitrogen begins")
    axes.set_xlim(0.0, 1.03 * float(paper.air.before.history.time[-1]))
    axes.set_ylim(0.0, None)
    name_axes(axes, TIME, "greatest depth [µm]")
    legend(axes, 3)
    air, cold = (test.before.track.depth * 1e6 for test in (paper.air, paper.nitrogen))
    caption(figure, f"K = {number(paper.fit.bisection.wear_coefficient)} makes {air:.2f} µm in air, to within the 1 % "
                    f"of the bisection, and predicts {cold:.2f} µm in nitrogen (stated: 4.4 µm).")  # fmt: skip
    return figure


def _warming(paper: Paper) -> Figure:
    figure, (axes,) = _page(paper, "Fig. 13: warming of the disc above the environment")
    for test, colour, _, label in _styled(paper):
        axes.plot(test.time, test.warming, color=colour, label=f"{label}, Eq. 18")
    axes.axhline(WARMING, color=GREY, linewidth=0.9, linestyle="--", label="paper: about 10 K")
    axes.axvline(FALL, color=GREY, linewidth=0.8, linestyle=":", label="paper: fall near 4500 s in nitrogen")
    axes.set_xlim(0.0, 1.03 * float(max(paper.air.time[-1], paper.nitrogen.time[-1])))
    axes.set_ylim(0.0, None)
    name_axes(axes, TIME, "$T - T_\\infty$ [K]")
    legend(axes, 2)
    thermal = paper.air.experiment.thermal
    chosen = f"{thermal.convection:.3g} W/K and a heat capacity of {thermal.heat_capacity:.3g} J/K" if thermal else ""
    caption(figure, f"h S = {chosen} are not in the paper: h S is chosen so that the warming is about 10 K, and the "
                    "two curves say nothing more about its size. The fall follows that of μ.")  # fmt: skip
    return figure


def _predicted(paper: Paper) -> Figure:
    test, k = paper.nitrogen, paper.fit.bisection.wear_coefficient
    figure, (axes,) = _page(paper, "Fig. 14: profile in nitrogen, simulated with the K from air")
    history, track = test.before.history, test.before.track
    axes.plot(test.y * 1e3, test.height * 1e6, color=BLACK, label=f"{_kind(test)}")
    axes.plot(history.y * 1e3, history.height[-1] * 1e6, color=BLUE, label=f"simulated, K = {number(k)} from air")
    _across(axes, paper)
    axes.set_ylim(-1.15e6 * max(test.recorded.depth, track.depth), 0.5)
    legend(axes, 2)
    caption(figure, f"Depth {track.depth * 1e6:.2f} µm against {test.recorded.depth * 1e6:.2f} µm; width "
                    f"{track.width * 1e3:.2f} mm against {test.recorded.width * 1e3:.2f} mm at 5 % of the depth: too "
                    "narrow, as in the paper.")  # fmt: skip
    return figure


def before_and_after(paper: Paper, *, what: str) -> Figure:
    """Profiles of both tests by the paper's model and by the revised one, with a table. what: was added."""
    kinds = dict.fromkeys(_kind(test) for test in _tests(paper).values())
    title = "The paper's model and the revised one"
    figure, panels = page(2, 2, height=6.2, title=title, provenance=" and ".join(kinds))
    for axes, (test, _, _, label) in zip(panels[:2], _styled(paper), strict=True):
        axes.plot(test.y * 1e3, test.height * 1e6, color=BLACK, linewidth=2.2, alpha=0.45, label=_kind(test))
        for worn, colour, which in ((test.before, ORANGE, "paper's model"), (test.after, BLUE, "revised model")):
            if worn is not None:
                axes.plot(worn.history.y * 1e3, worn.history.height[-1] * 1e6, color=colour, label=which)
        _across(axes, paper)
        axes.set_title(f"{axes.get_title(loc='left')}  {label}", loc="left")
        legend(axes, 3)
    for axes, (test, _, _, label) in zip(panels[2:], _styled(paper), strict=True):
        _table(axes, test, label)
    added = f"Added: {what}, by the closed loop on the test in air. K is fitted there; in nitrogen all is predicted."
    reading = "The recorded profiles are parabolas of the stated depth and of widths read as 1.8 and 1.51 mm, on which "
    caption(figure, f"{added} {reading}the revised model rests." if _is_rebuilt(paper) else added)
    return figure


def _table(axes: Axes, test: PaperTest, label: str) -> None:
    """Depth, width, K and what is missed, recorded, before and after."""

    def column(worn: Worn | None) -> list[str]:
        if worn is None:
            return ["–"] * 5
        other = float(-worn.history.disc1_height[-1].min()) * 1e6
        return [f"{worn.track.depth * 1e6:.2f}", f"{worn.track.width * 1e3:.2f}", f"{other:.2f}",
                f"{worn.missed * 1e6:.2f}", number(worn.wear_coefficient)]  # fmt: skip

    recorded = [f"{test.recorded.depth * 1e6:.2f}", f"{test.recorded.width * 1e3:.2f}", "–", "–", "–"]
    rows = ["depth, disc 2 [µm]", "width at 5 % [mm]", "depth, disc 1 [µm]", "rms missed [µm]", "K [1]"]
    cells = [list(values) for values in zip(recorded, column(test.before), column(test.after), strict=True)]
    axes.axis("off")
    shown = axes.table(cells, rowLabels=rows, colLabels=[_kind(test), "paper's", "revised"], cellLoc="center",
                       colWidths=[0.42, 0.29, 0.29], bbox=Bbox.from_bounds(0.36, 0.1, 0.64, 0.85))  # fmt: skip
    shown.auto_set_font_size(False)
    shown.set_fontsize(7.5)
    for cell in shown.get_celld().values():
        cell.set_linewidth(0.4)
        cell.set_edgecolor("#BBBBBB")
    axes.set_title(f"{axes.get_title(loc='left')}  {label}", loc="left")
