"""The failures a user can cure: one exception class per exit code, the cure in its text."""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Self


@dataclass(frozen=True)
class Problem:
    """One mistake in a file: where it is, and what to do about it. Line 0: the file as a whole.

    block: lines of the table [measured] of a definition that cure it.
    """

    what: str
    file: Path | str = ""
    line: int = 0
    key: str = ""
    block: tuple[str, ...] = ()

    def __str__(self) -> str:
        """`file:line: key: what`, leaving out what is not known."""
        place = f"{self.file}:{self.line}" if self.file and self.line else str(self.file)
        return ": ".join(part for part in (place, self.key, self.what) if part)


class TwindiscError(Exception):
    """A failure with an exit code and one line per problem."""

    exit_code = 1

    def __init__(self, problems: str | Problem | Iterable[str | Problem]) -> None:
        """Take one problem or several."""
        several = [problems] if isinstance(problems, (str, Problem)) else list(problems)
        self.problems = tuple(p if isinstance(p, Problem) else Problem(p) for p in several)
        super().__init__("\n".join(str(p) for p in self.problems))

    def of(self, file: Path | str) -> Self:
        """The same failure, said of a file where it names none."""
        return type(self)([p if p.file else replace(p, file=str(file)) for p in self.problems])

    @property
    def lines(self) -> list[str]:
        """Each problem in a line, and below them the block of a definition that cures them, where it is known."""
        cures = [line for problem in self.problems for line in problem.block]
        return [*(str(problem) for problem in self.problems), *(["[measured]", *cures] if cures else [])]


class DefinitionError(TwindiscError):
    """The command line or the test definition is wrong."""

    exit_code = 2


class MeasurementError(TwindiscError):
    """The measured data cannot be used as they are."""

    exit_code = 3


class ValidityError(TwindiscError):
    """A computation did not converge, or the case lies outside what the theory covers."""

    exit_code = 4


class OutputError(TwindiscError):
    """A result could not be written; what was there before is kept."""

    exit_code = 2


NEGATIVE_FINDING = 5
"""Exit code of a run that worked and whose answer is no: a failed check, an unexplained residual."""


def bug(error: BaseException) -> str:
    """An error that should not have been, in one line, with the way to its traceback."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{Path(frame.filename).name}:{frame.lineno}"
    what = " ".join(str(error).split()) or "no message"
    return f"a bug in twindisc: {type(error).__name__}: {what} ({place}); set TWINDISC_DEBUG=1 for the traceback"


def nearest(name: str, choices: Iterable[str]) -> str | None:
    """The choice that a mistyped name most probably meant, or None where nothing is near."""
    by_folded = {choice.casefold(): choice for choice in choices}
    folded = name.casefold()
    if close := get_close_matches(folded, by_folded, n=1, cutoff=0.6):
        return by_folded[close[0]]
    begun = {choice[: len(folded) + 1]: choice for choice in by_folded}
    cut_short = get_close_matches(folded, begun, n=1, cutoff=0.8) if len(folded) > 3 else []
    return by_folded[begun[cut_short[0]]] if cut_short else None


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """`, did you mean X?` or an empty text."""
    choice = nearest(name, choices)
    return f", did you mean {choice}?" if choice else ""
