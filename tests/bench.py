"""Measured numbers beside their targets: `make bench`, or `python tests/bench.py [--seed N] SECTION ...` for some.

Accuracy against closed forms and CONTACT (tests/reference, and the tables of the tests), speed as the fewest processor
seconds of several runs, peak memory of each command as a process of its own. Nothing is asserted; a part that cannot
run says why.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import bench_campaigns
import bench_contact
import bench_loop
import bench_physics
import numpy as np
from rigs import solve_rolling

ROOT = Path(__file__).parents[1]
CONFIGS = ROOT / "configs"
REFERENCE = Path(__file__).parent / "reference"
A, B, P0, APPROACH = 0.170591303e-3, 0.270524050e-3, 744.9225410e6, 2.1897674474e-6
"""Hertz of the rig: CONTACT, open-source release 2025-07-23, rev 2707, and elliptic integrals, to all digits."""
G, NU, LOAD, SPEED, MU = 79.3e9, 0.3, 72.0, 9.42, 0.6
HARDNESS = 700 * 9.80665e6
COMMANDS = ("friction-chart", "identify-mu", "simulate-wear", "fit-k", "thermal", "contact", "check")


@dataclass(frozen=True)
class Row:
    """A number beside its target; met is None where there is nothing to meet."""

    what: str
    found: str
    target: str = ""
    met: bool | None = None


def at_most(what: str, value: float, limit: float, unit: str = "", digits: str = ".3g") -> Row:
    """A number that should not be larger than its target."""
    return Row(what, f"{value:{digits}} {unit}".rstrip(), f"<= {limit:g} {unit}".rstrip(), bool(value <= limit))


def best(function: Callable[[], object], repeats: int = 5) -> float:
    """Processor seconds of the quickest of several calls, on a busy machine too."""
    times = []
    for _ in range(repeats):
        start = process_time()
        function()
        times.append(process_time() - start)
    return min(times)


def table(name: str) -> tuple[np.ndarray, ...]:
    """The columns of a reference table."""
    lines = [line for line in (REFERENCE / name).read_text().splitlines() if not line.startswith("#")]
    return tuple(np.loadtxt(lines, delimiter=",", skiprows=1).T)


# --- contact physics --------------------------------------------------------------------------------------------------


def hertz_and_kalker() -> Iterator[Row]:
    from test_kalker import CONTACT

    from twindisc_cli.physics import hertz, kalker

    found = hertz.contact_ellipse(
        curvature_x=2.0 / 0.03, curvature_y=1.0 / 0.03, normal_load=LOAD, effective_modulus=G / (1.0 - NU)
    )
    pairs = zip((found.a, found.b, found.p0, found.approach), (A, B, P0, APPROACH), strict=True)
    yield at_most("Hertz of the rig: a, b, p0, approach, largest deviation", worst(pairs), 5e-9)
    nu, ratio, *columns = CONTACT.T
    known = kalker.coefficients(ratio, nu)
    for name, column in zip(("c11", "c22", "c23"), columns, strict=False):
        off = np.abs(getattr(known, name) / column - 1.0).max() * 100.0
        yield at_most(f"{name.upper()} against CONTACT, all nu and a/b", off, 1.0, "%")
    low = ratio < 3.0
    off = np.abs(known.c33[low] / columns[3][low] - 1.0).max() * 100.0
    yield at_most("C33 against CONTACT, a/b below 3", off, 2.0, "%")


def worst(pairs: Any) -> float:
    """Largest relative deviation of found from expected."""
    return max(float(np.max(np.abs(np.asarray(found) / expected - 1.0))) for found, expected in pairs)


def line_contact() -> Iterator[Row]:
    from scipy.optimize import brentq

    from table_makers.strips import solve_strips
    from twindisc_cli.physics import exact, fastrip, hertz, line_contact

    xi = np.linspace(0.0, 3.0, 301)
    carter = 1.0 - (1.0 - np.minimum(0.5 * xi, 1.0)) ** 2
    yield at_most("line, T/(mu N) against Carter", np.abs(line_contact.saturation(xi, "exact") - carter).max(), 1e-3)
    n, ends = 96, 16.0
    x, y = (2.0 * np.arange(n) + 1.0) / n - 1.0, ends * ((2.0 * np.arange(33) + 1.0) / 33 - 1.0)
    pressure = 1e-3 * np.sqrt(1.0 - x**2) * np.ones((33, 1))
    off = []
    for share in (0.2, 0.4, 0.6, 0.8):
        given = {"mu": 1.0, "shear_modulus": 1.0, "poisson": NU, "creepage_x": 2.0 * share * 1e-3 * (1.0 - NU)}
        found = solve_rolling(x=x, y=y, pressure=pressure, **given).traction[0, 16].sum() / pressure[16].sum()
        off.append(abs(found - 1.0 + (1.0 - share) ** 2))
    yield at_most("  against the half-space solver, middle of a strip 16 times as wide as long", max(off), 0.01)

    def patch(crown: float) -> Any:
        return hertz.contact_ellipse(curvature_x=85.1, curvature_y=crown, normal_load=7233.0, effective_modulus=1.1e11)

    slender = patch(np.exp(brentq(lambda log: patch(np.exp(log)).a / patch(np.exp(log)).b - 0.02, -14.0, 0.0)))
    line = line_contact.line_contact(
        curvature=85.1, normal_load=0.75 * 7233.0, width=slender.b, effective_modulus=1.1e11
    )
    off = [abs(float(of / one) - 1.0) * 100.0 for of, one in ((slender.a, line.a), (slender.p0, line.p0))]
    yield at_most("  a crowned pair at a/b = 0.02: a and p0 of its middle", max(off), 1.0, "%")
    known = fastrip.saturation(xi[1:])
    off = np.abs(exact.saturation(xi[1:], 0.02, NU) / known - 1.0).max() * 100.0
    yield at_most("  T/(mu N), against Carter strip by strip", off, 1.0, "%")
    half = 1.2 * float(slender.b)
    strips = np.linspace(-half, half, 241)
    crown = float(brentq(lambda c: patch(c).b / slender.b - 1.0, 1e-6, 1.0))
    gap = 0.5 * crown * strips**2
    found = solve_strips(y=strips, gap=gap, curvature_x=85.1, normal_load=7233.0, effective_modulus=1.1e11)
    off = abs(float(found.half_length.max() / line.a) - 1.0) * 100.0
    yield at_most("  its half-length by the strip solver, against the line", off, 1.0, "%")


def rig_patch(mu: Any = MU) -> Any:
    """The patch of the rig, with CONTACT's coefficients of its own FASTSIM."""
    from twindisc_cli.physics import fastsim

    return fastsim.Patch(A, B, LOAD, mu, G, 3.9388, 3.2194, 1.0911)


