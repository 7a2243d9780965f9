"""The documentation: every command line and every piece of Python in it is run, every figure in it is drawn."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from twindisc_cli.effects import catalogue

DOCS = Path(__file__).parents[1] / "docs"
if not (DOCS / "build.py").exists():
    pytest.skip("the documentation is not here: this is not a checkout", allow_module_level=True)
sys.path.insert(0, str(DOCS))
from build import DocumentationError, Workbench, build, page  # type: ignore[import-not-found]  # noqa: E402


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs")
    build(folder / "pages", folder / "work")
    return folder / "pages"


def test_all_pages_are_made_and_no_picture_or_page_is_missing(pages: Path) -> None:
    for path in pages.rglob("*.md"):
        text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text):
            assert "://" in target or (path.parent / target).exists(), f"{path.name}: {target}"
        assert "<!-- section" not in text
        assert "<!-- docstring" not in text
    assert {path.stem for path in (pages / "effects").glob("*.md")} == {"index", *catalogue()}
    assert "$ twindisc close-loop my_test.toml" in (pages / "tutorial.md").read_text(encoding="utf-8")


def test_the_tutorial_finds_what_its_log_was_made_with(pages: Path) -> None:
    text = (pages / "tutorial.md").read_text(encoding="utf-8")
    ratio, decay = re.search(r"falling_friction \(ratio = ([\d.]+) ± .*?decay_s_m = ([\d.]+) ±", text).groups()  # type: ignore[union-attr]
    assert float(ratio) == pytest.approx(0.5, abs=0.01)
    assert float(decay) == pytest.approx(3.0, abs=0.15)
    assert "torque zero 20 ±" in text


def test_a_page_that_shows_what_does_not_work_is_not_built(tmp_path: Path) -> None:
    bench = Workbench(tmp_path)
    with pytest.raises(DocumentationError, match=r"exit code 2 of `twindisc thermal nothing\.toml`"):
        page("```console\n$ twindisc thermal nothing.toml\n```\n", bench, tmp_path)
    with pytest.raises(DocumentationError, match="has no section 'Nowhere'"):
        page('<!-- section "Nowhere" of README.md -->', bench, tmp_path)
    assert page("```python\nprint(6 * 7)\n```\n", bench, tmp_path).endswith("```text\n42\n```\n")


def test_no_command_line_stands_where_it_is_not_run() -> None:
    for path in DOCS.glob("*.md"):
        plain = re.sub(r"^```console\n.*?^```\n", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        assert not re.findall(r"^\$? ?twindisc .*", plain, re.MULTILINE), path.name
