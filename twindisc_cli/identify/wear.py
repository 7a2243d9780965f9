"""The wear coefficient of a test from its measured profile, by the paper's bisection and by least squares.

The two agree where the simulated profile has the measured one's shape. Where it has not, least squares trades depth
against width; then the depth decides, as in the paper, and the standard error takes in how far the two are apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.errors import MeasurementError, ValidityError
from twindisc_cli.identify.least_squares import Fit, fit_positive
from twindisc_cli.identify.track import Track, last_profile, worn_track
from twindisc_cli.identify.wear_coefficient import TOLERANCE, Bisection, bisect_depth
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics.archard import allowed_coefficient


@dataclass(frozen=True)
class WearFit:
    """K and its standard error [1], by `method` "least squares" or "bisection"; both, and what they rest on.

    measured, simulated: the track of the last profile of the disc that wears, `disc`. Of that profile, (sample,): y and
    height [m], simulated_height at K, squares_height at the least-squares K; rms of height less simulated_height [m].
    allowed: the K of Archard's W H / E; energy: what was dissipated up to that profile [J].
    """

    wear_coefficient: float
    std: float
    method: str
    bisection: Bisection
    least_squares: Fit
    disc: int
    measured: Track
    simulated: Track
    y: Floats
    height: Floats
    simulated_height: Floats
    squares_height: Floats
    rms: float
    allowed: float
    energy: float


def identify_wear(model: ForwardModel, mu: Floats) -> WearFit:
    """Fit K to the measured profiles with mu (step,) in the contact."""
    test = model.experiment
    profile = test.measured.profile
    if profile is None:
        raise MeasurementError("no profile was measured; name its file under [measured]")
    last = last_profile(profile)
    y, height = profile.y[last], profile.height[last]
    measured, section = worn_track(y, height, smooth=True), -float(np.trapezoid(height, y))
    if not (measured.depth > 0.0 and section > 0.0):
        raise MeasurementError("nothing is worn off in the last measured profile: no height in it is below the rest")

    def heights(k: Floats) -> Floats:
        base = BaseParameters.declared(test, np.broadcast_to(mu, (len(k), len(mu))))
        return model.predict(replace(base, K=k)).profile

    def track(k: float) -> Track:
        return worn_track(y, heights(np.array([k]))[0, last], smooth=False)

    energy = _energy(model, mu, int(profile.iteration[last][0]))
    if not energy > 0.0:
        raise ValidityError("nothing slides up to the last measured profile: no K can have worn it")
    hardness = model.circumference_hardness / (2.0 * np.pi * model.radius)
    allowed = float(allowed_coefficient(volume=2.0 * np.pi * model.radius * section, energy=energy, hardness=hardness))
    bisection = bisect_depth(lambda k: track(k).depth, measured_depth=measured.depth, start=allowed)
    squares = fit_positive(heights, measured=profile.height, weights=np.ones_like(profile.height), start=allowed)
    error = (measured.depth - track(squares.value).depth) / measured.depth * 100.0
    agrees = abs(error) < TOLERANCE
    k = squares.value if agrees else bisection.wear_coefficient
    simulated = heights(np.array([k]))[0, last]
    return WearFit(
        wear_coefficient=k,
        std=float(np.hypot(squares.std, squares.value - k)),
        method="least squares" if agrees else "bisection",
        bisection=bisection,
        least_squares=squares,
        disc=int(profile.disc[last][0]),
        measured=measured,
        simulated=worn_track(y, simulated, smooth=False),
        y=y,
        height=height,
        simulated_height=simulated,
        squares_height=squares.predicted[last],
        rms=float(np.sqrt(np.mean((height - simulated) ** 2))),
        allowed=allowed,
        energy=energy,
    )


def _energy(model: ForwardModel, mu: Floats, iterations: int) -> float:
    """Energy dissipated in the first iterations [J]."""
    energy = model.predict(BaseParameters.declared(model.experiment, mu[None])).state.energy[0]
    return float(energy[model.points.of_iteration[iterations - 1]])
