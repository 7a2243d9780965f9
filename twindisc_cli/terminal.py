"""The one way to say something to a stream: whatever the text holds, and whatever has become of the stream.

Control characters are escaped, what the stream's encoding lacks is written as an escape, long lines are cut in their
middle, and a reader that has gone (a closed or broken pipe) is no failure: the work was done all the same.
"""

from __future__ import annotations

import errno
import json
import os
import re
import sys
from collections.abc import Iterable, Mapping
from typing import Any, TextIO

from twindisc_cli.errors import OutputError

LONGEST_LINE, LONGEST_FAILURE = 2000, 400
MOST_LINES = 40  # of mistakes: a screenful
_GONE = (errno.EPIPE, errno.EBADF, errno.ESHUTDOWN)
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]")


def say(lines: Iterable[str], *, error: bool = False) -> None:
    """Write lines to stdout, or with `error` to stderr."""
    _write("".join(f"{plain_line(line)}\n" for line in lines), error=error)


def say_failure(problems: Iterable[str]) -> None:
    """Write the lines of a failure to stderr; beyond a screenful only their number."""
    lines = [plain_line(problem, longest=LONGEST_FAILURE) for problem in problems]
    more = [f"... and {len(lines) - MOST_LINES} more"] if len(lines) > MOST_LINES else []
    say([*lines[:MOST_LINES], *more], error=True)


def say_text(text: str) -> None:
    """Write a text of several lines, such as a file's content, to stdout as it stands."""
    _write(text, error=False)


def say_json(value: Mapping[str, Any], *, indent: int | None = 2) -> None:
    """Write one JSON object to stdout; beyond plain text in UTF-8 everything is a JSON escape."""
    text = json.dumps(value, indent=indent, ensure_ascii=False)
    if not _is_utf8(sys.stdout) or _CONTROL.search(text.replace("\n", "")):
        text = json.dumps(value, indent=indent, ensure_ascii=True)
    _write(f"{text}\n", error=False)


def plain_line(text: str, *, longest: int = LONGEST_LINE) -> str:
    """A text as one line of bounded length, its control characters escaped."""
    line = _CONTROL.sub(lambda match: match[0].encode("unicode_escape").decode("ascii"), text)
    half = (longest - 5) // 2
    return line if len(line) <= longest else f"{line[:half]} ... {line[-half:]}"


def _is_utf8(stream: TextIO | None) -> bool:
    return (getattr(stream, "encoding", None) or "utf-8").lower().replace("-", "") == "utf8"


def _write(text: str, *, error: bool) -> None:
    """Write and flush; OutputError where stdout takes nothing although somebody reads it, as on a full disk."""
    stream = sys.stderr if error else sys.stdout
    if stream is None:  # closed by who started this
        return
    encoding = getattr(stream, "encoding", None) or "utf-8"
    try:
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        stream.flush()
    except ValueError:  # closed meanwhile
        return
    except OSError as failure:
        _discard(stream)
        if not error and failure.errno not in _GONE:
            raise OutputError(f"standard output cannot be written: {failure.strerror}") from failure


def _discard(stream: TextIO) -> None:
    """Let the rest of a stream go nowhere, so that leaving does not fail on what it still holds."""
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
    except (OSError, ValueError):
        return
