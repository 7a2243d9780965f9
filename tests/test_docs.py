"""The documentation: every command line and every piece of Python in it is run, every figure in it is drawn."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import suros

from twindisc_cli.effects import catalogue

DOCS = Path(__file__).parents[1] / "docs"
if not (DOCS / "build.py").exists():
    pytest.skip("the documentation is not here: this is not a checkout", allow_module_level=True)
sys.path.insert(0, str(DOCS))
from build import DocumentationError, Workbench, build, modules, page  # type: ignore[import-not-found]  # noqa: E402
from tables import FORMULAS, formula, keys  # type: ignore[import-not-found]  # noqa: E402


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs")
    build(folder / "pages", folder / "work")
    return folder / "pages"


@pytest.mark.long
def test_all_pages_are_made_and_no_picture_or_page_is_missing(pages: Path) -> None:
    for path in pages.rglob("*.md"):
        text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text):
            assert "://" in target or (path.parent / target).exists(), f"{path.name}: {target}"
        assert "<!-- section" not in text
        assert not re.search(r"<!-- (table|results|modules|console|numbers)", text), path.name
    assert {path.stem for path in (pages / "effects").glob("*.md")} == {"index", *catalogue()}
    assert "$ twindisc close-loop my_test.toml" in (pages / "tutorial.md").read_text(encoding="utf-8")


@pytest.mark.long
def test_the_tutorial_finds_what_its_log_was_made_with(pages: Path) -> None:
    text = (pages / "tutorial.md").read_text(encoding="utf-8")
    ratio, decay = re.search(r"falling_friction \(ratio = ([\d.]+) ± .*?decay_s_m = ([\d.]+) ±", text).groups()  # type: ignore[union-attr]
    assert float(ratio) == pytest.approx(0.5, abs=0.01)
    assert float(decay) == pytest.approx(3.0, abs=0.15)
    zero, std = re.search(r"torque zero ([\d.]+) ± ([\d.]+) mN m", text).groups()  # type: ignore[union-attr]
    assert abs(float(zero) - 20.0) < 2.0 * float(std) < 2.5


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


def test_every_effect_has_a_formula_and_every_equation_is_typeset() -> None:
    pytest.importorskip("latex2mathml", reason="the packages of the documentation are not installed")
    from hooks import typeset  # type: ignore[import-not-found]

    assert FORMULAS.keys() == catalogue().keys()
    theory = (DOCS / "theory.md").read_text(encoding="utf-8")
    equations = [*re.findall(r"\$\$ (.*?) \$\$", theory, re.DOTALL), *FORMULAS.values(), *map(formula, FORMULAS)]
    for tex in equations:
        made = typeset(tex.replace("$", "").replace("<br>", " "), displayed=True)
        assert made.count("<math") == made.count("</math>") == 1
        assert "\\" not in re.sub(r'aria-label="[^"]*"', "", made), tex
    assert {int(n) for n in re.findall(r"\\tag\{(\d+)", theory)} >= {1, 4, 5, 6, 7, 9, 10, 11, *range(12, 20)}


def test_an_equation_keeps_its_number() -> None:
    pytest.importorskip("latex2mathml", reason="the packages of the documentation are not installed")
    from hooks import on_page_content  # type: ignore[import-not-found]

    page = on_page_content(r'<div class="arithmatex">\[a &lt; b \tag{9}\]</div><span class="arithmatex">\(c\)</span>')
    assert page.count("<math") == 2
    assert '<span class="number">(9)</span>' in page
    assert "<mo>&#x0003C;</mo>" in page
    assert "tag" not in page


def test_the_reference_lists_every_key_and_every_module() -> None:
    import json
    import pkgutil

    import twindisc_cli
    from twindisc_cli.commands.schema import run

    text = keys()
    schema = json.loads(run())
    names = {key for part in [schema, *schema["$defs"].values()] for key in part.get("properties", ())}
    effects = {p.name for effect in catalogue().values() for p in effect.params} | set(catalogue())
    columns = {"column", "unit", "sign"}
    assert {name for name in names - effects - columns if f"`{name}`" not in text} <= {"effects"}
    physics = [m.name for m in pkgutil.iter_modules(twindisc_cli.__path__) if m.name in ("physics", "identify", "laws")]
    assert len(physics) == 3
    listed = modules()
    assert "::: twindisc_cli.physics.hertz" in listed and "._" not in listed


def test_examples_in_docstrings_are_shown_as_python() -> None:
    pytest.importorskip("griffe", reason="the packages of the documentation are not installed")
    from doctests import EXAMPLE  # type: ignore[import-not-found]

    fenced = EXAMPLE.sub("[]", "Words.\n\n>>> 1 + 1\n2\n\nMore.")
    assert fenced == "Words.\n\n[]\n\nMore."


def test_from_the_text_of_a_rig_to_the_wear_rate(tmp_path: Path) -> None:
    """The page of SUROS is run; its friction and its wear are those of the data, which are those of the test's code."""
    shutil.copytree(DOCS / "examples/suros", tmp_path / "suros")
    suros.write_raw(tmp_path)
    for name in ("rig.txt", "weights.csv", "block.toml"):
        assert (tmp_path / name).read_text() == (tmp_path / "suros" / name).read_text()
    text = page((DOCS / "example-suros.md").read_text(encoding="utf-8"), Workbench(tmp_path), tmp_path / "to")
    mu = [[float(v) for v in row] for row in re.findall(r"%  ([\d.]+)  ([\d.]+) \.\.\. ([\d.]+)", text)]
    assert len(mu) == 10
    assert [row[0] for row in mu] == pytest.approx([0.42] * 10, abs=0.01)
    assert sum(low - 0.001 <= 0.42 <= high + 0.001 for _, low, high in mu) >= 8
    rows = re.findall(r"disc (\d)  +([\d.]+) N/mm2  +([\d.]+) ug", text)
    for disc, k in (("1", 2e-4), ("2", 3.7e-4)):
        index, rate = np.array([(float(i), float(r)) for d, i, r in rows if d == disc]).T
        expected = k * 7850 / (280 * 9.80665e6) * index * 1e6 * np.where(index > 20.0, 3.0, 1.0) * 1e3
        np.testing.assert_allclose(rate, expected, rtol=0.04)
