"""docs/architecture.md: its rooms are the folders of the package, and its drawing has the floors of the linter."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "twindisc_cli"
PAGE = ROOT / "docs/architecture.md"


@pytest.fixture(scope="module")
def page() -> str:
    if not PAGE.exists():
        pytest.skip("the pages of the documentation are not here")
    return PAGE.read_text(encoding="utf-8")


def test_its_rooms_are_the_folders(page: str) -> None:
    rooms = re.findall(r"^\| `([\w/]+)` \|", page, re.MULTILINE)
    folders = {path.parent.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("__init__.py")} - {"."}
    assert len(rooms) == len(set(rooms))
    assert set(rooms) == folders


def test_its_drawing_has_the_floors_in_their_order(page: str) -> None:
    """Every floor that the linter holds stands in the drawing, none above one that may import it."""
    drawing = page.split("```text\n")[1].split("```")[0].split("\n")
    linter = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    *floors, _beside = linter["contracts"][0]["layers"]
    lines = []
    for floor in floors:
        names = re.findall(r"twindisc_cli\.(\w+)", floor)
        at = [n for name in names for n, line in enumerate(drawing) if re.search(rf"\b{name}\b", line[:54])]
        assert len(at) >= len(names), f"{floor} is not drawn"
        lines.append(min(at))
    assert lines == sorted(lines)


def test_the_files_it_names_are_there(page: str) -> None:
    named = re.findall(r"`(?:(\w+)/)?(\w+\.py)`", page)
    assert named
    for room, file in named:
        assert (PACKAGE / room / file).is_file(), f"{room}/{file}"


def test_modules_beside_the_rooms_are_named(page: str) -> None:
    beside = {"cli.py", "api.py", "terminal.py", "__init__.py", "__main__.py"}
    for path in PACKAGE.glob("*.py"):
        assert path.name in beside or f"`{path.name}`" in page
