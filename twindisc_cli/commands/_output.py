"""What a user asks of the output of every command; it imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twindisc_cli.digests import digest_of

FORMATS = ("png", "pdf", "svg")
DPI = 150  # a figure of two columns fills a screen


@dataclass(frozen=True)
class Output:
    """Where results go, what figures are drawn as, and how the outcome is reported.

    formats: of the figure, none where it is not wanted; dpi of its pixels; over, what time is drawn over, "" as usual;
    panels, whether each panel is a file of its own too; style, a style sheet of matplotlib. dry_run: only say what
    would be made, and why. depfile: a file for the rule that make reads. effects: a folder of further effects.
    trust_effects: whether the Python files in folders that definitions name may be run.
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
    over: str = ""
    panels: bool = False
    style: Path | None = None

    @property
    def options(self) -> dict[str, Any]:
        """What of it decides the files, where that is not as usual."""
        chosen: dict[str, Any] = {}
        if self.formats != ("png",):
            chosen["formats"] = list(self.formats)
        if self.dpi != DPI:
            chosen["dpi"] = self.dpi
        if self.over:
            chosen["over"] = self.over
        if self.panels:
            chosen["panels"] = True
        chosen |= {key: digest_of(path) for key, path in (("effects", self.effects), ("style", self.style)) if path}
        return chosen
