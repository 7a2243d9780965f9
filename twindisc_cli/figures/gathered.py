"""The report of a test for print: two pages of A4, what was found first, the figures behind it."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import matplotlib
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.image import imread

from twindisc_cli.figures.style import BLUE, GREY, RED
from twindisc_cli.version import __version__

if TYPE_CHECKING:
    from twindisc_cli.report.gathered import Part

PAGE = (8.27, 11.69)
"""A4 [inch]."""
MARGIN, LINE = 0.06, 0.0135
"""Of the page's width; a line of text, of its height."""
CHARACTERS = 118  # of 8 points between the margins
FIRST = 5
"""Sentences of each command on the first page; the HTML page has all."""
DPI = 200  # of a picture on paper


def pages(
    name: str, description: str, provenance: str, parts: Sequence[Part], numbers: Sequence[tuple[str, str]]
) -> bytes:
    """The pages as PDF, the same bytes for the same results."""
    buffer = io.BytesIO()
    with (
        matplotlib.rc_context({"pdf.fonttype": 42}),
        PdfPages(buffer, metadata={"CreationDate": None, "Producer": None, "Creator": None}) as book,
    ):
        drawn = [part for part in parts if part.figure]
        for figure in (
            _first(name, description, provenance, parts, numbers, drawn[0] if drawn else None),
            _second(name, drawn[1:]),
        ):
            if figure is not None:
                book.savefig(figure, dpi=DPI)
    return buffer.getvalue()


def _first(
    name: str,
    description: str,
    provenance: str,
    parts: Sequence[Part],
    numbers: Sequence[tuple[str, str]],
    leading: Part | None,
) -> Figure:
    """Title, numbers, what each command says, and the first figure."""
    figure = _blank(name)
    figure.text(MARGIN, 0.955, name, fontsize=15, fontweight="bold", va="top")
    stamp = f"{provenance} data" if provenance else ""
    figure.text(
        1 - MARGIN, 0.95, stamp, fontsize=9, color=GREY if provenance == "measured" else RED, ha="right", va="top"
    )
    figure.text(MARGIN, 0.932, "\n".join(wrap(description, CHARACTERS)[:1]), fontsize=8, color=GREY, va="top")
    top = 0.915
    for what, value in numbers:
        figure.text(MARGIN, top, what, fontsize=7.5, va="top")
        figure.text(0.45, top, value, fontsize=7.5, fontweight="bold", va="top")
        top -= LINE
    top -= 0.6 * LINE
    floor = 0.44 if leading else 0.05
    for text, bold in _sentences(parts):
        if top < floor + LINE:
            break
        figure.text(
            MARGIN, top, text, fontsize=6.8, va="top", fontweight="bold" if bold else None, color=BLUE if bold else None
        )
        top -= 0.8 * LINE
    if leading:
        _picture(figure, leading, (MARGIN, 0.04, 1 - 2 * MARGIN, min(top, floor) - 0.045))
    return figure


def _sentences(parts: Sequence[Part]) -> Iterator[tuple[str, bool]]:
    """The lines of the first page; True where one is a heading."""
    for part in parts:
        yield f"{part.title}  ({part.command})", True
        for line in part.summary[:FIRST]:
            yield from ((f"{'' if i else '· '}{text}", False) for i, text in enumerate(wrap(line, CHARACTERS + 12)[:2]))


def _second(name: str, parts: Sequence[Part]) -> Figure | None:
    """The other figures in two columns."""
    if not parts:
        return None
    figure = _blank(name)
    rows = (len(parts) + 1) // 2
    height, width = 0.92 / rows, (1 - 2 * MARGIN) / 2
    for place, part in enumerate(parts):
        left, bottom = MARGIN + (place % 2) * width, 0.965 - (place // 2 + 1) * height
        _picture(figure, part, (left + 0.005, bottom + 0.01, width - 0.01, height - 0.02))
    return figure


def _picture(figure: Figure, part: Part, box: tuple[float, float, float, float]) -> None:
    axes = figure.add_axes(box)
    axes.imshow(imread(io.BytesIO(part.figure)), interpolation="antialiased")
    axes.set_anchor("N")
    axes.set_axis_off()


def _blank(name: str) -> Figure:
    figure = Figure(figsize=PAGE)
    figure.text(MARGIN, 0.02, f"{name}: report", fontsize=6.5, color=GREY)
    figure.text(1 - MARGIN, 0.02, f"twindisc {__version__}", fontsize=6.5, color=GREY, ha="right")
    return figure
