"""Every row of a measured file accounted for: used, or left out for a reason that is counted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

_MOST_LINES = 44  # of remarks: a screen


@dataclass(frozen=True)
class RowCount:
    """Rows of a file that were used, and those left out by reason; notes: what else is to be said of the file."""

    file: str
    used: int
    left_out: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def read(self) -> int:
        """All rows under the header."""
        return self.used + sum(self.left_out.values())

    @property
    def lines(self) -> tuple[str, ...]:
        """The count in a line, and each note."""
        left = ", ".join(f"{count} {reason}" for reason, count in self.left_out.items())
        message = f"{self.used} of {self.read} rows taken; left out: {left}" if left else f"all {self.read} rows taken"
        notes = (f"{self.file}: {_shortened(note)}" for note in self.notes)
        return (f"{self.file}: {message}", *(line for note in notes for line in note.split("\n")))

    def json(self) -> dict[str, Any]:
        """The count for scripts."""
        return {
            "file": self.file,
            "read": self.read,
            "used": self.used,
            "left_out": dict(self.left_out),
            "notes": list(self.notes),
        }


def _shortened(note: str) -> str:
    """A note of many lines without those in its middle."""
    lines = note.split("\n")
    if len(lines) <= _MOST_LINES:
        return note
    half = _MOST_LINES // 2
    return "\n".join([*lines[:half], f"  ... {len(lines) - 2 * half} more lines, see --json", *lines[-half:]])
