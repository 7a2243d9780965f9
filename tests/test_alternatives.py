"""What stands for a term of an answer: effects, laws in other words, and laws whose covariates run alike."""

from types import SimpleNamespace

import numpy as np
import pytest

from twindisc_cli.effects import catalogue
from twindisc_cli.loop.alternatives import Compared, weighed
from twindisc_cli.loop.terms import Alternative, EffectTerm, LawTerm

TIME = np.linspace(0.0, 1.0, 200)
NOISE = np.sin(40.0 * TIME)  # what nothing explains
RISING, OTHER = TIME, TIME**3  # what rises along the test, and what rises late


def member(names, evidence, removes):
    """An explanation of one term that takes this away from the misfit of the base model."""
    name, term = "_over_".join(names), term_of(*names)
    effect = catalogue().get(name) or SimpleNamespace(channel="profile")
    return SimpleNamespace(
        terms=(name,), labels=frozenset({term}), evidence=evidence, temperature=1.0, term=lambda name: term,
        effect=lambda name: effect, here=evidence, fit=left(NOISE + RISING - removes),
    )  # fmt: skip


def names(found):
    return [str(alternative.term) for alternative in found.alternatives]


def term_of(first, covariate=None):
    return LawTerm(first, covariate) if covariate else EffectTerm(first)


def left(residual):
    return SimpleNamespace(residual=residual, chi2=float(residual @ residual), at_bound=())


def compared(shares, *members):
    base = SimpleNamespace(terms=(), labels=frozenset(), evidence=-50.0, temperature=1.0, fit=left(NOISE + RISING))
    return Compared(members[0], [*members, base], np.array([*shares, 0.0]), base)


WARM = member(("temperature_dependent_wear",), 0.0, RISING)
BY_WARMTH, BY_ENERGY, BY_POWER = (member(("wear", c), -0.5, RISING) for c in ("temperature", "energy", "power"))


def test_a_law_over_its_own_covariate_is_the_effect_and_those_that_run_alike_are_one_rival():
    found = weighed(compared([0.3, 0.2, 0.25, 0.25], WARM, BY_WARMTH, BY_ENERGY, BY_POWER), WARM.terms[0])
    assert found.probability == pytest.approx(0.5)
    assert found.alternatives == [Alternative(LawTerm("wear", "energy"), pytest.approx(0.5))]
    assert found.same[LawTerm("wear", "power")] == LawTerm("wear", "energy")


def test_an_effect_without_a_covariate_of_its_own_takes_every_law_with_its_response():
    partition = member(("heat_partition",), 0.0, RISING)
    found = weighed(compared([0.6, 0.4], partition, member(("heat", "power"), -0.5, RISING)), partition.terms[0])
    assert found.probability == pytest.approx(1.0)
    assert not found.alternatives


def test_a_law_over_the_covariate_of_an_effect_is_another_form_of_it_and_is_named():
    other_form = member(("wear", "temperature"), -0.5, RISING - 0.6 * OTHER)
    late = member(("wear", "energy"), -0.5, RISING - 0.9 * OTHER)
    found = weighed(compared([0.3, 0.6, 0.1], WARM, other_form, late), WARM.terms[0])
    assert found.probability == pytest.approx(0.9)
    assert found.alternatives == [Alternative(LawTerm("wear", "temperature"), pytest.approx(0.6))]


def test_laws_stay_apart_in_the_set_of_a_law():
    found = weighed(compared([0.6, 0.4], BY_ENERGY, BY_POWER), BY_ENERGY.terms[0])
    assert found.alternatives == [Alternative(LawTerm("wear", "power"), pytest.approx(0.4))]


def test_an_effect_within_reach_is_named_though_the_set_is_full():
    severe = member(("severe_wear_transition",), -2.0, 0.7 * RISING + 0.3 * OTHER)
    late = member(("wear", "creepage"), -2.0, 0.5 * RISING + 0.5 * OTHER)
    found = weighed(compared([0.87, 0.07, 0.06], WARM, severe, late), WARM.terms[0])
    assert names(found) == ["severe_wear_transition"]


@pytest.mark.parametrize("as_well", [True, False])
def test_an_effect_that_fits_as_well_is_named_though_its_parameters_make_it_improbable(as_well):
    severe = member(("severe_wear_transition",), -4.0, RISING if as_well else 0.6 * RISING)
    found = weighed(compared([0.98, 0.02], WARM, severe), WARM.terms[0])
    assert names(found) == (["severe_wear_transition"] if as_well else [])


def test_the_set_of_an_effect_is_small_with_effects_before_laws():
    rising = [
        member(("wear", c), -1.0, RISING + k * OTHER) for c, k in (("energy", -0.5), ("power", 0.6), ("creepage", 2.0))
    ]
    severe, settling = (
        member((name,), -2.0, RISING - k * OTHER)
        for name, k in (("severe_wear_transition", 0.7), ("running_in_wear", 0.4))
    )
    shares = [0.25, 0.2, 0.15, 0.15, 0.12, 0.13]
    found = weighed(compared(shares, WARM, *rising, severe, settling), WARM.terms[0])
    assert names(found) == [
        "running_in_wear",
        "severe_wear_transition",
    ]
