"""The measured channels of a test: one file, one channel; being in this folder registers it.

A user's folders of such files join it (`add_folder`).
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING

from twindisc_cli.plugins import Folders

if TYPE_CHECKING:
    from collections.abc import Mapping

    from twindisc_cli.loop.channels._channel import Base, Channel
    from twindisc_cli.model.experiment import Experiment


@cache
def channels() -> Mapping[str, Channel]:
    """Every channel by its name, those first that drive the others."""
    from twindisc_cli.loop.channels._channel import Channel

    names = [m.name for m in iter_modules(__path__) if not m.name.startswith("_")]
    results: dict[str, Channel] = {name: import_module(f"{__name__}.{name}").CHANNEL for name in names}
    _folders.join(results, Channel)
    return MappingProxyType(dict(sorted(results.items(), key=lambda pair: pair[1].order)))


_folders = Folders("channel", __name__, channels.cache_clear)
add_folder = _folders.add
forget_folders = _folders.forget


def further_channels() -> Mapping[str, Channel]:
    """The channels that say themselves how their samples are read, by name."""
    return {name: channel for name, channel in channels().items() if channel.file is not None}


def measured_channels(test: Experiment) -> tuple[str, ...]:
    """Names of the channels that were measured in a test."""
    return tuple(name for name, channel in channels().items() if channel.samples(test) is not None)


def base_named(key: str) -> Base | None:
    """The base parameter of a key; None where no channel declares one."""
    return next((base for channel in channels().values() for base in channel.parameters if base.key == key), None)


def place_of(key: str) -> tuple[str, ...]:
    """Tables and key under which a definition gives a base parameter."""
    name, base = next((n, b) for n, channel in channels().items() for b in channel.parameters if b.key == key)
    return base.place or ("channels", name, key)
