"""Reading what a user names: regular files only, and not without bounds."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

LARGEST = 2**31
"""Bytes of a measured file."""
LARGEST_DEFINITION = 2**22
"""Bytes of a definition; what is longer is something else."""
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
        found = path.stat()
    except ValueError as error:  # a NUL in the name
        raise OSError(errno.EINVAL, "no file can have such a name") from error
    for is_kind, code, what in _KINDS:
        if is_kind(found.st_mode):
            raise IsADirectoryError(code, what) if code == errno.EISDIR else OSError(code, what)
    if found.st_size > largest:
        raise OSError(errno.EFBIG, f"is {found.st_size / 2**20:.0f} MB long; at most {largest / 2**20:.0f} MB are read")
    return path.read_bytes()