def fastsim_accuracy() -> Iterator[Row]:
    import test_fastsim

    from twindisc_cli.physics import fastsim

    mu, creepage, ratio = table("creep_curves_fastsim.csv")
    closed = mu * fastsim.saturation(G * A * B * 3.9388 * creepage / (mu * LOAD))
    yield at_most(f"FASTSIM T/N, closed form, {len(mu)} points", np.abs(closed - ratio).max(), 0.003)
    integrated = fastsim.solve(rig_patch(mu), creepage_x=creepage, speed=SPEED).force_x / LOAD
    yield at_most(f"FASTSIM T/N, integrated on 50x50, {len(mu)} points", np.abs(integrated - ratio).max(), 0.003)
    off = []
    for rates, widths, expected in test_fastsim.test_kalkers_published_check_values.pytestmark[0].args[1]:
        widths = np.asarray(widths if np.ndim(widths) else [widths], dtype=float)
        y = 1.0 - np.cumsum(widths) + 0.5 * widths
        cell = 2.0 * np.sqrt(1.0 - y**2) / 5 * widths
        driven = tuple(np.array([rate], dtype=float) for rate in rates)
        cells = fastsim.march(driven, y=y, nx=5)
        total = sum(np.array([(tx * cell).sum(), (ty * cell).sum()]) for _, tx, ty, _ in cells)
        forces = np.abs(total) * 2.0 / np.pi
        off += [abs(f / e - 1.0) for f, e in zip(forces, expected, strict=True) if e]
    yield at_most("FASTSIM, Kalker's five check values of 1982", max(off) * 100.0, 0.5, "%")


def fastsim_energy() -> Iterator[Row]:
    import test_fastsim

    from twindisc_cli.physics import fastsim

    case = test_fastsim.combined()
    found = fastsim.solve(rig_patch(), **case)
    power = SPEED * (
        case["creepage_x"] * found.force_x + case["creepage_y"] * found.force_y + case["spin"] * found.moment
    )
    summed = found.power_per_length.sum(axis=-1) * 2.0 * B / found.y.shape[-1]
    off = np.abs(summed / power - 1.0).max() * 100.0
    yield at_most("energy balance of 36 combined creepages, 50x50 (closed by construction)", off, 0.5, "%")
    creepage = np.array([0.001, 0.002, 0.004, 0.008])
    exact = SPEED * creepage * MU * LOAD * fastsim.saturation(G * A * B * 3.9388 * creepage / (MU * LOAD))
    errors = []
    for n in (25, 50, 100, 200):
        integrated = fastsim.solve(rig_patch(), creepage_x=creepage, speed=SPEED, nx=n, ny=n)
        errors.append(np.abs(integrated.power_per_length.sum(axis=-1) * 2.0 * B / n / exact - 1.0).max() * 100.0)
    yield at_most("power over the strips against the closed form, 50x50", errors[1], 0.5, "%")
    order = np.log2(errors[0] / errors[-1]) / 3.0
    yield Row("  its order of convergence, 25x25 to 200x200", f"{order:.2f}", ">= 1", bool(order >= 1.0))


def fastsim_speed() -> Iterator[Row]:
    from twindisc_cli.physics import fastsim

    rng = np.random.default_rng(1)
    vx, vy = rng.uniform(0.0, 0.01, (2, 1000))
    spin = rng.uniform(-14.0, 14.0, 1000)

    def batch() -> None:
        fastsim.solve(rig_patch(), creepage_x=vx, creepage_y=vy, spin=spin, speed=SPEED)

    yield at_most("FASTSIM 50x50 with spin, a point of a batch of 1000", best(batch) * 1e3, 25.0, "us")


# --- friction ---------------------------------------------------------------------------------------------------------


def friction() -> Iterator[Row]:
    from twindisc_cli.commands.friction_chart import FAMILY
    from twindisc_cli.identify.chart import friction_chart
    from twindisc_cli.identify.friction import mu_from_traction
    from twindisc_cli.identify.law import unworn_law

    test = shipped("ambient").experiment
    for traction in ("fastsim", "fastrip", "exact"):
        law = unworn_law(with_options(test, traction=traction))
        mu = np.linspace(0.05, 0.7, 40)[:, None]
        creepage = np.geomspace(1e-5, 0.999 * law.full_slip * mu / law.slope)[:, :, 0].T
        back = mu_from_traction(
            law.apparent(mu, creepage), traction=lambda m, law=law, creepage=creepage: law.apparent(m, creepage)
        )
        off = np.abs(back / mu - 1.0)[law.slope * creepage / mu < 0.98 * law.full_slip].max()
        yield at_most(f"identify-mu of {traction}, in partial slip", off, 1e-6)
    many = FAMILY, np.geomspace(1e-5, 0.1, 200)
    for traction in ("fastsim", "exact"):
        chosen = with_options(test, traction=traction)
        seconds = best(lambda chosen=chosen: friction_chart(chosen, mu=many[0], creepage=many[1]))
        yield at_most(f"chart of 14 mu x 200 creepages, {traction}", seconds * 1e3, 50.0, "ms")


def shipped(name: str) -> Any:
    """A shipped test."""
    from twindisc_cli.definition import load

    return load(CONFIGS / f"{name}.toml")


def with_options(experiment: Any, **options: Any) -> Any:
    """A test under other options."""
    return replace(experiment, options=replace(experiment.options, **options))


# --- wear -------------------------------------------------------------------------------------------------------------


def worn(name: str, **options: Any) -> Any:
    """The JSON of simulate-wear with nothing remembered from before."""
    from twindisc_cli.commands import simulate_wear
    from twindisc_cli.model.wear_path.provider import remembered

    remembered.cache_clear()
    test = shipped(name)
    return simulate_wear.run(replace(test, experiment=with_options(test.experiment, **options))).json


