"""Records of real rigs, as shipped: what the loop says of them holds for one half as for the other."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from definitions import shipped

from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.explain import Outcome, explain, rises
from twindisc_cli.loop.thresholds import THRESHOLDS
from twindisc_cli.model.experiment import Experiment

Label = tuple[str, ...]


def part(test: Experiment, number: int) -> Experiment:
    """One half of the samples of every channel, pairs of neighbours drawn at random; the same two halves each time."""
    measured = test.measured
    for name in measured_channels(test):
        samples = channels()[name].samples(test)
        count = len(channels()[name].values(samples))
        drawn = np.random.default_rng(2).integers(0, 2, count // 2 + 1)
        first = np.repeat(drawn, 2)[:count]
        second = np.repeat(1 - drawn, 2)[:count]
        kept = (first, second)[number] == 1
        columns = {column.name: getattr(samples, column.name)[kept] for column in fields(samples)}
        measured = measured.with_samples(name, replace(samples, **columns))
    return replace(test, measured=measured)


@cache
def explained(name: str, half: int | None = None) -> Outcome:
    test = shipped(name).experiment
    seen = test if half is None else part(test, half)
    return explain([seen], validate=None, quick=True, progress=lambda stage, share: None)


def told(found: Outcome) -> set[Label]:
    """What is in the answer or cannot be told from it."""
    near = [m for m in found.members if (found.answer.evidence - m.evidence) / found.answer.heat < THRESHOLDS.within]
    return {label for member in [found.answer, *near] for label in member.labels}


@pytest.mark.parametrize("name", ["eurosprinter", "mtm_running_in"])
def test_the_answer_raises_no_error_of_what_was_held_out(name: str) -> None:
    judged = explained(name).judged
    for channel in judged.before.problem.channels:
        before, after = (judged.misses(channel, k, held_out=True) for k in ("unseen_before", "unseen_after"))
        assert not rises(before, after)


def test_what_one_half_of_eurosprinter_names_is_in_the_set_of_the_other() -> None:
    one, two = explained("eurosprinter", 0), explained("eurosprinter", 1)
    assert one.answer.labels <= told(two)
    assert two.answer.labels <= told(one)


def test_friction_settles_in_the_tribometer() -> None:
    """Friction of the MTM falls and rises over two hours: a law of the time, or the effect of that name."""
    found = explained("mtm_running_in")
    assert found.answer.terms
    of_time = {"time", "cycles", "energy"}
    assert any(label[-1] in of_time or label[0] == "running_in_friction" for label in told(found))
