"""Records of real rigs, as shipped: what the loop says of them holds for one half as for the other."""

from __future__ import annotations

import numpy as np
import pytest
from records.answers import choice, come_back, foretold, holds, of_halves
from records.errors import of_split
from records.figure import explained
from records.sources import shipped
from records.splits import SEED, held_out

from twindisc_cli.loop.explain import Outcome
from twindisc_cli.loop.judge import rises

SPLITS = 5


def raises_nothing(found: Outcome) -> bool:
    """Whether no channel's held-out error rises."""
    judged = found.judged
    pairs = [
        tuple(judged.misses(channel, k, held_out=True) for k in ("unseen_before", "unseen_after"))
        for channel in judged.before.problem.channels
    ]
    return not any(rises(before, after) for before, after in pairs)


def test_the_answer_to_the_locomotive_raises_no_error_of_what_was_held_out() -> None:
    assert raises_nothing(explained("eurosprinter"))


def test_what_one_half_of_eurosprinter_names_is_in_the_set_of_the_other() -> None:
    """In four of five, over splits at random: no formula is exact there, and a name must come back to be told."""
    found = come_back(of_halves("eurosprinter", seed) for seed in range(SPLITS))
    assert found
    assert np.mean([right for _, right in found]) >= 0.8
    assert np.mean([told for told, _ in found]) <= np.mean([right for _, right in found]) + 0.1


FALLS = pytest.mark.xfail(reason="friction falls above 6 %, where nothing below says so", strict=False)


@pytest.mark.parametrize("block", [0, 1, pytest.param(2, marks=FALLS)])
def test_the_error_of_a_range_of_creepages_that_nothing_saw_is_below_the_base_models(block: int) -> None:
    test = shipped("eurosprinter")
    split, masks = list(held_out(test, "blocks"))[block]
    found = of_split("eurosprinter", test, split, masks)
    assert found.loop < found.base


def test_what_five_sweeps_of_a_lubricated_ball_teach_foretells_the_others() -> None:
    """Sweeps at random, and both ends of the record; the level runs in by a tenth over it."""
    for learnt, most in ((choice(0), 0.45), (range(5), 0.5), (range(15, 20), 0.5)):
        found = foretold(learnt, quick=True)
        assert found.named == ("lubricated_film",)
        assert found.error <= most * found.constant


def test_friction_settles_in_the_tribometer() -> None:
    """Friction of the MTM grows over two hours: one law over time, to the noise; no error rises."""
    found = explained("mtm_running_in")
    assert found.answer.labels == {("mu", "time")}
    assert found.judged.error("traction", "after", held_out=False) < 0.02 * found.judged.error(
        "traction", "before", held_out=False
    )
    assert raises_nothing(found)


def test_the_law_that_a_half_of_the_running_in_teaches_is_that_of_the_other_half() -> None:
    one, two = of_halves("mtm_running_in", SEED)
    assert one.named.keys() == two.named.keys() == {"mu over time"}
    assert all(holds(one, two))
    assert all(holds(two, one))
    assert all(told.high - told.low < 0.02 * told.value for half in (one, two) for told in half.base.values())
