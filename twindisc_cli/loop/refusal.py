"""Why an explanation is not given as the answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Reason = Literal[
    "at a bound", "rarely chosen", "raises the error", "does not predict", "in other words", "explains less"
]


@dataclass(frozen=True)
class Refusal:
    """The reason in a few words, and in full where there is more to say.

    What "raises the error" does so on samples that were fitted, or in a test that is only predicted; what "does not
    predict" on samples held out alone.
    """

    reason: Reason
    full: str = ""

    @property
    def why(self) -> str:
        """The reason in full."""
        return self.full or self.reason

    @property
    def errs(self) -> bool:
        """Whether it raises an error, of whatever samples."""
        return self.reason in ("raises the error", "does not predict")
