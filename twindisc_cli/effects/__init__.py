"""The catalogue of physical effects: one file, one effect; being in this folder registers it.

A user's folders of such files join it (`add_folder`). Importing this package imports no effect; `catalogue()` does.
"""

from __future__ import annotations

import sys
import traceback
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING

from twindisc_cli.errors import DefinitionError, Problem

if TYPE_CHECKING:
    from collections.abc import Mapping

    from twindisc_cli.effects._effect import Effect

_folders: dict[Path, None] = {}
"""The folders of the user's effects, in the order in which they were added."""


@cache
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its name: those of this folder in alphabetical order, then those of the user's folders."""
    names = sorted(m.name for m in iter_modules(__path__) if not m.name.startswith("_"))
    found = {name: import_module(f"{__name__}.{name}").EFFECT for name in names}
    for folder in _folders:
        for path in sorted(folder.glob("[!_]*.py")):
            if path.stem in found:
                raise DefinitionError(Problem(f"there is an effect called {path.stem} already; rename the file", path))
            found[path.stem] = effect_of(path)
    return MappingProxyType(found)


def add_folder(folder: Path) -> None:
    """Let the effect files of a folder join the catalogue."""
    if not folder.is_dir():
        raise DefinitionError(Problem("is no folder of effect files", folder))
    if folder.resolve() not in _folders:
        _folders[folder.resolve()] = None
        catalogue.cache_clear()


def forget_folders() -> None:
    """Leave the catalogue with the effects of this package."""
    if _folders:
        _folders.clear()
        catalogue.cache_clear()


def effect_of(path: Path) -> Effect:
    """The effect that a user's file declares; DefinitionError says what is wrong with the file."""
    from twindisc_cli.effects._effect import Effect

    name = f"{__name__}.{path.stem}"
    spec = spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.stem.isidentifier():
        raise DefinitionError(Problem("is no Python file that can be named as an effect", path))
    module = module_from_spec(spec)
    try:
        sys.modules[name] = module
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        own = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
        line = (own[-1] if own else getattr(error, "lineno", None)) or 0
        raise DefinitionError(Problem(f"{type(error).__name__}: {error}", path, line)) from None
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise DefinitionError(Problem("declares no effect: EFFECT = Effect(...) is missing", path))
    return effect
