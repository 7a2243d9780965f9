"""Files of profilometers: maps of heights and single profiles, and the profile across the track in them.

Most are read by surfalize. Three are read here: texts of Gwyddion and of Taylor Hobson, and Sensofar's .plu, in which
surfalize 0.19 takes the size of the map, which stands before the heights, for two of them.
"""

from __future__ import annotations

import re
import struct
import warnings
from collections.abc import Callable, Mapping
from io import BytesIO

import numpy as np

from twindisc_cli.measurement.sheet import Floats

Heights = tuple[Floats, float, float]
"""A map of heights [m] (y, x) and the steps along x and y [m]."""
_BY_LIBRARY = frozenset(
    (".x3p", ".sur", ".al3d", ".plux", ".opd", ".sdf", ".gwy", ".vk3", ".vk4", ".vk6", ".vk7", ".zmg", ".os3d",
     ".nms", ".lext", ".zon", ".cag")
)  # fmt: skip
_GWYDDION = re.compile(rb"(?:\xef\xbb\xbf)?# (?:Channel|Kanal): ")
_TAYLOR_HOBSON = re.compile(rb"\s*\d+ \d+\s*\r?\n[^\n]*\bPRF\s*\r?\n(?s:.{0,400}?)\nCZ ")
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9, "pm": 1e-12}
_PLU_STEPS, _PLU_SIZE, _PLU_HEIGHTS, _PLU_UNKNOWN = 404, 500, 508, 1000001.0
"""Bytes at which a .plu holds the steps [um], lines and columns, and the heights [um]; a height that is none."""


def profilometer(data: bytes, suffix: str) -> Callable[[bytes], Heights] | None:
    """Who reads the file of a profilometer, by its first bytes and its name; None where it is none."""
    if _GWYDDION.match(data):
        return _gwyddion
    if _TAYLOR_HOBSON.match(data[:2000]):
        return _taylor_hobson
    if suffix == ".plu":
        return _sensofar
    return (lambda data: _by_library(data, suffix)) if suffix in _BY_LIBRARY else None


def _gwyddion(data: bytes) -> Heights:
    """A text of Gwyddion: a matrix of heights below its width and height."""
    text = data.decode("utf-8-sig", errors="replace")
    head = [line for line in text.splitlines() if line.startswith("#")]
    sizes = [re.search(r"([\d.,]+(?:[eE][-+]?\d+)?)\s*(\w+)\s*$", line) for line in head[1:3]]
    unit = re.search(r":\s*(\w+)\s*$", head[3]) if len(head) > 3 else None
    rows = [line.replace(",", ".").split() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    heights = np.array(rows, dtype=np.float64) * (_LENGTHS[unit[1]] if unit else 1.0)
    extent = [float(size[1].replace(",", ".")) * _LENGTHS[size[2]] for size in sizes if size]
    if len(extent) < 2:
        raise ValueError("it has no width and height")
    return heights, extent[0] / heights.shape[1], extent[1] / heights.shape[0]


def _taylor_hobson(data: bytes) -> Heights:
    """A profile of Taylor Hobson's instruments as text (.prf): head, settings and heights, each ending in EOR.

    `CX` and `CZ` name the unit and the factor of each axis, `SPACING CX` the step, and each line of the last part is a
    height. After surfile of INRiM (A. Giura), which reads it so.
    """
    head, settings, heights = (part.split("\n") for part in data.decode("cp1252").split("EOR")[:3])
    words = {line.split()[0]: line.split()[1:] for line in head if line.strip()}
    along, scale = (_LENGTHS[words[axis][2].casefold()] for axis in ("CX", "CZ"))
    step = next(float(line.split()[2]) for line in settings if line.startswith("SPACING CX"))
    values = np.array([float(line) for line in heights if line.strip()])
    return np.atleast_2d(values * scale * float(words["CZ"][3])), step * along, 1.0


def _sensofar(data: bytes) -> Heights:
    """A map or a profile of Sensofar (.plu), laid out as Gwyddion's modules/file/sensofar.c says: all lengths in um."""
    step_x, step_y = struct.unpack_from("<ff", data, _PLU_STEPS)
    rows, columns = struct.unpack_from("<II", data, _PLU_SIZE)
    heights = np.frombuffer(data, "<f4", rows * columns, _PLU_HEIGHTS).reshape(rows, columns).astype(np.float64)
    return np.where(heights == _PLU_UNKNOWN, np.nan, heights) * 1e-6, abs(step_x) * 1e-6, abs(step_y) * 1e-6


def _by_library(data: bytes, suffix: str) -> Heights:
    from surfalize import Surface

    surface = Surface.load(BytesIO(data), format=suffix)
    return np.atleast_2d(surface.data) * 1e-6, surface.step_x * 1e-6, surface.step_y * 1e-6


def across(heights: Floats, step_x: float, step_y: float) -> tuple[Mapping[str, Floats], tuple[str, ...]]:
    """The columns of the profile across the track of a map of heights [m] (y, x), and notes; the mean along the other.

    The track runs where heights change less: across it the mean profile is the deeper one.
    """
    level = heights - _plane(heights)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        means = [np.nanmean(level, axis=axis) for axis in (0, 1)]
        whole = [np.nanmean(heights, axis=axis) for axis in (0, 1)]
    along_x = heights.shape[0] == 1 or (heights.shape[1] > 1 and np.nanstd(means[0]) >= np.nanstd(means[1]))
    step, mean = (step_x, whole[0]) if along_x else (step_y, whole[1])
    lines = heights.shape[0] if along_x else heights.shape[1]
    message = (f"a map of {heights.shape[1]} x {heights.shape[0]} heights: the mean of its {lines} "
            f"{'rows' if along_x else 'columns'}, across the track as it seems")  # fmt: skip
    columns = {"y [mm]": 1e3 * step * (np.arange(len(mean)) + 0.5), "height [um]": 1e6 * mean}
    return columns, (message,) if lines > 1 else ()


def _plane(heights: Floats) -> Floats:
    """The plane through a map of heights."""
    shape: tuple[int, ...] = heights.shape
    rows, columns = np.indices(shape)
    known = np.isfinite(heights)
    design = np.column_stack([np.ones(known.sum()), rows[known], columns[known]])
    fit = np.linalg.lstsq(design, heights[known], rcond=None)[0]
    return np.asarray(fit[0] + fit[1] * rows + fit[2] * columns)
