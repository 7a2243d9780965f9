"""A figure, and each of its panels, as files: the same bytes for the same figure."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 150
"""Pixels an inch, unless others are asked for."""
_PLACES = 7
"""Decimals of a place on the page, as a share of its width or height."""
_UNDATED: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
    "svg": {"Date": None, "Creator": None},
}
"""What matplotlib would note of the day and of itself, by format."""
PROVENANCE = "provenance"
"""What the text on a figure is called that says where its data are from: it stays on every panel."""
_STAMP, _PAD = 0.08, 0.05
"""From a panel down to the line that says where its data are from, and around both [inch]."""


def png(figure: Figure) -> bytes:
    """The figure as PNG, without the date and the version of the program that drew it."""
    return drawn_as(figure, "png", DPI)


def drawn_as(figure: Figure, form: str, dpi: int, *, tight: bool = False) -> bytes:
    """The figure in a format that matplotlib knows; tight: cut to what is visible on it."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    buffer = io.BytesIO()
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    with matplotlib.rc_context({"svg.hashsalt": "twindisc", "pdf.fonttype": 42}):
        _lay_out(figure)
        if form == "png" and not tight:
            canvas.print_png(buffer, metadata=_UNDATED[form])  # type: ignore[no-untyped-call]
        else:
            cut: dict[str, Any] = {"bbox_inches": "tight", "pad_inches": _PAD} if tight else {}
            figure.savefig(buffer, format=form, dpi=dpi, metadata=_UNDATED[form], **cut)
    return buffer.getvalue()


def drawn_files(name: str, figure: Figure, formats: Sequence[str], dpi: int, *, panels: bool) -> dict[str, bytes]:
    """The files of a figure by name; with panels NAME-a, NAME-b, ... too, where it has several. It is used up then."""
    files = {f"{name}.{form}": drawn_as(figure, form, dpi) for form in formats}
    lettered = {letter: axes for axes in figure.axes if (letter := _letter(axes))} if panels else {}
    if lettered:
        figure.suptitle("")
    for letter, panel in lettered.items():
        others = [axes for axes in figure.axes if axes not in lettered.values()]
        _leave_visible(figure, [panel, *(axes for axes in others if _belongs(axes, panel))])
        files |= {f"{name}-{letter}.{form}": drawn_as(figure, form, dpi, tight=True) for form in formats}
    return files


def _letter(axes: Axes) -> str:
    """The letter of a panel, as it stands before its title; "" where it has none."""
    match = re.match(r"\$\\mathbf\{\((\w)\)\}\$", axes.get_title(loc="left"))
    return match[1] if match else ""


def _belongs(axes: Axes, panel: Axes) -> bool:
    """Whether axes are a part of a panel: they share its abscissa, or are the scale of its colours."""
    scale = getattr(axes, "_colorbar", None)
    return panel.get_shared_x_axes().joined(panel, axes) or (scale is not None and scale.mappable.axes is panel)


def _leave_visible(figure: Figure, group: Sequence[Axes]) -> None:
    """Leave one panel, without its letter, and below it where its data are from."""
    from matplotlib.transforms import Bbox

    panel = group[0]
    panel.set_title(panel.get_title(loc="left").partition("}$")[2].strip(), loc="left")
    for axes in figure.axes:
        axes.set_visible(axes in group)
    boxes = [box for axes in group if (box := axes.get_tightbbox()) is not None]
    box = Bbox.union(boxes).transformed(figure.transFigure.inverted())
    for text in figure.texts:
        text.set_visible(text.get_gid() == PROVENANCE)
        if text.get_visible():
            text.set(x=box.x0, y=box.y0 - _STAMP / figure.get_figheight(), va="top")


def _lay_out(figure: Figure) -> None:
    """Place the panels, once for all formats.

    The solver of matplotlib's layout takes its unknowns in the order of their addresses: the last digits of the
    places, and here and there a pixel, would be others in every process.
    """
    if (engine := figure.get_layout_engine()) is None:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    for axes in figure.axes:
        left, bottom, width, height = (round(float(v), _PLACES) for v in axes.get_position(original=True).bounds)
        axes.set_position((left, bottom, width, height))
    for text in figure.texts:
        x, y = text.get_position()
        text.set_position((round(float(x), _PLACES), round(float(y), _PLACES)))
