"""A seeded part of `make fuzz`: no traceback, no hang, no mixture of two results."""

import fuzz
import pytest

PART = {"definitions": 400, "tables": 400, "imports": 150, "campaigns": 150, "results": 300, "physics": 25, "loops": 2}
PART |= {"kills": 3, "impossible": 25, "combined": 25, "odd": 40}


@pytest.mark.parametrize("kind", PART)
def test_no_case_of_a_kind_ends_in_a_traceback_or_a_hang(kind: str) -> None:
    tally = fuzz.run(kind, range(PART[kind]), limit=300.0)
    assert not tally.failures
    assert len(tally.answers) > 1, "the cases are all alike"
