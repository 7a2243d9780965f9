"""The fitting problem: several tests, their channels as white noise, and a vector of parameters.

    minimise |W (y - f(theta))|^2,   W W' = (C + D D')^-1

    y   measured channels, f the forward model, C the covariance of the noise
    D   what the inputs' tolerances could change (nuisances), one column each

K belongs to the material and is shared by all tests, mu and the convection belong to each test, the effects to the rig
and so to all tests. Parameters that span decades are fitted as logarithms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import CHANNELS, Channel
from twindisc_cli.loop.noise import Noise, profile_noise, temperature_noise, traction_noise
from twindisc_cli.loop.span import span_of
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel, Prediction
from twindisc_cli.model.surface import recorded_sections

DRIVEN: tuple[Channel, ...] = ("traction", "temperature", "profile")
"""The channels in the order in which they drive each other: friction warms the disc, a warm disc may wear faster."""

TOLERANCES: tuple[tuple[str, dict[str, float]], ...] = (
    ("third_body_layer", {"slope_ratio": 0.993}),
    ("load_error", {"error_percent": 0.7}),
)
"""Effects whose small sizes are no finding: name and parameters at one standard deviation."""

STEP_TOLERANCE = (0.003, 6e-6)
"""Error of the creepage that each step may have on its own, one standard deviation: relative and absolute."""


@dataclass(frozen=True)
class Case:
    """One test with the noise of its channels.

    free_mu: mu as measured (iteration,) in place of a model of friction, and its standard deviation.
    known: values of K and convection_W_K to hold where they are not fitted, and to start from.
    """

    model: ForwardModel
    noise: Mapping[Channel, Noise]
    free_mu: tuple[Floats, Floats] | None = None
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def test(self) -> Experiment:
        """The test itself."""
        return self.model.experiment

    def values(self, channel: Channel) -> Floats:
        """Measured values of a channel (sample,)."""
        measured = self.test.measured
        if channel == "traction" and measured.traction is not None:
            return measured.traction.ratio
        if channel == "profile" and measured.profile is not None:
            return measured.profile.height
        assert measured.temperature is not None
        return measured.temperature.temperature

    @cached_property
    def first_wear(self) -> float:
        """K from W H / E of the last recorded profile, with the traction as it was measured; 0 without a profile."""
        profile = self.test.measured.profile
        if "K" in self.known:
            return self.known["K"]
        if profile is None:
            return 0.0
        last = profile.iteration == profile.iteration.max()
        section = max(sum(recorded_sections(profile, last)), 1e-14)
        return float(np.clip(section * self.model.circumference_hardness / measured_energy(self), 1e-8, 0.5))

    @cached_property
    def first_convection(self) -> float:
        """Convection [W/K] from the mean power, with the traction as measured, over the mean warming; 1 unmeasured."""
        thermal, samples = self.test.thermal, self.test.measured.temperature
        if "convection_W_K" in self.known:
            return self.known["convection_W_K"]
        if thermal is None or samples is None:
            return 1.0
        warming = float(np.mean(samples.temperature - thermal.environment_temperature))
        power = measured_energy(self) / float(self.test.history.end_time[-1])
        return float(np.clip(power / max(abs(warming), 1e-3), 1e-3, 1e4))

    @property
    def held(self) -> dict[str, float]:
        """Base parameters where they are not fitted: as the definition says, else the first guess; mu may be NaN."""
        guess = {"mu": np.nan, "K": self.first_wear, "convection_W_K": self.first_convection}
        return guess | stated(self.test)


def channels_of(test: Experiment) -> tuple[Channel, ...]:
    """The channels that were measured."""
    measured = test.measured
    present = {
        "traction": measured.traction is not None,
        "profile": measured.profile is not None,
        "temperature": measured.temperature is not None and test.thermal is not None,
    }
    return tuple(channel for channel in CHANNELS if present[channel])


def stated(test: Experiment) -> dict[str, float]:
    """The base parameters that a definition gives a value."""
    values = {
        "mu": test.options.friction_coefficient,
        "K": test.options.wear_coefficient,
        "convection_W_K": test.thermal.convection if test.thermal else np.nan,
    }
    return {key: value for key, value in values.items() if np.isfinite(value)}


def friction_is_given(test: Experiment) -> bool:
    """Whether the definition says mu at every iteration."""
    return bool(np.isfinite(test.options.friction_coefficient) or np.isfinite(test.history.given_mu).all())


def noise_of(test: Experiment) -> dict[Channel, Noise]:
    """Noise of every measured channel."""
    makers = {"traction": traction_noise, "profile": profile_noise, "temperature": temperature_noise}
    return {channel: makers[channel](test) for channel in channels_of(test)}


def case_of(test: Experiment) -> Case:
    """A test with the noise of its channels."""
    return Case(ForwardModel(test), noise_of(test))


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter: its name, bounds and start in the unit of the test definition, and the tests it acts in."""

    name: str
    effect: str | None
    key: str
    unit: str
    start: float
    lower: float
    upper: float
    log: bool
    case: int | None = None
    off: float | None = None

    def inner(self, value: float) -> float:
        """The number that is fitted."""
        return float(np.log(value)) if self.log else value / self.scale

    def outer(self, inner: Floats) -> Floats:
        """The value in the unit of the test definition."""
        return np.exp(inner) if self.log else inner * self.scale

    @property
    def scale(self) -> float:
        """Size of a unit step of a parameter that is not fitted as a logarithm."""
        return max(abs(self.start - (self.off or 0.0)), 1e-3 * (self.upper - self.lower))


