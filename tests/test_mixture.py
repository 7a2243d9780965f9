"""The average over explanations: its weights, and what predicts beyond the samples that were fitted."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from records.sources import sweeps

from twindisc_cli.loop.mixture import Mixture, _weights
from twindisc_cli.model.forward import ForwardModel

SEEN = {("traction", "creepage"): (0.01, 0.1)}


@dataclass(frozen=True)
class Member:
    """As much of an explanation as an average asks for."""

    evidence: float = 0.0
    chi2: float = 10.0
    terms: tuple[str, ...] = ("falling_friction",)
    laws: dict[str, Any] = field(default_factory=dict)
    temperature: float = 1.0

    @property
    def labels(self) -> frozenset[str]:
        return frozenset((*self.terms, *self.laws))

    @property
    def fit(self) -> Any:
        return SimpleNamespace(chi2=self.chi2, residual=np.zeros(12), theta=np.zeros(2))


def law(shape: str | None) -> Any:
    return SimpleNamespace(shape=shape, covariate="creepage")


def mixed(*members: Member, weights: tuple[float, ...]) -> Mixture:
    return Mixture(cast(Any, [SimpleNamespace(explanation=m) for m in members]), np.array(weights), SEEN)


def weights_at(mixture: Mixture) -> tuple[np.ndarray, np.ndarray]:
    """Weights at the samples of a sweep (member, sample), and which of these are beyond what was seen."""
    test = sweeps()[9]
    model = ForwardModel(test)
    assert test.measured.traction is not None
    creepage = test.measured.traction.creepage
    found = mixture.weights_at("traction", model, model.predict({"mu": np.array([0.05])}))
    return found, (creepage < 0.01) | (creepage > 0.1)


@pytest.mark.parametrize(("shape", "weight"), [(None, 0.7), ("linear", 0.0), ("power", 0.0), ("logistic", 0.7)])
def test_what_grows_without_bound_gives_way_beyond_the_samples_seen(shape: str | None, weight: float) -> None:
    found, beyond = weights_at(mixed(Member(laws={"law": law(shape)}), Member(), weights=(0.7, 0.3)))
    assert beyond.any()
    assert not beyond.all()
    assert found[0, beyond] == pytest.approx(weight)
    assert found[0, ~beyond] == pytest.approx(0.7)
    assert found.sum(axis=0) == pytest.approx(1.0)


def test_what_grows_without_bound_stays_where_nothing_else_predicts() -> None:
    found, _ = weights_at(
        mixed(Member(laws={"law": law("linear")}), Member(laws={"law": law("power")}), weights=(0.7, 0.3))
    )
    assert found[0] == pytest.approx(0.7)


def weighed(*members: Member) -> np.ndarray:
    return _weights(cast(Any, members), cast(Any, SimpleNamespace(shares=np.full(len(members), np.nan))))


def test_where_all_are_as_evident_the_base_model_outweighs_each_by_their_number() -> None:
    base, *others = weighed(Member(terms=()), Member(), Member(), Member())
    assert others == pytest.approx([base / 4.0] * 3)


def test_where_the_best_leaves_more_than_the_noise_the_odds_shrink_by_that() -> None:
    """The odds of QAIC: differences of the evidence over the variance that the best leaves, here 40 over 12 - 2."""
    odds = [np.log(w[0] / w[1]) for w in (weighed(Member(8.0, c), Member(0.0, c)) for c in (10.0, 40.0))]
    assert odds == pytest.approx([8.0, 2.0])