def wear_accuracy() -> Iterator[Row]:
    from twindisc_cli.commands import fit_k
    from twindisc_cli.model.wear_path import grid
    from twindisc_cli.model.wear_path.provider import remembered

    k = fit_k.run(shipped("ambient")).json
    found = worn("ambient", wear_coefficient=k["K"])
    volume, energy = (
        np.array([i[key] for i in found["iterations"]]) for key in ("worn_volume_mm3", "dissipated_energy_kJ")
    )
    off = np.abs(volume * 1e-9 * HARDNESS / k["K"] / (energy * 1e3) - 1.0).max()
    yield at_most("worn volume x H / K over dissipated energy, every iteration", off, 1e-6)
    for contact in ("hertz", "half_space"):
        before = worn("ambient", wear_coefficient=k["K"], contact=contact)
        growth, grid.GROWTH = grid.GROWTH, 0.5 * grid.GROWTH
        try:
            after = worn("ambient", wear_coefficient=k["K"], contact=contact)
        finally:
            grid.GROWTH = growth
        remembered.cache_clear()
        off = max(abs(after[key] / before[key] - 1.0) for key in ("depth_um", "width_mm")) * 100.0
        yield at_most(f"depth and width under halved steps, {contact}", off, 0.5, "%")
    yield Row("K from the test in air, depth 6 um", f"{k['K']:.3g} +- {k['K_std']:.1g}", "5e-5 ... 7e-5")
    nitrogen = worn("cryogenic", wear_coefficient=k["K"])
    off = abs(nitrogen["depth_um"] / 4.4 - 1.0) * 100.0
    yield at_most(f"  its depth in nitrogen, {nitrogen['depth_um']:.3g} um against 4.4", off, 10.0, "%")
    early = [i for i in nitrogen["iterations"] if i["time_s"] <= 2000.0][-1]
    share = early["worn_volume_mm3"] / nitrogen["worn_volume_mm3"] * 100.0
    yield at_most("  wear there before 2000 s", share, 10.0, "%")


def temperature() -> Iterator[Row]:
    from twindisc_cli.commands import thermal

    for name in ("ambient", "cryogenic"):
        found = thermal.run(shipped(name)).json
        yield Row(f"disc temperature rise, {name}", f"{found['rise_C']:.3g} K", "about 10 K")
    step = {i["time_s"]: i["temperature_C"] for i in found["iterations"]}
    fall = step[4620.0] - step[4200.0]
    yield Row("disc in nitrogen over step 11, where mu falls (4200 to 4620 s)", f"{fall:.2f} K", "< 0", fall < 0.0)


def wear_speed() -> Iterator[Row]:
    from twindisc_cli.commands import fit_k
    from twindisc_cli.model.wear_path.provider import remembered

    def fit() -> None:
        remembered.cache_clear()
        fit_k.run(shipped("ambient"))

    fit()
    seconds = best(lambda: worn("ambient", wear_coefficient=5.7e-5))
    yield at_most("simulate-wear, ambient, definition and data read", seconds, 0.05, "s")
    yield at_most("fit-k, ambient, over simulate-wear", best(fit) / seconds, 2.0, "times")
    seconds = best(lambda: worn("ambient", wear_coefficient=5.7e-5, contact="half_space"), 3)
    yield at_most("simulate-wear, ambient, half-space contact", seconds, 2.0, "s")