@dataclass(frozen=True)
class Settled:
    """Parameters that an earlier problem left in the tests: where they are (parameter,), and their covariance."""

    problem: Problem
    theta: Floats
    covariance: Floats


@dataclass(frozen=True)
class Problem:
    """Tests and channels to be explained together, by base parameters and the named effects."""

    cases: Sequence[Case]
    channels: tuple[Channel, ...]
    effects: tuple[str, ...] = ()
    settled: tuple[Settled, ...] = ()
    nuisance: Floats | None = field(default=None, repr=False)

    @property
    def in_order(self) -> list[Channel]:
        """The channels, those first that drive the others."""
        return [channel for channel in DRIVEN if channel in self.channels]

    def with_effects(self, *names: str) -> Problem:
        """The same problem with other effects."""
        return replace(self, effects=tuple(names))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Base parameters that the chosen channels can show, then those of the effects."""
        return (*self._base(), *(p for name in self.effects for p in effect_parameters(name)))

    def _base(self) -> list[Parameter]:
        found: list[Parameter] = []
        for number, case in enumerate(self.cases):
            present = set(self.channels) & set(case.noise)
            thermal = case.test.thermal
            if case.free_mu is None and "traction" in present and not friction_is_given(case.test):
                level = float(np.clip(np.quantile(np.abs(case.values("traction")), 0.9), 1e-3, 2.0))
                found.append(Parameter("mu", None, "mu", "1", level, 1e-3, 3.0, True, number))
            if "temperature" in present and thermal is not None and not np.isfinite(thermal.convection):
                level = case.first_convection
                found.append(
                    Parameter("convection_W_K", None, "convection_W_K", "W K-1", level, 1e-5, 1e6, True, number)
                )
        recorded = [case.first_wear for case in self.cases if "profile" in case.noise]
        given = any(np.isfinite(case.test.options.wear_coefficient) for case in self.cases)
        if "profile" in self.channels and recorded and not given:
            found.append(Parameter("K", None, "K", "1", float(np.median(recorded)), 1e-9, 1.0, True))
        return found

    def start(self) -> Floats:
        """Inner start values (parameter,)."""
        return np.array([p.inner(p.start) for p in self.parameters])

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Inner lower and upper bounds (parameter,)."""
        lower = [p.inner(p.lower) for p in self.parameters]
        return np.array(lower), np.array([p.inner(p.upper) for p in self.parameters])

    def predict(self, theta: Floats, extra: Mapping[str, Mapping[str, Floats]] | None = None) -> list[Prediction]:
        """Predictions of every test for parameter sets theta (set, parameter), with extra effects if asked."""
        return [
            case.model.predict(self._base_of(number, case, theta), {**self.effects_of(theta), **(extra or {})})
            for number, case in enumerate(self.cases)
        ]

    def _off_creepage(self, theta: Floats) -> Floats:
        """White predictions (step, sample) with the creepage of one step after the other off by its tolerance."""
        rows = []
        for number, case in enumerate(self.cases):
            history = case.test.history
            relative = np.hypot(STEP_TOLERANCE[0], STEP_TOLERANCE[1] / np.maximum(np.abs(history.creepage), 1e-6))
            steps = np.unique(history.step)[:, None] == history.step
            rows.append(self._moved(theta, len(steps), number, {"creepage_factor": 1.0 + relative * steps}))
        return np.concatenate(rows)

    def _off_friction(self, theta: Floats) -> Floats:
        """White predictions (iteration, sample) with mu off by its standard deviation, where it is as measured."""
        rows = [np.empty((0, len(self.measured)))]
        for number, case in enumerate(self.cases):
            if case.free_mu is not None:
                mu, std = case.free_mu
                rows.append(self._moved(theta, len(mu), number, {"mu": mu + np.diag(std)}))
        return np.concatenate(rows)

    def _off_settled(self, theta: Floats) -> Floats:
        """White predictions (parameter, sample) with what is settled moved along the axes of its uncertainty."""
        rows = [np.empty((0, len(self.measured)))]
        for earlier in self.settled:
            lower, upper = earlier.problem.bounds
            moved = np.clip(earlier.theta + np.linalg.cholesky(earlier.covariance).T, lower, upper)
            sets = np.tile(theta, (len(moved), 1))
            predictions = [
                case.model.predict(
                    self._base_of(number, case, sets, earlier.problem.own_base(number, moved)),
                    {**earlier.problem.effects_of(moved), **self.effects_of(sets)},
                )
                for number, case in enumerate(self.cases)
            ]
            rows.append(self.white(predictions))
        return np.concatenate(rows)

    def _moved(self, theta: Floats, count: int, off: int, change: Mapping[str, Floats]) -> Floats:
        """White predictions (set, sample) for `count` changes of the base parameters of one test."""
        sets = np.tile(theta, (count, 1))
        predictions = [
            case.model.predict(
                {**self._base_of(number, case, sets), **(change if number == off else {})}, self.effects_of(sets)
            )
            for number, case in enumerate(self.cases)
        ]
        return self.white(predictions)

    def own_base(self, number: int, theta: Floats) -> dict[str, Floats]:
        """The fitted base parameters of a test for theta (set, parameter)."""
        return {
            p.key: p.outer(column)
            for column, p in zip(theta.T, self.parameters, strict=True)
            if p.effect is None and p.case in (None, number)
        }

    def effects_of(self, theta: Floats) -> dict[str, dict[str, Floats]]:
        """Parameters of the effects for theta (set, parameter), by effect and key."""
        found: dict[str, dict[str, Floats]] = {name: {} for name in self.effects}
        for column, p in zip(np.atleast_2d(theta).T, self.parameters, strict=True):
            if p.effect is not None:
                found[p.effect][p.key] = p.outer(column)
        return found

    def _base_of(
        self, number: int, case: Case, theta: Floats, known: Mapping[str, Floats] | None = None
    ) -> dict[str, Floats]:
        """Base parameters of a test for theta (set, parameter), `known` ones (set,) in place of its own.

        What the definition says of mu in single steps stands above both.
        """
        sets = len(theta)
        base = {key: np.full(sets, value) for key, value in case.held.items()}
        base |= self.own_base(number, theta) | dict(known or {})
        step_mu = case.test.history.given_mu
        if case.free_mu is not None:
            base["mu"] = np.broadcast_to(case.free_mu[0], (sets, len(case.free_mu[0])))
        elif np.isfinite(step_mu).any():
            base["mu"] = np.where(np.isfinite(step_mu), step_mu, base["mu"][:, None])
        return base

    def white(self, predictions: Sequence[Prediction]) -> Floats:
        """Predicted channels as white numbers (set, sample), all tests and channels in a row."""
        parts = [
            case.noise[channel].whiten(getattr(prediction, channel))
            for case, prediction in zip(self.cases, predictions, strict=True)
            for channel in self.channels
            if channel in case.noise
        ]
        return np.concatenate(parts, axis=-1)

    @cached_property
    def measured(self) -> Floats:
        """Measured channels as white numbers (sample,)."""
        parts = [
            case.noise[channel].whiten(case.values(channel))
            for case in self.cases
            for channel in self.channels
            if channel in case.noise
        ]
        return np.concatenate(parts, axis=-1)

    @cached_property
    def slices(self) -> dict[Channel, list[slice]]:
        """Where each channel of each test stands in a row of white numbers."""
        found: dict[Channel, list[slice]] = {channel: [] for channel in self.channels}
        first = 0
        for case in self.cases:
            for channel in self.channels:
                if channel in case.noise:
                    count = int(case.noise[channel].kept.sum())
                    found[channel].append(slice(first, first + count))
                    first += count
        return found

    @cached_property
    def _shrinkage(self) -> tuple[Floats, Floats]:
        """Directions of the nuisances (sample, direction), and by how much rows shrink along each."""
        assert self.nuisance is not None
        left, size, _ = np.linalg.svd(self.nuisance, full_matrices=False)
        return left, 1.0 / np.sqrt(1.0 + size**2) - 1.0

    def discount(self, rows: Floats) -> Floats:
        """Shrink white rows (..., sample) along the nuisances: (1 + D D')^(-1/2)."""
        if self.nuisance is None or self.nuisance.shape[1] == 0:
            return rows
        left, shrink = self._shrinkage
        return np.asarray(rows + ((rows @ left) * shrink) @ left.T)

    def with_nuisance(self, theta: Floats, slopes: Floats) -> Problem:
        """The same problem with the nuisances as they are at theta (parameter,).

        What the base parameters can imitate, whose slopes are (sample, base), is taken out of them: it costs nothing
        there, and a nuisance, which is only known for small changes, must not stand in for a large one.
        """
        span = span_of(slopes)
        plain = self.white(self.predict(theta[None]))[0]
        moved = [
            self.white(self.predict(theta[None], _extra(name, sizes)))[0] - plain
            for name, sizes in TOLERANCES
            if name not in self.effects
        ]
        others = [self._off_creepage(theta[None]), self._off_friction(theta[None]), self._off_settled(theta[None])]
        columns = np.concatenate([np.array(moved), np.concatenate(others) - plain]).T
        return replace(self, nuisance=columns - span @ (span.T @ columns))


