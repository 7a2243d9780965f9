"""The files of a test: the definition as a user would write it, and the measured tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .rig import Rig
from .sensors import DENSITY, Channels, Plan

_DEFINITION = """schema = 1

[test]
name = "{name}"

[rig]
normal_load_N = {load}
mean_speed_rpm = {rpm}
disc1 = {{ rolling_radius_mm = {radius}, transverse_radius_mm = {crown1} }}
disc2 = {{ rolling_radius_mm = {radius}, transverse_radius_mm = {crown2} }}

[material]
youngs_modulus_GPa = {modulus}
poisson_ratio = 0.3
hardness_HV = {hardness}
density_kg_m3 = {density}

[thermal]
environment_temperature_C = {environment}
heat_capacity_J_K = {capacity}

[history]
revolutions_per_iteration = {revolutions}
steps = [
{steps}
]

[model]
contact = "{contact}"
traction = "{law}"

[measured]
{traction}
profile = "{tables}profile.csv"
profile_place = "as recorded"
temperature = "{tables}temperature.csv"
{mass}provenance = "synthetic"
"""


def definition(rig: Rig, plan: Plan, name: str, tables: str) -> str:
    """The definition of a test: what is set and known, with mu, K and the convection left to be identified.

    The names of its tables begin with `tables`.
    """
    steps = "\n".join(
        f"  {{ creepage_percent = {round(100.0 * creepage, 6)!r}, iterations = {count}{_driven(rig, step)} }},"
        for step, (creepage, count) in enumerate(zip(rig.creepage, rig.iterations, strict=True))
    )
    traction = f'traction = "{tables}traction.csv"'
    if plan.tachometer:
        traction = f'log = "{tables}log.csv"\ntorque_disc = 2'
    mass = f'mass = "{tables}mass.csv"\n' if plan.weighed else ""
    crown = [_uncertain(round(1e3 * r, 4), rig.declared_std) for r in rig.crown]
    return _DEFINITION.format(
        name=name, load=rig.load, rpm=rig.rpm, radius=round(1e3 * rig.radius, 4), crown1=crown[0], crown2=crown[1],
        modulus=_uncertain(rig.modulus / 1e9, rig.declared_std),
        hardness=rig.hardness, environment=rig.environment, capacity=rig.capacity,
        revolutions=rig.revolutions, steps=steps, contact=rig.contact, law=rig.declared_law, tables=tables,
        traction=traction, mass=mass, density=DENSITY,
    )  # fmt: skip


def _driven(rig: Rig, step: int) -> str:
    """What a step has of its own."""
    load = f", normal_load_N = {rig.load * rig.load_over(step):.6g}" if rig.loads else ""
    speed = f", mean_speed_rpm = {rig.rpm * rig.speed_over(step):.6g}" if rig.speeds else ""
    return load + speed


def _uncertain(value: float, share: float) -> str:
    """A number of a definition, with its standard deviation where it is told."""
    if share == 0.0 or np.isinf(value):
        return repr(value)
    return f"{{ value = {value!r}, std = {round(abs(value) * share, 6)!r} }}"


def write_tables(folder: Path, tables: str, *, rig: Rig, plan: Plan, measured: Channels) -> None:
    """The measured tables in `folder`, their names begun with `tables`."""
    if plan.tachometer:
        _write_log(folder / f"{tables}log.csv", rig, plan, measured)
    else:
        _write_traction(folder / f"{tables}traction.csv", rig, plan, measured["traction"])
    if plan.weighed:
        _write_mass(folder / f"{tables}mass.csv", plan, measured["mass"])
    celsius = rig.environment + measured["temperature"]
    rows = [f"{t:.1f},{c:.3f}" for t, c in zip(plan.temperature_time, celsius, strict=True)]
    _write(folder / f"{tables}temperature.csv", "time [s],temperature [degC]", rows)
    _write_profile(folder / f"{tables}profile.csv", plan, measured["profile"])


def _write_traction(path: Path, rig: Rig, plan: Plan, ratio: np.ndarray) -> None:
    time = plan.traction_time
    step = rig.step_at(time)
    percent = 100.0 * np.array(rig.creepage)[step]
    rows = [f"{t:.1f},{s + 1},{c:g},{r:.5f}" for t, s, c, r in zip(time, step, percent, ratio, strict=True)]
    _write(path, "time [s],step,creepage [%],traction ratio [1]", rows)


def _write_log(path: Path, rig: Rig, plan: Plan, measured: Channels) -> None:
    """What the rig drives, with the errors of its tachometers, and the torque on disc 2."""
    time = plan.traction_time
    creepage = rig.of_step(rig.creepage, time) + rig.of_step(rig.creepage_error, time)
    speed, load = rig.rpm * rig.of_step(rig.speeds, time), rig.load * rig.of_step(rig.loads, time)
    errors = measured["speeds"].reshape(2, -1)
    speeds = [speed * (1.0 + s * creepage / 2.0 + error) for s, error in zip((1, -1), errors, strict=True)]
    columns = (time, *speeds, measured["traction"] * load * rig.radius, load)
    rows = [f"{t:.1f},{one:.4f},{two:.4f},{m:.6g},{n:.6g}" for t, one, two, m, n in zip(*columns, strict=True)]
    _write(path, "time [s],speed 1 [rpm],speed 2 [rpm],torque [N m],normal load [N]", rows)


def _write_mass(path: Path, plan: Plan, lost: np.ndarray) -> None:
    parts = [(stop, disc) for stop in plan.weighed for disc in plan.discs]
    rows = [
        f"{stop},{disc},{1e6 * m:.4f},{1e6 * plan.balance:.4f}" for (stop, disc), m in zip(parts, lost, strict=True)
    ]
    _write(path, "iteration,disc,mass loss [mg],uncertainty [mg]", rows)


def _write_profile(path: Path, plan: Plan, height: np.ndarray) -> None:
    """Columns for the disc and for the iteration only where there are several."""
    names, rows, parts = [], [], height.reshape(len(plan.stops), len(plan.discs), -1)
    if len(plan.stops) > 1:
        names.append("iteration")
    if len(plan.discs) > 1:
        names.append("disc")
    for i, stop in enumerate(plan.stops):
        for j, disc in enumerate(plan.discs):
            key = "".join([f"{stop}," if len(plan.stops) > 1 else "", f"{disc}," if len(plan.discs) > 1 else ""])
            rows += [f"{key}{1e3 * y:.4f},{1e6 * h:.4f}" for y, h in zip(plan.y, parts[i, j], strict=True)]
    _write(path, ",".join([*names, "y [mm],height [um]"]), rows)


def _write(path: Path, header: str, rows: list[str]) -> None:
    path.write_text("\n".join([header, *rows]) + "\n")
