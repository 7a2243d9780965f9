"""Every figure can be printed: no text on another or beyond the page, no legend on a panel, its data named."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from definitions import outcome, shipped
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from test_close_loop_report import found, learnt, made, nothing, unknown
from test_mass import facet, loss
from test_mass import test as weighed_test

from twindisc_cli.campaign.outcome import outcome_of
from twindisc_cli.campaign.table import Row, table_of
from twindisc_cli.commands import fit_k, paper
from twindisc_cli.definition import load
from twindisc_cli.figures.campaign import figure_of, labelled, map_of
from twindisc_cli.figures.close_loop import figure as loop_figure
from twindisc_cli.figures.style import WIDTH, from_zero, house_style, logarithmic, page
from twindisc_cli.report import sentences
from twindisc_cli.results.drawn import png

SLACK = 0.8
"""Pixels by which boxes may touch: the boxes of texts hold empty room above and below the letters."""

SHIPPED = [
    *(
        ("ambient", c)
        for c in ("friction-chart", "identify-mu", "simulate-wear", "fit-k", "thermal", "contact", "check")
    ),
    *(("cryogenic", c) for c in ("simulate-wear", "fit-k", "check")),
    *(("lewis2004", c) for c in ("friction-chart", "identify-mu", "thermal", "contact", "check")),
    *(("eurosprinter", c) for c in ("friction-chart", "identify-mu", "contact")),
    *(("mtm_running_in", c) for c in ("friction-chart", "identify-mu", "contact", "check")),
]


@pytest.fixture(autouse=True)
def as_the_program_draws() -> Iterator[None]:
    with house_style():
        yield


def drawn(figure: Figure) -> Figure:
    FigureCanvasAgg(figure).draw()
    return figure


def texts(figure: Figure) -> Iterator[Text]:
    """Every text that is drawn; of the numbers of an axis those inside its limits."""
    unseen = {id(text) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for text in hidden(axis)}
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip() and id(text) not in unseen:
            yield text


def hidden(axis: Axis) -> Iterator[Text]:
    """The numbers of ticks beyond the limits, and of an axis that is off."""
    low, high = sorted(axis.get_view_interval())
    slack = 1e-9 * (high - low)
    for ticks, places in (
        (axis.get_major_ticks(), axis.get_majorticklocs()),
        (axis.get_minor_ticks(), axis.get_minorticklocs()),
    ):
        for tick, place in zip(ticks, places, strict=False):
            shown = low - slack <= place <= high + slack and axis.axes.axison
            yield from () if shown and tick.label1.get_visible() else (tick.label1,)
            yield from () if shown and tick.label2.get_visible() else (tick.label2,)


def faults(figure: Figure) -> list[str]:
    """Texts that lie on another or leave the page, and legends on a panel."""
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts(drawn(figure))]
    page_box = figure.bbox.padded(SLACK)
    told = [f"leaves the page: {name!r}" for name, box in boxes if not inside(box, page_box)]
    for (one, first), (other, second) in combinations(boxes, 2):
        if first.padded(-SLACK).overlaps(second.padded(-SLACK)):
            told.append(f"{one!r} lies on {other!r}")
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend is not None and legend.get_window_extent().overlaps(axes.get_window_extent()):
            told.append(f"a legend lies on {axes.get_title(loc='left')!r}")
    return told


def inside(box: Bbox, other: Bbox) -> bool:
    return bool(other.x0 <= box.x0 and box.x1 <= other.x1 and other.y0 <= box.y0 and box.y1 <= other.y1)


def check(figure: Figure, provenance: str) -> None:
    assert faults(figure) == []
    assert figure.get_figwidth() == pytest.approx(WIDTH)
    assert f"{provenance} data" in [text.get_text() for text in figure.texts]


@pytest.mark.filterwarnings("ignore:constrained_layout")
def test_faults_are_seen() -> None:
    figure, (first, _) = page(1, 2, height=3.0, title="two", provenance="synthetic")
    assert faults(figure) == []
    first.text(0.5, 0.5, "one", transform=first.transAxes)
    first.text(0.5, 0.5, "other", transform=first.transAxes)
    first.text(-3.0, 0.7, "beyond", transform=first.transAxes)
    first.plot([0.0, 1.0], label="a line")
    first.legend(loc="center")
    assert [line.partition(" ")[0] for line in faults(figure)[:2]] == ["leaves", "'one'"]
    assert any("legend" in line for line in faults(figure))


@pytest.mark.parametrize(("name", "command"), SHIPPED)
def test_figures_of_the_shipped_tests(name: str, command: str) -> None:
    drawing = outcome(name, command).figure
    assert drawing is not None
    kinds = {"eurosprinter": "digitised", "mtm_running_in": "measured"}
    check(drawing(), kinds.get(name, "reconstructed"))


@pytest.mark.parametrize("kind", [found, nothing, unknown, learnt])
def test_figure_of_the_loop(tmp_path: Path, kind: Callable) -> None:
    test = made(tmp_path, "small")
    diagnosis = kind(test)
    verdict = sentences.sentences(diagnosis)[0]
    check(loop_figure(diagnosis, [test.experiment], title="small", provenance="reconstructed", verdict=verdict),
          "reconstructed")  # fmt: skip


@pytest.fixture(scope="module")
def paper_figures(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Callable[[], Figure]]:
    """The figures of the paper, and the sheet of a model in which both discs wear."""
    source = shipped("ambient").path
    text = source.read_text(encoding="utf-8").replace("../data", str(source.parents[1] / "data"))
    both = "[model]\nwear_coefficient = 2.2e-4\n[effects.wear_partition]\ndisc1_share = 0.5\n"
    revised = tmp_path_factory.mktemp("revised") / "revised.toml"
    revised.write_text(f"{text}\n{both}[effects.half_space_contact]\nshare = 1.0\n", encoding="utf-8")
    return paper.run(shipped("ambient"), shipped("cryogenic"), load(revised)).figures


PAPER = ("fig02", "fig04", "fig05", "fig06", "fig07", "fig08", "fig09", "fig11", "fig12", "fig13", "fig14",
         "before_and_after")  # fmt: skip


@pytest.mark.parametrize("name", PAPER)
def test_figures_of_the_paper(paper_figures: Mapping[str, Callable[[], Figure]], name: str) -> None:
    assert set(paper_figures) == set(PAPER)
    figure = paper_figures[name]()
    if name in ("fig04", "fig05"):  # a case of the theory, without data
        assert faults(figure) == []
    else:
        check(figure, "reconstructed")


@pytest.mark.parametrize(
    ("name", "command", "figure"),
    [("ambient", "fit-k", "fit-k-sensitivity"), ("cryogenic", "thermal", "thermal-friction")],
)
def test_further_figures_of_the_shipped_tests(name: str, command: str, figure: str) -> None:
    check(outcome(name, command).figures[figure](), "reconstructed")


def test_figures_of_weighed_discs(tmp_path: Path) -> None:
    both = "".join(f"{n},{loss(n):.9g},{0.02 * loss(n):.9g},2\n" for n in (2, 4, 5))
    mass = "iteration,mass loss [mg],uncertainty [mg],disc\n" + both
    for data in ({"mass": mass}, {"mass": mass, "profile": facet()}):
        figure = fit_k.run(weighed_test(tmp_path, **data)).figure
        assert figure is not None
        check(figure(), "measured")


def campaign(command: str, found: Sequence[Mapping[str, Any]]) -> Figure:
    """The figure over tests in each of which something was found, three of them repeats."""
    rows = [
        Row(f"test {i}", f"{i}.toml", 0, group="dry" if i < 3 else "", found=dict(one)) for i, one in enumerate(found)
    ]
    table = table_of(rows)
    drawing = figure_of(command, table, outcome_of(table), (), "synthetic")
    assert drawing is not None
    return drawing()


@pytest.mark.parametrize("tests", [2, 5, 24])
def test_figures_of_campaigns(tests: int) -> None:
    rng = np.random.default_rng(tests)
    energy = np.geomspace(9.0, 60.0 if tests > 2 else 12.0, tests)
    k = np.where(energy < 20.0, 5e-5, 2e-4) * np.exp(0.05 * rng.standard_normal(tests))
    worn = [{"K [1]": v, "K std [1]": 0.3 * v, "T gamma / A [N/mm2]": e, "wear rate [um/km]": v * e * 1e5}
            for v, e in zip(k, energy, strict=True)]  # fmt: skip
    check(campaign("fit-k", worn), "synthetic")
    effects = [{"verdict": "effects_found", "effects": "falling_friction; misalignment",
                "falling_friction probability [1]": 0.9, "misalignment probability [1]": 0.3}] * tests  # fmt: skip
    check(campaign("close-loop", effects), "synthetic")


@pytest.mark.parametrize(
    ("key", "unit", "shown"),
    [("decay_s_m", "s m-1", "decay [s m⁻¹]"), ("critical_creepage_percent", "%", "critical creepage [%]"),
     ("slope_um_mm", "um mm-1", "slope [µm mm⁻¹]"), ("ratio", "1", "ratio [1]")],
)  # fmt: skip
def test_parameters_are_labelled_by_name_and_unit(key: str, unit: str, shown: str) -> None:
    assert labelled(key, unit) == shown


@pytest.mark.parametrize(
    ("low", "high"), [(9.4, 12.7), (0.2, 300.0), (5e-5, 6e-5), (1e-5, 2e-3), (0.4, 21.0), (8.0, 8.0), (1e-6, 1.0)]
)
def test_a_logarithmic_axis_has_a_few_numbers_that_do_not_meet(low: float, high: float) -> None:
    figure, (axes,) = page(1, 1, height=3.0, title="log", provenance="synthetic")
    axes.plot([low, high], [low, high])
    logarithmic(axes.xaxis, low, high)
    logarithmic(axes.yaxis, low, high)
    assert faults(figure) == []
    for axis, (begin, end) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        shown = [label for label, place in zip(axis.get_ticklabels(), axis.get_majorticklocs(), strict=True)
                 if begin <= place <= end and label.get_text()]  # fmt: skip
        assert 2 <= len(shown) <= 9
        assert np.isfinite(axis.get_majorticklocs()).all()


def test_values_that_hardly_differ_are_not_cut_and_are_numbered_in_full() -> None:
    with house_style():
        figure, (axes,) = page(1, 1, height=3.0, title="")
        axes.errorbar([1, 2], [6377.1, 6377.2], yerr=[0.5, 1.0], marker="o")
        from_zero(axes)
        low, high = axes.get_ylim()
        assert low == 0.0
        assert high > 1.05 * 6378.2
        axes.set_ylim(6377.1, 6377.2)
        drawn(figure)
        assert not axes.yaxis.get_offset_text().get_text()


def test_a_map_names_what_was_varied_and_draws_what_came_out() -> None:
    asked = [{"rig.load [N]": load, "rig.creepage [%]": slip} for slip in (0.25, 0.5) for load in (50.0, 100.0)]
    rows = [Row(str(n), "a.toml", 0, asked=a, found={"depth [um]": 1.0 + n}) for n, a in enumerate(asked)]
    rows += [
        Row("base", "a.toml", 0, asked={"rig.load [N]": 72.0}, found={"depth [um]": 3.0}),
        Row("failed", "a.toml", 3, error="x", asked={"rig.load [N]": 72.0, "rig.creepage [%]": 9.0}),
    ]
    names = ["rig.load [N]", "rig.creepage [%]"]
    figure = map_of(table_of(rows), names, ["depth [um]"], title="map", provenance="")
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["0.25", "0.5", "base"]


@pytest.mark.parametrize(("keys", "lines"), [(1, 3), (3, 6), (5, 8)])
def test_a_map_over_many_keys_has_room_for_its_panels(keys: int, lines: int) -> None:
    names = [f"rig.disc{i}.transverse radius [mm]" for i in range(keys + 1)]
    rows = [
        Row("t", "a.toml", 0, asked=dict(zip(names, (load, *(30.125 + line * i for i in range(keys))), strict=True)),
            found={"depth [um]": load, "width [mm]": load / 100.0, "wear rate [um/km]": 2.0 * load})
        for line in range(lines)
        for load in (20.0, 63.2456, 200.0)
    ]  # fmt: skip
    drawing = figure_of("simulate-wear", table_of(rows), outcome_of(table_of(rows)), (), "synthetic")
    assert drawing is not None
    assert png(drawing())
    check(drawing(), "synthetic")
