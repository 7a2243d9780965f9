"""Files that are either whole or not there, and that appear together."""

from __future__ import annotations

import errno
import glob
import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from twindisc_cli.errors import OutputError, Problem


def write_all(files: Mapping[Path, bytes], *, gone: Collection[Path] = ()) -> None:
    """Write every file under a temporary name beside it, then put all in place; `gone` are removed with it.

    The last file speaks for the others: it goes first and comes last, so that it is never beside files that it does
    not know. On any failure, a full disk or an interrupt, the temporary files go and what was there before stays.
    """
    waiting: dict[Path, Path] = {}
    path = Path()
    try:
        for path, data in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            _remove_abandoned(path)
            temporary = path.with_name(f".{path.name[:200]}.{os.getpid()}.tmp")
            waiting[temporary] = path
            with temporary.open("wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
        with _alone(path.parent):
            _put_in_place(waiting, gone)
    except OSError as error:
        reason = error.strerror or str(error)
        what = f"cannot be written: {reason}; nothing was changed, choose another folder with -o or make room"
        raise OutputError(Problem(what, str(path))) from error
    finally:
        for temporary in waiting:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def _put_in_place(waiting: Mapping[Path, Path], gone: Collection[Path]) -> None:
    """Rename; whatever ends it in between, the last file is not there, and so no mixture counts as a result."""
    *_, last = waiting.values()
    if len(waiting) > 1 or gone:
        last.unlink(missing_ok=True)
    for path in gone:
        path.unlink(missing_ok=True)
    for temporary, path in waiting.items():
        temporary.replace(path)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """One process at a time puts files in place in a folder, where the system knows locks."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    held = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(held, fcntl.LOCK_EX)
        yield
    finally:
        os.close(held)


def _remove_abandoned(path: Path) -> None:
    """Remove the temporary files beside `path` of processes that were killed while they wrote it."""
    for left in path.parent.glob(f".{glob.escape(path.name[:200])}.*.tmp"):
        process = left.suffixes[-2].removeprefix(".") if len(left.suffixes) > 1 else ""
        if process.isdigit() and not _lives(int(process)):
            left.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    """Whether there is such a process; yes where that cannot be known."""
    if os.name != "posix":
        return True  # there, asking would end it
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
