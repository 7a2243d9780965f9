"""The wear coefficient of a test from its measured profile, by the paper's bisection and by least squares.

The two agree where the simulated profile has the measured one's shape. Where it has not, least squares trades depth
against width; then the depth decides, as in the paper, and the standard error takes in how far the two are apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from twindisc_cli.errors import MeasurementError, Problem, ValidityError
from twindisc_cli.identify.energy import wear_factors
from twindisc_cli.identify.least_squares import Fit, fit_positive
from twindisc_cli.identify.track import UPSIDE_DOWN, Track, last_profile, standing_up, worn_track
from twindisc_cli.identify.wear_coefficient import TOLERANCE, Bisection, bisect_depth
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Floats, Ints
from twindisc_cli.model.forward import ForwardModel, IntegratedSets
from twindisc_cli.physics.archard import allowed_coefficient


@dataclass(frozen=True)
class WornDisc:
    """What the last measured profile says of the disc that wears, `disc`, and what wore it.

    last: the samples of that profile among all; stop: the entry of the history, from 1, by whose end it was recorded;
    y and height of the samples [m], (sample,); measured: their track.
    allowed: the K of W H / E, W worn off both discs, which declared effects multiply; part: the measured disc's share
    of W by the declared effects; energy: what was dissipated up to that profile [J]; sliding: the normal load times the
    distance slid by then [N m].
    """

    last: Ints
    stop: int
    disc: int
    y: Floats
    height: Floats
    measured: Track
    allowed: float
    part: float
    energy: float
    sliding: float


@dataclass(frozen=True)
class WearFit(WornDisc):
    """K and its standard error [1], by `method` "least squares" or "bisection"; both, and what they rest on.

    simulated: the track at K. Of the last profile, (sample,): simulated_height at K, squares_height at the
    least-squares K [m]; rms of height less simulated_height [m].
    """

    wear_coefficient: float
    std: float
    method: str
    bisection: Bisection
    least_squares: Fit
    simulated: Track
    simulated_height: Floats
    squares_height: Floats
    rms: float

    @property
    def archard(self) -> float:
        """Archard's k of W = k N s / H [1] over K of W = K E / H: the mean T/N, weighed by the distance slid."""
        return self.energy / self.sliding

    def with_energy_error(self, error: float) -> WearFit:
        """Add the standard error of the energy, as a share of it, to those of K."""
        squares = self.least_squares
        squares = replace(squares, std=float(np.hypot(squares.std, error * squares.value)))
        return replace(self, least_squares=squares, std=_std(squares, self.wear_coefficient))


def identify_wear(model: ForwardModel, mu: Floats) -> WearFit:
    """Fit K to the measured profiles with mu (step,) in the contact."""
    worn = _worn(model, mu)

    def last_height(k: float) -> Floats:
        return np.asarray(_heights(model, mu, np.array([k]))[0, worn.last])

    def depth(k: float) -> float:
        return worn_track(worn.y, last_height(k), smooth=False).depth

    measured = worn.measured.depth
    bisection = bisect_depth(depth, measured_depth=measured, start=worn.allowed)
    squares = _squares(model, mu, worn.allowed)
    agrees = abs(measured - depth(squares.value)) / measured * 100.0 < TOLERANCE
    k = squares.value if agrees else bisection.wear_coefficient
    simulated = last_height(k)
    factor = wear_factors(model, mu, k, [worn.stop])[0]
    worn = replace(worn, allowed=worn.allowed / factor)
    return WearFit(
        **vars(worn),
        wear_coefficient=k,
        std=_std(squares, k),
        method="least squares" if agrees else "bisection",
        bisection=bisection,
        least_squares=squares,
        simulated=worn_track(worn.y, simulated, smooth=False),
        simulated_height=simulated,
        squares_height=squares.predicted[worn.last],
        rms=float(np.sqrt(np.mean((worn.height - simulated) ** 2))),
    )


