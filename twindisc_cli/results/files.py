"""Files that are either whole or not there."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from twindisc_cli.errors import OutputError, Problem


def write_all(files: Mapping[Path, bytes]) -> None:
    """Write every file under a temporary name beside it, then rename them in order.

    On any failure, a full disk or an interrupt, the temporary files go and what was there before stays.
    """
    waiting: dict[Path, Path] = {}
    path = Path()
    try:
        for path, data in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
            waiting[temporary] = path
            with temporary.open("wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
        for temporary, path in waiting.items():
            temporary.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        what = f"cannot be written: {reason}; nothing was changed, choose another folder with -o or make room"
        raise OutputError(Problem(what, str(path))) from error
    finally:
        for temporary in waiting:
            temporary.unlink(missing_ok=True)
