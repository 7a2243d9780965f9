"""The paper's pair of tests, in air and in liquid nitrogen, as its figures need them (sections 2.3, 3.1 to 3.3).

One wear coefficient is found from the test in air (bisection on depth, Eqs. 16, 17) and wears both. The contact is
Hertz's with the best circle, and disc 2 alone wears, unless effects are given: those of a model that a closed loop
has revised.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.steps import StepFriction, friction_in_use, identify_friction
from twindisc_cli.identify.track import Track, last_profile, worn_track
from twindisc_cli.identify.wear import WearFit, identify_wear
from twindisc_cli.identify.wear_history import WearHistory, wear_history
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel

WORN = ("profile", "mass")
"""Channels whose effects act on the wear."""


@dataclass(frozen=True)
class Worn:
    """What a model makes of one test with one K [1]: the history of its wear, and the track at the end.

    missed: root mean square of the recorded less the simulated height [m].
    """

    wear_coefficient: float
    history: WearHistory
    missed: float

    @property
    def track(self) -> Track:
        """Depth and width of the track of disc 2 at the end [m]."""
        return self.history.track[-1]


@dataclass(frozen=True)
class PaperTest:
    """One of the two tests: friction of its steps, recorded profile, wear, and warming of the disc.

    mu (step,) as found from the recorded friction; y and height [m] (sample,); recorded, the track in them; time [s]
    and warming above the environment [K] (point,); before, the paper's model; after, the revised one, or None.
    """

    experiment: Experiment
    friction: StepFriction
    mu: Floats
    y: Floats
    height: Floats
    recorded: Track
    before: Worn
    time: Floats
    warming: Floats
    after: Worn | None = None


@dataclass(frozen=True)
class Paper:
    """Both tests, how K was found from the one in air, and the effects of the revised model that act on the wear."""

    air: PaperTest
    nitrogen: PaperTest
    fit: WearFit
    added: Mapping[str, Mapping[str, float]]


def reproduce(air: Experiment, nitrogen: Experiment, revised: Experiment | None = None) -> Paper:
    """Run the paper's procedure on its two tests; DefinitionError where one lacks what the figures need.

    revised: a test of which the wear's effects and the K are also tried on both, each with its own friction.
    """
    for test in (air, nitrogen):
        _refuse_what_lacks(test)
    model = ForwardModel(_as_in_the_paper(air))
    fit = identify_wear(model, friction_in_use(model).mu)
    k = fit.bisection.wear_coefficient
    added = {} if revised is None else _of_the_wear(revised)
    return Paper(_test(air, k, revised), _test(nitrogen, k, revised), fit, added)


def _refuse_what_lacks(test: Experiment) -> None:
    lacking = [
        what
        for what, there in (
            ("a traction", test.measured.traction is not None),
            ("a profile", test.measured.profile is not None),
            ("convection_W_K under [thermal]", test.thermal is not None and np.isfinite(test.thermal.convection)),
            ("a contact in a point", not test.rig.is_line),
        )
        if not there
    ]
    if lacking:
        raise DefinitionError(f"the figures of the paper need {', '.join(lacking)} of the test {test.name}")


def _as_in_the_paper(test: Experiment) -> Experiment:
    """The test by the paper's model: Hertz's contact, FASTSIM, disc 2 alone wears, no K known."""
    options = replace(test.options, contact="hertz", traction="fastsim", wear_coefficient=np.nan)
    return replace(test, options=options, effects={}, laws={})


def _test(test: Experiment, k: float, after: Experiment | None) -> PaperTest:
    """One test by the paper's model with K, and by a revised one with its own K."""
    plain = _as_in_the_paper(test)
    model, profile = ForwardModel(plain), plain.measured.profile
    if profile is None:
        raise AssertionError
    mu = friction_in_use(model).mu
    last = last_profile(profile)
    y, height = profile.y[last], profile.height[last]
    base = BaseParameters.declared(plain, mu[None])
    state = model.predict(replace(base, K=np.array([k]))).state
    environment = plain.thermal.environment_temperature if plain.thermal else np.nan
    revised = None if after is None else _worn(_revised(plain, after), after.options.wear_coefficient, y, height)
    return PaperTest(
        experiment=test,
        friction=identify_friction(model),
        mu=mu,
        y=y,
        height=height,
        recorded=worn_track(y, height, smooth=True),
        before=_worn(plain, k, y, height),
        time=model.points.time,
        warming=state.temperature[0] - environment,
        after=revised,
    )


def _worn(test: Experiment, k: float, y: Floats, height: Floats) -> Worn:
    model = ForwardModel(test)
    history = wear_history(model, mu=friction_in_use(model).mu, wear_coefficient=k)
    simulated = np.interp(y, history.y, history.height[-1], left=0.0, right=0.0)
    return Worn(k, history, float(np.sqrt(np.mean((height - simulated) ** 2))))


def _revised(test: Experiment, after: Experiment) -> Experiment:
    """A test with the contact, the wear's effects and the K of a revised one; its friction stays its own."""
    options = replace(test.options, contact=after.options.contact, wear_coefficient=after.options.wear_coefficient)
    return replace(test, options=options, effects=_of_the_wear(after))


def _of_the_wear(test: Experiment) -> Mapping[str, Mapping[str, float]]:
    """The declared effects that act on the wear."""
    return {name: values for name, values in test.effects.items() if catalogue()[name].channel in WORN}
