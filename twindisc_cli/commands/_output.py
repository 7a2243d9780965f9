"""What a user asks of the output of every command; it imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twindisc_cli.digests import digest_of

FORMATS = ("png", "pdf", "svg")
DPI = 150


@dataclass(frozen=True)
class Output:
    """Where results go, what figures are drawn as, and how the outcome is told.

    formats: of the figure, dpi of its pixels. dry_run: only say what would be made, and why. depfile: a file for the
    rule that make reads. effects: a folder of further effects. trust_effects: whether the Python files in folders that
    definitions name may be run.
    """

    folder: Path
    as_json: bool = False
    force: bool = False
    formats: tuple[str, ...] = ("png",)
    dpi: int = DPI
    quiet: bool = False
    verbose: bool = False
    dry_run: bool = False
    depfile: Path | None = None
    effects: Path | None = None
    trust_effects: bool = False

    @property
    def options(self) -> dict[str, Any]:
        """What of it decides the files, where that is not as usual."""
        chosen: dict[str, Any] = {}
        if self.formats != ("png",):
            chosen["formats"] = list(self.formats)
        if self.dpi != DPI:
            chosen["dpi"] = self.dpi
        if self.effects is not None:
            chosen["effects"] = digest_of(self.effects)
        return chosen
