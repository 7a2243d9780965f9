"""Reading what a user names: regular files only, and not without bounds."""

from __future__ import annotations

import errno
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

LARGEST = 2**31
"""Bytes of a measured file."""
LARGEST_DEFINITION = 2**22
"""Bytes of a definition; what is longer is something else."""
DEEPEST = 50
"""Tables in tables of a TOML document; reading one costs the square of them."""
_TOKEN = re.compile(
    r"""(?P<dot>[ \t]*\.[ \t]*(?=["'\w-]))|#[^\n]*|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|[A-Za-z0-9_-]+|(?P<end>.|\n)"""
)
_KINDS = (
    (stat.S_ISDIR, errno.EISDIR, "is a folder"),
    (stat.S_ISFIFO, errno.EINVAL, "is a pipe, which can be read only once; name a file"),
    (stat.S_ISSOCK, errno.EINVAL, "is a socket; name a file"),
    (stat.S_ISCHR, errno.EINVAL, "is a device; name a file"),
    (stat.S_ISBLK, errno.EINVAL, "is a device; name a file"),
)


def read_regular(path: Path, *, largest: int = LARGEST) -> bytes:
    """The bytes of a file; OSError, with what is wrong as its strerror, where it cannot be read as a whole."""
    try:
        result = path.stat()
    except ValueError as error:  # a NUL in the name
        raise OSError(errno.EINVAL, "no file can have such a name") from error
    for is_kind, code, what in _KINDS:
        if is_kind(result.st_mode):
            raise IsADirectoryError(code, what) if code == errno.EISDIR else OSError(code, what)
    if result.st_size > largest:
        raise OSError(
            errno.EFBIG, f"is {result.st_size / 2**20:.0f} MB long; at most {largest / 2**20:.0f} MB are read"
        )
    return path.read_bytes()


def read_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML document; tomllib.TOMLDecodeError where the text is none.

    RecursionError, before it is read, where a key has more than 50 parts or values are nested by the hundred.
    """
    if any(line.count(".") > DEEPEST and _parts(line) > DEEPEST for line in text.split("\n")):
        raise RecursionError
    return tomllib.loads(text)


def _parts(line: str) -> int:
    """The most parts that a dotted key in a line has; what stands in quotes or in a remark is none."""
    most = parts = 0
    for token in _TOKEN.finditer(line):
        if token["dot"]:
            parts += 1
            most = max(most, parts)
        elif token["end"]:
            parts = 0
    return most + 1
