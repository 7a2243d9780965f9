"""contact: pressure, traction and slip over the patch, the exact theory beside FASTSIM, at one point of a test.

The operating point is the first of the step that is most in partial slip, where the theories differ most; a test that
has none, or whose friction is unknown, is shown at mu = 0.6 and 0.2 % creepage, the case of the paper's Figs. 4 and 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.commands._theories import Field, Patch, exact_field, fastsim_field, hertz_patch, profile_patch
from twindisc_cli.definition import Test
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.identify.track import last_profile
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics import exact, fastrip, kalker
from twindisc_cli.results import Array, Axis, Dataset, Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURE_4 = (0.6, 0.002)
SMOOTHED_OVER = 40
PARTIAL = 0.99
"""Share of mu N above which a step counts as sliding all over."""


@dataclass(frozen=True)
class Point:
    """An operating point: mu [1], creepages [1], spin [rad/m], load [N], and where it is from."""

    mu: float
    creepage_x: float
    creepage_y: float
    spin: float
    normal_load: float
    origin: str


def run(test: Test) -> Result:
    """Solve the contact of one operating point by both theories."""
    experiment = test.experiment
    point = _operating_point(ForwardModel(experiment))
    patch = _patch(experiment, point.normal_load)
    rig, given = (
        experiment.rig,
        {
            "mu": point.mu,
            "creepage_x": point.creepage_x,
            "creepage_y": point.creepage_y,
            "spin": point.spin,
        },
    )
    fields = (exact_field(patch, rig, **given), fastsim_field(patch, rig, **given))
    shortcuts = _shortcuts(experiment, point, patch)
    return Result(
        command="contact",
        summary=_summary(point, patch, fields, shortcuts),
        json={
            "operating_point": {
                "origin": point.origin,
                "mu": point.mu,
                "creepage_percent": point.creepage_x * 100.0,
                "lateral_creepage_percent": point.creepage_y * 100.0,
                "spin_rad_m": point.spin,
                "normal_load_N": point.normal_load,
            },
            "patch": patch.origin,
            **{field.theory: _numbers(field, patch, point.normal_load) for field in fields},
            **shortcuts,
        },
        dataset=_dataset(point, fields),
        figure=lambda: _figure(experiment, point, fields),
    )


def _operating_point(model: ForwardModel) -> Point:
    """The beginning of the step with the smallest T/(mu N), all declared effects acting; else the paper's case."""
    test = model.experiment
    mu, source = friction_in_use(model)
    known = np.isfinite(mu) & (test.history.step_creepage != 0.0)
    state = model.predict(BaseParameters.declared(test, np.where(known, mu, 1.0)[None])).state
    first = model.points.of_iteration[np.unique(test.history.step, return_index=True)[1]]
    shape = (1, len(model.points.time))

    def at(values: Floats) -> Floats:
        return np.asarray(np.broadcast_to(values, shape)[0, first])

    capacity = at(state.sliding_speed * state.mu * state.normal_load)
    share = np.divide(at(state.power), capacity, out=np.full(len(mu), np.inf), where=known & (capacity > 0.0))
    chosen = int(np.argmin(share))
    if share[chosen] > PARTIAL:
        friction, creepage = FIGURE_4
        why = "no step of the test is known to be in partial slip: the case of the paper's Figs. 4 and 5"
        return Point(friction, creepage, 0.0, 0.0, test.rig.normal_load, why)
    return Point(
        mu=float(at(state.mu)[chosen]),
        creepage_x=float(at(state.creepage)[chosen]),
        creepage_y=float(at(state.lateral_creepage)[chosen]),
        spin=float(at(state.spin)[chosen]),
        normal_load=float(at(state.normal_load)[chosen]),
        origin=f"step {chosen + 1}, the most in partial slip; its mu is {source[chosen]}",
    )


def _patch(test: Experiment, normal_load: float) -> Patch:
    """Hertz's ellipse of the unworn discs; under half_space the patch of the measured profile, or of the unworn one."""
    if test.options.contact == "hertz":
        return hertz_patch(test.rig, normal_load)
    profile = test.measured.profile
    if profile is None:
        reach = 6.0 * hertz_patch(test.rig, normal_load).b
        y = np.linspace(-reach, reach, 481)
        return profile_patch(test.rig, normal_load, y=y, height=np.zeros_like(y), origin="the unworn discs")
    last = last_profile(profile)
    height = _without_roughness(profile.height[last])
    origin = f"the {test.measured.provenance} profile"
    return profile_patch(test.rig, normal_load, y=profile.y[last], height=height, origin=origin)


def _without_roughness(height: Floats) -> Floats:
    """Parabolas through a fortieth of the profile: what is rougher than that, the patch presses flat.

    Source: A. Savitzky and M. J. E. Golay, Analytical Chemistry 36 (1964) 1627-1639.
    """
    half = len(height) // (2 * SMOOTHED_OVER)
    weights = 3.0 * half * (half + 1) - 1.0 - 5.0 * np.arange(-half, half + 1) ** 2
    return np.convolve(np.pad(height, half, mode="edge"), weights / weights.sum(), mode="valid")


