"""Every figure of the paper and one of each command, compared as an image with a kept reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import matplotlib
import numpy as np
import pytest
from images import FEW, REFERENCES, Pixels, differing, drawn, figures, picture
from matplotlib.figure import Figure
from PIL import Image

NAMES = sorted(path.stem for path in REFERENCES.glob("*.png"))
MOVED = ("fig02", "fig06", "fig09", "fig12", "fig13", "fig14", "simulate-wear", "thermal")


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


@pytest.mark.parametrize("name", MOVED)
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


@pytest.mark.parametrize("name", ["fig02", "simulate-wear"])
def test_other_fonts_make_no_difference(every: Mapping[str, Callable[[], Figure]], name: str) -> None:
    from twindisc_cli.figures.style import house_style

    with house_style():
        matplotlib.rcParams["font.family"] = "DejaVu Serif"
        image = picture(every[name]())
    assert differing(image, reference(name)) <= FEW
