"""Where each key of a TOML document stands, which tomllib does not tell.

`locate(text)` reads a document that tomllib has already accepted, so it only has to find its way, not to judge. Keys
are paths such as ("history", "steps", 3, "mu"); inline tables, arrays and arrays of tables included.
"""

from __future__ import annotations

import re

Key = tuple[str | int, ...]

_BLANK = re.compile(r"(?:\s|#[^\n]*)*")
_PART = re.compile(r"""[ \t]*("(?:\\.|[^"\\\n])*"|'[^'\n]*'|[A-Za-z0-9_-]+)[ \t]*""")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'', re.DOTALL)
_SCALAR = re.compile(r"[^,\]}#\n]*")


class _Scanner:
    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.lines: dict[Key, int] = {}
        self.counts: dict[Key, int] = {}

    def note(self, key: Key) -> None:
        self.lines.setdefault(key, self.text.count("\n", 0, self.at) + 1)

    def blank(self) -> str:
        """Skip white space and comments; the next character, or '' at the end."""
        match = _BLANK.match(self.text, self.at)
        assert match is not None  # the pattern matches the empty text
        self.at = match.end()
        return self.text[self.at : self.at + 1]

    def dotted(self) -> Key:
        """Read a bare, quoted or dotted key."""
        parts: list[str] = []
        while match := _PART.match(self.text, self.at):
            parts.append(match[1].strip("\"'"))
            self.at = match.end()
            if self.text[self.at : self.at + 1] != ".":
                break
            self.at += 1
        return tuple(parts)

    def document(self) -> None:
        table: Key = ()
        while character := self.blank():
            if character == "[":
                table = self.header()
            else:
                self.pair(table)

    def header(self) -> Key:
        many = self.text.startswith("[[", self.at)
        start = self.at
        self.at += 2 if many else 1
        parts = self.dotted()
        self.at, end = start, self.text.index("]", self.at)
        table: Key = ()
        for depth, part in enumerate(parts, start=1):
            table = (*table, part)
            self.note(table)
            if many and depth == len(parts):
                self.counts[table] = self.counts.get(table, -1) + 1
            if table in self.counts:  # an array of tables: the last one is meant
                table = (*table, self.counts[table])
                self.note(table)
        self.at = end + (2 if many else 1)
        return table

    def pair(self, table: Key) -> None:
        self.blank()
        start = self.at
        parts = self.dotted()
        after, self.at = self.at, start
        for depth in range(1, len(parts) + 1):
            self.note(table + parts[:depth])
        self.at = after + 1  # past the equals sign
        self.value(table + parts)

    def value(self, key: Key) -> None:
        opening = self.blank()
        if opening == "[":
            self.items(key, "]")
        elif opening == "{":
            self.items(key, "}")
        else:
            match = _STRING.match(self.text, self.at) or _SCALAR.match(self.text, self.at)
            assert match is not None  # the scalar pattern matches the empty text
            self.at = match.end()

    def items(self, key: Key, closing: str) -> None:
        """The inside of an array or of an inline table."""
        self.at += 1
        index = 0
        while (character := self.blank()) and character != closing:
            if character == ",":
                self.at += 1
            elif closing == "}":
                self.pair(key)
            else:
                self.note((*key, index))
                self.value((*key, index))
                index += 1
        self.at += 1


def locate(text: str) -> dict[Key, int]:
    """The line, from 1, of every table, key and array item of a valid TOML document."""
    scanner = _Scanner(text.replace("\r\n", "\n"))
    scanner.document()
    return scanner.lines