def wear_paths() -> Iterator[Row]:
    """Paths read off the table, against the integration on four times the strips with half the steps, at places
    between."""
    from table_makers.paths import refined, rig_of
    from twindisc_cli.model import path_table
    from twindisc_cli.model.integration import Setup, integrate
    from twindisc_cli.model.wear_path import grid
    from twindisc_cli.model.wear_path.tabulated import tabulated_path

    for contact in ("hertz", "half_space"):
        rng, depths, areas, pressures, seconds = np.random.default_rng(11), [], [], [], []
        for draw in range(40):
            rig = rig_of(float(np.exp(rng.uniform(*path_table.RATIOS[[0, -1]]))))
            section = float(np.exp(rng.uniform(0.0, np.log(1000.0)))) * grid.first_section(rig)
            wander = float(path_table.WANDERS[draw % len(path_table.WANDERS)] * rig.patch.b)
            nodes, y = grid.nodes_to(rig, section, 0.5 * grid.GROWTH), refined(grid.strips_of(rig, section, wander), 4)
            integrated = integrate(Setup(rig, contact, wander), y, nodes)
            path = tabulated_path(rig, contact, section, wander)
            seconds.append(best(lambda s=section, w=wander, r=rig, c=contact: tabulated_path(r, c, s, w)))
            middle = len(y) // 2
            strip = integrated.depth[0, -1, middle - 2 : middle + 3] @ np.array([0.125, 0.25, 0.25, 0.25, 0.125])
            depths.append(100.0 * abs(path.depth[-1, len(path.y) // 2] / strip - 1.0))
            areas.append(100.0 * np.abs(path.area / np.interp(path.section, nodes, integrated.contact.area[0]) - 1.0))
            off = 100.0 * np.abs(path.p0 / np.interp(path.section, nodes, integrated.contact.p0[0]) - 1.0)
            pressures.append((rig.patch.a / rig.patch.b, off))
        at_nodes = np.concatenate(areas)
        yield at_most(
            f"{contact}, path from the table against the integration, 40 drawn: depth", max(depths), 0.05, "%"
        )
        for name, chosen in (("a/b > 0.3", True), ("slender patches", False)):
            off = np.concatenate([of for ratio, of in pressures if (ratio > 0.3) == chosen])
            yield Row(f"  p0, 95 % of the nodes within, {name}", f"{np.quantile(off, 0.95):.3g} %")
        yield at_most("  area, 95 % of the nodes within", float(np.quantile(at_nodes, 0.95)), 0.5, "%")
        yield Row("  area, the largest (strips at the edge of the integration jump)", f"{at_nodes.max():.3g} %")
        yield at_most("  a path, median", float(np.median(seconds)) * 1e3, 2.0, "ms")


def worn_peak_pressure() -> Iterator[Row]:
    """Of half-space tracks up to three patches wide, over strips and steps, and by the full solver."""
    import rigs

    from twindisc_cli.model.wear_path import grid
    from twindisc_cli.model.wear_path.integrated import integrated_path
    from twindisc_cli.physics.half_space.normal import solve_profile

    rig, sections = rigs.rig(), np.array([3e-10, 1e-9, 1.8e-9])
    usual = grid.STRIPS, grid.GROWTH
    found, peaks = {}, {}
    steps = [(121, growth) for growth in (0.24, 0.12, 0.06, 0.03, 0.015)]
    strips = [(count, 0.06) for count in (61, 121, 241, 481)]
    try:
        for grid.STRIPS, grid.GROWTH in {*steps, *strips}:
            integrated_path.cache_clear()
            path = integrated_path(rig, "half_space", grid.tier(rig, 1e-9), 0.0, None)
            found[grid.STRIPS, grid.GROWTH] = path
            peaks[grid.STRIPS, grid.GROWTH] = np.interp(sections, path.section, path.p0)
    finally:
        grid.STRIPS, grid.GROWTH = usual
        integrated_path.cache_clear()
    path = found[121, 0.06]
    node = int(np.searchsorted(path.section, 1e-9))
    near = [found[key] for key in ((61, 0.06), (241, 0.06), (121, 0.03))]
    off = max(abs(np.interp(path.section[node], f.section, f.p0) / path.p0[node] - 1.0) for f in near)
    yield at_most("peak pressure of a worn track: half and twice the strips, half the step", off * 100.0, 0.5, "%")
    for name, row in (("steps", steps), ("strips", strips)):
        finest = peaks[row[-1]]
        off = [np.sqrt(np.mean((peaks[key] / finest - 1.0) ** 2)) for key in row[:3]]
        order = float(np.log2(off[0] / off[2]) / 2.0)
        told = f"{order:.2f} ({', '.join(f'{100.0 * o:.2g}' for o in off)} %)"
        yield Row(f"  its order over {name}, three sections, two halvings", told, ">= 1", order >= 1.0)
    full = solve_profile(
        y=path.y,
        gap=0.5 * rig.curvature_y * path.y**2 + path.depth[node],
        curvature_x=rig.curvature_x,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
    )
    yield at_most("  against the full solver", abs(path.p0[node] / full.pressure.max() - 1.0) * 100.0, 3.0, "%")


def local_wear() -> Iterator[Row]:
    """A threshold and a transition strip by strip on 60 iterations of a small rig."""
    import rigs

    from twindisc_cli.model.experiment import Options
    from twindisc_cli.model.forward import ForwardModel
    from twindisc_cli.model.wear_path import grid
    from twindisc_cli.model.wear_path.provider import remembered

    base = {"mu": np.array([0.6]), "K": np.array([6e-5]), "convection_W_K": np.array([1.6])}
    threshold = {"wear_threshold": {"threshold_N_mm2": np.array([0.7])}}
    severe = {
        "severe_wear_transition": {
            "ratio": np.array([4.0]),
            "critical_N_mm2": np.array([3.0]),
            "width": np.array([0.03]),
        }
    }
    none = {
        "severe_wear_transition": {
            "ratio": np.array([1.0 + 1e-9]),
            "critical_N_mm2": np.array([3.0]),
            "width": np.array([0.03]),
        }
    }

    def end(contact: Any, effects: Any = None) -> tuple[Any, np.ndarray, float]:
        history = rigs.history([0.002, 0.005, 0.01, 0.02, 0.01, 0.005], 10)
        model = ForwardModel(rigs.experiment(history, options=Options(contact=contact, wear_coefficient=6e-5)))
        found = model.predict(base, effects)
        seconds = best(lambda: model.predict(base, effects))
        depth = found.paths.at(lambda path: path.depth, found.section[:, -1:])[0, 0]
        return found, np.interp(np.linspace(-1e-3, 1e-3, 401), found.paths.paths[0].y, depth), seconds

    for contact in ("hertz", "half_space"):
        even, path = end(contact, none)[1], end(contact)[1]
        off = float(np.abs(even - path).max() / path.max())
        yield at_most(f"{contact}, local wear where K is the same, against the path", off, 1e-6)
        for name, effects in (("threshold", threshold), ("transition", severe)):
            found, depth, seconds = end(contact, effects)
            path, (own,) = found.paths.paths[0], found.paths.at(lambda path: path.depth, found.section[:, -1:])[0]
            volume = own.sum() * (path.y[1] - path.y[0]) / found.section[0, -1] - 1.0
            spent = np.diff(found.state.energy[0], prepend=0.0) @ found.state.wear_factor[0]
            energy = found.section[0, -1] / (6e-5 * spent / (2.0 * np.pi * 0.03 * rigs.HARDNESS)) - 1.0
            yield at_most(f"  {name}: volume and energy balance", max(abs(volume), abs(energy)), 1e-6)
            growth, grid.GROWTH = grid.GROWTH, 0.25 * grid.GROWTH
            try:
                remembered.cache_clear()
                fine = end(contact, effects)[1]
            finally:
                grid.GROWTH = growth
                remembered.cache_clear()
            yield at_most(
                "    depth, against a quarter of the step", abs(depth.max() / fine.max() - 1.0) * 100, 0.1, "%"
            )
            yield at_most("    60 iterations", seconds, 0.05, "s")


# --- exact contact ----------------------------------------------------------------------------------------------------


def centres(n: int) -> np.ndarray:
    """Centres of n elements over -1 ... 1."""
    return (2.0 * np.arange(n) + 1.0) / n - 1.0


def rolled(n: int, **given: Any) -> Any:
    """The exact solution on n x n elements over the ellipse."""

    x, y = A * centres(n), B * centres(n)
    pressure = P0 * np.sqrt(np.maximum(0.0, 1.0 - (x / A) ** 2 - (y[:, None] / B) ** 2))
    return solve_rolling(x=x, y=y, pressure=pressure, **{"mu": MU, "shear_modulus": G, "poisson": NU, **given})


def exact_traction() -> Iterator[Row]:
    from twindisc_cli.physics import exact, fastrip, fastsim, kalker

    mu, creepage, ratio = table("creep_curves_exact.csv")
    linear = G * A * B * float(kalker.coefficients(A / B, NU).c11)
    xi = linear * creepage / (mu * LOAD)
    off = np.abs(mu * exact.saturation(xi, A / B, NU) - ratio).max()
    yield at_most(f"exact T/N, table, {len(mu)} points", off, 0.001)
    yield from exact_limit(dict(zip(creepage[mu == MU], ratio[mu == MU], strict=True)))
    for name, law in (("FASTSIM", fastsim), ("FaStrip", fastrip)):
        yield Row(f"{name} against the exact theory, largest", f"{np.abs(mu * law.saturation(xi) - ratio).max():.3f}")
    one = [f"{MU * law.saturation(linear * 0.002 / (MU * LOAD)):.4f}" for law in (fastrip, fastsim)]
    yield Row("FaStrip, FASTSIM at mu = 0.6, 0.2 % (exact 0.3251)", ", ".join(one), "0.3286, 0.3160")


def friction_by_local_slip() -> Iterator[Row]:
    """The law of the catalogue takes mu from the rigid slip; the solver can take it from the slip at each place."""
    for ratio, decay in ((0.6, 2.0), (0.3, 5.0), (0.3, 10.0)):

        def law(slip: Any, ratio: float = ratio, decay: float = decay) -> Any:
            return MU * (ratio + (1.0 - ratio) * np.exp(-decay * SPEED * slip))

        off = []
        for creepage in (0.001, 0.002, 0.003, 0.004, 0.005, 0.007, 0.01, 0.02, 0.05):
            local = rolled(40, creepage_x=creepage, mu=law).force_x
            off.append((rolled(40, creepage_x=creepage, mu=float(law(creepage))).force_x - local) / (MU * LOAD))
        what = f"falling_friction, ratio {ratio:g}, {decay:g} s/m: by rigid less by local slip"
        yield Row(what, f"{100.0 * min(off):.2f} to {100.0 * max(off):.2f} % of mu N")


def exact_limit(reference: dict[float, float]) -> Iterator[Row]:
    """The solver's T/N carried to the limit, and its own error, against the reference over creepage."""
    from twindisc_cli.physics.half_space import rolling

    points, within, largest = (0.0005, 0.001, 0.002, 0.003, 0.004, 0.005), 0, 0.0
    for creepage in points:
        forces = [rolled(n, creepage_x=creepage).force_x / LOAD for n in (60, 120)]
        value, error = rolling.limit(*forces)
        off = abs(float(value) - reference[creepage])
        largest, within = max(largest, off), within + (off <= float(error) + 3e-4)
    yield at_most("exact T/N, solver on 60 and 120 carried to the limit, mu = 0.6", largest, 0.001)
    told = f"{within} of {len(points)}"
    yield Row("  within its own error (the reference's is 3e-4)", told, "all", within == len(points))


def combined_creepages() -> Iterator[Row]:
    columns = table("combined_exact.csv")
    off = np.zeros(3)
    for vx, vy, spin, *forces in zip(*columns, strict=True):
        found = rolled(120, creepage_x=vx, creepage_y=vy, spin=spin * 1e3)
        mine = np.array([found.force_x, found.force_y, found.moment * 1e3])
        off = np.maximum(off, np.abs(mine + np.array(forces)))
    shares = off / (MU * LOAD * np.array([1.0, 1.0, np.sqrt(A * B) * 1e3])) * 100.0
    of = f"exact, combined creepages, n = 120, {len(columns[0])} cases"
    yield at_most(f"{of}: Fx, Fy over mu N", max(shares[:2]), 0.5, "%")
    yield at_most(f"{of}: Mz over mu N c", shares[2], 1.0, "%")


def spin_sampling() -> Iterator[Row]:
    """Where an element takes its spin: error over mu N on 20, 40 and 80 elements against the limit, and its order."""
    from twindisc_cli.physics.half_space import rolling

    cases = [(2e-3, -1e-3, 14.0), (0.0, 1e-3, 7.0), (1e-3, 2e-3, -10.0), (5e-4, 0.0, 4.0)]
    found, kept = {}, rolling.SPIN_AHEAD
    for ahead in (0.0, kept, 0.25, 0.5):
        rolling.SPIN_AHEAD = ahead
        found[ahead] = np.array([[forces_over_load(n, *case) for case in cases] for n in (20, 40, 80, 160)])
    rolling.SPIN_AHEAD = kept
    limit = 2.0 * found[kept][3] - found[kept][2]
    for ahead, values in found.items():
        off = np.sqrt(np.mean((values[:3] - limit) ** 2, axis=(1, 2))) * 100.0
        order = np.log2(off[0] / off[2]) / 2.0
        place = f"spin taken {ahead:.3g} of an element ahead, n = 80: Fx, Fy, M, root mean square (order {order:.2f})"
        yield at_most(place, off[2], 0.25, "%") if ahead == kept else Row(place, f"{off[2]:.3g} %")


def forces_over_load(n: int, vx: float, vy: float, phi: float) -> list[float]:
    """Forces over mu N, and the moment over mu N and its arm, on n x n elements."""
    from twindisc_cli.physics import spin

    found = rolled(n, creepage_x=vx, creepage_y=vy, spin=phi)
    return [value / (MU * LOAD) for value in (found.force_x, found.force_y, found.moment / float(spin.arm(A, B)))]


def law_with_spin() -> Iterator[Row]:
    """Cases drawn over the range of a twin-disc: yaw within 40 mrad, tilt within 100 mrad, a/b from 0.05 to 5."""
    rng = np.random.default_rng(7)
    count = 500
    ratio, nu = np.geomspace(0.05, 5.0, count), rng.uniform(0.2, 0.4, count)
    mu, pressure = rng.uniform(0.05, 0.7, count), rng.uniform(0.4e9, 1.5e9, count)
    size = 10.0 ** rng.uniform(-4.0, -2.5, count)
    vx = 10.0 ** rng.uniform(-4.0, -1.0, count)
    vy, phi = rng.uniform(-0.04, 0.04, count) * rng.uniform(0, 1, count) ** 3, rng.uniform(-0.1, 0.1, count) / 0.03
    drawn = np.array([ratio, nu, mu, pressure / G, size, vx, vy, phi])
    off = np.array([np.abs(law_of(*case) - solved(*case)) for case in drawn.T]) * 100.0
    largest = np.max(off[:, :2], axis=1)
    what = f"law with yaw and tilt against the solver's limit from 40 and 80 elements, {count} cases"
    yield at_most(f"{what}: Tx, Ty over mu N, 95 % within", float(np.quantile(largest, 0.95)), 0.5, "%")
    yield at_most("  the largest", float(largest.max()), 1.5, "%")
    yield at_most("  spin moment over mu N and its arm, 95 % within", float(np.quantile(off[:, 2], 0.95)), 1.0, "%")
    turned = np.abs(law_of(0.63, NU, MU, P0 / G, 2.1e-4, 0.002, 0.001, 14.0) - law_of(
        0.63, NU, MU, P0 / G, 2.1e-4, 0.002, -0.001, 14.0))[0]  # fmt: skip
    yield Row("  T/(mu N) with yaw against tilt, less with both of one sign", f"{turned:.4f}", "0.0034 (CONTACT)")


def law_of(ratio: float, nu: float, mu: float, p0: float, c: float, vx: float, vy: float, phi: float) -> np.ndarray:
    """Tx, Ty over mu N and M over mu N and its arm by the table; p0 over G, c = sqrt(ab) [m]."""
    from twindisc_cli.physics import exact, kalker, spin

    a, b, known = c * np.sqrt(ratio), c / np.sqrt(ratio), kalker.coefficients(ratio, nu)
    per_vx, per_vy = (1.5 / (np.pi * mu * p0) * float(value) for value in (known.c11, known.c22))
    drive = per_vx * vx, per_vy * vy, float(spin.stiffness(per_vx, per_vy, a, b)) * phi
    level = exact.saturation(np.linalg.norm(drive), ratio, nu)
    return np.array([float(level * part) for part in spin.quotients(*drive, ratio, nu)])


def solved(ratio: float, nu: float, mu: float, p0: float, c: float, vx: float, vy: float, phi: float) -> np.ndarray:
    """The same by the solver on 40 and 80 elements; creepage follows each grid's own load, as the table's does."""
    from twindisc_cli.physics import spin

    a, b, found = c * np.sqrt(ratio), c / np.sqrt(ratio), []
    for n in (40, 80):
        x, y = a * centres(n), b * centres(n)
        pressure = p0 * np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2))
        capacity = mu * pressure.sum() * (x[1] - x[0]) * (y[1] - y[0])
        given = {"mu": mu, "shear_modulus": 1.0, "poisson": nu, "creepage_x": vx, "creepage_y": vy, "spin": phi}
        one = solve_rolling(x=x, y=y, pressure=pressure, **given)
        found.append(np.array([one.force_x, one.force_y, one.moment / float(spin.arm(a, b))]) / capacity)
    return np.asarray(2.0 * found[1] - found[0])


def figure_4() -> Iterator[Row]:
    found = rolled(120, creepage_x=0.002)
    off = abs(found.stick_fraction / 0.655 - 1.0) * 100.0
    yield at_most(f"Fig. 4, stick fraction {found.stick_fraction:.4f} against 0.655", off, 1.0, "%")
    peak = float(np.hypot(*found.traction).max()) * 1e-6
    yield at_most(f"Fig. 4, peak traction {peak:.1f} against 397.5 MPa", abs(peak / 397.5 - 1.0) * 100.0, 1.0, "%")


def closed_forms() -> Iterator[Row]:
    import test_rolling

    a, radius, mu, creepage, load = 1e-3, 0.5, 0.3, 2.4e-4, 178.9e3
    expected = 1.0 - (1.0 - creepage * radius / (mu * a)) ** 2
    errors = []
    for n in (50, 100, 200, 400):
        x, y, pressure = test_rolling.line_contact(n, a=a, load=load, width=0.2)
        found = test_rolling.solve(x, y, pressure, mu=mu, shear_modulus=82e9, poisson=0.28, creepage_x=creepage)
        errors.append(found.force_x / (mu * pressure.sum() * found.element_area) - expected)
    order = np.log2(errors[0] / errors[-1]) / 3.0
    yield Row("Carter, order of convergence (n = 50 to 400)", f"{order:.2f}", "1", bool(abs(order - 1.0) < 0.1))
    yield Row("  error of T/(mu N) at n = 400", f"{abs(errors[-1]):.1e}")
    off = abs(test_rolling.bentall_johnson(-4.294e-4, mu=0.05))
    yield at_most("Bentall-Johnson: T/(mu N) at the creepage of free rolling", off, 0.02)


def worn_profile() -> Iterator[Row]:
    from test_strips import HERTZ, RIG, worn_gap

    from table_makers.strips import semi_width, solve_strips
    from twindisc_cli.physics.half_space import rolling
    from twindisc_cli.physics.half_space.normal import solve_profile

    y = np.linspace(-0.6e-3, 0.6e-3, 256)
    strips = solve_strips(y=y, gap=worn_gap(y), **RIG)
    full = solve_profile(y=y, gap=worn_gap(y), **RIG)
    for name, peak, width, area in (
        ("strips", strips.peak_pressure, semi_width(strips), strips.area),
        ("full", full.pressure.max(), semi_width(full), full.area),
    ):
        pairs = ((peak, 723.2e6), (width, 0.355e-3), (area, 0.173937e-6))
        yield at_most(f"worn flat, {name}: peak, half-width, area", worst(pairs) * 100.0, 1.0, "%")
    ratio, _ = rolling.limit(*[worn_traction(fineness) for fineness in (1, 2)])
    yield at_most(f"worn flat, T/N {float(ratio):.4f} at 0.2 % against 0.3738", abs(float(ratio) - 0.3738), 0.003)
    sphere = solve_strips(y=y, gap=y**2 / 60e-3, **RIG)
    found = (sphere.half_length.max(), semi_width(sphere), sphere.peak_pressure)
    yield at_most("sphere by strips against Hertz: a, b, p0", worst(zip(found, HERTZ, strict=False)) * 100.0, 0.5, "%")


def worn_traction(fineness: int) -> float:
    """T/N of the worn flat at mu = 0.6 and 0.2 %, on elements of 5 by 10 um over the fineness."""
    from test_strips import worn_gap

    from twindisc_cli.physics.half_space.normal import solve_gap

    x, y = 180e-6 * centres(72 * fineness), 460e-6 * centres(92 * fineness)
    gap = x**2 / 0.03 + worn_gap(y)[:, None]
    pressed = solve_gap(x=x, y=y, gap=gap, normal_load=LOAD, effective_modulus=G / (1.0 - NU))
    given = {"mu": MU, "shear_modulus": G, "poisson": NU, "creepage_x": 0.002}
    return solve_rolling(x=x, y=y, pressure=pressed.pressure, **given).force_x / LOAD


def worn_law() -> Iterator[Row]:
    """The forward model's T/N at mu = 0.6 in partial slip against the solver, on tracks of either contact model."""
    from test_worn import rolled

    shallow, deep = [(0.03, 2e-5), (0.03, 6e-5), (0.008, 1e-4)], [(0.03, 1e-3), (0.008, 2e-3), (0.1, 5e-3)]
    for contact, truth in (("hertz", worn_ellipse), ("half_space", worn_track)):
        for name, cases in (("shallow", shallow), ("deep", deep)):
            off = [np.abs(np.subtract(*truth(*rolled(*case, contact=contact)))).max() for case in cases]
            yield at_most(f"forward law, exact, on three {name} worn tracks, {contact}: T/N", max(off), 0.003)
    wander = {"lateral_wander": {"std_mm": np.array([0.15])}}
    off = [np.abs(np.subtract(*worn_track(*rolled(*case, effects=wander)))).max() for case in (shallow[1], deep[0])]
    yield at_most("  with a lateral wander of 0.15 mm", max(off), 0.003)


def power_of_strips() -> Iterator[Row]:
    """Power per strip in partial slip against the solver, over the largest, on patches it was not made with."""
    from test_partial_slip import off

    creepages = np.array([1.0, 1.25, 1.5, 2.0])
    for name, section in (("new", 0.0), ("worn to 4 S1", 4.0), ("worn to 40 S1", 40.0)):
        errors = np.array([off(ratio, section, 96, creepages) for ratio in (0.35, 0.8, 1.5)])
        inside, outermost, by_load = 100.0 * errors.max(axis=(0, 2))
        yield at_most(f"power of a strip, xi >= 1, on three patches {name}", inside, 2.0, "%")
        yield Row("  on the outermost fortieth of the width; taken as load", f"{outermost:.2f} %; {by_load:.0f} %")


def worn_ellipse(model: Any, found: Any) -> tuple[np.ndarray, np.ndarray]:
    """T/N of the model at the creepages in the end, and of the solver on the ellipse, from 60 and 120 elements."""
    from test_worn import CREEPAGE, at_the_end

    from twindisc_cli.physics.half_space import rolling

    rig, known, patch = model.experiment.rig, *at_the_end(model, found)
    a, b, forces = float(patch.a.item()), float(patch.b.item()), []
    for n in (60, 120):
        x, y = a * centres(n), b * centres(n)
        pressure = np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2))
        pressure *= rig.normal_load / (pressure.sum() * (x[1] - x[0]) * (y[1] - y[0]))
        given = {"mu": MU, "shear_modulus": rig.shear_modulus, "poisson": rig.poisson_ratio}
        forces.append(
            [solve_rolling(x=x, y=y, pressure=pressure, creepage_x=v, **given).force_x / LOAD for v in CREEPAGE]
        )
    return known, rolling.limit(*forces)[0]


