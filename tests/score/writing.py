"""The files of a test: the definition as a user would write it, and the measured tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .rig import Rig
from .sensors import Channels, Plan

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
traction = "{tables}traction.csv"
profile = "{tables}profile.csv"
profile_place = "as recorded"
temperature = "{tables}temperature.csv"
provenance = "synthetic"
"""


def definition(rig: Rig, name: str, tables: str) -> str:
    """The definition of a test: what is set and known, with mu, K and the convection left to be identified.

    The names of its tables begin with `tables`.
    """
    steps = "\n".join(
        f"  {{ creepage_percent = {round(100.0 * creepage, 6)!r}, iterations = {count} }},"
        for creepage, count in zip(rig.creepage, rig.iterations, strict=True)
    )
    crown = [_uncertain(round(1e3 * r, 4), rig.declared_std) for r in rig.crown]
    return _DEFINITION.format(
        name=name, load=rig.load, rpm=rig.rpm, radius=round(1e3 * rig.radius, 4), crown1=crown[0], crown2=crown[1],
        modulus=_uncertain(rig.modulus / 1e9, rig.declared_std),
        hardness=rig.hardness, environment=rig.environment, capacity=rig.capacity,
        revolutions=rig.revolutions, steps=steps, contact=rig.contact, law=rig.declared_law, tables=tables,
    )  # fmt: skip


def _uncertain(value: float, share: float) -> str:
    """A number of a definition, with its standard deviation where it is told."""
    if share == 0.0 or np.isinf(value):
        return repr(value)
    return f"{{ value = {value!r}, std = {round(abs(value) * share, 6)!r} }}"


def write_tables(folder: Path, tables: str, *, rig: Rig, plan: Plan, measured: Channels) -> None:
    """traction.csv, profile.csv and temperature.csv in `folder`, their names begun with `tables`."""
    time = plan.traction_time
    step = np.array(rig.steps)[(time / rig.duration).astype(int)]
    percent = 100.0 * np.array(rig.creepage)[step]
    rows = [
        f"{t:.1f},{s + 1},{c:g},{r:.5f}" for t, s, c, r in zip(time, step, percent, measured["traction"], strict=True)
    ]
    _write(folder / f"{tables}traction.csv", "time [s],step,creepage [%],traction ratio [1]", rows)
    celsius = rig.environment + measured["temperature"]
    rows = [f"{t:.1f},{c:.3f}" for t, c in zip(plan.temperature_time, celsius, strict=True)]
    _write(folder / f"{tables}temperature.csv", "time [s],temperature [degC]", rows)
    _write_profile(folder / f"{tables}profile.csv", plan, measured["profile"])


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
