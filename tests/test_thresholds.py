"""The calibrated numbers of the loop: none without a meaning."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields

import pytest

from twindisc_cli.loop.thresholds import ACCEPTANCE, RESAMPLING, SEARCH, TOLERANCES

GROUPS = (TOLERANCES, SEARCH, ACCEPTANCE, RESAMPLING)


@pytest.mark.parametrize(("group", "name"), [(group, field.name) for group in GROUPS for field in fields(group)])
def test_every_number_says_what_it_means(group: object, name: str) -> None:
    """A line of the record's docstring begins with the number's name, alone or among others, and says something."""
    text = inspect.getdoc(type(group)) or ""
    entries = re.findall(r"^((?:\w+, )*\w+)(?:\n +|  +)(\S.*)$", text, flags=re.MULTILINE)
    (meaning,) = [meaning for names, meaning in entries if name in names.split(", ")]
    assert len(meaning.split()) >= 4


def test_a_term_is_not_left_out_for_what_it_was_added_for() -> None:
    assert SEARCH.seen_law_evidence < SEARCH.effect_evidence <= SEARCH.law_evidence
    assert 0.0 < RESAMPLING.probable < RESAMPLING.established < 1.0
    assert 0.0 < RESAMPLING.resembles < RESAMPLING.same_response < 1.0
