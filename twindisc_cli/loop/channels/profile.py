"""Worn profile: the height change across the track at the recorded stops; it fixes the wear coefficient."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.identify.energy import measured_energy
from twindisc_cli.loop.channels._channel import Channel, Generic, Mask, known, wear_coefficient
from twindisc_cli.loop.channels._held_out import held_out_bands
from twindisc_cli.loop.generic import RIPPLES, levels, waves
from twindisc_cli.loop.noise import Noise
from twindisc_cli.loop.noise_estimate import estimate, in_a_run, scatter
from twindisc_cli.loop.trends import FEWEST_FREE, polynomials
from twindisc_cli.model.experiment import Experiment, Floats, Ints, ProfileSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.model.surface import recorded_sections
from twindisc_cli.quantities import Quantity

NEIGHBOURS = 9  # points of a running median: longer than a spike, shorter than a waviness
SPIKE = 6.0  # standard deviations: one in 5e8 of normal noise


def recorded_stops(test: Experiment) -> set[tuple[int, int]]:
    """Disc and iteration of every recorded profile."""
    profile = test.measured.profile
    return set() if profile is None else set(zip(profile.disc.tolist(), profile.iteration.tolist(), strict=True))


def _guess(model: ForwardModel) -> float:
    """K from W H / E of the last recorded profile, with the traction as it was measured."""
    test = model.experiment
    if test.measured.profile is None:
        return np.nan
    profile = known(test.measured.profile)
    last = profile.iteration == profile.iteration.max()
    section = max(sum(recorded_sections(profile, last)), 1e-14)
    return float(np.clip(section * model.circumference_hardness / measured_energy(test), 1e-8, 0.5))


def noise(test: Experiment) -> Noise:
    """Noise of the height, from the outer parts of the unworn flanks of every recorded profile."""
    profile = known(test.measured.profile)
    record = _records(profile)
    flank = _flanks(profile, record)
    position, series = profile.y, record * 2 + (profile.y > 0.0)
    size = float(np.ptp(profile.height))
    if flank.sum() >= 6 * FEWEST_FREE:
        trend = polynomials(profile.y[flank], series[flank], 1, 6)
        result = estimate(profile.height[flank], [trend], position[flank], series[flank], size, correlated=True)
    else:
        trend = polynomials(profile.y, record, 24, 3)
        result = estimate(profile.height, [trend], position, record, size, correlated=True)
    order = np.lexsort((profile.y, record))
    spacing = float(np.median(np.diff(profile.y[order])[np.diff(record[order]) == 0]))
    kept = np.ones(len(profile.y), dtype=bool)
    for here in _each(profile, record):
        rough = profile.height[here] - _smoothed(profile.height[here])
        far = np.abs(rough) > SPIKE * max(result.std, scatter(rough))
        kept[here] = ~far | in_a_run(far)
    return result.at(kept, position / spacing, record)


def _smoothed(height: Floats) -> Floats:
    """Medians of NEIGHBOURS samples (sample,), beyond the ends as at the ends."""
    beyond = np.pad(height, NEIGHBOURS // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(beyond, NEIGHBOURS), axis=1))


def _records(profile: ProfileSamples) -> Ints:
    """Number of the recorded profile to which each sample belongs."""
    stops = np.unique(np.stack([profile.disc, profile.iteration]), axis=1, return_inverse=True)[1]
    return np.asarray(stops.ravel(), dtype=np.int64)


def _each(profile: ProfileSamples, record: Ints) -> Iterator[Ints]:
    """The samples of each recorded profile, in order across the track."""
    for number in np.unique(record):
        here = np.flatnonzero(record == number)
        yield here[np.argsort(profile.y[here])]


def _flanks(profile: ProfileSamples, record: Ints) -> Mask:
    """Samples well outside the worn zone, where the smoothed height leaves the line through the outer parts."""
    outer = np.abs(profile.y).max()
    edge = 0.0
    for here in _each(profile, record):
        y, far = profile.y[here], np.abs(profile.y[here]) > 0.85 * outer
        if far.sum() < 3:
            continue
        left = profile.height[here] - np.polyval(np.polyfit(y[far], profile.height[here][far], 1), y)
        spread = 1.5 * np.median(np.abs(left[far])) + 1e-12
        width = max(3, len(here) // 60)
        smooth = np.convolve(left, np.full(width, 1.0 / width), mode="same")
        worn = np.abs(smooth[width:-width]) > 4.0 * spread
        if worn.any():
            edge = max(edge, float(np.abs(y[width:-width][worn]).max()))
    return np.asarray(np.abs(profile.y) > edge + 0.25 * (outer - edge))


def _generic(model: ForwardModel, prediction: Prediction) -> Iterator[Generic]:
    samples = known(model.experiment.measured.profile)
    surface = prediction.state.surface
    edge = float(surface.edge.max()) if surface is not None else 0.5 * float(np.abs(samples.y).max())
    unit = samples.y / max(1.3 * edge, 1e-9)
    inside = np.abs(unit) <= 1.0
    legendre = np.asarray(np.polynomial.legendre.legvander(np.clip(unit, -1.0, 1.0), 10) * inside[:, None], dtype=float)
    yield "y", "even", legendre[:, 0::2]
    yield "y", "odd", legendre[:, 1::2]
    for centre in np.linspace(-1.0, 1.0, 17):
        yield "y", "bump", np.exp(-0.5 * ((unit - centre) / 0.08) ** 2)[:, None]
    for wave in waves(np.clip(unit, -1.0, 1.0), RIPPLES):
        yield "y", "wave", wave * inside[:, None]
    yield "y", "line", np.stack([np.ones_like(unit), samples.y / np.abs(samples.y).max()], axis=1)
    stops = _records(samples)
    if stops.max() > 0:
        shape = -prediction.profile[0]
        yield "time", "stops", levels(stops) * (shape / max(float(np.ptp(shape)), 1e-30))[:, None]


def _withheld(test: Experiment, steps: tuple[int, ...]) -> Mask:
    return held_out_bands(known(test.measured.profile).y)


def _covariates(model: ForwardModel, prediction: Prediction) -> dict[str, Floats | Ints]:
    test, profile = model.experiment, known(model.experiment.measured.profile)
    return {"y": profile.y, "disc": profile.disc, "iteration": test.history.completed(profile.iteration)}


def _planned(test: Experiment, times: Floats, half_width: float) -> ProfileSamples:
    y = np.linspace(-half_width, half_width, 201)
    stops = np.unique(np.linspace(1, len(test.history.step), 4).astype(np.int64))
    every = len(y) * len(stops)
    return ProfileSamples(
        np.tile(y, len(stops)), np.zeros(every), np.full(every, 2, dtype=np.int64), np.repeat(stops, len(y))
    )


CHANNEL = Channel(
    name="profile",
    label="worn profile",
    quantity=Quantity("profile", "h", "height change", "um"),
    order=2,
    assumed_noise=1e-7,
    samples=lambda test: test.measured.profile,
    values=lambda samples: np.asarray(samples.height),
    predicted=lambda model, prediction: prediction.profile,
    noise=noise,
    generic=_generic,
    withheld=_withheld,
    covariates=_covariates,
    planned=_planned,
    parameters=(wear_coefficient(_guess),),
    look_at={
        "y": "how wear spreads across the track: patch shape, alignment, play, both discs, the profilometer",
        "time": "a wear coefficient that changed over the history",
    },
)
