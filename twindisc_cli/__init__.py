"""twindisc: friction, wear, temperature and missing physics of twin-disc tests.

The functions and records in `__all__` are the public interface (see `twindisc_cli.api`); they are imported when they
are first asked for, so that the command line starts without them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from twindisc_cli.version import __version__

if TYPE_CHECKING:
    from twindisc_cli.api import (
        Disc,
        Experiment,
        Rig,
        Thermal,
        close_loop,
        creep_curve,
        disc_temperature,
        experiment,
        identify_friction,
        wear_track,
    )

__all__ = [
    "Disc",
    "Experiment",
    "Rig",
    "Thermal",
    "__version__",
    "close_loop",
    "creep_curve",
    "disc_temperature",
    "experiment",
    "identify_friction",
    "wear_track",
]


def __getattr__(name: str) -> Any:
    """A name of the public interface, imported now."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("twindisc_cli.api"), name)
