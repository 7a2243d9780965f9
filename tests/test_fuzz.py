"""A seeded part of `make fuzz`: no traceback, no hang, no mixture of two results."""

import fuzz
import pytest

PART = {"definitions": 200, "tables": 200, "imports": 75, "campaigns": 75, "results": 150, "physics": 15, "loops": 2}
PART |= {"kills": 3, "impossible": 15, "combined": 15, "odd": 25}


@pytest.mark.parametrize("kind", PART)
def test_no_case_of_a_kind_ends_in_a_traceback_or_a_hang(kind: str) -> None:
    tally = fuzz.run(kind, range(PART[kind]), limit=300.0)
    assert not tally.failures
    assert len(tally.answers) > 1, "the cases are all alike"
