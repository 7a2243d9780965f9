"""The catalogue of physical effects: one file, one effect; being in this folder registers it.

Importing this package imports no effect; `catalogue()` does.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from twindisc_cli.effects._effect import Effect


@cache
def catalogue() -> Mapping[str, Effect]:
    """Every effect of this folder by its name, in alphabetical order."""
    names = sorted(m.name for m in iter_modules(__path__) if not m.name.startswith("_"))
    return MappingProxyType({name: import_module(f"{__name__}.{name}").EFFECT for name in names})
