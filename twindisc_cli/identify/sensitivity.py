"""How far K moves with what a test does not say: the K of the measured depth, with one assumption changed at a time.

Assumptions of the rig, the material and the history go through the forward model. The rule by which the best circle
updates the curvature (section 3.2) goes through the paper's own procedure, iteration by iteration:

    du(y) = K e / (2 pi R H) 3 / (4 b) (1 - (y/b)^2)        depth that an iteration of energy e [J] takes off (Eq. 15)
    kappa = kappa_0 + kappa of the best circle through u    in the patch before, by its pressure, or in the whole track

The model's own circle lies inside the patch that follows from it. Fitted in the patch before, as section 3.2 may be
read, patches alternate between narrow and wide, and the track becomes deeper with the same K.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from twindisc_cli.errors import ValidityError
from twindisc_cli.identify.roots import bracketed_root
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.identify.track import last_profile, worn_track
from twindisc_cli.identify.wear import WearFit
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, Rig
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.physics.best_circle import fit_curvature
from twindisc_cli.physics.hertz import contact_ellipse

FRICTION, LOAD = 0.01, 0.02
"""Changes of mu [1], and of the load as a share: usual tolerances."""
DISC = (("hardness", "hardness", 0.05), ("Young's modulus", "youngs_modulus", 0.05),
        ("crown radius", "transverse_radius", 0.02))  # fmt: skip
"""Quantities of both discs and their changes, as shares; a steel is some 5 % stiffer in liquid nitrogen than in air."""
FURTHER = 2
"""Iterations by which the last two steps are made longer."""
REACH, ENOUGH = 8.0, 1e-4
"""K is sought from this many times below to above the one found, until the depth is off by such a share."""
STRIPS, PARTS, ACROSS, CURVATURES = 401, 3, 8.0, 400
"""Strips over so many half-widths of the patch to each side, and parts of an iteration for the circle's updates."""
Rule = Callable[[Floats, Floats, float], Floats]


@dataclass(frozen=True)
class Variation:
    """One assumption changed: what, and the K of the measured depth [1] with it; change, of K as a share of K."""

    what: str
    wear_coefficient: float
    change: float


def sensitivity(model: ForwardModel, fit: WearFit) -> list[Variation]:
    """How far the K of depth moves with each assumption that the measured profile's test rests on.

    First those of the discs and the history, then of the contact, then the rules of the circle, where they apply; none
    of a line.
    """
    test = model.experiment
    if test.rig.is_line:
        return []
    base = _k_of_depth(test, fit)
    through = [(what, _k_of_depth(changed, fit)) for what, changed in _changed(test)]
    results = [Variation(what, k, k / base - 1.0) for what, k in through]
    if circle_applies(test):
        results += [Variation(what, base * ratio, ratio - 1.0) for what, ratio in _by_rule(model, fit, base).items()]
    return [variation for variation in results if np.isfinite(variation.change)]


def circle_applies(test: Experiment) -> bool:
    """Whether one Hertzian patch under the rig's load wears disc 2 alone from its crown, as the rules have it."""
    if test.effects or test.laws or test.options.contact != "hertz" or test.measured.start is not None:
        return False
    history = test.history
    one_load = not history.separate and bool(np.all(history.load_factor[history.driven] == 1.0))
    return one_load and bool(np.isnan(test.options.disc1_wear_coefficient))


def _k_of_depth(test: Experiment, fit: WearFit) -> float:
    """K that makes the measured depth; NaN where a changed assumption leaves the test without a friction."""
    model, profile = ForwardModel(test), test.measured.profile
    if profile is None:
        return np.nan
    unworn = replace(test, options=replace(test.options, wear_coefficient=np.nan))  # its friction depends on no K
    last = last_profile(profile)
    try:
        mu = friction_in_use(ForwardModel(unworn)).mu
    except ValidityError:
        return np.nan
    known = np.where(np.isfinite(mu), mu, 1.0)

    def depth(k: float) -> float:
        base = BaseParameters.declared(test, known[None])
        height = model.predict(replace(base, K=np.array([k]))).profile[0, last]
        return worn_track(fit.y, height, smooth=False).depth

    return _root(depth, fit, fit.wear_coefficient)


def _root(depth: Callable[[float], float], fit: WearFit, k: float) -> float:
    """The K near k that makes the measured depth, to within ENOUGH of it."""

    def short(log_k: Floats) -> Floats:
        off = depth(float(np.exp(log_k[0]))) / fit.measured.depth - 1.0
        return np.array([0.0 if abs(off) < ENOUGH else off])

    return float(np.exp(bracketed_root(short, np.log([k / REACH]), np.log([k * REACH])))[0])


