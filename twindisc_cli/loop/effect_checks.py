"""One harness for every effect, built in or a user's own: is it all that its file says, and could the loop find it?

The test it acts in: steel discs of 30 mm, steps in partial slip before and after steps in full sliding, profiles of
both discs, temperatures. The last check makes data with the effect at its typical size, noise of a fixed seed on them,
and lets the loop look for it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from twindisc_cli.effects._effect import STAGES, Effect
from twindisc_cli.laws.covariates import COVARIATES
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.model.experiment import (
    Disc,
    Experiment,
    Floats,
    History,
    Measured,
    Options,
    ProfileSamples,
    Rig,
    TemperatureSamples,
    Thermal,
    TractionSamples,
)
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.physics.half_space import ContactError

CHANNELS = ("traction", "profile", "temperature")
CREEPAGE = np.array([0.001, 0.02, 0.09, 0.002, 0.004, 0.01, 0.04])
BASE = {"mu": 0.5, "K": 6e-5, "convection_W_K": 2.0}
NOISE = {"traction": 0.003, "profile": 2e-7, "temperature": 0.2}
"""Standard deviations of what is measured: T/N [1], height [m], temperature [K]."""
SEED = 1  # the same effect file passes or fails in the same way on every run
DRAWS = 24  # points within the limits, beside the corners
SETTLED = 1e-6
"""What moves by less than this share of a channel's range has not changed: the passes of the model stop there."""


@dataclass(frozen=True)
class Check:
    """One claim of an effect file, whether it holds, and what was seen."""

    what: str
    ok: bool
    seen: str = ""

    def __str__(self) -> str:
        """One line."""
        return f"{'ok' if self.ok else 'FAILS'}: {self.what}{f': {self.seen}' if self.seen else ''}"


def declared(name: str, effect: Effect) -> Iterator[Check]:
    """What the file says of the effect is complete, and fits its function."""
    text = effect.explanation
    needed = [part for part in ("=", "Leaves behind, when it is missing:", "Valid for:") if part not in text]
    title = text.partition("\n")[0]
    yield Check("the docstring begins `Name: what happens.`", ":" in title and title.endswith("."), title)
    yield Check("it gives formula, what is left behind, validity", not needed, f"missing: {needed}" if needed else "")
    yield Check("the stage is one of the model's", effect.stage in STAGES, effect.stage)
    known = effect.channel in effect.seen_in <= set(channels())
    yield Check("channel is one of seen_in, all are known", known, f"{effect.channel} of {sorted(effect.seen_in)}")
    over = f"{effect.over}, not one of {', '.join(COVARIATES)}"
    yield Check("over is a covariate of laws, or nothing", effect.over in ("", *COVARIATES), over)
    yield Check("the source has a year, a volume or a section", bool(re.search(r"\d", effect.source)), effect.source)
    code = effect.apply.__code__
    keywords = code.co_varnames[code.co_argcount : code.co_argcount + code.co_kwonlyargcount]
    names = tuple(p.name for p in effect.params)
    yield Check("apply takes each parameter as a keyword", keywords == names, f"{keywords}, declared {names}")
    yield Check("a parameter switches it off", any(p.off is not None for p in effect.params))
    for p in effect.params:
        fits = p.lower <= p.start <= p.upper and p.lower < p.upper and p.start != p.off
        positive = not p.log or (p.lower > 0.0 and (p.off is None or p.off > 0.0))
        yield Check(f"{p.name}: start lies in the bounds and is not off; log is positive", fits and positive)


def acting(name: str, effect: Effect) -> Iterator[Check]:
    """Off it does nothing; on it changes what it says, by each of its parameters."""
    model, plain = _model(), _plain()
    off = {p.name: p.off for p in effect.params if p.off is not None}
    neutral = {p.name: 0.0 for p in effect.params if p.off is None and p.start == 0.0}
    changed = _changed(_predict(model, {name: values_of(effect, {**off, **neutral})}), plain, 0.0)
    yield Check(
        "off, the model is the same to the last bit", not changed, f"changed: {sorted(changed)}" if changed else ""
    )
    typical = _predict(model, {name: values_of(effect, {})})
    seen = _changed(typical, plain)
    what = f"{', '.join(sorted(seen)) or 'none'} changed"
    yield Check("on, it changes the channels of seen_in and no others", seen == effect.seen_in, what)
    for p in effect.params:
        twice = {key: np.repeat(value, 2) for key, value in values_of(effect, {}).items()}
        moved = _predict(model, {name: twice | {p.name: np.array(ends_of(effect)[p.name])}})
        yield Check(f"{p.name} does something", effect.channel in _changed(moved, typical))


def sound(name: str, effect: Effect) -> Iterator[Check]:
    """Finite in the corners of its bounds and at random places inside."""
    limits = ends_of(effect)
    corners = np.stack([c.ravel() for c in np.meshgrid(*limits.values(), indexing="ij")], axis=1)
    low, high = np.array(list(limits.values())).T
    part = np.random.default_rng(SEED).random((DRAWS, len(limits)))
    inside = np.concatenate([corners, low + part * (high - low)])
    try:
        sets = {key: np.ascontiguousarray(column) for key, column in zip(limits, inside.T, strict=True)}
        prediction = _predict(_model(), {name: sets})
        finite = [np.isfinite(getattr(prediction, channel)).all(axis=1) for channel in CHANNELS]
        bad = inside[~np.all(finite, axis=0)]
        seen = f"not at {dict(zip(limits, bad[0].tolist(), strict=True))}" if len(bad) else f"{len(inside)} places"
        yield Check("finite anywhere in its bounds", not len(bad), seen)
    except (ContactError, ArithmeticError, ValueError) as error:
        yield Check("finite anywhere in its bounds", False, f"{type(error).__name__}: {error}")


