"""Every figure of the paper and one of each command, compared as an image with a kept reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import matplotlib
import numpy as np
import pytest
from images import DPI, FEW, REFERENCES, Pixels, differing, drawn, figures, picture
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.transforms import Affine2D
from PIL import Image

NAMES = sorted(path.stem for path in REFERENCES.glob("*.png"))
BARS, MAPS = ("fig08", "simulate-wear", "check", "fit-k-sensitivity"), ("fig04", "fig05", "contact")
CURVES = [name for name in NAMES if name not in ("check", "fit-k-sensitivity")]


@pytest.fixture(scope="module")
def every() -> Mapping[str, Callable[[], Figure]]:
    return figures()


def reference(name: str) -> Pixels:
    return np.asarray(Image.open(REFERENCES / f"{name}.png").convert("L"))


def test_every_figure_has_a_reference(every: Mapping[str, Callable[[], Figure]]) -> None:
    assert sorted(every) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_is_its_reference(every: Mapping[str, Callable[[], Figure]], name: str) -> None:
    assert differing(picture(drawn(every[name])), reference(name)) <= FEW


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_that_moved_by_one_percent_of_its_axis_is_seen(
    every: Mapping[str, Callable[[], Figure]], name: str
) -> None:
    figure = drawn(every[name])
    lines = [(axes, line) for axes in figure.axes for line in axes.lines]
    axes, line = max(lines, key=lambda pair: len(np.atleast_1d(pair[1].get_ydata())))
    low, high = axes.get_ylim()
    line.set_ydata(np.asarray(line.get_ydata(), dtype=float) + 0.01 * (high - low))
    axes.set_ylim(low, high)
    assert differing(picture(figure), reference(name)) > FEW


@pytest.mark.parametrize("name", [*BARS, *MAPS])
def test_bars_or_a_map_that_moved_by_one_percent_of_their_axis_are_seen(
    every: Mapping[str, Callable[[], Figure]], name: str
) -> None:
    figure = drawn(every[name])
    figure.set_layout_engine("none")
    figure.set_dpi(DPI)
    kind, few = (QuadMesh, 1) if name in MAPS else (Rectangle, 3)
    axes, found = next(
        (axes, found)
        for axes in figure.axes
        if len(found := [artist for artist in axes.get_children() if type(artist) is kind and artist is not axes.patch])
        >= few
    )
    low, high = axes.get_ylim()
    moved = Affine2D().translate(0.01 * axes.bbox.width, 0.01 * axes.bbox.height)
    for artist in found:
        artist.set_transform(artist.get_transform() + moved)
    axes.set_ylim(low, high)
    assert differing(picture(figure), reference(name)) > FEW


@pytest.mark.parametrize("name", ["fig02", "simulate-wear"])
def test_other_fonts_make_no_difference(every: Mapping[str, Callable[[], Figure]], name: str) -> None:
    from twindisc_cli.figures.style import house_style

    with house_style():
        matplotlib.rcParams["font.family"] = "DejaVu Serif"
        image = picture(every[name]())
    assert differing(image, reference(name)) <= FEW