def _shortcuts(test: Experiment, point: Point, patch: Patch) -> dict[str, Any]:
    """T/N by the closed forms that hold for an ellipse without lateral creepage and spin."""
    if test.options.contact != "hertz" or point.creepage_y or point.spin:
        return {}
    nu = test.rig.poisson_ratio
    linear = test.rig.shear_modulus * patch.a * patch.b * float(kalker.coefficients(patch.a / patch.b, nu).c11)
    capacity = point.mu * point.normal_load
    xi = linear * abs(point.creepage_x) / capacity
    sense = float(np.sign(point.creepage_x)) * point.mu
    return {
        "fastrip": {
            "T_over_N": sense * float(fastrip.saturation(xi)),
            "stick_fraction": float(fastrip.stick_fraction(xi)),
            **_size(patch),
        },
        "exact_table": {"T_over_N": sense * float(exact.saturation(xi, patch.a / patch.b, nu))},
    }


def _size(patch: Patch) -> dict[str, float]:
    return {"a_mm": patch.a * 1e3, "b_mm": patch.b * 1e3, "p0_MPa": float(patch.fine.pressure.max()) * 1e-6}


def _numbers(field: Field, patch: Patch, normal_load: float) -> dict[str, float]:
    return {
        "T_over_N": field.force_x / normal_load,
        "T_over_N_error": field.error / normal_load,
        "stick_fraction": field.stick_fraction,
        **_size(patch),
        "lateral_T_over_N": field.force_y / normal_load,
        "spin_moment_N_mm": field.moment * 1e3,
        "peak_traction_MPa": float(np.hypot(*field.traction).max()) * 1e-6,
        "power_W": field.power,
    }


def _summary(point: Point, patch: Patch, fields: tuple[Field, ...], shortcuts: dict[str, Any]) -> tuple[str, ...]:
    turned = f", lateral {point.creepage_y * 100.0:.3g} %, spin {point.spin:.3g} rad/m" * bool(
        point.creepage_y or point.spin
    )
    size = _size(patch)
    lines = [
        f"{point.origin}",
        f"mu = {point.mu:.3g}, creepage {point.creepage_x * 100.0:.3g} %{turned}, load {point.normal_load:.3g} N",
        f"patch of {patch.origin}: a {size['a_mm']:.4g} mm, b {size['b_mm']:.4g} mm, p0 {size['p0_MPa']:.4g} MPa",
    ]
    for field in fields:
        error = f" ± {field.error / point.normal_load:.1g}" if field.error else ""
        lines.append(
            f"{field.theory}: T/N = {field.force_x / point.normal_load:.4f}{error}, "
            f"sticks over {field.stick_fraction * 100.0:.1f} % of the patch"
        )
    if "fastrip" in shortcuts:
        lines.append(f"fastrip: T/N = {shortcuts['fastrip']['T_over_N']:.4f}")
    return tuple(lines)


def _figure(test: Experiment, point: Point, fields: tuple[Field, ...]) -> Figure:
    from twindisc_cli.figures.contact import fields_and_sections

    case = f"$\\mu$ = {point.mu:.3g}, $\\upsilon_x$ = {point.creepage_x * 100.0:.3g} %"
    if point.creepage_y or point.spin:
        case += f", $\\upsilon_y$ = {point.creepage_y * 100.0:.3g} %, $\\varphi$ = {point.spin:.3g} rad/m"
    recorded = test.measured.traction is not None or test.measured.profile is not None
    provenance = test.measured.provenance if recorded else ""
    return fields_and_sections(fields, mu=point.mu, name=test.name, case=case, provenance=provenance)


def _dataset(point: Point, fields: tuple[Field, ...]) -> Dataset:
    axes: list[Axis] = []
    arrays: list[Array] = []
    for field in fields:
        name, of = field.theory, f"by {field.theory}"
        rows, columns = (f"{name}_strip", f"{name}_cell")
        axes += [
            Axis(rows, np.arange(field.sticks.shape[0]), "1", f"strip across the patch {of}"),
            Axis(columns, np.arange(field.sticks.shape[1]), "1", f"cell along rolling {of}"),
        ]
        quantities = (
            ("x", field.x, "m", "position along rolling, leading edge at the largest"),
            ("y", field.y, "m", "position across"),
            ("pressure", field.pressure, "Pa", "normal pressure"),
            ("traction_x", field.traction[0], "Pa", "longitudinal traction"),
            ("traction_y", field.traction[1], "Pa", "lateral traction"),
            ("slip_x", field.slip[0], "m s-1", "longitudinal sliding velocity"),
            ("slip_y", field.slip[1], "m s-1", "lateral sliding velocity"),
            ("sticks", field.sticks.astype(np.int8), "1", "1 where the surfaces stick, 0 elsewhere"),
        )
        arrays += [Array(f"{name}_{q}", (rows, columns), v, unit, f"{what}, {of}") for q, v, unit, what in quantities]
        arrays.append(
            Array(f"{name}_power_per_length", (rows,), field.power_per_length, "W m-1", f"dissipated power {of}")
        )
    attrs: dict[str, str | float] = {
        "operating_point": point.origin,
        "mu": point.mu,
        "creepage": point.creepage_x,
        "lateral_creepage": point.creepage_y,
        "spin_rad_m": point.spin,
        "normal_load_N": point.normal_load,
    }
    return Dataset(axes=tuple(axes), arrays=tuple(arrays), attrs=attrs)
