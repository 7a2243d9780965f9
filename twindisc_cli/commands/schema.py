"""schema: the JSON schema of a test definition."""

from __future__ import annotations

import json

from twindisc_cli.definition.schema import json_schema


def run() -> str:
    """The schema as indented JSON."""
    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
