"""contact: pressure, traction and slip over the patch, the exact theory beside FASTSIM, at one point of a test.

The operating point is the beginning of the step that is chosen, or of the one that is most in partial slip, where the
theories differ most. Another creepage or mu than the test's is an illustrative case, and is called one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.definition import Test
from twindisc_cli.errors import DefinitionError, Problem, ValidityError
from twindisc_cli.identify.steps import StepFriction, friction_in_use, identify_friction
from twindisc_cli.identify.track import last_profile
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.contact_fields import Field, Patch, exact_field, fastsim_field, hertz_patch, profile_patch
from twindisc_cli.model.experiment import Experiment, Floats, History, Ints, Measured, Rig
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.traction_law import creep_stiffness, share_of_full_slip, slip_of_pressure
from twindisc_cli.physics import exact, fastrip, kalker, shakedown, third_body, unlike
from twindisc_cli.physics.half_space import NoConvergenceError
from twindisc_cli.physics.half_space.rolling import Creepage, SlipLaw
from twindisc_cli.results import Array, Axis, Dataset, Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMOOTHED_OVER = (40, 20, 10)
"""Parts of a profile: a parabola spans one of them."""
RIPPLE = 0.05
"""Share of p0 that the roughness left in a profile may press."""
MOMENT = 1e-4
"""Part of an iteration in which the state is still that of its beginning."""
PARTIAL = 0.99
"""Share of mu N above which a step counts as sliding all over."""


@dataclass(frozen=True)
class Point:
    """An operating point: mu [1], creepages [1], spin [rad/m], load [N], rolling speed [m/s], and where it is from.

    warning: what is not known of mu; empty where it is. illustrative: not what the test ran at; its rolling speed is
    the rig's where it is taken from a pause.
    """

    mu: float
    creepage_x: float
    creepage_y: float
    spin: float
    normal_load: float
    rolling_speed: float
    origin: str
    warning: str
    illustrative: bool


@dataclass(frozen=True)
class Subsurface:
    """How hard the softer disc is pressed: k [Pa], p0/k and T/N [1], the limits of p0/k, depth of greatest shear [m].

    along, across: a and b of the patch [m], across inf for a line.
    """

    k: float
    pressed: float
    traction_ratio: float
    yields: float
    shakes_down: float
    depth: float
    along: float
    across: float

    @classmethod
    def of(cls, rig: Rig, patch: Patch, field: Field) -> Subsurface:
        """Under the pressure of a patch and the traction of a theory."""
        k = float(shakedown.shear_yield(min(rig.disc1.hardness, rig.disc2.hardness)))
        across = np.inf if patch.line else patch.b
        ratio = float(np.hypot(field.force_x, field.force_y)) / patch.normal_load
        yields, shakes = shakedown.limits(ratio, patch.a, across)
        depth = shakedown.greatest_shear(patch.a, across)[1]
        pressed = float(patch.fine.pressure.max()) / k
        return cls(k, pressed, ratio, float(yields), float(shakes), depth, patch.a, across)

    @property
    def state(self) -> str:
        """What the map says."""
        if self.pressed > self.shakes_down:
            return "beyond shakedown"
        return "shakes down" if self.pressed > self.yields else "elastic"

    def summary(self) -> tuple[str, ...]:
        """One line, and a warning where the surface flows on."""
        message = (
            f"{self.state}: p0 / k = {self.pressed:.2f} at T/N = {self.traction_ratio:.3f}, yields from "
            f"{self.yields:.2f}, shakes down to {self.shakes_down:.2f}; greatest shear without traction "
            f"{self.depth * 1e3:.3g} mm deep",
        )
        beyond = (
            "warning: beyond shakedown every pass leaves plastic strain: Archard's law alone does not read this wear"
        )
        return (*message, beyond) if self.state == "beyond shakedown" else message

    def json(self) -> dict[str, Any]:
        """For scripts."""
        return {
            "state": self.state,
            "shear_yield_MPa": self.k * 1e-6,
            "p0_over_k": self.pressed,
            "traction_ratio": self.traction_ratio,
            "first_yield_p0_over_k": self.yields,
            "shakedown_p0_over_k": self.shakes_down,
            "depth_of_greatest_shear_mm": self.depth * 1e3,
        }


def run(test: Test, *, step: int | None = None, creepage: float | None = None, mu: float | None = None) -> Result:
    """Solve the contact of one operating point by both theories: of a step from 1, at another creepage [%] or mu."""
    experiment = test.experiment
    point = _operating_point(ForwardModel(experiment), step=step, creepage=creepage, mu=mu)
    patch = _patch(experiment, point.normal_load)
    rig = replace(experiment.rig, rolling_speed=point.rolling_speed)
    driven = Creepage(point.creepage_x, point.creepage_y, point.spin)
    local, layer = _local_friction(experiment, point), experiment.options.layer_compliance
    fields = (
        exact_field(patch, rig, mu=local, creepage=driven, layer_compliance=layer),
        fastsim_field(patch, rig, mu=point.mu, creepage=driven, layer_compliance=layer),
    )
    shortcuts = _shortcuts(experiment, point, patch)
    under = Subsurface.of(rig, patch, fields[0])
    return Result(
        command="contact",
        summary=_summary(point, patch, fields, shortcuts, rig.dundurs) + under.summary(),
        json={
            "operating_point": {
                "origin": point.origin,
                "illustrative": point.illustrative,
                "mu": point.mu,
                "creepage_percent": point.creepage_x * 100.0,
                "lateral_creepage_percent": point.creepage_y * 100.0,
                "spin_rad_m": point.spin,
                "normal_load_N": point.normal_load,
                "rolling_speed_m_s": point.rolling_speed,
            },
            "patch": patch.origin,
            "dundurs_beta": rig.dundurs,
            **{field.theory: _numbers(field, patch, point.normal_load) for field in fields},
            **shortcuts,
            "subsurface": under.json(),
        },
        dataset=_dataset(point, patch, fields, _kalker(rig, patch)),
        figure=lambda: _figure(experiment, point, fields, under),
    )


def _operating_point(model: ForwardModel, *, step: int | None, creepage: float | None, mu: float | None) -> Point:
    """The beginning of a step, all declared effects acting, at another creepage [%] or mu where they are given."""
    test = model.experiment
    steps = len(test.history.step_creepage)
    if step is not None and not 1 <= step <= steps:
        raise DefinitionError(f"--step {step}: the history has the steps 1 to {steps}")
    identified = identify_friction(model) if test.measured.traction is not None else None
    friction = friction_in_use(model, identified)
    known = np.isfinite(friction.mu) & (test.history.step_creepage != 0.0)
    history, begin = _with_moments(test.history)
    measured = Measured(start=test.measured.start, columns=test.measured.columns)
    begun = ForwardModel(replace(test, history=history, measured=measured))
    state = begun.predict(BaseParameters.declared(begun.experiment, np.where(known, friction.mu, 1.0)[None])).state
    first = begun.points.of_iteration[begin]
    shape = (1, len(begun.points.time))

    def at(values: Floats) -> Floats:
        return np.asarray(np.broadcast_to(values, shape)[0, first])

    share = np.where(known, at(share_of_full_slip(test.rig, state)), np.inf)
    slowest = np.where(share > PARTIAL, share + np.abs(at(state.creepage)), share)
    chosen = int(np.argmin(slowest)) if step is None else step - 1
    if mu is None and not known[chosen]:
        where = "for any step" if step is None else f"in step {step}"
        raise DefinitionError(f"no friction, or no creepage, is known {where}: give --mu (and --creepage)")
    own_creepage = float(at(state.creepage)[chosen])
    if creepage is None and own_creepage == 0.0:
        raise DefinitionError(f"step {chosen + 1} rolls without creepage: give --creepage, or another --step")
    is_identified = mu is None and friction.source[chosen] == "identified"
    return Point(
        mu=float(at(state.mu)[chosen]) if mu is None else mu,
        creepage_x=own_creepage if creepage is None else creepage / 100.0,
        creepage_y=float(at(state.lateral_creepage)[chosen]),
        spin=float(at(state.spin)[chosen]),
        normal_load=float(at(state.normal_load)[chosen]),
        rolling_speed=float(at(state.rolling_speed)[chosen]) or test.rig.rolling_speed,
        origin=_origin(
            chosen, friction.source[chosen], share[chosen], creepage=creepage, mu=mu, asked=step is not None
        ),
        warning=_not_bounded(identified, chosen) if identified and is_identified else "",
        illustrative=creepage is not None or mu is not None,
    )


def _not_bounded(friction: StepFriction, step: int) -> str:
    """That T/N hardly bounds the mu of a step, from 0; empty where it does."""
    low, high = float(friction.low[step]), float(friction.high[step])
    if not np.isfinite(low) or high - low <= friction.mu[step]:
        return ""
    interval = f"{low:.3g} to {high:.3g}" if np.isfinite(high) else f"{low:.3g} and more"
    return f"mu of step {step + 1} is hardly known, 90 % interval {interval}: --step or --mu takes another"


def _with_moments(history: History) -> tuple[History, Ints]:
    """The history in which each step begins with an iteration of a moment, and where these are, (step,)."""
    index = np.sort(np.concatenate([np.arange(len(history.step)), history.step_begin]))
    begin = np.searchsorted(index, history.step_begin)
    share = np.ones(len(index))
    share[begin], share[begin + 1] = MOMENT, 1.0 - MOMENT
    same = {
        name: getattr(history, name)[index]
        for name in ("step", "creepage", "given_mu", "load_factor", "speed_factor", "yaw")
    }
    duration, revolutions = (share * values[index] for values in (history.duration, history.revolutions))
    return replace(history, **same, duration=duration, revolutions=revolutions), begin


def _origin(step: int, source: str, share: float, *, creepage: float | None, mu: float | None, asked: bool) -> str:
    """What the operating point is, in words."""
    if creepage is not None or mu is not None:
        given = [] if creepage is None else [f"creepage {creepage:g} %"]
        given += [] if mu is None else [f"mu {mu:g}"]
        return f"an illustrative case, {' and '.join(given)} as asked for; all else as at the start of step {step + 1}"
    partial = share <= PARTIAL
    slides = "" if partial else ", which slides all over" if asked else ", which slides all over as the other steps do"
    most = ", the most in partial slip" if partial and not asked else ""
    return f"step {step + 1}{most}{slides}; its mu is {source}"


def _patch(test: Experiment, normal_load: float) -> Patch:
    """Hertz's patch of the unworn discs; under half_space the patch of the measured profile, or of the unworn one.

    The ends of a line count only where a measured profile shows them.
    """
    profile = test.measured.profile
    if test.options.contact == "hertz" or (test.rig.is_line and profile is None):
        return hertz_patch(test.rig, normal_load)
    if profile is None:
        reach = 6.0 * hertz_patch(test.rig, normal_load).b
        y = np.linspace(-reach, reach, 481)
        return profile_patch(test.rig, normal_load, y=y, height=np.zeros_like(y), origin="the unworn discs")
    last = last_profile(profile)
    y, height = profile.y[last], profile.height[last]
    parts = _smoothed_over(test.rig, y, height)
    origin = f"the {test.measured.provenance} profile"
    if parts != SMOOTHED_OVER[0]:
        origin += f" smoothed over {np.ptp(y) / parts * 1e3:.2g} mm against its roughness"
    try:
        return profile_patch(test.rig, normal_load, y=y, height=_smooth(height, parts), origin=origin)
    except NoConvergenceError as error:
        cure = 'smooth it in its file, or take contact = "hertz" under [model]'
        raise ValidityError(
            Problem(f"no pressure was found on the recorded profile: {error}; {cure}", key="profile")
        ) from error


def _smoothed_over(rig: Rig, y: Floats, height: Floats) -> int:
    """Into how many parts a profile is cut for its smoothing: into the most that leave little of its roughness.

    A wave of height A and length L presses pi E* A / L (K. L. Johnson, Contact Mechanics, 1985, chapter 13).
    """
    for parts in SMOOTHED_OVER:
        left = np.std(np.diff(height, 2)) / np.sqrt(6.0) * np.sqrt(np.sum(_weights(len(height), parts) ** 2))
        if np.pi * rig.effective_modulus * left / (np.ptp(y) / parts) < RIPPLE * float(rig.patch.p0):
            break
    return parts


def _smooth(height: Floats, parts: int) -> Floats:
    """Parabolas through a part of the profile, one of so many: what is rougher than that, the patch presses flat.

    Source: W. S. Cleveland, Journal of the American Statistical Association 74 (1979) 829-836.
    """
    weights = _weights(len(height), parts)
    return np.convolve(np.pad(height, len(weights) // 2, mode="edge"), weights, mode="valid")


def _weights(points: int, parts: int) -> Floats:
    """What the heights about a point count in the parabola there, (point,); these fall to nothing at its ends."""
    half = points // (2 * parts)
    x = np.arange(-half, half + 1) / (half + 1)
    near = (1.0 - np.abs(x) ** 3) ** 3
    weights = near * (np.sum(near * x**4) - np.sum(near * x**2) * x**2)
    return np.asarray(weights / weights.sum()) if half else np.ones(1)


def _local_friction(test: Experiment, point: Point) -> float | SlipLaw:
    """mu, or what it is at each place where it falls with the sliding speed: by the slip there, not that of all."""
    falling = test.effects.get("falling_friction")
    if falling is None:
        return point.mu
    ratio, decay = falling["ratio"], falling["decay_s_m"] * point.rolling_speed

    def share(slip: Floats) -> Floats:
        return np.asarray(ratio + (1.0 - ratio) * np.exp(-decay * slip))

    at_rest = point.mu / share(np.hypot(point.creepage_x, point.creepage_y))
    return lambda slip: at_rest * share(slip)


def _shortcuts(test: Experiment, point: Point, patch: Patch) -> dict[str, Any]:
    """T/N by the closed forms that hold for an ellipse without lateral creepage and spin."""
    if test.options.contact != "hertz" or point.creepage_y or point.spin:
        return {}
    if patch.line:
        return {}
    rig, a, b = test.rig, np.asarray(patch.a), np.asarray(patch.b)
    stiffness, compliance = creep_stiffness(rig, a, b)[0], test.options.layer_compliance
    layer = third_body.compliance_ratio(compliance, stiffness=stiffness, a=a, b=b)
    per_creepage = float(stiffness * third_body.slope_factor(layer)) / (point.mu * point.normal_load)
    x = per_creepage * point.creepage_x
    of_slip = per_creepage * float(slip_of_pressure(rig, a, b, np.asarray(point.normal_load)))
    xi = float(np.hypot(x, of_slip))
    quotient = float(unlike.quotients(x, of_slip, a / b, rig.poisson_ratio)[0]) if of_slip else float(np.sign(x))
    saturation = exact.saturation(xi, a / b, rig.poisson_ratio)
    share = float(third_body.saturation(np.asarray(xi), layer, saturation))
    shortcuts: dict[str, Any] = {"exact_table": {"T_over_N": point.mu * quotient * share}}
    if not (of_slip or compliance):
        shortcuts["fastrip"] = {
            "T_over_N": point.mu * quotient * float(fastrip.saturation(xi)),
            "stick_fraction": float(fastrip.stick_fraction(xi)),
            **_size(patch),
        }
    return shortcuts


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


def _summary(
    point: Point, patch: Patch, fields: tuple[Field, ...], shortcuts: dict[str, Any], dundurs: float
) -> tuple[str, ...]:
    turned = f", lateral {point.creepage_y * 100.0:.3g} %, spin {point.spin:.3g} rad/m" * bool(
        point.creepage_y or point.spin
    )
    size = _size(patch)
    lines = [
        f"{point.origin}",
        *([f"warning: {point.warning}"] if point.warning else []),
        f"mu = {point.mu:.3g}, creepage {point.creepage_x * 100.0:.3g} %{turned}, load {point.normal_load:.3g} N",
        f"patch of {patch.origin}: a {size['a_mm']:.4g} mm, b {size['b_mm']:.4g} mm, p0 {size['p0_MPa']:.4g} MPa",
    ]
    if dundurs:
        lines.append(
            f"discs of unlike elasticity (Dundurs' second constant {dundurs:.2g}): the exact theory and its table have "
            "the slip that pressure alone makes, FASTSIM takes the combined modulus"
        )
    for field in fields:
        error = f" ± {field.error / point.normal_load:.1g} (error of the grid)" if field.error else ""
        lines.append(
            f"{field.theory}: T/N = {field.force_x / point.normal_load:.4f}{error}, "
            f"sticks over {field.stick_fraction * 100.0:.1f} % of the patch"
        )
    if "fastrip" in shortcuts:
        lines.append(f"fastrip: T/N = {shortcuts['fastrip']['T_over_N']:.4f}")
    return tuple(lines)


def _figure(test: Experiment, point: Point, fields: tuple[Field, ...], under: Subsurface) -> Figure:
    from twindisc_cli.figures.contact import fields_and_sections

    case = f"$\\mu$ = {point.mu:.3g}, $\\upsilon_x$ = {point.creepage_x * 100.0:.3g} %"
    if point.creepage_y or point.spin:
        case += f", $\\upsilon_y$ = {point.creepage_y * 100.0:.3g} %, $\\varphi$ = {point.spin:.3g} rad/m"
    recorded = test.measured.traction is not None or test.measured.profile is not None
    provenance = test.measured.provenance if recorded else ""
    if point.illustrative:
        case += " (illustrative: not what the test ran at)"
    return fields_and_sections(fields, under, mu=point.mu, name=test.name, case=case, provenance=provenance)


def _kalker(rig: Rig, patch: Patch) -> dict[str, float]:
    """Kalker's coefficients of the patch, as Eqs. 9 and 10 take them; none of a line, or beyond their table."""
    if patch.line:
        return {}
    try:
        c = kalker.coefficients(patch.a / patch.b, rig.poisson_ratio)
    except ValueError:
        return {}
    return {f"C{index}": float(getattr(c, f"c{index}")) for index in ("11", "22", "23", "33")}


def _dataset(point: Point, patch: Patch, fields: tuple[Field, ...], coefficients: dict[str, float]) -> Dataset:
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
        "rolling_speed_m_s": point.rolling_speed,
        "patch": patch.origin,
        "a_m": patch.a,
        "b_m": patch.b,
        "p0_Pa": float(patch.fine.pressure.max()),
        **coefficients,
        **{f"{field.theory}_T_over_N": field.force_x / point.normal_load for field in fields},
    }
    return Dataset(axes=tuple(axes), arrays=tuple(arrays), attrs=attrs)
