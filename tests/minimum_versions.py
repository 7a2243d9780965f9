"""The oldest versions that pyproject.toml allows, as pins for pip: python tests/minimum_versions.py > pins.txt."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def pins() -> list[str]:
    """`name==version` of every requirement of the program and of its tests."""
    extras = PROJECT["optional-dependencies"]
    wanted = [*PROJECT["dependencies"], *extras["cluster"], *extras["rigs"], *extras["test"]]
    found = [re.fullmatch(r"([\w-]+)>=([\w.]+)", requirement) for requirement in wanted]
    return sorted({f"{match[1]}=={match[2]}" for match in found if match})


if __name__ == "__main__":
    print("\n".join(pins()))
