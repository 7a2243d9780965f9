"""How far a command is, where nobody watches: a line in the log now and then, with the time left."""

from __future__ import annotations

import pytest

from twindisc_cli.commands import _runner
from twindisc_cli.commands._runner import progress_bar


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(_runner.time, "monotonic", lambda: now[0])
    return now


def test_a_log_holds_a_line_every_ten_seconds_with_the_time_left(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_bar() as progress:
        for second in range(0, 61):
            clock[0] = 100.0 + second
            progress("search", second / 240.0)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        f"search: {second} s so far, about {left} left"
        for second, left in ((13, "4 min"), (23, "4 min"), (33, "3 min"), (43, "3 min"), (53, "3 min"))
    ]


def test_what_is_short_or_asked_to_be_quiet_says_nothing(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_bar() as progress:
        clock[0] += 9.0
        progress("check", 0.9)
    with progress_bar(quiet=True) as progress:
        clock[0] += 900.0
        progress("search", 0.5)
    assert capsys.readouterr().err == ""
