"""Files of a user's own that declare an effect or a channel: found in folders, imported, every mistake told."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from twindisc_cli.errors import DefinitionError, Problem


@dataclass(frozen=True)
class Folders:
    """Folders of files that each declare one thing.

    kind: what that is called; package: whose modules the files become; changed: what to call when the folders change.
    """

    kind: str
    package: str
    changed: Callable[[], None]
    paths: dict[Path, None] = field(default_factory=dict)

    @property
    def _one(self) -> str:
        return f"{'an' if self.kind[0] in 'aeiou' else 'a'} {self.kind}"

    def add(self, folder: Path) -> None:
        """Let the files of a folder join; DefinitionError where there is no such folder."""
        if not folder.is_dir():
            raise DefinitionError(Problem(f"is no folder of {self.kind} files", folder))
        if folder.resolve() not in self.paths:
            self.paths[folder.resolve()] = None
            self.changed()

    def forget(self) -> None:
        """Forget all folders."""
        if self.paths:
            self.paths.clear()
            self.changed()

    def join(self, found: dict[str, Any], of: type) -> None:
        """Add what every file declares to what was found, by the name of the file, which must be a new one."""
        for folder in self.paths:
            for path in sorted(folder.glob("[!_]*.py")):
                if path.stem in found:
                    what = f"there is {self._one} called {path.stem} already; rename the file"
                    raise DefinitionError(Problem(what, path))
                found[path.stem] = self.read(path, of)

    def read(self, path: Path, of: type) -> Any:
        """What a file declares under the name of its kind, an object of type `of`."""
        name = f"{self.package}.{path.stem}"
        spec = spec_from_file_location(name, path)
        if spec is None or spec.loader is None or not path.stem.isidentifier():
            raise DefinitionError(Problem(f"is no Python file that can be named as {self._one}", path))
        module = module_from_spec(spec)
        try:
            sys.modules[name] = module
            spec.loader.exec_module(module)
        except Exception as error:
            del sys.modules[name]
            own = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
            line = (own[-1] if own else getattr(error, "lineno", None)) or 0
            raise DefinitionError(Problem(f"{type(error).__name__}: {error}", path, line)) from None
        found = getattr(module, self.kind.upper(), None)
        if not isinstance(found, of):
            what = f"{self.kind.upper()} = {of.__name__}(...)"
            raise DefinitionError(Problem(f"declares no {self.kind}: {what} is missing", path))
        return found
