"""Make paths_hertz.npz and paths_half_space.npz of twindisc_cli/model: `python -m table_makers.paths`.

Rigs of all curvature ratios of `path_table` are integrated over all of its sections and wanders, on four times the
strips of `grid` or more and with half the steps, in several integrations whose strips suit their sections. What strips
and steps leave of noise is smoothed by a spline over t. Loads and wear indices across the patch are given by principal
components. Eight minutes on one core; made again from nothing, the numbers are the same to the last bit.

Against the integration on four times the strips with half the steps, at 40 places drawn between the nodes (`make
bench`), from S1, the shortest path that is asked for, to 1000 S1:

                          hertz      half_space
    greatest depth        0.01 %     0.04 %
    area                  0.02 %     0.2 % at 95 % of the nodes
    p0                    0.02 %     1 % at 95 % of the nodes; `pressure_error` tells up to 14 % on deep tracks, whose
                                     pressure at the shoulders no strips resolve
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from twindisc_cli.model import path_table
from twindisc_cli.model.experiment import Contact, Disc, Floats, Rig
from twindisc_cli.model.integration import Pressed, Setup, integrate
from twindisc_cli.model.points import Mask
from twindisc_cli.model.wear_path import grid, path
from twindisc_cli.physics.half_space.strips import StripContact

ENDS = (0.0, 2.0, 16.0, 128.0, 512.0, path_table.MOST)
"""Sections over S1 at which an integration with wider strips takes over."""
FINER = {"hertz": (4, 0.02), "half_space": (4, 0.03)}
"""How many times the strips of `grid`, at least, and the growth of the section in a step."""
WIDEST = 0.025
"""Width of a strip over half of the width of the patch where an integration takes over, at most."""
LARGEST = 32767
"""Numbers are kept as integers of at most this size."""
LOADS = 20
"""Principal components of the loads."""
PLACES = {"hertz": 4, "half_space": 12}
"""Principal components of the wear indices."""
COARSE = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 65))
"""Places over the half-width at which loads are smoothed."""


@dataclass(frozen=True)
class Integrations:
    """All integrations of one rig: numbers as in the table at t (node, number), loads in the middle of steps (step,
    place).

    loads: C at the COARSE places less that of a parabola; spread: wear index over the mean (node, creepage,
    place).
    """

    t: Floats
    numbers: Floats
    spread: Floats
    middle: Floats
    loads: Floats


def rig_of(ratio: float) -> Rig:
    """A straight disc on a crowned one with this ratio of the curvatures."""
    steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": 7e9}
    return Rig(Disc(0.03, np.inf, **steel), Disc(0.03, 0.015 / ratio, **steel), normal_load=72.0, rolling_speed=9.42)


def integrated(contact: Contact, ratio: float, wander: float) -> Integrations:
    """March through the sections of the table; wander over b."""
    rig = rig_of(ratio)
    b, unit = float(rig.patch.b), grid.first_section(rig)
    parts, strips = [], []
    for begin, end in pairwise(ENDS):
        y, nodes = _grids(rig, contact, begin, end, wander)
        found = integrate(Setup(rig, contact, wander * b), y, nodes)
        kept = (nodes >= begin * unit) & ((nodes < 0.999 * end * unit) | (end == ENDS[-1]))
        parts.append((_t(nodes[kept] / unit), *_read(rig, found.contact, y, kept)))
        middle = 0.5 * (nodes[1:] + nodes[:-1])
        inside = (middle >= begin * unit) & (middle < end * unit)
        strips.append((_t(middle[inside] / unit), y / b, found.carried[0][inside]))
    t, numbers, half_width, spread = (np.concatenate([part[i] for part in parts]) for i in range(4))
    width = smooth(t, np.log(half_width))
    noise = np.abs(numbers[:, 3] - smooth(t, numbers[:, 3])(t))
    numbers[:, 0], numbers[:, 7] = width(t), np.expm1(np.maximum.accumulate(noise))
    middle = np.append(0.0, np.concatenate([at for at, _, _ in strips]))
    across, carried = np.exp(width(middle[1:])), [(y, row) for _, y, load in strips for row in load]
    loads = [_within(y, row, float(w)) for w, (y, row) in zip(across, carried, strict=True)]
    return Integrations(t, numbers, spread, middle, np.concatenate([np.zeros((1, len(COARSE))), loads]))


def _grids(rig: Rig, contact: Contact, begin: float, end: float, wander: float) -> tuple[Floats, Floats]:
    """Strips, and nodes [m2] up to `end`, half as many long before `begin`; both sections over S1."""
    (times, growth), b, unit = FINER[contact], float(rig.patch.b), grid.first_section(rig)
    y, nodes = grid.strips_of(rig, end * unit, wander * b), grid.nodes_to(rig, end * unit, growth)
    widest = WIDEST * b * max(1.0, np.cbrt(begin))
    fine = refined(y, max(times, int(np.ceil((y[1] - y[0]) / widest))))
    early = nodes < 0.5 * begin * unit
    return fine, np.concatenate([nodes[early][::2], nodes[~early]])


def _t(section: Floats) -> Floats:
    return np.asarray(np.log1p(section / path_table.FIRST))


def refined(y: Floats, times: int) -> Floats:
    """So many strips for each of y."""
    middle = times * (len(y) // 2)
    return np.asarray(y[-1] / middle * np.arange(-middle, middle + 1))


def _read(rig: Rig, found: Pressed, y: Floats, kept: Mask) -> tuple[Floats, Floats, Floats]:
    """Numbers (the half-width is yet to come), half-width over b, and spread at the nodes kept."""
    a, b, p0 = (float(value) for value in (rig.patch.a, rig.patch.b, rig.patch.p0))
    own = {name: getattr(found, name)[0][kept] for name in ("a", "b", "p0", "area", "square", "stiffening")}
    logs = [np.log(v) for v in (own["a"] / a, own["b"] / b, own["p0"] / p0, own["area"] / (np.pi * a * b))]
    load, none = found.line_load[0][kept], np.zeros_like(own["a"])
    numbers = np.stack([none, *logs, own["square"], own["stiffening"] - 1.0, none], axis=-1)
    ellipse = bool(np.all(own["square"] == 0.0))
    half_width = own["b"] if ellipse else StripContact(y, load, load, np.zeros(())).extent[1]
    return numbers, half_width / b, path.spread_of(y, load, found.intensity[0][kept], own["area"])


def _within(y: Floats, load: Floats, half_width: float) -> Floats:
    """C at the COARSE places less that of a parabola, of the load of the strips (strip,)."""
    middle = len(y) // 2
    borders = np.append(0.0, y[middle:] + 0.5 * (y[1] - y[0]))
    sums = np.cumsum(np.concatenate([[0.0, 0.5 * load[middle]], load[middle + 1 :]]))
    within = np.interp(COARSE * half_width, borders, 0.5 * sums / sums[-1])
    within[-1] = 0.5
    return np.asarray(within - (0.75 * COARSE - 0.25 * COARSE**3))


def smooth(t: Floats, values: Floats) -> Callable[[Floats], Floats]:
    """The cubic spline over t with a knot at each of the table's nodes that fits values (node, ...) best."""
    from scipy.interpolate import make_lsq_spline

    ends = path_table.NODES[[0, -1]]
    knots = np.concatenate([np.repeat(ends[0], 4), path_table.NODES[2:-2], np.repeat(ends[1], 4)])
    found: Callable[[Floats], Floats] = make_lsq_spline(np.clip(t, *ends), values, knots)
    return found


