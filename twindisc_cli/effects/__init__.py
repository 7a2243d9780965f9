"""The catalogue of physical effects: one file, one effect; being in this folder registers it.

A user's folders of such files join it (`add_folder`), or one file (`add_file`). Importing this package imports no
effect; `catalogue()` does.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING

from twindisc_cli.plugins import Folders

if TYPE_CHECKING:
    from collections.abc import Mapping

    from twindisc_cli.effects._effect import Effect


@cache
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its name: those of this folder in alphabetical order, then those of the user's folders."""
    from twindisc_cli.effects._effect import Effect

    names = sorted(m.name for m in iter_modules(__path__) if not m.name.startswith("_"))
    results = {name: import_module(f"{__name__}.{name}").EFFECT for name in names}
    _folders.join(results, Effect)
    return MappingProxyType(results)


def _unread(effect: Effect) -> str:
    """What to say of parameters that an effect's function takes and never reads; "" where there are none."""
    from dis import get_instructions

    code = getattr(effect.apply, "__code__", None)
    if code is None:
        return ""
    read = {
        name
        for step in get_instructions(code)
        if step.opname.startswith(("LOAD", "STORE_FAST_LOAD", "MAKE_CELL"))
        for name in (step.argval if isinstance(step.argval, tuple) else (step.argval,))
    }
    taken = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    unread = [p.name for p in effect.params if p.name in taken and p.name not in read]
    return f"declares {', '.join(unread)}, which its function never reads" if unread else ""


_folders = Folders("effect", __name__, catalogue.cache_clear, _unread)
add_folder = _folders.add
add_file = _folders.add_file
forget_folders = _folders.forget


def effect_of(path: Path) -> Effect:
    """The effect that a user's file declares; DefinitionError says what is wrong with the file."""
    from twindisc_cli.effects._effect import Effect

    effect: Effect = _folders.read(path, Effect)
    return effect
