"""The pages people read: words for what was found, and self-contained HTML."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment


def pages() -> Environment:
    """Where the templates of the pages are; a name that a template does not know is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("twindisc_cli", "report")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