def make(contact: Contact) -> None:
    """Write the table of a contact."""
    rows = [[integrated(contact, float(np.exp(x)), float(w)) for x in path_table.RATIOS] for w in path_table.WANDERS]
    numbers, spread, load = (
        np.array([[smooth(getattr(row, at), getattr(row, of))(path_table.NODES) for row in own] for own in rows])
        for at, of in (("t", "numbers"), ("t", "spread"), ("middle", "loads"))
    )
    numbers[:, :, 0] = 0.0  # Hertz
    mean = spread.mean(axis=(0, 1, 2))
    loads, modes = _components(load, 0 if contact == "hertz" else LOADS)
    flat = (spread - mean).reshape(*spread.shape[:3], -1)
    spreads, places = _components(flat, PLACES[contact])
    values = np.concatenate([numbers, loads, spreads], axis=-1)
    step = np.maximum(np.abs(values).max(axis=(0, 1, 2)), 1e-30) / LARGEST
    np.savez_compressed(
        Path(path_table.__file__).with_name(f"paths_{contact}.npz"),
        codes=np.round(values / step).astype(np.int16),
        step=step,
        modes=_finer(modes).astype(np.float32),
        spread=mean.astype(np.float32),
        places=places.reshape(-1, *mean.shape).astype(np.float32),
    )


def _components(values: Floats, count: int) -> tuple[Floats, Floats]:
    """The first principal components (count, place) of values (..., place), and their sizes (..., count)."""
    rows = values.reshape(-1, values.shape[-1])
    _, _, right = np.linalg.svd(rows, full_matrices=False)
    return (rows @ right[:count].T).reshape(*values.shape[:-1], count), right[:count]


def _finer(modes: Floats) -> Floats:
    """Modes at the COARSE places, at those of the table."""
    from scipy.interpolate import CubicSpline

    if not len(modes):
        return np.zeros((0, len(path_table.ETA)))
    angles = np.linspace(0.0, 1.0, len(path_table.ETA))
    fine = CubicSpline(np.linspace(0.0, 1.0, len(COARSE)), modes, axis=1)(angles)
    fine[:, [0, -1]] = 0.0
    return np.asarray(fine)


if __name__ == "__main__":
    for chosen in ("hertz", "half_space"):
        make(chosen)
