"""The fitting problem: several tests, all their channels as white noise, and a vector of parameters.

    minimise |W (y - f(theta))|^2,   W W' = (C + D D')^-1

    y   measured channels, f the forward model, C the covariance of the noise
    D   what the inputs' tolerances could change (nuisances), one column each

K belongs to the material and is shared by all tests but repeats, which show how it scatters; mu and the convection
belong to each test, effects and laws to the rig and so to all tests, or to one of them alone. Parameters that span
decades are fitted as logarithms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import chain, pairwise

import numpy as np

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import FIRST_SEEN, Effect
from twindisc_cli.effects._state import State
from twindisc_cli.errors import DefinitionError
from twindisc_cli.errors import Problem as Mistake
from twindisc_cli.laws.quantities import Quantity
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.channels._channel import Base
from twindisc_cli.loop.noise import Mask, Noise
from twindisc_cli.loop.nuisances import Nuisances
from twindisc_cli.model.base import MODEL_KEYS
from twindisc_cli.model.chain import COUNTED, SETTLED
from twindisc_cli.model.experiment import Experiment, Floats, Ints
from twindisc_cli.model.forward import ForwardModel, IntegratedSets
from twindisc_cli.model.patch import Paths
from twindisc_cli.model.prediction import Prediction

_Values = Mapping[str, Floats]
TOO_QUIET = 0.8
"""Scatter about a model, over the noise, below which the noise is not that of the samples: they do not scatter as far.
"""


@dataclass(frozen=True)
class Case:
    """One test with the noise of its channels.

    known: base parameters to hold where they are not fitted; near: state of the base model, where predictions begin;
    mu_scatter: standard deviation of the mu of a step over its mean, where that is taken for noise [1].
    """

    model: ForwardModel
    noise: Mapping[str, Noise]
    known: Mapping[str, float] = field(default_factory=dict)
    near: State | None = field(default=None, repr=False, compare=False)
    mu_scatter: float = 0.0

    @property
    def test(self) -> Experiment:
        """The test itself."""
        return self.model.experiment

    def values(self, channel: str) -> Floats:
        """Measured values of a channel (sample,)."""
        return channels()[channel].values(channels()[channel].samples(self.test))

    def with_noise_about(self, prediction: Prediction) -> Case:
        """The same with the noise that a prediction leaves, where that is less than the samples alone let expect."""
        less = dict[str, Noise]()
        for name, noise in self.noise.items():
            channel = channels()[name]
            left = self.values(name) - channel.predicted(self.model, prediction)[0]
            if channel.noise_about is None or np.std(left[noise.kept]) > TOO_QUIET * noise.std:
                continue
            about = channel.noise_about(self.test, left)
            less |= {name: about} if about.estimated and about.std < noise.std else {}
        return replace(self, noise={**self.noise, **less}) if less else self

    @property
    def guesses(self) -> Mapping[str, float]:
        """Base parameters from the measurements alone, by key; NaN where nothing shows them."""
        return _guesses(self.model)

    @cached_property
    def held(self) -> dict[str, float]:
        """Base parameters where they are not fitted: as the definition says, as known from elsewhere, else guessed."""
        given = {**self.known, **stated(self.test)}
        return given if given.keys() >= {base.key for base in base_parameters()} else {**self.guesses, **given}


def base_parameters() -> list[Base]:
    """The base parameters that channels fix."""
    return [base for channel in channels().values() for base in channel.parameters]


def stated(test: Experiment) -> dict[str, float]:
    """The base parameters that a definition gives a value."""
    values = {base.key: base.of(test) for base in base_parameters()}
    return {key: value for key, value in values.items() if np.isfinite(value)}


def case_of(test: Experiment) -> Case:
    """A test with the noise of its channels."""
    return cases_of([test])[0]


def cases_of(tests: Sequence[Experiment]) -> list[Case]:
    """Tests with the noise of their channels, of which they are evidence together."""
    noise: list[dict[str, Noise]] = [{} for _ in tests]
    for name, channel in channels().items():
        own = [i for i, test in enumerate(tests) if name in measured_channels(test)]
        measured = [tests[i] for i in own]
        noises = channel.together(measured) if channel.together else [channel.noise(test) for test in measured]
        for i, result in zip(own, noises, strict=True):
            noise[i][name] = result
    cases = [Case(ForwardModel(test), result) for test, result in zip(tests, noise, strict=True)]
    for case in cases:
        refuse_unread(case)
    return [replace(case, near=_base_state(case)) for case in cases]


def _base_state(case: Case) -> State | None:
    """The state of the base model with what the measurements alone say; None where they leave something open."""
    guessed = {key: np.array([value]) for key, value in case.held.items()}
    state = case.model.predict(guessed, integrated="none", profiled=False).state
    return state if np.isfinite(state.energy).all() else None


class _Read(dict[str, Floats]):
    """Parameters that remember which of them were asked for."""

    def __init__(self, values: Mapping[str, Floats]) -> None:
        super().__init__(values)
        self.asked: set[str] = set()

    def __getitem__(self, key: str) -> Floats:
        """One of them, remembered."""
        self.asked.add(key)
        return super().__getitem__(key)


def refuse_unread(case: Case) -> None:
    """DefinitionError where a measured channel declares a base parameter that neither model nor channel reads."""
    own = {n: [b.key for b in channels()[n].parameters if b.key not in MODEL_KEYS] for n in case.noise}
    if not any(own.values()):
        return
    prediction = case.model.predict({key: np.array([value]) for key, value in case.held.items()})
    read = _Read(prediction.own)
    for name in case.noise:
        channels()[name].predicted(case.model, replace(prediction, own=read))
    unread = [(name, key) for name, keys in own.items() for key in keys if key not in read.asked]
    if unread:
        message = "; ".join(f"the channel {name} declares {key}, which nothing reads" for name, key in unread)
        raise DefinitionError(Mistake(f'{message}: its `predicted` finds it in prediction.own["{unread[0][1]}"]'))


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter: its name, bounds and start in the unit of the test definition, and the tests it acts in.

    `term` is the effect or law it belongs to, None for a base parameter; a `normal` one has a unit normal prior.
    """

    name: str
    term: str | None
    key: str
    unit: str
    start: float
    lower: float
    upper: float
    log: bool
    case: int | None = None
    off: float | None = None
    normal: bool = False

    def inner(self, value: float) -> float:
        """The number that is fitted."""
        return float(np.log(value)) if self.log else value / self.scale

    def outer(self, inner: Floats) -> Floats:
        """The value in the unit of the test definition."""
        return np.exp(inner) if self.log else inner * self.scale

    def size(self, value: float) -> float:
        """Size of an effect in its typical ones: where it is off, 0."""
        assert self.off is not None
        off = self.inner(self.off)
        return (self.inner(value) - off) / (self.inner(self.start) - off)

    @property
    def scale(self) -> float:
        """Size of a unit step of a parameter that is not fitted as a logarithm."""
        return 1.0 if self.normal else max(abs(self.start - (self.off or 0.0)), 1e-3 * (self.upper - self.lower))


