"""What stands for a term of an answer: effects, laws in other words, and laws whose covariates run alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rigs import Floats, experiment, history, spread, traction_samples

from twindisc_cli.laws.covariates import COVARIATES
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.trial import Trial, formula
from twindisc_cli.loop.alternatives import Compared, Weighed, shorter, weighed
from twindisc_cli.loop.explain import is_negligible, most_probable, next_to_judge
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import at
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.refusal import Refusal
from twindisc_cli.loop.terms import Alternative, LawTerm
from twindisc_cli.model.experiment import Measured

COURSE = history((0.02, 0.05), 1)
AT = spread(COURSE, 100)
MEASURED = Measured(traction=traction_samples(COURSE, AT, 0.6 + 0.0 * AT, 0.004))
PROBLEM = Problem([case_of(experiment(COURSE, measured=MEASURED))], ("traction",))
TIME = np.linspace(0.0, 1.0, len(AT))
NOISE = np.sin(40.0 * TIME)  # what nothing explains
RISING, OTHER = TIME, TIME**3  # what rises along the test, and what rises late


def line(quantity: str, covariate: str) -> Trial:
    """A law on trial."""
    begin, end = (COVARIATES[covariate].key(name) for name in ("begin", "end"))
    start = {QUANTITIES[quantity].size_key: 0.1, begin: 0.0, end: 1.0}
    return formula(quantity, covariate, "linear", start, (0.0, 1.0), 1.0)


def explanation(problem: Problem, evidence: float, residual: Floats) -> Explanation:
    """An explanation that leaves this residual; the cost of its choice gives it this evidence."""
    fitted = replace(at(problem, problem.start()), residual=residual)
    return Explanation(fitted, {"choice": fitted.evidence - evidence}, fitted.chi2)


def member(names: tuple[str, ...], evidence: float, removes: Floats) -> Explanation:
    """An explanation of one term that takes this away from the misfit of the base model: an effect, or a law."""
    name = "_over_".join(names)
    trial = {} if len(names) == 1 else {name: line(*names)}
    return explanation(PROBLEM.with_terms(name, trial=trial), evidence, NOISE + RISING - removes)


def names(found: Weighed) -> list[str]:
    return [str(alternative.term) for alternative in found.alternatives]


def compared(shares: Sequence[float], *members: Explanation) -> Compared:
    base = explanation(PROBLEM, -50.0, NOISE + RISING)
    return Compared(members[0], [*members, base], np.array([*shares, 0.0]), base)


WARM = member(("temperature_dependent_wear",), 0.0, RISING)
BY_WARMTH, BY_ENERGY, BY_POWER = (member(("wear", c), -0.5, RISING) for c in ("temperature", "energy", "power"))


def test_a_law_over_its_own_covariate_is_the_effect_and_those_that_run_alike_are_one_rival() -> None:
    found = weighed(compared([0.3, 0.2, 0.25, 0.25], WARM, BY_WARMTH, BY_ENERGY, BY_POWER), WARM.terms[0])
    assert found.probability == pytest.approx(0.5)
    assert found.alternatives == [Alternative(LawTerm("wear", "energy"), pytest.approx(0.5))]
    assert found.same[LawTerm("wear", "power")] == LawTerm("wear", "energy")


def test_an_effect_without_a_covariate_of_its_own_takes_every_law_with_its_response() -> None:
    partition = member(("heat_partition",), 0.0, RISING)
    found = weighed(compared([0.6, 0.4], partition, member(("heat", "power"), -0.5, RISING)), partition.terms[0])
    assert found.probability == pytest.approx(1.0)
    assert not found.alternatives


def test_a_law_over_the_covariate_of_an_effect_is_another_form_of_it_and_is_named() -> None:
    other_form = member(("wear", "temperature"), -0.5, RISING - 0.6 * OTHER)
    late = member(("wear", "energy"), -0.5, RISING - 0.9 * OTHER)
    found = weighed(compared([0.3, 0.6, 0.1], WARM, other_form, late), WARM.terms[0])
    assert found.probability == pytest.approx(0.9)
    assert found.alternatives == [
        Alternative(LawTerm("wear", "temperature"), pytest.approx(0.6)),
        Alternative(LawTerm("wear", "energy"), pytest.approx(0.1)),
    ]


def test_laws_stay_apart_in_the_set_of_a_law() -> None:
    found = weighed(compared([0.6, 0.4], BY_ENERGY, BY_POWER), BY_ENERGY.terms[0])
    assert found.alternatives == [Alternative(LawTerm("wear", "power"), pytest.approx(0.4))]


def test_what_is_within_reach_is_named_though_the_set_is_probable_enough_while_it_is_small() -> None:
    severe = member(("severe_wear_transition",), -2.0, 0.7 * RISING + 0.3 * OTHER)
    late, later = (member(("wear", c), -2.0, 0.5 * RISING + k * OTHER) for c, k in (("creepage", 0.5), ("energy", 0.9)))
    found = weighed(compared([0.83, 0.07, 0.06, 0.04], WARM, severe, late, later), WARM.terms[0])
    assert names(found) == ["severe_wear_transition", "wear over creepage"]
    found = weighed(compared([0.07, 0.82, 0.06, 0.05], late, WARM, severe, later), late.terms[0])
    assert names(found) == ["temperature_dependent_wear", "severe_wear_transition"]


@pytest.mark.parametrize("as_well", [True, False])
def test_an_effect_that_fits_as_well_is_named_though_its_parameters_make_it_improbable(as_well: bool) -> None:
    severe = member(("severe_wear_transition",), -4.0, RISING if as_well else 0.6 * RISING)
    found = weighed(compared([0.98, 0.02], WARM, severe), WARM.terms[0])
    assert names(found) == (["severe_wear_transition"] if as_well else [])


def test_the_set_of_an_effect_has_three_members_and_that_of_a_law_ends_where_it_is_probable_enough() -> None:
    """It holds 88 %, 80 % being asked. In an effect's, effects come before laws that are hardly ahead."""
    rising = [
        member(("wear", c), -1.0, RISING + k * OTHER) for c, k in (("energy", -0.5), ("power", 0.6), ("creepage", 2.0))
    ]
    severe, settling = (
        member((name,), -2.0, RISING - k * OTHER)
        for name, k in (("severe_wear_transition", 0.7), ("running_in_wear", 0.4))
    )
    shares = [0.25, 0.2, 0.15, 0.14, 0.12, 0.14]
    found = weighed(compared(shares, WARM, *rising, severe, settling), WARM.terms[0])
    assert names(found) == ["running_in_wear", "wear over energy"]
    found = weighed(compared([0.2, 0.3, *shares[2:]], WARM, *rising, severe, settling), WARM.terms[0])
    assert names(found) == ["wear over energy", "running_in_wear"]
    found = weighed(compared(shares, rising[0], *rising[1:], WARM, severe, settling), rising[0].terms[0])
    assert names(found) == [
        "wear over power", "wear over creepage", "running_in_wear", "temperature_dependent_wear"
    ]  # fmt: skip