def _std(squares: Fit, k: float) -> float:
    """Standard error of K, which takes in how far the K of least squares is from it."""
    return float(np.hypot(squares.std, squares.value - k))


def fit_wear_squares(model: ForwardModel, mu: Floats) -> Fit:
    """K by least squares alone, with mu (step,) in the contact: the whole of the measured profiles, not their depth."""
    return _squares(model, mu, _worn(model, mu).allowed)


def _squares(model: ForwardModel, mu: Floats, start: float) -> Fit:
    profile = model.experiment.measured.profile
    assert profile is not None
    heights, weights = partial(_heights, model, mu), np.ones_like(profile.height)
    rough = partial(heights, integrated="none")
    return fit_positive(heights, measured=profile.height, weights=weights, start=start, rough=rough)


def _heights(model: ForwardModel, mu: Floats, k: Floats, integrated: IntegratedSets = "each") -> Floats:
    """The profiles (set, sample) [m] with each K (set,)."""
    base = BaseParameters.declared(model.experiment, np.broadcast_to(mu, (len(k), len(mu))))
    return model.predict(replace(base, K=k), integrated=integrated).profile


def _worn(model: ForwardModel, mu: Floats) -> WornDisc:
    profile = model.experiment.measured.profile
    if profile is None:
        only = (
            "the only profile is that of the new disc" if model.experiment.measured.start else "no profile was measured"
        )
        raise MeasurementError(f"{only}: name one of the worn disc, or the mass lost, under [measured]")
    last = last_profile(profile)
    y, height = profile.y[last], profile.height[last]
    disc, stop = int(profile.disc[last][0]), int(profile.iteration[last][0])
    track, section = worn_track(y, height, smooth=True), -float(np.trapezoid(height, y))
    if not (track.depth > 0.0 and section > 0.0):
        raise MeasurementError(_nothing_worn(y, height))
    energy, sliding, part = _spent(model, mu, stop, disc)
    if not energy > 0.0:
        raise ValidityError("nothing slides up to the last measured profile: no K can have worn it")
    volume = 2.0 * np.pi * model.radius * section / part
    allowed = float(allowed_coefficient(volume=volume, energy=energy, hardness=model.experiment.rig.disc2.hardness))
    return WornDisc(last, stop, disc, y, height, track, allowed, part, energy, sliding)


def _nothing_worn(y: Floats, height: Floats) -> Problem:
    """That the last measured profile has no track, and what can make it so."""
    what = "nothing is worn off in the last measured profile: no height in it is below the rest"
    if up := standing_up(y, height):
        what = (
            "nothing is worn off in the last measured profile: it stands up by "
            f"{up * 1e6:.3g} µm where a track would be cut in; {UPSIDE_DOWN}"
        )
    return Problem(what, key="profile")


def _spent(model: ForwardModel, mu: Floats, iterations: int, disc: int) -> tuple[float, float, float]:
    """Of the first iterations: energy dissipated [J], load times distance slid [N m]; a disc's part of the wear [1].

    The part is that of the declared effects; a K of disc 1 that is declared stands beside K, and shares nothing out.
    ValidityError where the disc bears none.
    """
    test = model.experiment
    state = model.predict(BaseParameters.declared(test, mu[None])).state
    last = int(model.points.of_iteration[iterations - 1])
    pressed = np.broadcast_to(np.abs(state.sliding_speed) * state.normal_load, state.energy.shape)[0]
    sliding = float(np.sum((pressed * state.duration)[: last + 1]))
    if np.isfinite(test.options.disc1_wear_coefficient):
        return float(state.energy[0, last]), sliding, 1.0
    share = float(np.broadcast_to(state.disc1_share, state.energy.shape)[0, last])
    part = share if disc == 1 else 1.0 - share
    if not part > 0.0:
        what = f"the last profile is of disc {disc}, and by the model it does not wear: declare wear_partition"
        raise ValidityError(what)
    return float(state.energy[0, last]), sliding, part
