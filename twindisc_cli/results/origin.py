"""What a result was made from, and the key that says whether it would be the same again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from twindisc_cli.digests import program_digest

if TYPE_CHECKING:
    from twindisc_cli.quantities import Floats

SCHEMA = 3
"""Number of the form of result files."""


@dataclass(frozen=True)
class Source:
    """A definition as it was read: sha256 of its text, and of each file that it names, by that name."""

    definition: str
    inputs: Mapping[str, str]


def _unknown() -> tuple[Floats, Floats]:
    """No iterations; numpy is loaded for them alone, and what is up to date is said without."""
    import numpy as np

    return np.empty(0), np.empty(0)


@dataclass(frozen=True)
class Origin:
    """What a result was made from.

    configs: the resolved definition as TOML, of the test first, then of further tests. inputs: sha256 of each measured
    file by name. provenance: what kind of data they are. options: what else decides the result. sources: the same
    definitions and files as they lie on the disk. turned: ends of the test's iterations and pauses [s], and the
    revolutions until then, each (iteration,).
    """

    name: str
    configs: tuple[str, ...]
    inputs: Mapping[str, str]
    provenance: str
    options: Mapping[str, Any]
    sources: tuple[Source, ...] = ()
    turned: tuple[Floats, Floats] = field(default_factory=_unknown)

    def run_key(self, command: str) -> str:
        """sha256 of the program, command, definitions and inputs: the same key, the same result."""
        parts = (SCHEMA, program_digest(), command, self.configs, dict(sorted(self.inputs.items())), self.options)
        return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