INTEGRATED, INTEGRATED_LOCALLY = 4, {"hertz": 50, "half_space": 150}
"""How many predictions without an integration take as long as one with it; where K differs from strip to strip beside
loads that change, by the contact."""


@dataclass
class Effort:
    """How much was predicted for an answer: parameter sets, those with an integration as many as take as long."""

    spent: int = 0


@dataclass(frozen=True)
class Problem:
    """Tests and channels to be explained together, by base parameters and terms: effects by name, and trial laws.

    tracks: for each test how its track is found where K differs from strip to strip; by an integration where none are
    given. unlike: whether a term may act in one of the tests alone; repeats of a test share all terms, and each has a K
    of its own. effort: of all problems made from one, together.
    """

    cases: Sequence[Case]
    channels: tuple[str, ...]
    terms: tuple[str, ...] = ()
    trial: Mapping[str, Effect] = field(default_factory=dict)
    nuisance: Nuisances | None = field(default=None, repr=False)
    tracks: Sequence[IntegratedSets | Paths] | None = field(default=None, repr=False)
    unlike: bool = False
    effort: Effort = field(default_factory=Effort, repr=False, compare=False)

    def with_terms(self, *names: str, trial: Mapping[str, Effect] | None = None) -> Problem:
        """The same problem with other terms."""
        every = {**self.trial, **(trial or {})}
        return replace(self, terms=tuple(names), trial={name: every[name] for name in names if name in every})

    def effect(self, name: str) -> Effect:
        """A term as it acts: a law on trial, or an effect of the catalogue."""
        return self.trial[name] if name in self.trial else catalogue()[name]

    def acting(self, number: int, terms: Mapping[str, _Values], trial: Mapping[str, Effect]) -> dict[str, _Values]:
        """Those of the terms that act in a test; trial: terms on trial beside those of the problem."""
        every = {**self.trial, **trial}
        return {n: of for n, of in terms.items() if n not in every or every[n].test in ("", self.tests[number])}

    @property
    def tests(self) -> list[str]:
        """Names of the tests (test,)."""
        return [case.test.name for case in self.cases]

    @property
    def own_terms(self) -> list[str]:
        """The tests in which a term may act alone, by name."""
        return self.tests if self.unlike and len(set(self.tests)) == len(self.tests) > 1 else []

    @property
    def is_local(self) -> bool:
        """Whether K differs from strip to strip, by a term or by what a test declares."""
        declared = (name for case in self.cases for name in case.test.effects)
        laws = (law for case in self.cases for law in case.test.laws.values())
        return any(self.effect(name).local for name in (*self.terms, *declared)) or any(law.local for law in laws)

    @property
    def shows_wear(self) -> bool:
        """Whether a channel was measured in which wear shows first, or one that stands for it."""
        return any(name == FIRST_SEEN["wear"] or "wear" in channels()[name].stands_for for name in self.channels)

    def shown_in(self, of: Effect | Quantity) -> str:
        """The channel an effect or a quantity shows in first, or the measured one that stands for it, or ""."""
        stands = (name for name in self.channels if of.stage in channels()[name].stands_for)
        return of.channel if of.channel in self.channels else next(stands, "")

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Base parameters that the channels can show, then those of the terms."""
        return (*self._base(), *(p for name in self.terms for p in parameters_of(name, self.effect(name))))

    def _base(self) -> list[Parameter]:
        """One for every channel and test; those that are shared, once."""
        results: dict[tuple[str, int | None], Parameter] = {}
        repeats = len(self.cases) > 1 and not self.unlike
        for name in self.channels:
            for base in channels()[name].parameters:
                seen = [i for i, case in enumerate(self.cases) if name in case.noise]
                given = [i for i, case in enumerate(self.cases) if np.isfinite(base.of(case.test))]
                shared = base.shared and not repeats
                if shared and seen and not given:
                    start = float(np.median([self.cases[i].held[base.key] for i in seen]))
                    results.setdefault((base.key, None), _parameter(base, start, None))
                for i in [] if shared else sorted({*seen} - {*given}):
                    results.setdefault((base.key, i), _parameter(base, self.cases[i].held[base.key], i))
        return list(results.values())

    @property
    def sharing(self) -> list[tuple[str, ...]]:
        """The channels, those together that share a base parameter: profile and weighings the wear coefficient."""
        keys = {name: {base.key for base in channels()[name].parameters} for name in self.channels}
        groups: list[tuple[str, ...]] = []
        for name in self.channels:
            linked = [group for group in groups if any(keys[name] & keys[other] for other in group)]
            groups = [*(group for group in groups if group not in linked), (*chain.from_iterable(linked), name)]
        return groups

    def start(self) -> Floats:
        """Inner start values (parameter,)."""
        return np.array([p.inner(p.start) for p in self.parameters])

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Inner lower and upper bounds (parameter,)."""
        lower = [p.inner(p.lower) for p in self.parameters]
        return np.array(lower), np.array([p.inner(p.upper) for p in self.parameters])

    @cached_property
    def normal(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Which parameters have a unit normal prior (parameter,)."""
        return np.array([p.normal for p in self.parameters], dtype=bool)

    def predict(
        self,
        theta: Floats,
        *,
        integrated: IntegratedSets | None = None,
        rough: bool = False,
        near: Sequence[State | None] = (),
    ) -> list[Prediction]:
        """Predictions of every test for parameter sets theta (set, parameter), which are near the first of them.

        rough: for a first look, to about a ten-thousandth; near: states nearby, of each test, where they are known.
        """
        return self.moved(theta, integrated=integrated, rough=rough, near=near)

    def moved(
        self,
        theta: Floats,
        *,
        number: int | None = None,
        base: Mapping[str, Floats] | None = None,
        extra: Mapping[str, Mapping[str, Floats]] | None = None,
        trial: Mapping[str, Effect] | None = None,
        integrated: IntegratedSets | None = None,
        rough: bool = False,
        near: Sequence[State | None] = (),
    ) -> list[Prediction]:
        """Predictions with base parameters of test `number` (all tests: None) replaced, and with extra effects."""
        for case, how in zip(self.cases, self._tracks, strict=True):
            self.effort.spent += len(theta) + self._effort_of_tracks(case, integrated or how, len(theta))
        return [
            case.model.predict(
                {**self.base_of(i, theta), **((base or {}) if number in (None, i) else {})},
                self.acting(i, {**self.terms_of(theta), **(extra or {})}, trial or {}),
                {**self.trial, **(trial or {})},
                integrated=integrated or self._tracks[i],
                near=(near[i] if near else None) or case.near,
                within=COUNTED if rough else SETTLED,
            )
            for i, case in enumerate(self.cases)
        ]

    @property
    def is_integrated(self) -> bool:
        """Whether tracks are found by an integration."""
        return self.is_local or any(case.model.loads_change for case in self.cases)

    def followed(self, theta: Floats) -> Problem:
        """The same problem on the tracks of inner parameters (parameter,) nearby, for which no integration is
        needed."""
        if not self.is_integrated:
            return self
        return replace(self, tracks=[prediction.paths.first for prediction in self.predict(theta[None])])

    def begun_at(self, near: Sequence[State | None]) -> Problem:
        """The same problem with states nearby, of each test where they are known, at which its predictions begin."""
        cases = [replace(case, near=state or case.near) for case, state in zip(self.cases, near, strict=True)]
        return replace(self, cases=cases)

    @property
    def _tracks(self) -> Sequence[IntegratedSets | Paths]:
        return self.tracks or ["first"] * len(self.cases)

    def _effort_of_tracks(self, case: Case, how: IntegratedSets | Paths, sets: int) -> int:
        """The effort of the integrations in a prediction of so many parameter sets of a test."""
        local, changes = self.is_local, case.model.loads_change
        if how not in ("each", "first") or not (local or changes):
            return 0
        each = INTEGRATED_LOCALLY[case.test.options.contact] if local and changes else INTEGRATED
        return each * (sets if how == "each" else 1)

    def own_base(self, number: int, theta: Floats) -> dict[str, Floats]:
        """The fitted base parameters of a test for theta (set, parameter)."""
        return {
            p.key: p.outer(column)
            for column, p in zip(theta.T, self.parameters, strict=True)
            if p.term is None and p.case in (None, number)
        }

    def terms_of(self, theta: Floats) -> dict[str, dict[str, Floats]]:
        """Parameters of the terms for theta (set, parameter), by term and key."""
        results: dict[str, dict[str, Floats]] = {name: {} for name in self.terms}
        for column, p in zip(np.atleast_2d(theta).T, self.parameters, strict=True):
            if p.term is not None:
                results[p.term][p.key] = p.outer(column)
        return results

    def base_of(self, number: int, theta: Floats) -> dict[str, Floats]:
        """Base parameters of a test for theta (set, parameter); mu that is given in single steps stands above."""
        case = self.cases[number]
        base = {key: np.full(len(theta), value) for key, value in case.held.items()} | self.own_base(number, theta)
        step_mu = case.test.history.given_mu
        if np.isfinite(step_mu).any():
            base["mu"] = np.where(np.isfinite(step_mu), step_mu, base["mu"][:, None])
        return base

    @property
    def parts(self) -> list[tuple[int, str]]:
        """Test and channel of each part of a row of whitened values."""
        return [(i, name) for i, case in enumerate(self.cases) for name in self.channels if name in case.noise]

    def white(self, predictions: Sequence[Prediction]) -> Floats:
        """Predicted channels as whitened values (set, sample), all tests and channels in a row."""
        parts = [
            self.cases[i].noise[c].whiten(channels()[c].predicted(self.cases[i].model, predictions[i]))
            for i, c in self.parts
        ]
        return np.concatenate(parts, axis=-1)

    @cached_property
    def places(self) -> dict[tuple[int, str], slice]:
        """Where each part stands in a row of whitened values, in their order."""
        ends = [0, *np.cumsum([int(self.cases[i].noise[c].kept.sum()) for i, c in self.parts]).tolist()]
        return {part: slice(*bounds) for part, bounds in zip(self.parts, pairwise(ends), strict=True)}

    @cached_property
    def owner(self) -> Ints:
        """The test that each white sample is of (sample,)."""
        return np.repeat([i for i, _ in self.places], [at.stop - at.start for at in self.places.values()])

    @cached_property
    def measured(self) -> Floats:
        """Measured channels as whitened values (sample,)."""
        return np.concatenate([self.cases[i].noise[c].whiten(self.cases[i].values(c)) for i, c in self.parts])

    @cached_property
    def slices(self) -> dict[str, list[slice]]:
        """Where each channel of each test stands in a row of whitened values."""
        return {channel: [at for (_, c), at in self.places.items() if c == channel] for channel in self.channels}

    def assumed(self, channel: str) -> Mask:
        """White samples of a channel whose noise had to be assumed (sample,)."""
        result = np.zeros(len(self.owner), dtype=bool)
        for (i, c), at in self.places.items():
            result[at] = c == channel and not self.cases[i].noise[c].estimated
        return result

    def count(self, channel: str, test: str = "") -> int:
        """White samples of a channel over all tests, or in one."""
        own = [at for (i, c), at in self.places.items() if c == channel and test in ("", self.tests[i])]
        return sum(at.stop - at.start for at in own)

    def own_samples(self, rows: Floats, channel: str) -> list[tuple[str, Mask]]:
        """Tests in which alone a term of a channel may act that moves white rows (..., sample), with their samples.

        None where the tests share the base parameters of the channel, as K, or where no more than one of them moves:
        the term acts in that one alone anyhow.
        """
        if all(base.shared for base in channels()[channel].parameters):
            return []
        parts = [(name, self.owner == number) for number, name in enumerate(self.own_terms)]
        moved = [(name, own) for name, own in parts if np.any(rows[..., own] != 0.0)]
        return moved if len(moved) > 1 else []

    @property
    def cost_of_one(self) -> float:
        """What the choice of a test costs a term that acts in it alone [nats]."""
        return float(np.log(max(len(self.own_terms), 1)))

    @property
    def volume(self) -> float:
        """Half the logarithm of the determinant of the covariance of all samples."""
        alone = sum(case.noise[name].volume for case in self.cases for name in self.channels if name in case.noise)
        return alone + (self.nuisance.volume if self.nuisance is not None else 0.0)

    def discount(self, rows: Floats) -> Floats:
        """Shrink white rows (..., sample) along the nuisances."""
        return rows if self.nuisance is None else self.nuisance.discounted(rows)

    def white_with(
        self, theta: Floats, name: str, own: Sequence[dict[str, Floats]], trial: Mapping[str, Effect] | None = None
    ) -> Floats:
        """White prediction (sample,) with an effect of which each test has parameters of its own."""
        every = {**self.trial, **(trial or {})}
        predictions = [
            case.model.predict(
                self.base_of(i, theta[None]),
                self.acting(i, {**self.terms_of(theta), name: own[i]}, every),
                every,
                integrated=self._tracks[i],
                near=case.near,
            )
            for i, case in enumerate(self.cases)
        ]
        return np.asarray(self.white(predictions)[0])


def problem_of(tests: Sequence[Experiment], *, unlike: bool = False) -> Problem:
    """All channels of the tests, with their noise; unlike: whether these are no repeats of one test."""
    cases = cases_of(tests)
    return Problem(cases, tuple(c for c in channels() if any(c in case.noise for case in cases)), unlike=unlike)


@lru_cache(maxsize=32)
def _guesses(model: ForwardModel) -> Mapping[str, float]:
    """Base parameters from the measurements alone, by key, once for each model."""
    guesses: dict[str, float] = {}
    for base in base_parameters():
        if not np.isfinite(guesses.get(base.key, np.nan)):
            guesses[base.key] = base.guess(model)
    return guesses


def _parameter(base: Base, start: float, case: int | None) -> Parameter:
    return Parameter(base.key, None, base.key, base.unit, start, base.lower, base.upper, True, case)


def parameters_of(name: str, effect: Effect) -> list[Parameter]:
    """The parameters of an effect or a law as they are fitted."""
    return [
        Parameter(f"{name}.{p.name}", name, p.name, p.unit, p.start, p.lower, p.upper, p.log, None, p.off, p.normal)
        for p in effect.params
    ]
