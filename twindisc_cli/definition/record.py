"""A loaded test: what the file says, as it was resolved, and as the physics takes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from twindisc_cli.measurement import RowCount
from twindisc_cli.model.experiment import Experiment


@dataclass(frozen=True)
class Test:
    """One test definition with its measured data.

    resolved: the definition with every default filled in, ready for tomli-w. inputs: sha256 by the name of each
    measured file, as the definition names it. rows: what became of the rows of each. digest: sha256 of the text.
    """

    __test__: ClassVar[bool] = False

    path: Path
    experiment: Experiment
    resolved: Mapping[str, Any]
    inputs: Mapping[str, str]
    rows: tuple[RowCount, ...] = ()
    digest: str = ""
