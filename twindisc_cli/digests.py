"""What identifies a file: the sha256 of its bytes, remembered where the file is large.

Reading gigabytes takes seconds. The digest of a large file is kept in the user's cache folder beside what the system
says of the file: its place, its length, and when its content and its entry were last changed. While all of that is the
same the file is not read. A file that changed just now is: the clock of the disk might not show its next change.
"""

from __future__ import annotations

import json
import os
import time
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

from twindisc_cli.reading import read_regular

PROGRAM = Path(__file__).parent
"""The folder of the package."""
REMEMBERED_FROM = 2**26
"""Bytes; what is shorter is read in a twentieth of a second."""
SETTLED_NS = 2_000_000_000
"""Nanoseconds after its last change from which a file is remembered: some disks count time in steps of two seconds."""
_KEPT = 1000
"""Files remembered; the oldest go first."""


@cache
def program_digest() -> str:
    """sha256 of the program: of the names and contents of all files of the package but those that Python makes."""
    result = sha256()
    for path in sorted(PROGRAM.rglob("*")):
        if path.suffix != ".pyc" and path.is_file():
            result.update(f"{path.relative_to(PROGRAM).as_posix()} {path.stat().st_size}\n".encode())
            result.update(path.read_bytes())
    return result.hexdigest()


def digest_of_text(path: Path) -> str:
    """sha256 of a text file without the mark of its encoding."""
    return sha256(read_regular(path).removeprefix(b"\xef\xbb\xbf")).hexdigest()


def digest_of(path: Path) -> str:
    """sha256 of a file, or of the names and contents of the Python files in a folder."""
    if path.is_dir():
        listing = [(file.name, digest_of(file)) for file in sorted(path.glob("*.py"))]
        return sha256(json.dumps(listing).encode()).hexdigest()
    place, state = _seen(path)
    if state[0] < REMEMBERED_FROM:
        return sha256(read_regular(path)).hexdigest()
    known = _known()
    if known.get(place, [])[1:] == state:
        return str(known[place][0])
    digest = sha256(read_regular(path)).hexdigest()
    if time.time_ns() - max(state[1:]) > SETTLED_NS and _seen(path) == (place, state):
        _remember({**known, place: [digest, *state]})
    return digest


def _seen(path: Path) -> tuple[str, list[int]]:
    """The place of a file on the disk; its length, and the times of the last change of its content and its entry."""
    result = path.stat()
    return f"{result.st_dev}:{result.st_ino}", [result.st_size, result.st_mtime_ns, result.st_ctime_ns]


def _cache() -> Path:
    folder = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    return Path(folder, "twindisc/digests.json")


def _known() -> dict[str, list[str | int]]:
    """What was remembered, by place; nothing where that cannot be read."""
    try:
        known = json.loads(_cache().read_bytes())
    except (OSError, ValueError, RuntimeError):  # of the last kind: nobody's home; brackets by the thousand
        return {}
    return known if isinstance(known, dict) and all(isinstance(kept, list) for kept in known.values()) else {}


def _remember(known: dict[str, list[str | int]]) -> None:
    """Write what is remembered; where that cannot be written, the file is read again next time."""
    with suppress(OSError, RuntimeError):
        path = _cache()
        temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(json.dumps(dict(list(known.items())[-_KEPT:])))
        temporary.replace(path)
