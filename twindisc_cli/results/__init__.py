"""Results: the records a command returns, and how they are written.

The records are imported when they are first asked for: what is up to date is reported without numpy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twindisc_cli.results.result import Array, Axis, Dataset, Result, or_null

__all__ = ["Array", "Axis", "Dataset", "Result", "or_null"]


def __getattr__(name: str) -> Any:
    """A record, imported now."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("twindisc_cli.results.result"), name)
