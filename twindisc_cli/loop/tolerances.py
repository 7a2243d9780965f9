"""What the inputs of a test may be off by, and what that does to the white prediction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.effects import catalogue
from twindisc_cli.identify.repeats import repeats_of
from twindisc_cli.identify.span import span_of
from twindisc_cli.identify.steps import creepage_error
from twindisc_cli.loop.nuisances import Nuisances
from twindisc_cli.loop.problem import Case, Problem
from twindisc_cli.loop.thresholds import ACCEPTANCE, TOLERANCES
from twindisc_cli.model.base import column
from twindisc_cli.model.experiment import Experiment, Floats, Rig
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

_Off = tuple[str, Floats]
"""An input that is off by its tolerance, and the white prediction with it (sample,)."""

LITTLE = 3.0
"""Length of a change [standard deviations of the noise] up to which it may have another shape (correlation 0.9)."""
QUANTITIES_OF_DISCS = {"transverse_radius": "crown_error", "youngs_modulus": None}
"""What may be off of both discs, and the effect that stands in the place of its tolerance."""
DECLARED = {"third_body_layer": "initial_slope"}
"""Quantities of the rig whose tolerance in a definition takes the place of that of an effect."""


def with_nuisances(problem: Problem, theta: Floats, slopes: Floats) -> Problem:
    """The same problem with the nuisances as they are at theta (parameter,).

    What the base parameters can absorb, whose slopes are (sample, base), is taken out of them: it costs nothing
    there, and a nuisance, which is only known for small changes, must not stand in for a large one.
    """
    span = span_of(slopes)
    nearby = problem.followed(theta)
    predictions = nearby.predict(theta[None])
    plain = nearby.white(predictions)[0]
    inputs, rows = zip(
        *_off_effects(nearby, theta),
        *_off_sensors(nearby, theta, plain),
        *_off_theory(nearby, theta, plain),
        _off_track(nearby, theta, predictions),
        *_off_in_steps(
            nearby, theta, "creepage_factor", "creepage of step", lambda case: creepage_tolerance(case.test)
        ),
        *_off_levels(nearby, theta, plain),
        *_off_in_steps(nearby, theta, "mu", "mu of step", mu_tolerance),
        *_off_rig(nearby, theta, plain),
        strict=True,
    )
    columns = np.nan_to_num(np.array(rows) - plain).T
    absorbed = span @ (span.T @ columns)
    # mu is meant over the load as set, whatever the load was
    known = np.array([name.startswith("load_error") for name in inputs])
    return replace(problem, nuisance=Nuisances(inputs, columns - absorbed, absorbed[:, ~known]))


def _off_effects(problem: Problem, theta: Floats) -> list[_Off]:
    """White predictions with a small size of each of the effects that are no finding, by parameter.

    They come on top of what a test declares: the tolerance of a declared effect is relative to it.
    """
    return [
        (f"{name}.{key}", _with_slight(problem, theta, name, key, size))
        for name, key, size in TOLERANCES.effects
        if name not in problem.terms
    ]


def _off_sensors(problem: Problem, theta: Floats, plain: Floats) -> list[_Off]:
    """White predictions with one record after the other off by how well its zero and place are known."""
    off = []
    for number, case in enumerate(problem.cases):
        for name, key, size in known_sensors(case.test):
            if name not in problem.terms:
                row = _with_slight(problem, theta, name, key, size)
                for record, own in enumerate(_records(problem, number, catalogue()[name].channel), 1):
                    off.append((f"{name}.{key} of record {record} of {case.test.name}", np.where(own, row, plain)))
    return off


def _off_theory(problem: Problem, theta: Floats, plain: Floats) -> list[_Off]:
    """White predictions by the exact law of each test on two cylinders for which FASTSIM is declared."""
    name = "exact_elasticity"
    tests = [n for n, c in enumerate(problem.cases) if c.test.approximates_a_line and name not in c.test.effects]
    if not tests or name in problem.terms:
        return []
    row = _with_slight(problem, theta, name, "share", 1.0)
    return [(f"{name}.share of {problem.tests[n]}", np.where(problem.owner == n, row, plain)) for n in tests]


def _off_track(problem: Problem, theta: Floats, predictions: Sequence[Prediction]) -> _Off:
    """White prediction with a worn track that rolls a little softer, the nearer it is to a rectangle."""
    extra = []
    for prediction in predictions:
        state = prediction.state
        square = prediction.paths.patch(prediction.section, state.normal_load / state.nominal_load).square
        extra.append({"slope_ratio": 1.0 - TOLERANCES.worn_slope * square})
    name = "creep stiffness of the worn track"
    return name, problem.white_with(theta, name, extra, {name: catalogue()["third_body_layer"]})


def _with_slight(problem: Problem, theta: Floats, name: str, key: str, size: float) -> Floats:
    """White prediction (sample,) with a small size of an effect."""
    return problem.white_with(theta, name, [_slightly(case.test, name, key, size) for case in problem.cases])


def _records(problem: Problem, number: int, channel: str) -> list[NDArray[np.bool_]]:
    """Which white samples are of each record of a channel of a test (sample,): its profiles, or the whole of it."""
    places = [
        np.full(int(problem.cases[i].noise[c].kept.sum()), (i, c) == (number, channel), dtype=np.int64)
        for i, c in problem.parts
    ]
    if channel == "profile" and (number, channel) in problem.parts:
        noise = problem.cases[number].noise[channel]
        places[problem.parts.index((number, channel))] = (
            1 + np.unique(noise.series[noise.order], return_inverse=True)[1]
        )
    place = np.concatenate(places)
    return [place == record for record in range(1, int(place.max()) + 1)]


def _off_in_steps(
    problem: Problem, theta: Floats, key: str, what: str, sizes_of: Callable[[Case], Floats]
) -> list[_Off]:
    """White predictions with an input of one step after the other off by its tolerance.

    sizes_of: the tolerances of a test over the values of the input (iteration,).
    """
    off = list[_Off]()
    for number, case in enumerate(problem.cases):
        sizes = sizes_of(case)
        if np.any(sizes):
            names = [f"{what} {step + 1} of {case.test.name}" for step in np.unique(case.test.history.step)]
            off += zip(names, step_by_step(problem, number, theta, key, sizes), strict=True)
    return off


def step_by_step(problem: Problem, number: int, theta: Floats, key: str, sizes: Floats | float) -> Floats:
    """White predictions (step, sample) with a base parameter of one step of a test after the other off.

    sizes: by how much, over its value (iteration,).
    """
    step = problem.cases[number].test.history.step
    return problem.white(scaled(problem, number, theta, key, 1.0 + sizes * (np.unique(step)[:, None] == step)))


def scaled(problem: Problem, number: int, theta: Floats, key: str, factors: Floats) -> list[Prediction]:
    """Predictions with a base parameter of a test times factors (set, iteration)."""
    base = column(problem.base_of(number, theta[None]).get(key, np.ones(1)), 1)
    return problem.moved(np.tile(theta, (len(factors), 1)), number=number, base={key: base * factors})


def _off_levels(problem: Problem, theta: Floats, plain: Floats) -> list[_Off]:
    """White predictions with what tests share, as K, off in one test after the other as it scatters in repeats."""
    if len(problem.cases) < 2:
        return []
    shared = {
        p.key: p.outer(at) for p, at in zip(problem.parameters, theta, strict=True) if (p.term, p.case) == (None, None)
    }
    more = {key: value * (1.0 + ACCEPTANCE.repeat_scatter) for key, value in shared.items()}
    rows = {key: problem.white(problem.moved(theta[None], base={key: value}))[0] for key, value in more.items()}
    return [
        (f"{key} of {test}", np.where(problem.owner == number, row, plain))
        for key, row in rows.items()
        for number, test in enumerate(problem.tests)
    ]


def mu_tolerance(case: Case) -> Floats:
    """Relative error of mu from one step to the next (iteration,) [1]: of separate tests, or taken for noise."""
    return repeat_scatter(case.test) + case.mu_scatter


def repeat_scatter(test: Experiment) -> Floats:
    """Relative error of mu from one separate test to the next (iteration,) [1]: as repeats show it, else as is usual.

    Of a test that lies apart from the others, as far as it does: what happened in it alone does not count as evidence.
    """
    shown, step = repeats_of(test), test.history.step
    sizes = np.full(len(step), ACCEPTANCE.repeat_scatter if np.isnan(shown.scatter) else shown.scatter)
    for number, by in shown.apart.items():
        sizes[step == number] = by
    return sizes


def _off_rig(problem: Problem, theta: Floats, plain: Floats) -> list[_Off]:
    """White predictions with the geometry and the modulus off by their tolerances.

    Where loads change or K differs from strip to strip, half-space contact would have to be integrated for each:
    what changes little is then taken from the updated Hertz ellipse.
    """
    off = list[_Off]()
    rough = _white_with_discs(problem, theta, None, hertz=problem.is_integrated)
    for name, effect in QUANTITIES_OF_DISCS.items():
        if effect in problem.terms:
            continue
        change = _white_with_discs(problem, theta, name, hertz=problem.is_integrated) - rough
        if problem.is_integrated and np.linalg.norm(change) > LITTLE:
            before, after = (_white_with_discs(problem, theta, each, hertz=False) for each in (None, name))
            change = after - before
        off.append((name, plain + change))
    return off


def _white_with_discs(problem: Problem, theta: Floats, off: str | None, *, hertz: bool) -> Floats:
    """White prediction (sample,) with one quantity of the discs off; hertz: with the updated ellipse."""
    moved = _with_discs(problem, off, hertz=hertz)
    return np.asarray(moved.white(moved.predict(theta[None]))[0])


def _with_discs(problem: Problem, off: str | None, *, hertz: bool) -> Problem:
    """The same problem with one quantity of the discs off by its tolerance; hertz: with the updated ellipse."""
    tests = [
        replace(
            case.test,
            options=replace(case.test.options, contact="hertz") if hertz else case.test.options,
            rig=case.test.rig if off is None else _off(case.test, off),
        )
        for case in problem.cases
    ]
    cases = [replace(c, model=ForwardModel(test), known=c.held) for c, test in zip(problem.cases, tests, strict=True)]
    return replace(problem, cases=cases, tracks=None)


def _off(test: Experiment, name: str) -> Rig:
    """The rig of a test with one quantity of both discs off by its standard deviation."""
    return test.rig.with_discs(name, 1.0 + test.tolerances.get(name, getattr(TOLERANCES, name)))


def creepage_tolerance(test: Experiment) -> Floats:
    """Relative error that the creepage of each iteration may have (iteration,): of its step, and of tachometers."""
    relative, error = TOLERANCES.step_creepage
    history = test.history
    absolute = np.hypot(error, creepage_error(test)[history.step])
    return np.hypot(relative, absolute / np.maximum(np.abs(history.creepage), 1e-6))


def known_sensors(test: Experiment) -> tuple[tuple[str, str, float], ...]:
    """Effect, parameter and standard error of what was recorded of the sensors and taken off: zeros and places."""
    zero, place = test.measured.torque_zero, test.measured.profile_place
    known: list[tuple[str, str, float]] = []
    if zero is not None and zero.taken_off and np.isfinite(zero.std):
        known.append(("torque_offset", "offset", zero.std))
    if place is not None:
        known += [("profile_tilt", "slope_um_mm", place.slope * 1e3), ("profile_tilt", "offset_um", place.offset * 1e6)]
        known.append(("lateral_offset", "offset_mm", place.centre * 1e3))
    return tuple(known)


def _slightly(test: Experiment, name: str, key: str, size: float) -> dict[str, Floats]:
    """An effect a little larger than the test declares it: by a factor where its parameter is one, else by a sum."""
    declared, known = test.effects.get(name, {}), test.tolerances.get(DECLARED.get(name, ""))
    size = size if known is None else float(np.copysign(known, size))
    values = {p.name: declared.get(p.name, p.off if p.off is not None else p.start) for p in catalogue()[name].params}
    ratio = next(p.log for p in catalogue()[name].params if p.name == key)
    values[key] = values[key] * (1.0 + size) if ratio else values[key] + size
    return {name: np.array([value]) for name, value in values.items()}