def _extra(name: str, sizes: Mapping[str, float]) -> dict[str, dict[str, Floats]]:
    """An effect of given sizes, the other parameters at their start, as one parameter set."""
    return {name: {p.key: np.array([sizes.get(p.key, p.start)]) for p in effect_parameters(name)}}


def effect_parameters(name: str) -> list[Parameter]:
    """The parameters of an effect as they are fitted."""
    return [
        Parameter(f"{name}.{p.name}", name, p.name, p.unit, p.start, p.lower, p.upper, p.log, off=p.off)
        for p in catalogue()[name].params
    ]


def measured_energy(case: Case) -> float:
    """Energy dissipated in a test [J], from the traction as measured (or the friction coefficient given)."""
    test, history = case.test, case.test.history
    mu = np.full(len(history.step), test.options.friction_coefficient)
    mu = np.where(np.isfinite(history.given_mu), history.given_mu, mu)
    if test.measured.traction is not None:
        samples = test.measured.traction
        level = {s: float(np.mean(samples.ratio[samples.step == s])) for s in np.unique(samples.step)}
        mean = float(np.mean(samples.ratio))
        mu = np.array([level.get(int(s), mean) for s in history.step])
    power = mu * test.rig.normal_load * np.abs(history.creepage) * test.rig.rolling_speed
    return max(float(np.sum(power * history.duration)), 1e-9)
