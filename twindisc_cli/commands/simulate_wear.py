"""simulate-wear: profile, contact patch and dissipated energy after each iteration of the history (Figs. 8, 12)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.commands._base import friction_of_steps, wear_coefficient
from twindisc_cli.definition import Test
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.track import last_profile
from twindisc_cli.identify.wear_history import WearHistory, wear_history
from twindisc_cli.model.experiment import Experiment, Floats, Rig, Start
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POWER_PER_LENGTH = "dissipated power per length P_l of Eq. 15, mean over the iteration"
WORTH_TELLING = 0.01
"""Share of the creepage that the radii may be off before it is reported."""

RESOLVED = 1.6
"""Width of a track over that of the new patch up to which `contact` on the written profile gives p0 within 2 %."""


def run(test: Test) -> Result:
    """Wear the discs through the history of a test."""
    experiment = test.experiment
    if experiment.history.separate:
        raise DefinitionError(
            "the steps are tests of their own (history.separate): no wear is carried over, and there is no single "
            "profile; give each test a definition of its own"
        )
    model = ForwardModel(experiment)
    mu = friction_of_steps(model).mu
    k, source = wear_coefficient(model, mu)
    if np.isnan(k):
        raise DefinitionError(
            "no wear coefficient is known: give wear_coefficient under [model], or a measured profile to find it from"
        )
    history = wear_history(model, mu=mu, wear_coefficient=k)
    return Result(
        command="simulate-wear",
        summary=(
            *_summary(history, k, source),
            *_shoulders(history, experiment.rig),
            *_begun(experiment.measured.start),
        ),
        json={
            **_iteration(history, -1),
            "final_radius_mm": _radius(history.radius[-1] * 1e3),
            "wear_coefficient": k,
            "wear_coefficient_source": source,
            "error_estimate_percent": history.error * 100.0,
            "p0_error_estimate_percent": history.pressure_error * 100.0,
            "iterations": [
                {"iteration": i + 1, "time_s": t, "creepage_percent": history.creepage[i] * 100.0}
                | {"mu": or_null(history.mu[i]), **_iteration(history, i)}
                for i, t in enumerate(history.time)
            ],
        },
        dataset=_dataset(history, k, source, experiment),
        figure=lambda: _figure(experiment, history),
    )


def _iteration(history: WearHistory, i: int) -> dict[str, Any]:
    track = history.track[i]
    return {
        "depth_um": track.depth * 1e6,
        "width_mm": track.width * 1e3,
        "worn_volume_mm3": history.volume[i] * 1e9,
        "dissipated_energy_kJ": history.energy[i] * 1e-3,
        "radius_mm": _radius(history.radius[i] * 1e3),
        "rolling_radius_mm": [_radius(r * 1e3) for r in history.rolling_radius[:, i]],
        "creepage_shift_percent": _creepage_shift(history, i) * 100.0,
        "a_mm": history.a[i] * 1e3,
        "b_mm": history.b[i] * 1e3,
        "p0_MPa": history.p0[i] * 1e-6,
    }


def _radius(value: float) -> float | None:
    """A radius; None of a flat disc."""
    return None if np.isinf(value) else float(value)


def _summary(history: WearHistory, k: float, source: str) -> tuple[str, ...]:
    track = history.track[-1]
    return (
        f"K = {k:.3g}, {source}",
        f"disc 2: {track.depth * 1e6:.3g} µm deep, {track.width * 1e3:.3g} mm wide at 5 % of the depth, "
        f"best circle {f'{history.radius[-1] * 1e3:.3g} mm' if np.isfinite(history.radius[-1]) else 'straight'}",
        f"worn volume {history.volume[-1] * 1e9:.3g} mm³ ({_worn_discs(history)}), "
        f"dissipated energy {history.energy[-1] * 1e-3:.3g} kJ",
        f"patch at the end: a {history.a[-1] * 1e3:.3g} mm, b {history.b[-1] * 1e3:.3g} mm, "
        f"p0 {history.p0[-1] * 1e-6:.4g} MPa",
        *_shrunk(history),
        f"estimated error of the depth: {history.error * 100.0:.2g} %, of p0: {history.pressure_error * 100.0:.2g} %",
    )


def _worn_discs(history: WearHistory) -> str:
    """The discs that have worn at the end."""
    worn = [np.any(height[-1] < 0.0) for height in (history.disc1_height, history.height)]
    return "both discs" if all(worn) else "disc 1" if worn[0] else "disc 2"


def _shoulders(history: WearHistory, rig: Rig) -> tuple[str, ...]:
    """That the points across a wide track do not resolve its shoulders, where the pressure of their profile peaks."""
    wide = history.track[-1].width / (2.0 * float(rig.patch.b))
    if rig.is_line or wide < RESOLVED:
        return ()
    return (
        f"the track is {wide:.2g} times as wide as the new patch: the written points do not resolve its shoulders, "
        "where half-space contact of the written profile peaks above p0 (7 % at twice the width, 20 to 50 % from three "
        "times on)",
    )


def _begun(start: Start | None) -> tuple[str, ...]:
    """From which discs the wear begins, where they were measured."""
    if start is None:
        return ()
    size = [f"disc {disc} {np.ptp(height) * 1e6:.3g} µm" for disc, height in enumerate(start.height, start=1)]
    return (f"begins at the recorded profiles of the new discs, from lowest to highest {', '.join(size)}",)


def _shrunk(history: WearHistory) -> tuple[str, ...]:
    """What the speeds of the new discs would make of the creepage, where it counts."""
    shift = _creepage_shift(history, -1)
    if abs(shift) < WORTH_TELLING * float(np.abs(history.creepage[-1])):
        return ()
    return (
        f"the discs have shrunk: had the speeds been left as for new discs, the creepage would be off by "
        f"{shift * 100.0:+.2g} %",
    )


def _creepage_shift(history: WearHistory, i: int) -> float:
    """What is added to the creepage where the speeds stay as the new radii asked: dR1 / R1 - dR2 / R2."""
    lost = np.array([history.height[i].min(), history.disc1_height[i].min()])[::-1]
    return float(np.subtract(*(lost / (history.rolling_radius[:, i] - lost))))


def _figure(test: Experiment, history: WearHistory) -> Figure:
    from twindisc_cli.figures.wear import worn

    profile = test.measured.profile
    recorded = profile is not None or test.measured.traction is not None
    last = None if profile is None else last_profile(profile)
    measured = None if profile is None or last is None else (profile.y[last], profile.height[last])
    return worn(history, test=test, provenance=test.measured.provenance if recorded else "", measured=measured)


def _new(start: Start | None, y: Floats) -> tuple[Array, ...]:
    """The profiles of the new discs, where the wear begins at measured ones."""
    if start is None:
        return ()
    one, two = (np.interp(y, start.y, height) for height in start.height)
    return (
        Array("new_height", ("y",), two, "m", "disc 2 as it was new, above its nominal shape"),
        Array("disc1_new_height", ("y",), one, "m", "disc 1 as it was new, above its nominal shape"),
    )


def _measured(test: Experiment) -> tuple[tuple[Axis, ...], tuple[Array, ...]]:
    """The last profile that was recorded, as levelled and centred; nothing where there is none."""
    profile = test.measured.profile
    if profile is None:
        return (), ()
    last = last_profile(profile)
    place = Axis("measured_y", profile.y[last], "m", "position across the track of the recorded profile")
    what = f"{test.measured.provenance} height change of disc {profile.disc[last][0]}"
    return (place,), (Array("measured_height", ("measured_y",), profile.height[last], "m", what),)


def _dataset(history: WearHistory, k: float, source: str, test: Experiment) -> Dataset:
    axes, arrays = _measured(test)
    rows = (
        ("time", history.time, "s", "time at the end of the iteration"),
        ("creepage", history.creepage, "1", "longitudinal creepage"),
        ("mu", history.mu, "1", "coefficient of friction; NaN in a pause"),
        ("traction_ratio", history.traction_ratio, "1", "T/N at the end of the iteration"),
        ("power", history.power, "W", "dissipated power, mean over the iteration"),
        ("energy", history.energy, "J", "energy dissipated so far"),
        ("volume", history.volume, "m3", "volume worn off both discs"),
        ("depth", np.array([t.depth for t in history.track]), "m", "depth of the track of disc 2"),
        ("width", np.array([t.width for t in history.track]), "m", "width of the track at 5 % of its depth"),
        ("radius", history.radius, "m", "transverse radius of the best circle of disc 2"),
        ("a", history.a, "m", "semi-axis of the patch along rolling"),
        ("b", history.b, "m", "semi-axis of the patch across rolling"),
        ("p0", history.p0, "Pa", "peak pressure"),
    )
    return Dataset(
        axes=(
            Axis("iteration", np.arange(1, len(history.time) + 1), "1", "number of the iteration"),
            Axis("y", history.y, "m", "position across the track"),
            *axes,
        ),
        arrays=(
            *(
                Array(name, ("iteration",), values, unit, what, name in ("radius", "mu"))
                for name, values, unit, what in rows
            ),
            Array("height", ("iteration", "y"), history.height, "m", "height change of disc 2"),
            Array("disc1_height", ("iteration", "y"), history.disc1_height, "m", "height change of disc 1"),
            Array("power_per_length", ("iteration", "y"), history.power_per_length, "W m-1", POWER_PER_LENGTH),
            *_new(test.measured.start, history.y),
            *arrays,
        ),
        attrs={
            "wear_coefficient": k,
            "wear_coefficient_source": source,
            "relative_error_of_depth": history.error,
            "relative_error_of_p0": history.pressure_error,
        },
    )