def test_two_effects_of_one_quantity_over_one_covariate_are_as_likely_one_law_over_it() -> None:
    def both(*terms: str) -> Explanation:
        trial = {name: line("mu", "creepage") for name in terms if name == "mu_over_creepage"}
        return explanation(PROBLEM.with_terms(*terms, trial=trial), 0.0, NOISE)

    law, film = LawTerm("mu", "creepage"), member(("film_breakdown",), -20.0, 0.5 * RISING)
    answer, beside = both("falling_friction", "film_breakdown"), both("mu_over_creepage", "film_breakdown")
    known = compared([0.6, 0.2, 0.2, 0.0], answer, member(("mu", "creepage"), -3.0, RISING), beside, film)
    falling, broken = (weighed(known, name, as_one_law=True) for name in answer.terms)
    assert (falling.probability, broken.probability) == (pytest.approx(0.3), pytest.approx(0.4))
    assert falling.alternatives == [Alternative(law, pytest.approx(0.3 + 0.2 + 0.2))]
    assert broken.alternatives == [Alternative(law, pytest.approx(0.3 + 0.2 + 0.1))]
    assert weighed(known, "falling_friction").probability == pytest.approx(1.0)  # as what is chosen is weighed
    broken = weighed(replace(known, answer=beside), "film_breakdown", as_one_law=True)
    assert (broken.probability, broken.alternatives) == (pytest.approx(0.4), [])  # the law is in the answer