def worn_track(model: Any, found: Any) -> tuple[np.ndarray, np.ndarray]:
    """The same on the worn profile. It and an ellipse go through the solvers on grids of as many elements: their
    difference and the law of the ellipse, 2e-4 from the solver, are free of most of the grids' errors."""
    from scipy.interpolate import CubicSpline
    from test_worn import CREEPAGE, at_the_end

    from table_makers import worn as making
    from table_makers.strips import solve_strips
    from twindisc_cli.model import worn
    from twindisc_cli.physics import exact, kalker
    from twindisc_cli.physics.half_space.strips import equivalent_ellipse

    rig, known, path = model.experiment.rig, at_the_end(model, found)[0], found.paths.paths[0]
    y, depth = path.y, found.paths.at(lambda other: np.array([np.interp(path.y, other.y, d) for d in other.depth]),
                                      found.section[:, -1:])[0, 0]  # fmt: skip
    half = min(1.3 * np.abs(y[depth > 0.02 * depth.max()]).max() + 0.5 * float(rig.patch.b), y[-1])
    fine = np.linspace(-half, half, 321)
    gap = CubicSpline(y, 0.5 * rig.curvature_y * y**2 + depth)(fine)
    strips = solve_strips(
        y=fine, gap=gap, curvature_x=rig.curvature_x, normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus, relative_accuracy=1e-4,
    )  # fmt: skip
    a, b = (float(axis) for axis in equivalent_ellipse(strips))
    stiffer, *departs = making.against_ellipse(rig, strips, gap)
    stiffness = stiffer * rig.shear_modulus * a * b * float(kalker.coefficients(a / b, rig.poisson_ratio).c11)
    xi = stiffness * np.array(CREEPAGE) / (MU * rig.normal_load)
    law = exact.saturation(xi, a / b, rig.poisson_ratio) + np.interp(xi, worn.CREEPAGES, np.append(0.0, departs))
    return known, MU * law