def found_again(name: str, effect: Effect) -> Iterator[Check]:
    """The loop names it on a synthetic test, alone or among what it cannot be separated from."""
    diagnosis = diagnose([_synthetic(name, effect)], validate=None, progress=lambda _what, _part: None, quick=True)
    sets = {
        result.name: (result.name, *(str(alternative.term) for alternative in result.alternatives))
        for result in diagnosis.effects
    }
    mine = next((head for head, members in sets.items() if name in members), None)
    if mine is None:
        names = ", ".join([*sets, *(law.name for law in diagnosis.laws)]) or "nothing"
        yield Check("the loop finds it on a synthetic test", False, f"it names {names}")
        return
    others = ", ".join(other for other in sets[mine] if other != name)
    yield Check("the loop finds it on a synthetic test", True, f"not separated from {others}" if others else "alone")
    if mine == name:
        estimates = next(result.parameters for result in diagnosis.effects if result.name == name)
        truth = {p.name: p.start for p in effect.params}
        seen = ", ".join(
            f"{key} {e.value:.3g} ± {e.std:.1g} (made with {truth[key]:g})" for key, e in estimates.items()
        )
        yield Check("its parameters there, with a standard deviation", True, seen)


def _synthetic(name: str, effect: Effect) -> Experiment:
    """The test as it would be measured with the effect at its typical size, with noise of a fixed seed."""
    blank = blank_test()
    made = _predict(_model(), {name: values_of(effect, {})})
    rng = np.random.default_rng(SEED)
    noisy = {c: getattr(made, c)[0] + NOISE[c] * rng.standard_normal(getattr(made, c).shape[1]) for c in CHANNELS}
    traction, profile, temperature = blank.measured.traction, blank.measured.profile, blank.measured.temperature
    assert traction is not None  # the blank test measures all three
    assert profile is not None
    assert temperature is not None
    measured = Measured(
        traction=replace(traction, ratio=noisy["traction"]),
        profile=replace(profile, height=noisy["profile"]),
        temperature=replace(temperature, temperature=noisy["temperature"]),
        provenance="synthetic",
    )
    return replace(blank, measured=measured)


def blank_test() -> Experiment:
    """Steel discs of 30 mm at 72 N: seven steps of three iterations, measured in all channels."""
    steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": 700 * 9.80665e6}
    rig = Rig(Disc(0.03, np.inf, **steel), Disc(0.03, 0.03, **steel), normal_load=72.0, rolling_speed=9.42)
    step = np.repeat(np.arange(len(CREEPAGE)), 3)
    ones = np.ones(len(step))
    history = History(step, CREEPAGE[step], 84.0 * ones, 4200.0 * ones, np.nan * ones)
    at = np.repeat(np.arange(len(step)), 6)
    time = 14.0 * np.arange(1.0, len(at) + 1.0)
    across = np.linspace(-1.5e-3, 1.5e-3, 121)
    facet = np.minimum((across**2 - 0.5e-3**2) / 0.06, 0.0)
    y, height = np.tile(across, 3), np.concatenate([0.1 * facet, 0.6 * facet, facet])
    stops = np.repeat([len(step), 9, len(step)], 121)
    measured = Measured(
        traction=TractionSamples(time, step[at], CREEPAGE[step][at], 0.5 * np.ones(len(at)), np.full(len(at), np.nan)),
        profile=ProfileSamples(y, height, np.repeat([1, 2, 2], 121), stops),
        temperature=TemperatureSamples(time, np.full(len(time), 300.0)),
        provenance="synthetic",
    )
    thermal = Thermal(293.15, 100.0, 293.15)
    return Experiment("synthetic", "", rig, history, Options(), thermal, measured=measured)


@cache
def _model() -> ForwardModel:
    return ForwardModel(blank_test())


@cache
def _plain() -> Prediction:
    """The prediction without any effect."""
    return _predict(_model())


def _predict(model: ForwardModel, effects: Mapping[str, Mapping[str, Floats]] | None = None) -> Prediction:
    base: Any = {key: np.array([value]) for key, value in BASE.items()}
    return model.predict(base, effects)


def values_of(effect: Effect, given: Mapping[str, float]) -> dict[str, Floats]:
    """Every parameter at its start, but for those given."""
    return {p.name: np.array([given.get(p.name, p.start)]) for p in effect.params}


def ends_of(effect: Effect) -> dict[str, tuple[float, float]]:
    """What a definition allows each parameter: its bounds, and `off`."""
    limits = {p.name: [p.lower, p.upper, *([] if p.off is None else [p.off])] for p in effect.params}
    return {name: (min(some), max(some)) for name, some in limits.items()}


def _changed(prediction: Prediction, than: Prediction, tolerance: float = SETTLED) -> set[str]:
    """Channels that differ in any set by more than `tolerance` times their own range."""
    pairs = {channel: (getattr(prediction, channel), getattr(than, channel)) for channel in CHANNELS}
    return {c for c, (new, old) in pairs.items() if np.max(np.abs(new - old)) > tolerance * np.ptp(old)}
