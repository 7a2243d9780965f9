"""What a rule finds: a value held against the range that the physics allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LIMIT_MARGIN = 1.05  # of what nothing can exceed, for the values that it is computed from


@dataclass(frozen=True)
class Finding:
    """A value held against the range that the physics allows, in the unit given; ok: whether it lies inside.

    hint: what to look at where it does not; sentence: said instead of the value and its range, where it is given.
    """

    rule: str
    subject: str
    value: float
    low: float
    high: float
    unit: str
    why: str
    hint: str = ""
    sentence: str = ""

    @property
    def ok(self) -> bool:
        """Whether the value lies in its range."""
        return bool(self.low <= self.value <= self.high)

    @property
    def strain(self) -> float:
        """How far the value uses up its range: above 1 it is outside."""
        upper = self.value / self.high if self.high > 0.0 else np.inf * np.sign(self.value)
        lower = self.low / self.value if self.low > 0.0 and self.value > 0.0 else 0.0
        return float(max(upper, lower))

    @property
    def message(self) -> str:
        """What was found, in one line."""
        limits = f"{number(self.low)} to {number(self.high)}" if np.isfinite(self.high) else f"≥ {number(self.low)}"
        if self.low <= 0.0:
            limits = f"at most {number(self.high)}"
        unit = f" {self.unit}" if self.unit != "1" else ""
        hint = f"; {self.hint}" if self.hint and not self.ok else ""
        said = self.sentence or f"{self.subject} is {number(self.value)}{unit}, {self.why} allows {limits}{unit}"
        return said + hint


def number(value: float) -> str:
    """A value as a message has it."""
    return f"{value:.3g}"