def contact_speed() -> Iterator[Row]:
    from test_strips import RIG, worn_gap

    from table_makers.strips import solve_strips

    limits, seconds = {60: 0.06, 120: 0.25, 240: 1.3}, {}
    rolled(20, creepage_x=0.002)
    for n in (30, 60, 120, 240):
        seconds[n] = best(lambda n=n: solve_both(n), 3)
        name = f"exact, normal and rolling, mu = 0.6, 0.2 %, n = {n}"
        yield at_most(name, seconds[n], limits[n], "s") if n in limits else Row(name, f"{seconds[n]:.3g} s")
    order = np.log(seconds[240] / seconds[30]) / np.log(8.0)
    yield Row("  its cost from n = 30 to 240 grows as n to the power", f"{order:.2f}", "about 2")
    y = np.linspace(-0.6e-3, 0.6e-3, 256)
    start = solve_strips(y=y, gap=worn_gap(y), relative_accuracy=0.01, **RIG)
    gap = worn_gap(y) + 1e-8 * np.cos(y / 1e-4)
    cold = best(lambda: solve_strips(y=y, gap=gap, relative_accuracy=0.01, **RIG)) * 1e3
    warm = best(lambda: solve_strips(y=y, gap=gap, relative_accuracy=0.01, start=start, **RIG)) * 1e3
    yield at_most("normal contact of 256 strips, 1 %, from a contact near by", warm, 5.0, "ms")
    yield at_most("normal contact of 256 strips, 1 %, from nothing", cold, 5.0, "ms")


