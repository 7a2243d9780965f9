"""A part of tests/mutations.py: no spoilt file gives a wrong mu without a line that names the cause."""

from __future__ import annotations

from mutations import tally


def test_no_spoilt_file_is_silently_wrong() -> None:
    found = tally(7, 60)
    assert found["silently wrong"] == 0
    assert found["right"] >= 20
    assert found["refused"] + found["said"] >= 10
