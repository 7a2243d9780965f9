"""Files of a user's own that declare an effect or a channel: found in folders, imported, every mistake reported.

Such a file is a program. A folder that only a definition names is not run: it is trusted where the command line names
it, or says that what definitions name is to be run.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from twindisc_cli import terminal
from twindisc_cli.errors import DefinitionError, Problem


class UntrustedError(DefinitionError):
    """A definition names a folder whose files nobody has said to run."""


_trusted: set[Path | None] = set()
"""Folders whose files a definition may have run; None stands for any."""
_run: set[str] = set()
"""The files that were run."""


def trust(folder: Path | None = None) -> None:
    """Let definitions name this folder, or any, to have the Python files in it run."""
    _trusted.add(None if folder is None else folder.resolve())


def forget_trust() -> None:
    """Let definitions name no folder any more."""
    _trusted.clear()


def is_trusted(folder: Path) -> bool:
    """Whether the files of a folder may be run because a definition names it."""
    return None in _trusted or folder.resolve() in _trusted


def fault(error: BaseException) -> DefinitionError | None:
    """The failure of a file of the user's that an error came from, by file and line; None where it is of none."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename in _run]
    if not frames:
        return None
    return DefinitionError(Problem(_what(error), frames[-1].filename, frames[-1].lineno or 0))


def _what(error: BaseException) -> str:
    """An error of a user's file in one line."""
    if isinstance(error, SystemExit):
        return "leaves the program by sys.exit; raise an error that says what is wrong"
    return " ".join(f"{type(error).__name__}: {error}".split())


@dataclass(frozen=True)
class _Print:
    """What `print` is in a user's file: stdout belongs to the results."""

    path: Path

    def __call__(self, *values: object, sep: str | None = None, **_: object) -> None:
        text = (" " if sep is None else sep).join(map(str, values))
        terminal.say([f"{self.path} prints: {line}" for line in text.split("\n")], error=True)


@dataclass(frozen=True)
class Folders:
    """Folders of files that each declare one thing, and single files beside them.

    kind: what that is called; package: whose modules the files become; changed: what to call when the folders change;
    wrong: what is wrong with a declaration, "" where nothing is.
    """

    kind: str
    package: str
    changed: Callable[[], None]
    wrong: Callable[[Any], str] = field(default=lambda found: "")
    paths: dict[Path, None] = field(default_factory=dict)

    @property
    def _one(self) -> str:
        return f"{'an' if self.kind[0] in 'aeiou' else 'a'} {self.kind}"

    def add(self, folder: Path) -> None:
        """Let the files of a folder join; DefinitionError where there is no such folder."""
        if not folder.is_dir():
            raise DefinitionError(Problem(f"is not a folder of {self.kind} files", folder))
        self._join(folder)

    def add_file(self, path: Path) -> None:
        """Let one file join, and none of those that lie beside it."""
        self._join(path)

    def _join(self, path: Path) -> None:
        if path.resolve() not in self.paths:
            self.paths[path.resolve()] = None
            self.changed()

    def forget(self) -> None:
        """Forget all folders and files."""
        if self.paths:
            self.paths.clear()
            self.changed()

    def join(self, result: dict[str, Any], of: type) -> None:
        """Add what every file declares to what was found, by the name of the file, which must be a new one."""
        for place in self.paths:
            for path in sorted(place.glob("[!_]*.py")) if place.is_dir() else [place]:
                if path.stem in result:
                    what = f"there is {self._one} called {path.stem} already; rename the file"
                    raise DefinitionError(Problem(what, path))
                result[path.stem] = self.read(path, of)

    def read(self, path: Path, of: type) -> Any:
        """What a file declares under the name of its kind, an object of type `of`."""
        name = f"{self.package}.{path.stem}"
        spec = spec_from_file_location(name, path)
        if spec is None or spec.loader is None or not path.stem.isidentifier():
            raise DefinitionError(Problem(f"is not a Python file that can be named as {self._one}", path))
        module = module_from_spec(spec)
        vars(module)["print"] = _Print(path)
        _run.add(str(path))
        try:
            sys.modules[name] = module
            spec.loader.exec_module(module)
        except (Exception, SystemExit) as error:
            sys.modules.pop(name, None)
            own = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
            line = (own[-1] if own else getattr(error, "lineno", None)) or 0
            raise DefinitionError(Problem(_what(error), path, line)) from None
        result = getattr(module, self.kind.upper(), None)
        if not isinstance(result, of):
            what = f"{self.kind.upper()} = {of.__name__}(...)"
            raise DefinitionError(Problem(f"declares no {self.kind}: {what} is missing", path))
        if wrong := self.wrong(result):
            raise DefinitionError(Problem(wrong, path))
        return result
