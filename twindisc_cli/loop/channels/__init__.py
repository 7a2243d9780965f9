"""The measured channels of a test: one file, one channel; being in this folder registers it."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from twindisc_cli.loop.channels._channel import Channel
    from twindisc_cli.model.experiment import Experiment


@cache
def channels() -> Mapping[str, Channel]:
    """Every channel by its name, those first that drive the others."""
    names = [m.name for m in iter_modules(__path__) if not m.name.startswith("_")]
    found: dict[str, Channel] = {name: import_module(f"{__name__}.{name}").CHANNEL for name in names}
    return MappingProxyType(dict(sorted(found.items(), key=lambda pair: pair[1].order)))


def measured_channels(test: Experiment) -> tuple[str, ...]:
    """Names of the channels that were measured in a test."""
    return tuple(name for name, channel in channels().items() if channel.samples(test) is not None)