def solve_both(n: int) -> None:
    """Normal contact and rolling on n x n elements over the patch and two more around."""
    from twindisc_cli.physics.half_space.normal import solve_gap

    share = (n + 4) / n
    x, y = share * A * centres(n + 4), share * B * centres(n + 4)
    pressed = solve_gap(
        x=x, y=y, gap=x**2 / 0.03 + y[:, None] ** 2 / 0.06, normal_load=LOAD, effective_modulus=G / (1.0 - NU)
    )
    solve_rolling(x=x, y=y, pressure=pressed.pressure, mu=MU, shear_modulus=G, poisson=NU, creepage_x=0.002)


# --- processes --------------------------------------------------------------------------------------------------------

CHILD = """
import sys
from twindisc_cli.cli import main
try:
    main(sys.argv[1:])
finally:
    peak = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
    print("peak", *peak, file=sys.stderr)
"""


def process(*arguments: str) -> tuple[float, float]:
    """Seconds and peak memory [MB] of a command as a process of its own; an exit code but 0 and 5 is an error."""
    start = perf_counter()
    done = subprocess.run([sys.executable, "-c", CHILD, *arguments], capture_output=True, text=True, check=False)
    seconds = perf_counter() - start
    if done.returncode not in (0, 5):
        raise RuntimeError(f"twindisc {' '.join(arguments)}: exit {done.returncode}: {done.stderr.splitlines()[:1]}")
    peak = re.search(r"peak VmHWM:\s*(\d+)", done.stderr)
    return seconds, float(peak[1]) / 1024.0 if peak else np.nan


def commands() -> Iterator[Row]:
    yield at_most("twindisc --help", min(process("--help")[0] for _ in range(5)), 0.25, "s")
    with tempfile.TemporaryDirectory() as folder:
        for command in COMMANDS:
            limit = 3.0 if command == "friction-chart" else None
            runs = [process(command, str(CONFIGS / "ambient.toml"), "-o", folder, "--force") for _ in range(2)]
            seconds, memory = min(r[0] for r in runs), max(r[1] for r in runs)
            name = f"{command}, ambient, whole process"
            yield at_most(name, seconds, limit, "s") if limit else Row(name, f"{seconds:.3g} s")
            yield at_most("  its peak memory", memory, 500.0, "MB", ".0f")