def _changed(test: Experiment) -> Iterator[tuple[str, Experiment]]:
    """The test with one assumption changed, and what it is."""
    rig = test.rig
    for share in (-1.0, 1.0):
        for what, name, size in DISC:
            yield f"{what} {100.0 * share * size:+.0f} %", replace(test, rig=rig.with_discs(name, 1.0 + share * size))
        pressed = replace(rig, normal_load=rig.normal_load * (1.0 + share * LOAD))
        yield f"load {100.0 * share * LOAD:+.0f} %", replace(test, rig=pressed)
        traction = test.measured.traction
        if traction is not None:
            shifted = replace(traction, ratio=traction.ratio + share * FRICTION * np.sign(traction.creepage))
            yield f"T/N {share * FRICTION:+.2f}", replace(test, measured=replace(test.measured, traction=shifted))
    yield f"last two steps {FURTHER} iterations longer", _longer(test)
    if "wear_partition" not in test.effects and np.isnan(test.options.disc1_wear_coefficient):
        yield "both discs wear equally", replace(test, effects={**test.effects, "wear_partition": {"disc1_share": 0.5}})
    if test.options.contact == "hertz" and "half_space_contact" not in test.effects:
        yield "half-space contact", replace(test, options=replace(test.options, contact="half_space"))


def _longer(test: Experiment) -> Experiment:
    """The test with the last two steps that are driven longer, and the times of the traction stretched with them."""
    history, traction = test.history, test.measured.traction
    late = np.isin(history.step, np.flatnonzero(history.step_driven)[-2:])
    longer = np.where(late, 1.0 + FURTHER / np.bincount(history.step)[history.step], 1.0)
    further = replace(history, duration=history.duration * longer, revolutions=history.revolutions * longer)
    if traction is None:
        return replace(test, history=further)
    time = np.interp(traction.time, np.append(0.0, history.end_time), np.append(0.0, further.end_time))
    stretched = replace(traction, time=time)
    return replace(test, history=further, measured=replace(test.measured, traction=stretched))


# ------------------------------------------------------------------------------------------- the rule of the circle


def _inside(y: Floats, _: Floats, b: float) -> Floats:
    return np.asarray(np.clip((b - np.abs(y)) / (y[1] - y[0]) + 0.5, 0.0, 1.0))


def _pressure(y: Floats, _: Floats, b: float) -> Floats:
    return np.asarray(np.maximum(1.0 - (y / b) ** 2, 0.0))


def _track(y: Floats, depth: Floats, b: float) -> Floats:
    return np.asarray(np.maximum((depth > 0.0).astype(float), _inside(y, depth, b)))


RULES: Mapping[str, tuple[Rule, str]] = {
    "circle inside the patch just left": (_inside, "part"),
    "circle of the last iteration's patch": (_inside, "iteration"),
    "circle of the last step's patch": (_inside, "step"),
    "circle weighed by the pressure": (_pressure, "part"),
    "circle through the whole track": (_track, "part"),
}
"""Weights of the circle's points, and after what it is updated."""


def _by_rule(model: ForwardModel, fit: WearFit, k: float) -> dict[str, float]:
    """K of each rule over the model's K."""
    mu = friction_in_use(model).mu
    energy = model.predict(BaseParameters.declared(model.experiment, mu[None])).state.energy[0]
    of_iteration = np.diff(energy[model.points.of_iteration], prepend=0.0)
    return {
        what: _root(partial(_depth_by_circle, model, of_iteration, rule, every), fit, k) / k
        for what, (rule, every) in RULES.items()
    }


def _depth_by_circle(model: ForwardModel, energy: Floats, rule: Rule, every: str, k: float) -> float:
    """Greatest depth [m] after iterations of these energies (iteration,) [J], with K = k."""
    rig, step = model.experiment.rig, model.experiment.history.step
    log_b, b = _half_width(rig)
    y = np.linspace(-ACROSS, ACROSS, STRIPS) * b
    depth, flattest = np.zeros_like(y), rig.curvature_y / ACROSS**3
    for number, section in enumerate(energy * k / model.circumference_hardness):
        ended = number + 1 == len(step) or step[number + 1] != step[number]
        for part in range(PARTS):
            depth = depth + section / PARTS * 0.75 / b * np.maximum(1.0 - (y / b) ** 2, 0.0)
            if every == "part" or (part == PARTS - 1 and (every == "iteration" or ended)):
                curvature = rig.curvature_y + float(fit_curvature(y, depth, rule(y, depth, b)))
                b = float(np.exp(np.interp(np.log(max(curvature, flattest)), *log_b)))
    return float(depth.max())


def _half_width(rig: Rig) -> tuple[tuple[Floats, Floats], float]:
    """Logarithms of relative transverse curvature [1/m] and half-width b [m] of Hertz's patch; b of the new discs."""
    curvature = rig.curvature_y * np.geomspace(1.0 / ACROSS**3, 4.0, CURVATURES)
    b = contact_ellipse(
        curvature_x=rig.curvature_x,
        curvature_y=curvature,
        normal_load=rig.normal_load,
        effective_modulus=rig.effective_modulus,
    ).b
    table = np.log(curvature), np.log(b)
    return table, float(np.exp(np.interp(np.log(rig.curvature_y), *table)))
