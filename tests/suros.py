"""A made-up test of a SUROS-like rig: two straight discs, traction logged, both discs weighed between the steps.

Nothing of the program is used. The contact is Carter's, found here from his stick zone by stepping the creep forces
through the patch; what wears is counted block by block on both discs, whose radii shrink while the speeds stay, so that
the creepage drifts as it does on the rig. Balance and torque scatter.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

E_STEEL, NU, DENSITY, HARDNESS = 209e9, 0.3, 7850.0, 280 * 9.80665e6
RADIUS, WIDTH, LOAD, RPM = 23.5e-3, 10e-3, 7233.0, 400.0
CREEPAGE, BLOCKS, REVOLUTIONS = (0.5, 1.0, 2.0, 5.0, 10.0), 2, 2500
STARTS = (1, 3, 5, 7, 9)


@dataclass(frozen=True)
class Truth:
    """What is hidden: mu, K of disc 2 and of disc 1; the balance's and the torque meter's scatter.

    Both wear `severe` times as fast above a critical T gamma / A [N/mm2], and as a power of the creepage over 2 %.
    """

    mu: float = 0.42
    k: float = 3.7e-4
    k_disc1: float = 0.0
    balance_mg: float = 0.3
    torque: float = 0.003
    severe: float = 1.0
    critical: float = np.inf
    power: float = 0.0
    blocks_weighed: int = BLOCKS


def half_length(radius_1: float, radius_2: float) -> float:
    """Hertz: a^2 = 4 q R / (pi E*)."""
    radius = 1 / (1 / radius_1 + 1 / radius_2)
    return float(np.sqrt(8 * LOAD / WIDTH * radius * (1 - NU**2) / (np.pi * E_STEEL)))


def traction_ratio(mu: float, creepage: float, radius_1: float, radius_2: float, cells: int = 4000) -> float:
    """T/N: the stick zone that makes the strain mismatch the creepage, its traction summed up."""
    a = half_length(radius_1, radius_2)
    peak = 2 * LOAD / (np.pi * a * WIDTH)
    # one semi-ellipse of traction stretches both surfaces alike: total mismatch 4 mu p0 (1 - nu^2) d / (E a)
    shift = min(abs(creepage) * E_STEEL * a / (4 * mu * peak * (1 - NU**2)), a)
    x = a * ((np.arange(cells) + 0.5) / cells * 2 - 1)
    outer = np.sqrt(a**2 - x**2)
    inner = np.sqrt(np.maximum((a - shift) ** 2 - (x - shift) ** 2, 0))
    return float(np.sign(creepage) * mu * np.sum(outer - inner) / np.sum(outer))


def run(truth: Truth, rng: np.random.Generator) -> tuple[list[tuple[float, ...]], list[tuple[float, ...]]]:
    """Rows of the log (time, creepage, T/N) and of the weighings (iteration, disc, mg)."""
    spin = RPM / 60 * 2 * np.pi
    radius = [RADIUS, RADIUS]
    log, weighed, lost, time = [], [], [0.0, 0.0], 0.0
    parts = 20
    for number in range(len(CREEPAGE) * BLOCKS):
        nominal = CREEPAGE[number // BLOCKS] / 100
        omega = spin * (1 + nominal / 2), spin * (1 - nominal / 2)
        for _ in range(parts):
            speeds = radius[0] * omega[0], radius[1] * omega[1]
            speed = 0.5 * sum(speeds)
            creepage = (speeds[0] - speeds[1]) / speed
            ratio = traction_ratio(truth.mu, creepage, *radius, cells=400)
            seconds = REVOLUTIONS / parts / (RPM / 60)
            time += seconds
            energy = ratio * LOAD * creepage * speed * seconds
            index = ratio * LOAD * creepage / (2 * half_length(*radius) * WIDTH) * 1e-6
            factor = (truth.severe if index > truth.critical else 1.0) * (abs(creepage) / 0.02) ** truth.power
            for disc, k in enumerate((truth.k_disc1, truth.k)):
                volume = factor * k * energy / HARDNESS
                lost[disc] += volume * DENSITY * 1e6
                radius[disc] -= volume / (2 * np.pi * radius[disc] * WIDTH)
            log.append((time, 100 * nominal, ratio + truth.torque * rng.standard_normal()))
        if (number + 1) % truth.blocks_weighed == 0:
            discs = (1, 2) if truth.k_disc1 else (2,)
            weighed += [(number + 1, d, lost[d - 1] + truth.balance_mg * rng.standard_normal()) for d in discs]
    return log, weighed


def write(folder: Path, truth: Truth, seed: int = 1, *, profile_factor: float | None = None, more: str = "") -> Path:
    """The files of a laboratory: definition, log, weighings; a profile whose volume is off by a factor, if any."""
    log, weighed = run(truth, np.random.default_rng(seed))
    table(folder / "log.csv", "time [s],creepage [%],traction ratio [1]", log)
    rows = [(*row, truth.balance_mg) for row in sorted(weighed, key=lambda row: (row[1], row[0]))]
    table(folder / "mass.csv", "iteration,disc,mass loss [mg],uncertainty [mg]", rows)
    files = 'traction = "log.csv"\nmass = "mass.csv"\n'
    if profile_factor is not None:
        y = np.linspace(-7.0, 7.0, 400)
        y = y[np.abs(np.abs(y) - 5.0) > 0.06]
        depth = profile_factor * weighed[-1][2] * 1e-6 / DENSITY / (2 * np.pi * RADIUS * WIDTH) * 1e6
        table(folder / "profile.csv", "y [mm],height [um]", [(v, -depth if abs(v) < 5 else 0.0) for v in y])
        files += 'profile = "profile.csv"\n'
    path = folder / "suros.toml"
    path.write_text(DEFINITION + more + '\n[measured]\nprovenance = "synthetic"\n' + files, encoding="utf-8")
    return path


SPACING, IDLE = 15.0, 8
"""Seconds between rows of the raw log, and rows without load before, between and after the blocks."""
NEW_DISC_G = (174.5181, 174.2207)


def zero(time: float) -> float:
    """The zero of the torque meter [N m], which warms up."""
    return 1.8 + 0.9 * (1 - np.exp(-time / 2500))


def raw_log(log: list[tuple[float, ...]], seed: int = 1) -> list[list[tuple[float, ...]]]:
    """Rows of the raw log (time, speeds, torque, load in kN), block by block, each with a run without load before."""
    rng, time, blocks = np.random.default_rng(seed), 0.0, []
    seconds = REVOLUTIONS / (RPM / 60)
    ends, creepage, ratio = (np.array(values) for values in zip(*log, strict=True))
    for number in range(len(CREEPAGE) * BLOCKS + 1):
        rows, last = [], number == len(CREEPAGE) * BLOCKS
        slip = creepage[min(number * 20, len(log) - 1)] / 100
        speeds = RPM * (1 + slip / 2), RPM * (1 - slip / 2)
        for n in range(IDLE + (0 if last else round(seconds / SPACING))):
            loaded = n >= IDLE
            at = number * seconds + (n - IDLE + 0.5) * SPACING
            friction = float(np.interp(at, ends, ratio)) * LOAD * RADIUS if loaded else 0.1 * rng.standard_normal()
            load = LOAD / 1e3 * (1 + 0.002 * rng.standard_normal()) if loaded else 0.0
            rows.append((time, *speeds, friction + zero(time) + 0.2 * rng.standard_normal(), load))
            time += SPACING
        blocks.append(rows)
    return blocks


def raw_text(rows: list[tuple[float, ...]]) -> str:
    """A log as a laboratory's logger writes it."""
    head = ["Twin disc rig; test 17; synthetic", "Operator: nobody", ""]
    head.append("Time [s];Upper speed [rpm];Lower speed [rpm];Torque [N m];Load [kN]")
    return "\n".join([*head, *(f"{t:.1f};{a:.2f};{b:.2f};{m:.3f};{load:.4f}" for t, a, b, m, load in rows)]) + "\n"


