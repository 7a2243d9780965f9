"""Every file of the catalogue under the harness that users have (`effects --test`), and what the contract asks."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from definitions import VALID

import twindisc_cli.effects
from twindisc_cli.definition.parse import parse
from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect
from twindisc_cli.errors import DefinitionError
from twindisc_cli.laws.covariates import COVARIATES
from twindisc_cli.loop.effect_checks import BASE, Check, acting, blank_test, declared, ends_of, sound, values_of
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

NAMES = sorted(catalogue())
CONTRACT = {
    "traction": """falling_friction film_breakdown temperature_dependent_friction running_in_friction third_body_layer
        two_slope_factors lubricated_film saturating_friction creepage_offset torque_offset sensor_drift gain_drift
        misalignment load_error exact_elasticity""",
    "profile": """half_space_contact lateral_wander lateral_offset wear_partition severe_wear_transition wear_threshold
        running_in_wear temperature_dependent_wear wear_level shoulder_pileup profile_tilt stylus_smoothing""",
    "temperature": """thermocouple_lag clock_offset ambient_drift parasitic_heat heat_partition shaft_conduction
        nonlinear_convection""",
}
"""Names that test definitions use, by the channel an effect shows in first: they stay."""
UNIT = re.compile(r"1|%|(?:s|h|K|W|J|kJ|N|m|mm|um|mrad)(?:-?\d)?(?: (?:s|h|K|W|J|N|m|mm|um)(?:-?\d)?)*")

every_effect = pytest.mark.parametrize("name", NAMES)


@cache
def plain() -> Prediction:
    return ForwardModel(blank_test()).predict({key: np.array([value]) for key, value in BASE.items()})


def test_the_test_of_the_harness_covers_what_effects_act_on() -> None:
    # Kalker: all of the patch slides where T = mu N; in partial slip T < mu N.
    ratio = plain().traction[0] / BASE["mu"]
    traction = blank_test().measured.traction
    assert traction is not None
    assert ratio[traction.step == 2].min() > 0.999
    assert ratio[traction.step == 0].max() < 0.5
    assert 0.2 < ratio[traction.step == 3].max() < 0.9
    assert plain().profile.min() < -1e-6
    assert np.ptp(plain().temperature) > 5.0


@every_effect
@pytest.mark.parametrize("part", [declared, acting, sound])
def test_every_claim_of_its_file_holds(name: str, part: Callable[[str, Effect], Iterator[Check]]) -> None:
    checks = list(part(name, catalogue()[name]))
    assert checks
    assert not [str(check) for check in checks if not check.ok]


@every_effect
def test_an_effect_that_draws_on_the_temperature_says_so(name: str) -> None:
    # two states that differ in nothing but the temperature of the disc
    effect, state = catalogue()[name], plain().state
    if effect.stage not in ("friction", "traction", "contact", "wear"):
        return
    warm, cold = (
        effect.apply(state.replace(temperature=state.temperature + d), **values_of(effect, {})) for d in (0.0, 5.0)
    )
    acted = any(
        not np.array_equal(getattr(warm, q), getattr(cold, q)) for q in ("mu", "slope", "wear_factor", "wander")
    )
    assert effect.needs_temperature is acted


@every_effect
def test_an_effect_over_a_covariate_changes_with_it(name: str) -> None:
    """Two states that differ in nothing but that covariate (a creep curve of another form is one over it as it is)."""
    effect, state = catalogue()[name], plain().state
    assert effect.over in ("", *COVARIATES)
    if effect.over and effect.stage in ("friction", "wear"):
        fields = ("time", "cycles") if effect.over == "time" else (effect.over,)
        moved = state.replace(**{field: 1.5 * getattr(state, field) for field in fields})
        here, there = (effect.apply(s, **values_of(effect, {})) for s in (state, moved))
        assert any(not np.array_equal(getattr(here, q), getattr(there, q)) for q in ("mu", "wear_factor"))


@pytest.mark.parametrize("name", [n for n in NAMES if catalogue()[n].stage == "friction"])
def test_friction_follows_the_size_of_the_creepage_and_not_its_direction(name: str) -> None:
    effect, state = catalogue()[name], plain().state
    turned = state.replace(creepage=-0.6 * state.creepage, lateral_creepage=0.8 * state.creepage)
    straight, oblique = (effect.apply(s, **values_of(effect, {})).mu for s in (state, turned))
    assert oblique == pytest.approx(straight, rel=1e-12)


@pytest.mark.parametrize("channel", CONTRACT)
def test_names_of_the_contract_are_there(channel: str) -> None:
    assert set(CONTRACT[channel].split()) <= {name for name in NAMES if catalogue()[name].channel == channel}


@every_effect
def test_parameters_have_units_and_meanings(name: str) -> None:
    for p in catalogue()[name].params:
        assert UNIT.fullmatch(p.unit), p.unit
        assert p.meaning and not p.meaning.endswith(".")
        assert p.off is None or not p.lower < p.upper < p.off


@every_effect
def test_it_can_be_declared_in_a_test_definition(name: str) -> None:
    table = {p.name: p.start for p in catalogue()[name].params}
    lines = "".join(f"{key} = {value!r}\n" for key, value in table.items())
    declared = parse(f"{VALID}\n[effects.{name}]\n{lines}", "small.toml").model_dump(exclude_none=True)["effects"]
    assert declared == {name: table}
    for key, (low, high) in ends_of(catalogue()[name]).items():
        for beyond in (low - 1.0, high + 1.0):
            with pytest.raises(DefinitionError, match=key):
                parse(f"{VALID}\n[effects.{name}]\n{key} = {beyond!r}\n", "small.toml")


@every_effect
def test_the_title_of_its_explanation_is_its_name(name: str) -> None:
    title = catalogue()[name].explanation.partition(":")[0].lower().replace("-", "")
    assert all(word in title for word in name.split("_"))


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
    effect = catalogue()[contributed]
    assert all(check.ok for part in (declared, acting, sound) for check in part(contributed, effect))
    test_it_can_be_declared_in_a_test_definition(contributed)