@pytest.mark.parametrize("other", ["running_in_friction", "two_slope_factors", "sensor_drift"])
def test_effects_of_other_quantities_or_over_other_covariates_are_no_law_together(other: str) -> None:
    two = explanation(PROBLEM.with_terms("falling_friction", other), 0.0, NOISE)
    known = compared([0.9, 0.1], two, member(("falling_friction",), -20.0, 0.5 * RISING))
    assert [weighed(known, name, as_one_law=True).probability for name in two.terms] == pytest.approx([1.0, 0.9])


def test_an_effect_gives_way_to_a_law_that_is_more_probable_by_itself() -> None:
    """Two laws that run alike are one rival in its set, and neither of them is what would be given."""
    own = [member(("wear", c), -0.5, RISING - 0.9 * OTHER) for c in ("energy", "power")]
    assert most_probable(compared([0.35, 0.35, 0.3], WARM, *own)).labels == WARM.labels
    assert most_probable(compared([0.35, 0.55, 0.1], WARM, *own)).labels == own[0].labels


def test_a_part_of_an_answer_is_given_where_it_is_more_probable_than_all_that_holds_it() -> None:
    """The second term of the answer is its own, or stands beside two others in whose place one of them is needed."""

    def pair(name: str) -> Explanation:
        return explanation(PROBLEM.with_terms("parasitic_heat", name), -4.0, NOISE)

    both, *others = (pair(n) for n in ("running_in_friction", "ambient_drift", "torque_offset"))
    part = member(("parasitic_heat",), 0.0, RISING)
    assert most_probable(compared([0.2, 0.6, 0.1, 0.1], both, part, *others)).labels == part.labels
    assert most_probable(compared([0.3, 0.4, 0.2, 0.1], both, part, *others)).labels == both.labels


def test_what_stands_behind_a_refused_explanation_comes_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """In 99 resamples of 100 the second is a thousand times less likely than the refused one; in one a third wins."""
    second, third = member(("running_in_wear",), -8.0, RISING), member(("severe_wear_transition",), -8.0, OTHER)
    known = compared([0.989, 0.001, 0.01], WARM, second, third)
    odds = {WARM.labels: (1.0, 0.0), second.labels: (1e-3, 0.0), third.labels: (0.0, 1.0), frozenset(): (1e-9, 1e-9)}

    def drawn(members: Sequence[Explanation]) -> Floats:
        rows = np.array([[odds[m.labels][number == 99] for m in members] for number in range(100)])
        return np.asarray(rows / rows.sum(axis=1, keepdims=True))

    monkeypatch.setattr("twindisc_cli.loop.resample.weights", drawn)
    assert next_to_judge(known, {}).labels == WARM.labels
    assert next_to_judge(known, {WARM.labels: Refusal("does not predict", "errs")}).labels == second.labels
    assert (
        next_to_judge(known, {m.labels: Refusal("raises the error", "errs") for m in (WARM, second, third)}).terms == ()
    )


@pytest.mark.parametrize(("share", "negligible"), [(0.001, True), (0.04, True), (0.06, False), (0.9, False)])
def test_what_fewer_than_a_twentieth_of_the_resamples_choose_is_negligible(share: float, negligible: bool) -> None:
    second = member(("running_in_wear",), -8.0, OTHER)
    known = compared([1.0 - share, share], WARM, second)
    assert is_negligible(weighed(replace(known, answer=second), second.terms[0])) == negligible


@pytest.mark.parametrize(("evidence", "share", "said"), [(-1.0, 0.3, True), (-30.0, 0.3, False), (-1.0, 0.01, False)])
def test_one_term_that_explains_as_much_as_two_others_is_found(evidence: float, share: float, said: bool) -> None:
    problem = PROBLEM.with_terms("third_body_layer", "falling_friction")
    two = explanation(problem, 0.0, NOISE)
    one, part = member(("mu", "energy"), evidence, RISING), member(("falling_friction",), -1.0, RISING)
    found = shorter(compared([0.7 - share, share, 0.3], two, one, part))
    assert [other.labels for other, _ in found] == ([one.labels] if said else [])
