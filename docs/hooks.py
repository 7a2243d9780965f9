"""Typesets the equations of the site while it is built: TeX between dollars becomes MathML, which every browser draws.

`pymdownx.arithmatex` marks what stands between `$` (in a line) or `$$` (displayed); `\\tag{9}` numbers a displayed one.
"""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

MARKED = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
TAG = re.compile(r"\\tag\{([^}]*)\}")


def typeset(tex: str, *, displayed: bool) -> str:
    """TeX as MathML; a displayed equation with its number at the right."""
    tag = TAG.search(tex)
    body = convert(TAG.sub("", tex).strip(), display="block" if displayed else "inline")
    if not displayed:
        return body
    number = f'<span class="number">({tag[1]})</span>' if tag else ""
    return f'<div class="equation" role="region" tabindex="0" aria-label="equation">{body}{number}</div>'


def on_page_content(content: str, **_: Any) -> str:
    """Called by mkdocs for every page."""
    return MARKED.sub(lambda m: typeset(html.unescape(m[2]), displayed=m[1] == "div"), content)
