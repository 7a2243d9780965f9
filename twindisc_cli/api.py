"""The public interface: arrays in, arrays out, SI units, creepages and T/N as ratios.

These names are imported from `twindisc_cli` itself and keep their meaning from version to version; what else the
package holds may move. The commands compute by the same functions.

>>> import numpy as np
>>> from twindisc_cli import Disc, Rig, creep_curve
>>> steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": 700 * 9.80665e6}
>>> rig = Rig(Disc(0.03, np.inf, **steel), Disc(0.03, 0.03, **steel), normal_load=72.0, rolling_speed=9.42)
>>> print(f"{rig.patch.a * 1e3:.4f} mm x {rig.patch.b * 1e3:.4f} mm, {rig.patch.p0 * 1e-6:.1f} MPa")
0.1706 mm x 0.2706 mm, 744.5 MPa
>>> print(creep_curve(rig, [0.0005, 0.002, 0.02], mu=0.6).round(3))
[0.094 0.315 0.6  ]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.identify.chart import friction_chart
from twindisc_cli.identify.friction import mu_from_traction
from twindisc_cli.identify.law import unworn_law
from twindisc_cli.identify.wear_history import WearHistory, wear_history
from twindisc_cli.loop.averaging import averaged
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.diagnosis import Diagnosis
from twindisc_cli.model.experiment import (
    Contact,
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
    Traction,
    TractionSamples,
    mean_radius,
)
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.traction_law import theory_for
from twindisc_cli.physics.disc_heat import temperatures

__all__ = [
    "Disc",
    "Experiment",
    "Rig",
    "Thermal",
    "close_loop",
    "creep_curve",
    "disc_temperature",
    "experiment",
    "identify_friction",
    "wear_track",
]


def creep_curve(rig: Rig, creepage: ArrayLike, *, mu: ArrayLike, traction: Traction | None = None) -> Floats:
    """T/N of the unworn discs over the creepage.

    Parameters
    ----------
    rig
        The discs and how they are driven.
    creepage : (n,)
        Difference of the surface speeds over their mean [1], of either sign.
    mu : scalar or (m,)
        Coefficient of friction in the contact [1].
    traction
        "fastsim" (the paper's), "fastrip", or "exact" (CONTACT's theory, from a table); left out: "fastsim", and
        "exact" on two cylinders.

    Returns
    -------
    (n,) or (m, n)
        Traction over normal load [1], a row for each mu where there are several.

    Raises
    ------
    ValidityError
        A quantity lies outside the range of the theory.
    ValueError
        A name or a number is not what it can be, or there are not as many of both arrays.

    Examples
    --------
    In full sliding T/N is mu, and the sign is the creepage's:

    >>> rig = Rig(Disc(0.03, np.inf, 206e9, 0.3, 7e9), Disc(0.03, 0.03, 206e9, 0.3, 7e9), 72.0, 9.42)
    >>> print(creep_curve(rig, [0.05, -0.05], mu=0.6))
    [ 0.6 -0.6]
    >>> creep_curve(rig, [0.001, 0.05], mu=[0.3, 0.6], traction="exact").shape
    (2, 2)
    """
    test = _bare(rig, Options(traction=_theory(rig, traction)))
    friction = _positive("mu", mu, or_zero=True)
    result = friction_chart(test, mu=friction, creepage=_floats(creepage)).apparent
    return result if np.ndim(mu) else np.asarray(result[0])


def identify_friction(
    rig: Rig, creepage: ArrayLike, traction_ratio: ArrayLike, *, traction: Traction | None = None
) -> Floats:
    """The coefficient of friction in the contact behind each measured T/N.

    Parameters
    ----------
    rig
        The discs and how they are driven.
    creepage : (n,)
        Difference of the surface speeds over their mean [1], of either sign.
    traction_ratio : (n,)
        Measured traction over normal load [1].
    traction
        "fastsim" (the paper's), "fastrip", or "exact" (CONTACT's theory, from a table); left out: "fastsim", and
        "exact" on two cylinders.

    Returns
    -------
    (n,)
        mu [1]; inf where T/N is above what elasticity allows at that creepage, NaN without creepage.

    Raises
    ------
    ValidityError
        A quantity lies outside the range of the theory.
    ValueError
        A name or a number is not what it can be, or there are not as many of both arrays.

    Examples
    --------
    It inverts `creep_curve` exactly:

    >>> rig = Rig(Disc(0.03, np.inf, 206e9, 0.3, 7e9), Disc(0.03, 0.03, 206e9, 0.3, 7e9), 72.0, 9.42)
    >>> ratio = creep_curve(rig, [0.0005, 0.002, 0.02], mu=0.6)
    >>> print(identify_friction(rig, [0.0005, 0.002, 0.02], ratio))
    [0.6 0.6 0.6]
    >>> print(identify_friction(rig, [0.0001], [0.5]))
    [inf]
    """
    law, slip = unworn_law(_bare(rig, Options(traction=_theory(rig, traction)))), np.abs(_floats(creepage))
    ratio = _floats(traction_ratio) * np.sign(_equally_many("creepages", creepage, "T/N", traction_ratio)[0])
    mu = mu_from_traction(ratio, traction=lambda mu: law.apparent(mu, slip))
    return np.where(slip > 0.0, mu, np.nan)


def wear_track(
    rig: Rig,
    creepage: ArrayLike,
    revolutions: ArrayLike,
    *,
    mu: ArrayLike,
    wear_coefficient: float,
    contact: Contact = "hertz",
) -> WearHistory:
    """What wear makes of disc 2 by Archard's law (Eqs. 13 to 15), iteration by iteration.

    Parameters
    ----------
    rig
        The discs and how they are driven.
    creepage : (n,)
        Creepage of each iteration [1].
    revolutions : (n,) or scalar
        Revolutions of each iteration.
    mu : scalar or (step,)
        Coefficient of friction in the contact [1]; iterations of one creepage in a row are a step.
    wear_coefficient
        K of the worn volume K E / H, with the dissipated energy E [J] and the hardness H [Pa].
    contact
        "hertz" updates the curvature by the best circle, as the paper does; "half_space" solves the worn profile's own
        patch.

    Returns
    -------
    WearHistory
        Profile, track, patch, worn volume and energy after each iteration.

    Raises
    ------
    ValidityError
        The patch outgrows the discs, or a quantity lies outside the range of the theory.
    ValueError
        There are not as many mu as steps, or a number is not what it can be.

    Examples
    --------
    What is worn off is K times the dissipated energy over the hardness, to rounding:

    >>> rig = Rig(Disc(0.03, np.inf, 206e9, 0.3, 7e9), Disc(0.03, 0.03, 206e9, 0.3, 7e9), 72.0, 9.42)
    >>> worn = wear_track(rig, [0.005, 0.02], [4200, 4200], mu=0.6, wear_coefficient=7e-5)
    >>> bool(np.isclose(worn.volume[-1] * 7e9 / 7e-5, worn.energy[-1], rtol=1e-4))
    True
    >>> print(f"{worn.track[-1].depth * 1e6:.2f} um deep, {worn.track[-1].width * 1e3:.2f} mm wide")
    0.12 um deep, 0.54 mm wide
    """
    history = _history(rig, creepage, revolutions)
    _positive("wear_coefficient", wear_coefficient)
    options = Options(contact=_one_of("contact", contact, get_args(Contact)), wear_coefficient=wear_coefficient)
    model = ForwardModel(replace(_bare(rig, options), history=history))
    friction, steps = _positive("mu", mu), len(history.step_begin)
    if len(friction) not in (1, steps):
        raise ValueError(f"{len(friction)} mu for {steps} steps: give one mu for each step, or one for all")
    return wear_history(model, mu=np.broadcast_to(friction, steps), wear_coefficient=wear_coefficient)


def disc_temperature(
    power: ArrayLike,
    duration: ArrayLike,
    *,
    heat_capacity: float,
    convection: float,
    environment: float = 293.15,
    initial: float | None = None,
) -> Floats:
    """Temperature of a disc that convection cools, exact between the changes of power (Eq. 18).

    Parameters
    ----------
    power : (n,) or scalar
        Heat that enters the disc in each interval [W].
    duration : (n,) or scalar
        Length of each interval [s].
    heat_capacity
        Mass times specific heat [J/K].
    convection
        h S, heat transfer coefficient times cooled surface [W/K].
    environment
        Temperature of the surroundings [K].
    initial
        Temperature at the beginning [K]; the environment's where none is given.

    Returns
    -------
    (n,)
        Temperature at the end of each interval [K].

    Examples
    --------
    After many time constants the warming is P / hS, after one it is 1 - 1/e of that:

    >>> print(disc_temperature([16.0, 16.0], [62.5, 1e6], heat_capacity=100.0, convection=1.6) - 293.15)
    [ 6.32120559 10.        ]
    """
    start = environment if initial is None else initial
    watts, seconds = np.broadcast_arrays(_floats(power), _positive("duration", duration, or_zero=True))
    _positive("heat_capacity", heat_capacity)
    _positive("convection", convection, or_zero=True)
    return np.asarray(
        temperatures(
            power=watts[None],
            duration=seconds,
            capacity=heat_capacity,
            convection=convection,
            environment=environment,
            initial=start,
        )[0]
    )


def experiment(
    rig: Rig,
    creepage: ArrayLike,
    revolutions: ArrayLike,
    *,
    traction_ratio: ArrayLike | None = None,
    traction_time: ArrayLike | None = None,
    profile: tuple[ArrayLike, ArrayLike] | None = None,
    temperature: tuple[ArrayLike, ArrayLike] | None = None,
    thermal: Thermal | None = None,
    mu: float = np.nan,
    wear_coefficient: float = np.nan,
    contact: Contact = "hertz",
    name: str = "test",
) -> Experiment:
    """A test for `close_loop`: how it was driven, and what was measured.

    Parameters
    ----------
    rig
        The discs and how they are driven.
    creepage : (n,)
        Creepage of each iteration [1]; iterations of one creepage in a row are a step.
    revolutions : (n,) or scalar
        Revolutions of each iteration.
    traction_ratio : (n,) or (sample,)
        Measured T/N [1], one for each iteration, or samples at `traction_time`.
    traction_time : (sample,)
        Times of the samples of T/N [s].
    profile
        Places across the track and height change of disc 2 at the end [m], two arrays (place,).
    temperature
        Times [s] and disc temperature [K], two arrays (sample,); it needs `thermal`.
    thermal
        Heat capacity, convection and environment of the disc.
    mu
        Coefficient of friction [1], where it is not to be identified.
    wear_coefficient
        K, where it is not to be identified.
    contact
        "hertz" (best circle, the paper's) or "half_space".
    name
        What the test is called in the result.

    Returns
    -------
    Experiment
        A test that `close_loop` takes.

    Raises
    ------
    ValueError
        There are not as many T/N as iterations or times, or a number is not what it can be.

    Examples
    --------
    >>> rig = Rig(Disc(0.03, np.inf, 206e9, 0.3, 7e9), Disc(0.03, 0.03, 206e9, 0.3, 7e9), 72.0, 9.42)
    >>> test = experiment(rig, [0.01, 0.01, 0.02], [4200] * 3, traction_ratio=[0.5, 0.52, 0.55])
    >>> test.history.step.tolist(), round(float(test.history.end_time[-1]), 1)
    ([0, 0, 1], 252.1)
    """
    history = _history(rig, creepage, revolutions)
    if temperature is not None and thermal is None:
        raise ValueError("a temperature needs thermal: the heat capacity and the environment of the disc")
    for what, value in (("mu", mu), ("wear_coefficient", wear_coefficient)):
        if not np.isnan(value):
            _positive(what, value)
    measured = Measured(
        traction=None if traction_ratio is None else _traction(history, traction_ratio, traction_time),
        profile=None if profile is None else _profile(history, *profile),
        temperature=None if temperature is None else _temperature(history, *temperature),
    )
    _one_of("contact", contact, get_args(Contact))
    options = Options(contact=contact, wear_coefficient=wear_coefficient, friction_coefficient=mu)
    return Experiment(name, "", rig, history, options, thermal, measured=measured)


def close_loop(
    *tests: Experiment,
    validate: Experiment | None = None,
    predict: Sequence[Experiment] = (),
    quick: bool = False,
    progress: Callable[[str, float], None] = lambda what, fraction: None,
) -> Diagnosis:
    """What the model lacks in these tests.

    Parameters
    ----------
    *tests
        One test or several, which then share what is found.
    validate
        A test that is not fitted but counts in the choice.
    predict
        Tests that are predicted at the end and count in nothing.
    quick
        No resampling, and so no probabilities.
    progress
        Called as progress(what, fraction) as it goes.

    Returns
    -------
    Diagnosis
        Verdict, effects and laws with their parameters, errors before and after, and what else it could be.

    Raises
    ------
    ValueError
        Nothing was measured, or nothing that fixes the friction.

    Examples
    --------
    A friction that falls with the sliding speed, in samples with a scatter of 0.003:

    >>> rig = Rig(Disc(0.03, np.inf, 206e9, 0.3, 7e9), Disc(0.03, 0.03, 206e9, 0.3, 7e9), 72.0, 9.42)
    >>> creepage = np.repeat([0.02, 0.06, 0.015, 0.09, 0.03, 0.045], 8)
    >>> falling = 0.6 * (0.5 + 0.5 * np.exp(-3.0 * 9.42 * creepage))
    >>> ratio = falling + 0.003 * np.random.default_rng(1).standard_normal(len(creepage))
    >>> found = close_loop(experiment(rig, creepage, np.full(48, 500), traction_ratio=ratio), quick=True)
    >>> found.verdict, [effect.name for effect in found.effects]
    ('effects_found', ['falling_friction'])
    >>> print(f"{found.effects[0].parameters['ratio'].value:.1f}")
    0.5
    """
    own, others = ([averaged(test) for test in group] for group in (tests, predict))
    other = averaged(validate) if validate is not None else None
    found = diagnose(
        [test for test, _ in own],
        validate=other[0] if other else None,
        predict=[test for test, _ in others],
        quick=quick,
        progress=progress,
    )
    used = [note for _, notes in (*own, *others, *([other] if other else [])) for note in notes]
    return replace(found, notes=[*used, *found.notes])


def _floats(values: ArrayLike) -> Floats:
    """Values (n,); ValueError where they have more axes."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    if array.ndim > 1:
        raise ValueError(f"an array of shape {array.shape}: give one axis")
    return array


def _finite(what: str, values: ArrayLike) -> Floats:
    array = _floats(values)
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{what} must be finite numbers")
    return array


def _positive(what: str, values: ArrayLike, *, or_zero: bool = False) -> Floats:
    array = _floats(values)
    if not np.all(np.isfinite(array) & ((array > 0.0) | (or_zero & (array == 0.0)))):
        raise ValueError(f"{what} must be finite and {'not negative' if or_zero else 'greater than 0'}")
    return array


def _equally_many(what: str, values: ArrayLike, other: str, others: ArrayLike) -> tuple[Floats, Floats]:
    one, two = _floats(values), _floats(others)
    if one.shape != two.shape:
        raise ValueError(f"{len(two)} {other} for {len(one)} {what}: give as many of both")
    return one, two


def _one_of(what: str, named: Any, names: Sequence[str]) -> Any:
    if named not in names:
        raise ValueError(f"{what} is one of {', '.join(names)}, not {named}")
    return named


def _theory(rig: Rig, named: Traction | None) -> Traction:
    """The theory of rolling that is named, else the usual one."""
    return theory_for(rig, None if named is None else _one_of("traction", named, get_args(Traction)))


def _rising(what: str, time: Floats, history: History) -> None:
    """Times rise, from 0 to the end of the history."""
    end = float(history.end_time[-1])
    if not np.all(np.diff(time) > 0.0) or not np.all((time >= 0.0) & (time <= end * 1.001)):
        raise ValueError(f"the times of the {what} must rise, and lie in the history, 0 to {end:g} s")


def _bare(rig: Rig, options: Options) -> Experiment:
    """A rig as a test without measurements, which has not run yet."""
    return Experiment("", "", rig, _history(rig, [0.01], [1.0]), options)


def _history(rig: Rig, creepage: ArrayLike, revolutions: ArrayLike) -> History:
    """Iterations (n,); those of one creepage in a row are a step. They last as long as the mean disc turns so often."""
    slip, turns = np.broadcast_arrays(_finite("creepages", creepage), _positive("revolutions", revolutions))
    if not len(slip):
        raise ValueError("no iterations: give a creepage for each")
    for what in ("normal_load", "rolling_speed"):
        _positive(what, getattr(rig, what))
    around = 2.0 * np.pi * mean_radius(rig.disc1, rig.disc2)
    step = np.concatenate([[0], np.cumsum(np.diff(slip) != 0.0)])
    return History(step, slip, turns * around / rig.rolling_speed, turns, np.full(len(slip), np.nan))


def _traction(history: History, ratio: ArrayLike, time: ArrayLike | None) -> TractionSamples:
    middle = history.end_time - 0.5 * history.duration
    at = middle if time is None else _floats(time)
    values, number = _floats(ratio), history.iteration_at(at)
    if values.shape != at.shape:
        expected = "one T/N for each iteration" if time is None else "as many times as T/N"
        raise ValueError(f"{len(values)} T/N for {len(at)} places: give {expected}")
    _finite("T/N", values)
    _rising("T/N", at, history)
    return TractionSamples(at, history.step[number], history.creepage[number], values, np.full(len(at), np.nan))


def _profile(history: History, places: ArrayLike, heights: ArrayLike) -> ProfileSamples:
    y, height = _equally_many("places", _finite("places", places), "heights", _finite("heights", heights))
    last = np.full(len(y), len(history.step), dtype=np.int64)
    return ProfileSamples(y, height, np.full(len(y), 2, dtype=np.int64), last)


def _temperature(history: History, times: ArrayLike, kelvin: ArrayLike) -> TemperatureSamples:
    time, temperature = _equally_many("times", times, "temperatures", _finite("temperatures", kelvin))
    _rising("temperatures", time, history)
    return TemperatureSamples(time, temperature)
