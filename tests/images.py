"""Figures as images without letters, compared with kept references.

Every text, legend and table is taken away and the panels stand where the grid puts them, so that fonts make no
difference; what is left are curves, points, bars, maps and ticks. A pixel agrees where one of its neighbours in the
other image is as bright; a curve that moved by 1 % of its axis does not.

    python -m tests.images          makes the references again, after a figure was changed on purpose: look at them
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray
from PIL import Image

Pixels = NDArray[np.uint8]
REFERENCES = Path(__file__).parent / "reference" / "figures"
DPI, LEVELS, FEW = 150, 40, 30
"""Pixels an inch; brightness (of 255) by which pixels may differ, below the 47 of the palest bars on white; pixels that
may: where lines cross, versions of matplotlib differ in a few."""


def picture(figure: Figure) -> Pixels:
    """The brightness of a figure's pixels without its letters, (row, column)."""
    from twindisc_cli.figures.style import house_style

    figure.set_layout_engine("none")
    for axes in figure.axes:
        if (legend := axes.get_legend()) is not None:
            legend.remove()
        for table in list(axes.tables):
            table.remove()
    for text in figure.findobj(Text):
        text.set_visible(False)
    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)
    with house_style():
        canvas.draw()
    return np.asarray(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("L"))


def differing(one: Pixels, other: Pixels) -> int:
    """Pixels of either image that no pixel of the other agrees with, at the same place or beside it."""
    if one.shape != other.shape:
        return one.size
    return max(_unmatched(one, other), _unmatched(other, one))


def _unmatched(one: Pixels, other: Pixels) -> int:
    padded = np.pad(other.astype(np.int16), 1, mode="edge")
    rows, columns = one.shape
    near = np.full(one.shape, 255, dtype=np.int16)
    for down in range(3):
        for right in range(3):
            near = np.minimum(near, np.abs(one - padded[down : down + rows, right : right + columns]))
    return int(np.sum(near > LEVELS))


def figures() -> Mapping[str, Callable[[], Figure]]:
    """The figures of the paper, and one of each command, by the name of their reference."""
    from definitions import outcome, shipped

    from twindisc_cli.commands import paper

    found = dict(paper.run(shipped("ambient"), shipped("cryogenic")).figures)
    for command in ("friction-chart", "identify-mu", "simulate-wear", "fit-k", "thermal", "contact", "check"):
        if (draw := outcome("ambient", command).figure) is not None:
            found[command] = draw
    found["fit-k-sensitivity"] = outcome("ambient", "fit-k").figures["fit-k-sensitivity"]
    return found


def drawn(draw: Callable[[], Figure]) -> Figure:
    """A figure as the program draws it."""
    from twindisc_cli.figures.style import house_style

    with house_style():
        return draw()


def main() -> None:
    """Make the references again."""
    REFERENCES.mkdir(parents=True, exist_ok=True)
    for name, draw in figures().items():
        Image.fromarray(picture(drawn(draw))).quantize(16).save(REFERENCES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    import sys

    sys.path.insert(0, str(Path(__file__).parent))
    main()
