"""The README and what users read: short, in standard words, true to the score, with a path that works as printed."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
if not (ROOT / "README.md").exists():
    pytest.skip("no README: this is not a checkout", allow_module_level=True)
README = (ROOT / "README.md").read_text(encoding="utf-8")
MOST_WORDS, MOST_COMMANDS = 1400, 5
UNUSUAL = re.compile(
    r"\b(foret\w+|stray\w*|alike|edged|polished|favoured|leftovers?|told|tells?|hangs? on|hung on|kin|imitat\w+|eased|"
    r"march(es|ed|ing)?|white numbers|calm\w*|renewed|pric(e|es|ed)|cooled (search|evidence)|swept (test|file)s?|"
    r"(?<!there )is no(?! longer))\b",
    re.IGNORECASE,
)
"""Words that a physicist has to read twice, with a standard one in their place: predict, outlier, similar, residual,
reported, depends on, integrate, is not a."""


def test_the_readme_is_two_screens() -> None:
    assert len(README.split()) <= MOST_WORDS


def pages() -> list[Path]:
    first = [ROOT / name for name in ("README.md", "PACKAGE.md", "CONTRIBUTING.md", "CHANGELOG.md", "paper/paper.md")]
    templates = [*(ROOT / "twindisc_cli/report").glob("*.html"), *(ROOT / "twindisc_cli").rglob("*.toml")]
    return [*first, *sorted((ROOT / "docs").glob("*.md")), *sorted(templates)]


def unusual(text: str) -> list[str]:
    return [match[0] for match in UNUSUAL.finditer(re.sub(r"<!--.*?-->", "", text))]


def test_the_list_of_words_finds_them() -> None:
    assert unusual("It is no law, foretold alike; there is no step. It hangs on") == [
        "is no", "foretold", "alike", "hangs on"
    ]  # fmt: skip


@pytest.mark.parametrize("path", pages(), ids=lambda path: path.name)
def test_pages_are_in_standard_words(path: Path) -> None:
    assert unusual(path.read_text(encoding="utf-8")) == []


def test_the_readme_counts_as_the_score_does() -> None:
    """Every count of the table of the score is a line of the full one, or the sum of two of its lines."""
    score = (ROOT / "docs/score.md").read_text(encoding="utf-8")
    block = score[score.index("<!-- score begins") : score.index("<!-- score ends")]
    counted = {(int(n), int(of)) for n, of in re.findall(r"(\d+) of +(\d+)", block)}
    sums = {(a + c, b + d) for a, b in counted for c, d in counted}
    table = README[README.index("| hidden in the test") : README.index("On measured records, where")]
    reported = [(int(n), int(of)) for n, of in re.findall(r"\| (\d+) of (\d+) \|", table)]
    assert len(reported) == 6
    for n, of in reported:
        assert (n, of) in counted | sums or (of - n, of) in counted, f"{n} of {of}"


def newcomer() -> list[str]:
    """The command lines from the clone to the first figure, as the README prints them."""
    block = re.search(r"<!-- newcomer begins -->\n```\n(.*?)```", README, re.DOTALL)
    assert block
    return [re.sub(r"\s+#.*", "", line) for line in block[1].splitlines() if line.strip()]


def test_five_commands_lead_from_the_clone_to_a_figure(tmp_path: Path) -> None:
    commands = newcomer()
    assert commands[0].startswith("git clone ") and len(commands) <= MOST_COMMANDS
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("no git, or not a clone")
    home = tmp_path / "home"
    home.mkdir()
    for line in commands:
        line = line.replace("REPOSITORY", str(ROOT)).replace("python3", sys.executable)
        done = subprocess.run(line, shell=True, cwd=home, env=offline(tmp_path), capture_output=True, text=True)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
    assert (home / "results/my_test/friction-chart.png").stat().st_size > 10_000


def offline(folder: Path) -> dict[str, str]:
    """An environment in which pip installs the clone alone; what it needs is linked from the packages of this run."""
    lent = folder / "lent"
    if not lent.exists():
        lent.mkdir()
        for path in installed():
            (lent / path.name).symlink_to(path)
    pip = {"PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0", "PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    return {**os.environ, **pip, "PYTHONPATH": str(lent), "OMP_NUM_THREADS": "1"}


def installed() -> Iterator[Path]:
    for path in Path(sysconfig.get_paths()["purelib"]).iterdir():
        if not re.match(r"twindisc|__editable__|pip", path.name) and path.suffix != ".pth":
            yield path


def test_the_definition_in_the_readme_runs(tmp_path: Path) -> None:
    from twindisc_cli.definition import load

    text = re.search(r"```toml\n(.*?)```", README, re.DOTALL)
    assert text
    (tmp_path / "my_test.toml").write_text(text[1], encoding="utf-8")
    (tmp_path / "traction.csv").write_text("creepage [%],traction ratio [1]\n0.5,0.55\n2,0.6\n")
    assert load(tmp_path / "my_test.toml").experiment.name == "my_test"


def messages(path: Path) -> Iterator[str]:
    """The texts of a file that are not docstrings; the name of a module handed to a template is none."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield "" if node.value == "told" else node.value


def test_effects_and_the_help_of_commands_are_in_standard_words() -> None:
    """Their docstrings are what users read."""
    from twindisc_cli import cli
    from twindisc_cli.effects import catalogue

    texts = {name: effect.explanation for name, effect in catalogue().items()}
    texts |= {
        command.name or "": (command.callback and command.callback.__doc__) or ""
        for command in cli.app.registered_commands
    }
    assert len(texts) > 30
    assert {name: words for name, text in texts.items() if (words := unusual(text))} == {}


def test_messages_are_in_standard_words() -> None:
    found = {
        f"{path.name}: {word}"
        for path in (ROOT / "twindisc_cli").rglob("*.py")
        for text in messages(path)
        for word in unusual(text)
    }
    assert found == set()
