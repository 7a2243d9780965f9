"""Every file of the catalogue under one harness: declared in full, silent when off, seen where it says, finite.

The test the effects act in: the rig of Chevalier et al. (2006) with steps in partial slip before and after steps in
full sliding, profiles of both discs, and temperatures.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from definitions import VALID

import twindisc_cli.effects
from twindisc_cli.definition.parse import parse
from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import STAGES, Effect
from twindisc_cli.errors import DefinitionError
from twindisc_cli.laws.covariates import COVARIATES
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
from twindisc_cli.model.forward import ForwardModel, Prediction

NAMES = sorted(catalogue())
CONTRACT = {
    "traction": """falling_friction film_breakdown temperature_dependent_friction running_in_friction third_body_layer
        two_slope_factors lubricated_film creepage_offset torque_offset sensor_drift misalignment load_error
        exact_elasticity""",
    "profile": """half_space_contact lateral_wander lateral_offset wear_partition severe_wear_transition wear_threshold
        running_in_wear temperature_dependent_wear shoulder_pileup profile_tilt stylus_smoothing""",
    "temperature": """thermocouple_lag ambient_drift parasitic_heat heat_partition shaft_conduction
        nonlinear_convection""",
}
"""Names that test definitions use, by the channel an effect shows in first: they stay."""
CHANNELS = tuple(CONTRACT)
CREEPAGE = np.array([0.001, 0.02, 0.09, 0.002, 0.004])
ITERATIONS = 3
DURATION = 84.0
UNIT = re.compile(r"1|%|(?:s|h|K|W|J|kJ|N|m|mm|um|mrad)(?:-?\d)?(?: (?:s|h|K|W|J|N|m|mm|um)(?:-?\d)?)*")
DRAWS = 24
SETTLED = 1e-6
"""The passes of the model stop when energy and temperature stand still; what moves by less has not changed."""

every_effect = pytest.mark.parametrize("name", NAMES)


@cache
def model() -> ForwardModel:
    steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": 700 * 9.80665e6}
    rig = Rig(Disc(0.03, np.inf, **steel), Disc(0.03, 0.03, **steel), normal_load=72.0, rolling_speed=9.42)
    step = np.repeat(np.arange(len(CREEPAGE)), ITERATIONS)
    ones = np.ones(len(step))
    history = History(step, CREEPAGE[step], DURATION * ones, 4200.0 * ones, np.nan * ones)
    at = np.repeat(np.arange(len(step)), 2)
    time = DURATION / 2 * np.arange(1.0, len(at) + 1.0)
    across = np.linspace(-1.5e-3, 1.5e-3, 121)
    facet = np.minimum((across**2 - 0.5e-3**2) / 0.06, 0.0)
    y, height = np.tile(across, 3), np.concatenate([0.1 * facet, 0.6 * facet, facet])
    measured = Measured(
        traction=TractionSamples(time, step[at], CREEPAGE[step][at], 0.5 * np.ones(len(at)), np.full(len(at), np.nan)),
        profile=ProfileSamples(y, height, np.repeat([1, 2, 2], 121), np.repeat([15, 9, 15], 121)),
        temperature=TemperatureSamples(time, np.full(len(time), 300.0)),
    )
    return ForwardModel(
        Experiment("all effects", "", rig, history, Options(), Thermal(293.15, 100.0, 293.15), measured=measured)
    )


def predict(effects: dict[str, dict[str, Floats]] | None = None) -> Prediction:
    base = {"mu": np.array([0.5]), "K": np.array([6e-5]), "convection_W_K": np.array([2.0])}
    return model().predict(base, effects)


@cache
def plain() -> Prediction:
    return predict()


def values(effect: Effect, **changed: float) -> dict[str, Floats]:
    """Every parameter at its start, but for those given."""
    return {p.name: np.array([changed.get(p.name, p.start)]) for p in effect.params}


def ends(effect: Effect) -> dict[str, tuple[float, float]]:
    """What a test definition allows each parameter: its bounds, and `off`."""
    limits = {p.name: [p.lower, p.upper, *([] if p.off is None else [p.off])] for p in effect.params}
    return {name: (min(some), max(some)) for name, some in limits.items()}


def changed_channels(prediction: Prediction, than: Prediction, tolerance: float = SETTLED) -> set[str]:
    """Channels that differ in any set by more than `tolerance` times their own range."""
    found: set[str] = set()
    for channel in CHANNELS:
        new, old = getattr(prediction, channel), getattr(than, channel)
        if np.max(np.abs(new - old)) > tolerance * np.ptp(old):
            found.add(channel)
    return found


def test_the_test_covers_what_effects_act_on() -> None:
    # Kalker: all of the patch slides where T = mu N; in partial slip T < mu N.
    ratio = plain().traction[0] / 0.5
    in_step = model().experiment.measured.traction
    assert in_step is not None
    assert ratio[in_step.step == 2].min() > 0.999
    assert ratio[in_step.step == 0].max() < 0.5
    assert 0.2 < ratio[in_step.step == 3].max() < 0.9
    assert plain().profile.min() < -1e-6
    assert np.ptp(plain().temperature) > 5.0


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_that_draws_on_the_temperature_says_so(name: str) -> None:
    # two states that differ in nothing but the temperature of the disc
    effect, state = catalogue()[name], plain().state
    if effect.stage not in ("friction", "traction", "contact", "wear"):
        return
    warm, cold = (effect.apply(state.replace(temperature=state.temperature + d), **values(effect)) for d in (0.0, 5.0))
    acted = any(
        not np.array_equal(getattr(warm, q), getattr(cold, q)) for q in ("mu", "slope", "wear_factor", "wander")
    )
    assert effect.needs_temperature is acted


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_over_a_covariate_changes_with_it(name: str) -> None:
    """Two states that differ in nothing but that covariate (a creep curve of another form is one over it as it is)."""
    effect, state = catalogue()[name], plain().state
    assert effect.over in ("", *COVARIATES)
    if effect.over and effect.stage in ("friction", "wear"):
        fields = ("time", "cycles") if effect.over == "time" else (effect.over,)
        moved = state.replace(**{field: 1.5 * getattr(state, field) for field in fields})
        here, there = (effect.apply(s, **values(effect)) for s in (state, moved))
        assert any(not np.array_equal(getattr(here, q), getattr(there, q)) for q in ("mu", "wear_factor"))


@pytest.mark.parametrize("channel", CHANNELS)
def test_names_of_the_contract_are_there(channel: str) -> None:
    assert set(CONTRACT[channel].split()) <= {name for name in NAMES if catalogue()[name].channel == channel}


@every_effect
def test_declaration(name: str) -> None:
    effect = catalogue()[name]
    assert effect.stage in STAGES
    assert effect.channel in effect.seen_in <= set(CHANNELS)
    assert re.search(r"\d", effect.source), "a source has a year, a volume or a section"
    assert len(effect.source) > 10
    assert [p.name for p in effect.params if p.off is not None], "a parameter must switch it off"
    signature = inspect.signature(effect.apply).parameters
    assert list(signature)[1:] == [p.name for p in effect.params]
    assert all(p.kind is p.KEYWORD_ONLY for p in list(signature.values())[1:])


@every_effect
def test_parameters(name: str) -> None:
    for p in catalogue()[name].params:
        assert UNIT.fullmatch(p.unit), p.unit
        assert p.meaning and not p.meaning.endswith(".")
        assert p.lower <= p.start <= p.upper
        assert p.lower < p.upper
        assert p.start != p.off, "a typical size is not off"
        assert p.off is None or not p.lower < p.upper < p.off
        assert not p.log or (p.lower > 0.0 and (p.off is None or p.off > 0.0))


@every_effect
def test_it_can_be_declared_in_a_test_definition(name: str) -> None:
    table = {p.name: p.start for p in catalogue()[name].params}
    lines = "".join(f"{key} = {value!r}\n" for key, value in table.items())
    declared = parse(f"{VALID}\n[effects.{name}]\n{lines}", "small.toml").model_dump(exclude_none=True)["effects"]
    assert declared == {name: table}
    for key, (low, high) in ends(catalogue()[name]).items():
        for beyond in (low - 1.0, high + 1.0):
            with pytest.raises(DefinitionError, match=key):
                parse(f"{VALID}\n[effects.{name}]\n{key} = {beyond!r}\n", "small.toml")


@every_effect
def test_explanation(name: str) -> None:
    effect = catalogue()[name]
    text = effect.explanation
    title = text.partition(":")[0].lower().replace("-", "")
    assert all(word in title for word in name.split("_"))
    assert text.partition("\n")[0].endswith(".")
    for needed in ("=", "Leaves behind, when it is missing:", "Valid for:"):
        assert needed in text


@every_effect
def test_off_leaves_the_model_bit_identical(name: str) -> None:
    effect = catalogue()[name]
    off = {p.name: p.off for p in effect.params if p.off is not None}
    neutral = {p.name: 0.0 for p in effect.params if p.off is None and p.start == 0.0}
    assert changed_channels(predict({name: values(effect, **off, **neutral)}), plain(), tolerance=0.0) == set()


@every_effect
def test_on_changes_the_channels_it_is_seen_in_and_no_other(name: str) -> None:
    effect = catalogue()[name]
    assert changed_channels(predict({name: values(effect)}), plain()) == set(effect.seen_in)


@every_effect
def test_every_parameter_acts(name: str) -> None:
    effect = catalogue()[name]
    typical = predict({name: values(effect)})
    for p in effect.params:
        at_ends = {key: np.repeat(value, 2) for key, value in values(effect).items()} | {p.name: ends(effect)[p.name]}
        moved = predict({name: {key: np.asarray(value) for key, value in at_ends.items()}})
        assert effect.channel in changed_channels(moved, typical), f"{p.name} does nothing"


@every_effect
def test_finite_anywhere_inside_the_bounds(name: str) -> None:
    effect = catalogue()[name]
    limits = ends(effect)
    corners = np.stack([c.ravel() for c in np.meshgrid(*limits.values(), indexing="ij")], axis=1)
    part = np.random.default_rng(len(name)).random((DRAWS, len(limits)))
    low, high = np.array(list(limits.values())).T
    inside = np.concatenate([corners, low + part * (high - low)])
    sets = {key: np.ascontiguousarray(column) for key, column in zip(limits, inside.T, strict=True)}
    prediction = predict({name: sets})
    for channel in CHANNELS:
        found = getattr(prediction, channel)
        assert found.shape[0] == len(inside)
        assert np.isfinite(found).all(), f"{channel} at {inside[~np.isfinite(found).all(axis=1)][:3]}"


@pytest.fixture
def contributed(tmp_path: Path) -> Iterator[str]:
    """The example of CONTRIBUTING.md, put into the folder of the effects as its text says."""
    text = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (name,) = re.findall(r"`twindisc_cli/effects/(\w+)\.py`", text.partition("| part")[0])
    (tmp_path / f"{name}.py").write_text(text.split("```python\n")[1].partition("```")[0], encoding="utf-8")
    twindisc_cli.effects.__path__.append(str(tmp_path))
    catalogue.cache_clear()
    yield name
    twindisc_cli.effects.__path__.remove(str(tmp_path))
    sys.modules.pop(f"twindisc_cli.effects.{name}", None)
    catalogue.cache_clear()


def test_the_example_for_contributors_needs_nothing_but_its_file(contributed: str) -> None:
    assert contributed in catalogue()
    assert contributed not in NAMES
    for check in (
        test_declaration,
        test_parameters,
        test_explanation,
        test_it_can_be_declared_in_a_test_definition,
        test_off_leaves_the_model_bit_identical,
        test_on_changes_the_channels_it_is_seen_in_and_no_other,
        test_every_parameter_acts,
        test_finite_anywhere_inside_the_bounds,
    ):
        check(contributed)