def weights(weighed: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    """Revolutions and the weight of each disc [g], as the balance shows them."""
    stops = sorted({row[0] for row in weighed})
    lost = {(row[0], row[1]): row[2] for row in weighed}
    rows = [(0.0, *NEW_DISC_G)]
    for stop in stops:
        own = (NEW_DISC_G[disc - 1] - 1e-3 * lost.get((stop, disc), 0.0) for disc in (1, 2))
        rows.append((REVOLUTIONS * stop, *(round(value, 4) for value in own)))
    return rows


def table(path: Path, header: str, rows: list[tuple[float, ...]]) -> None:
    """A CSV file."""
    lines = (",".join(f"{value:.10g}" for value in row) for row in rows)
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")


DEFINITION = f"""\
schema = 1
[test]
name = "suros"
[rig]
normal_load_N = {LOAD}
mean_speed_rpm = {RPM}
disc1 = {{ rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10.0 }}
disc2 = {{ rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10.0 }}
[material]
youngs_modulus_GPa = 209.0
poisson_ratio = 0.30
hardness_HV = 280
density_kg_m3 = 7850
[history]
revolutions_per_iteration = {REVOLUTIONS}
steps = [{", ".join(f"{{ creepage_percent = {c}, iterations = {BLOCKS} }}" for c in CREEPAGE)}]
[model]
traction = "exact"
"""


BLOCK = """\
# what no file of the rig says
[rig]
disc1 = { rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10.0 }
disc2 = { rolling_radius_mm = 23.5, transverse_radius_mm = inf, width_mm = 10.0 }
[material]
youngs_modulus_GPa = 209.0
poisson_ratio = 0.30
hardness_HV = 280
density_kg_m3 = 7850
[measured]
balance_mg = 0.1
provenance = "synthetic"
"""


def write_raw(folder: Path) -> None:
    """The files of the worked example: a raw log, weights of both discs, and what no file says."""
    log, weighed = run(Truth(k_disc1=2e-4, severe=3.0, critical=20.0, balance_mg=0.1), np.random.default_rng(7))
    (folder / "rig.txt").write_text(raw_text([row for rows in raw_log(log) for row in rows]), encoding="utf-8")
    table(folder / "weights.csv", "revolutions,weight disc 1 [g],weight disc 2 [g]", weights(weighed))
    (folder / "block.toml").write_text(BLOCK, encoding="utf-8")
