"""What wear has made of the discs after each iteration of a history (Figs. 8, 12), read off the forward model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.identify.track import Track, worn_track
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.patch import Paths
from twindisc_cli.model.wear_path.line import DEEPEST
from twindisc_cli.physics.archard import worn_volume
from twindisc_cli.physics.best_circle import fit_curvature
from twindisc_cli.physics.half_space import OutOfRangeError


@dataclass(frozen=True)
class WearHistory:
    """The state after each iteration, (iteration,), and profiles (iteration, strip).

    time [s], creepage, mu (NaN without creepage) and T/N [1] of the iteration; power [W], its mean over it, and
    power_per_length [W/m] (iteration, strip), P_l of Eq. 15; energy dissipated so far [J]; volume worn off both discs
    [m3]; y [m] (strip,); height [m], change of disc 2's profile, and disc1_height of disc 1's; track of disc 2; radius
    [m] of the best circle through disc 2's profile inside the patch, inf where it is flat, negative where hollow;
    rolling_radius [m] of both discs at the bottom of their tracks (disc, iteration); a, b
    semi-axes [m] and p0 [Pa] of the patch; error and pressure_error, the estimated relative errors of depth and p0.
    """

    time: Floats
    creepage: Floats
    mu: Floats
    traction_ratio: Floats
    power: Floats
    power_per_length: Floats
    energy: Floats
    volume: Floats
    y: Floats
    height: Floats
    disc1_height: Floats
    track: list[Track]
    radius: Floats
    rolling_radius: Floats
    a: Floats
    b: Floats
    p0: Floats
    error: float
    pressure_error: float


def wear_history(model: ForwardModel, *, mu: Floats, wear_coefficient: float) -> WearHistory:
    """Wear the discs with mu (step,) and one K [1], declared effects acting."""
    test, at = model.experiment, model.points.of_iteration
    base = replace(BaseParameters.declared(test, mu[None]), K=np.array([wear_coefficient]))
    prediction = model.unbounded.predict(base, profiled=False)
    state, wide = prediction.state, prediction.section.shape
    paths = prediction.paths
    load = np.broadcast_to(state.normal_load / state.nominal_load, wide)[0, at]
    section = prediction.section[:, at]
    y, depth = _profiles(paths, section, load)
    _refuse_worn_through(model, float(section.max()), float(depth.max()))
    patch = paths.patch(section, load)
    share = np.broadcast_to(state.disc1_share, wide)[0, at][:, None]
    height, disc1_height = -(1.0 - share) * depth, -share * depth
    power = np.diff(state.energy[0, at], prepend=0.0) / test.history.duration
    return WearHistory(
        time=test.history.end_time,
        creepage=np.broadcast_to(state.creepage, wide)[0, at],
        mu=np.where(test.history.creepage != 0.0, np.broadcast_to(state.mu, wide)[0, at], np.nan),
        traction_ratio=np.broadcast_to(state.traction_ratio, wide)[0, at],
        power=power,
        power_per_length=_power_per_length(y, depth, power),
        energy=state.energy[0, at],
        volume=worn_volume(y=y, depth=-height, rolling_radius=test.rig.track_radius(2))
        + worn_volume(y=y, depth=-disc1_height, rolling_radius=test.rig.track_radius(1)),
        y=y,
        height=height,
        disc1_height=disc1_height,
        track=[worn_track(y, row, smooth=False) for row in height],
        radius=_radius(y, height, patch.b[0], test.rig.disc2.transverse_radius, flat=test.rig.is_line),
        rolling_radius=np.array(
            [
                test.rig.disc1.rolling_radius + disc1_height.min(axis=1),
                test.rig.disc2.rolling_radius + height.min(axis=1),
            ]
        ),
        a=patch.a[0],
        b=patch.b[0],
        p0=paths.peak_pressure(section, load)[0],
        error=max(path.error for path in paths.paths),
        pressure_error=max(path.pressure_error for path in paths.paths),
    )


def _refuse_worn_through(model: ForwardModel, section: float, depth: float) -> None:
    """OutOfRangeError where a worn section [m2] and its depth [m] leave less of disc 2 than is followed."""
    rig = model.experiment.rig
    deepest = max(depth, section / rig.width)
    if deepest > DEEPEST * rig.disc2.rolling_radius:
        raise OutOfRangeError(
            f"the wear would be {deepest * 1e3:.3g} mm deep on a radius of {rig.disc2.rolling_radius * 1e3:.3g} mm; "
            f"it is followed to {DEEPEST:g} of the radius: do load, wear coefficient and history belong together?"
        )


def _profiles(paths: Paths, section: Floats, load: Floats) -> tuple[Floats, Floats]:
    """Worn depth of both discs [m] on strips y [m], (iteration, strip), at sections [m2] (1, iteration) and loads."""
    widest = max((path.y for path in paths.paths), key=lambda strips: float(strips[-1]))

    def depth(path_y: Floats, rows: Floats) -> Floats:
        if path_y is widest:
            return rows
        return np.array([np.interp(widest, path_y, row, left=0.0, right=0.0) for row in rows])

    scaled = paths.profile_scale(load[None])
    result = paths.at(lambda path: depth(path.y, path.depth), section, load)[0] * scaled.height.T
    scale = scaled.across[0]
    if np.all(scale == 1.0):
        return widest, result
    y = widest * float(scale.max())
    return y, np.array([np.interp(y / s, widest, row) for s, row in zip(scale, result, strict=True)])


def _power_per_length(y: Floats, depth: Floats, power: Floats) -> Floats:
    """The mean power [W] of each iteration over the strips [W/m], (iteration, strip), by the depth that it took off."""
    taken = np.diff(depth, axis=0, prepend=np.zeros((1, len(y))))
    total = np.trapezoid(taken, y, axis=1)
    return np.asarray(taken * np.divide(power, total, out=np.zeros_like(power), where=total > 0.0)[:, None])


def _radius(y: Floats, height: Floats, b: Floats, unworn: float, *, flat: bool) -> Floats:
    """Transverse radius [m] of the best circle through a worn disc inside the patch of half-width b, (iteration,)."""
    if flat:
        return np.full(len(height), unworn)
    inside = np.clip((b[:, None] - np.abs(y)) / (y[1] - y[0]) + 0.5, 0.0, 1.0)
    curvature = 1.0 / unworn - fit_curvature(y, height, inside)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / curvature)