def with_rows(part: Callable[..., Iterator[object]], *whom: str) -> Callable[[], Iterator[Row]]:
    """A section of another file, which makes its rows of the functions here."""
    return lambda: part(*whom, at_most, Row)  # type: ignore[return-value]


def close_loop() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        path = three_channels(Path(folder))
        seconds, memory = process("close-loop", str(path), "-o", folder, "--force")
        yield at_most("close-loop, 3 channels, 600 traction samples", seconds, 30.0, "s")
        yield at_most("  its peak memory", memory, 1500.0, "MB", ".0f")
        for name in ("ambient", "cryogenic", "eurosprinter", "mtm_running_in"):
            seconds, memory = process("close-loop", str(CONFIGS / f"{name}.toml"), "-o", folder, "--force")
            yield Row(f"close-loop, {name}", f"{seconds:.3g} s, {memory:.0f} MB")


def three_channels(folder: Path) -> Path:
    """The test in air with falling friction, measured in all channels, 600 samples of traction, as files."""
    from twindisc_cli.definition import dump

    test = shipped("ambient")
    tables = measured_tables(test.experiment)
    for name, (header, columns) in tables.items():
        np.savetxt(folder / f"{name}.csv", np.transpose(columns), delimiter=",", header=header, comments="", fmt="%.6f")
    document = {key: dict(value) if isinstance(value, dict) else value for key, value in test.resolved.items()}
    document["measured"] = {name: f"{name}.csv" for name in tables} | {"provenance": "synthetic"}
    document["thermal"].pop("convection_W_K")
    document["test"]["name"] = "three_channels"
    document.pop("reported")
    path = folder / "three_channels.toml"
    path.write_text(dump(document), encoding="utf-8")
    return path


def measured_tables(experiment: Any) -> dict[str, tuple[str, tuple[np.ndarray, ...]]]:
    """Header and columns of each channel's table, made by the model with noise."""
    from twindisc_cli.model.experiment import Measured, ProfileSamples, TemperatureSamples, TractionSamples
    from twindisc_cli.model.forward import ForwardModel

    rng, history = np.random.default_rng(3), experiment.history
    time = np.sort(rng.uniform(0.0, history.end_time[-1], 600))
    step = history.step[np.searchsorted(history.end_time, time)]
    y, unknown = np.linspace(-1.5e-3, 1.5e-3, 401), np.full(600, np.nan)
    measured = Measured(
        traction=TractionSamples(time, step, history.step_creepage[step], unknown, unknown),
        profile=ProfileSamples(y, np.zeros(401), np.full(401, 2), np.full(401, len(history.step))),
        temperature=TemperatureSamples(time[::2], np.zeros(300)),
    )
    base = {"mu": np.array([0.6]), "K": np.array([6e-5]), "convection_W_K": np.array([3.5])}
    falling = {"falling_friction": {"ratio": np.array([0.6]), "decay_s_m": np.array([2.0])}}
    made = ForwardModel(replace(experiment, measured=measured)).predict(base, falling)
    ratio = made.traction[0] + 0.005 * rng.standard_normal(600)
    height = 1e6 * made.profile[0] + 0.05 * rng.standard_normal(401)
    celsius = made.temperature[0] - 273.15 + 0.1 * rng.standard_normal(300)
    return {
        "traction": ("time [s],creepage [%],traction ratio [1]", (time, 100.0 * history.step_creepage[step], ratio)),
        "profile": ("y [mm],height [um]", (1e3 * y, height)),
        "temperature": ("time [s],temperature [degC]", (time[::2], celsius)),
    }


SECTIONS = {
    "hertz and Kalker": hertz_and_kalker,
    "line contact": line_contact,
    "FASTSIM": fastsim_accuracy,
    "FASTSIM energy": fastsim_energy,
    "FASTSIM speed": fastsim_speed,
    "friction": friction,
    "wear": wear_accuracy,
    "temperature": temperature,
    "wear speed": wear_speed,
    "wear paths": wear_paths,
    "local wear": local_wear,
    "worn peak pressure": worn_peak_pressure,
    "exact": exact_traction,
    "friction by local slip": friction_by_local_slip,
    "combined": combined_creepages,
    "spin sampling": spin_sampling,
    "law with spin": law_with_spin,
    "figure 4": figure_4,
    "closed forms": closed_forms,
    "worn profile": worn_profile,
    "worn law": worn_law,
    "power of strips": power_of_strips,
    **{name: with_rows(section) for name, section in bench_contact.SECTIONS.items()},
    "contact speed": contact_speed,
    "commands": commands,
    "campaigns: workers": with_rows(bench_campaigns.workers),
    "campaigns: charts": with_rows(bench_campaigns.charts),
    "campaigns: cluster": with_rows(bench_campaigns.on_cluster),
    "campaigns: kills of a worker": with_rows(bench_campaigns.kills, "worker"),
    "campaigns: kills of the scheduler": with_rows(bench_campaigns.kills, "scheduler"),
    "campaigns: kills of the command": with_rows(bench_campaigns.kills, "command"),
    "close-loop": close_loop,
}


def drawn(section: Callable[..., Iterator[Any]], seed: int) -> Callable[[], Iterator[Row]]:
    """A section whose cases are drawn with a seed of their own."""
    return lambda: section(np.random.default_rng(seed), at_most)


def main(arguments: list[str]) -> None:
    """Print the rows of the chosen sections, or of all."""
    parser = argparse.ArgumentParser(description="Measured numbers beside their targets.")
    parser.add_argument("--seed", type=int, default=1, help="of the cases that are drawn")
    parser.add_argument("section", nargs="*", help="words in the names of sections; left out: all")
    given = parser.parse_args(arguments)
    chosen = given.section
    threads = os.environ.get("OMP_NUM_THREADS", "all")
    print(f"{os.cpu_count()} cores, {threads} threads; load of the machine now: {os.getloadavg()[0]:.1f}")
    rows: list[Row] = []
    by_seed = bench_physics.SECTIONS | bench_loop.SECTIONS
    sections = SECTIONS | {name: drawn(section, given.seed) for name, section in by_seed.items()}
    for name, section in sections.items():
        if chosen and not any(word.lower() in name.lower() for word in chosen):
            continue
        print(f"\n{name}")
        try:
            for row in section():
                rows.append(row)
                mark = {True: "met", False: "MISSED", None: ""}[row.met]
                print(f"  {row.what:<72} {row.found:>20}  {row.target:<16} {mark}", flush=True)
        except Exception as error:
            print(f"  cannot run: {type(error).__name__}: {error}", flush=True)
    judged = [row.met for row in rows if row.met is not None]
    print(f"\n{sum(judged)} of {len(judged)} targets met")


if __name__ == "__main__":
    main(sys.argv[1:])
