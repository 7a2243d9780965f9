"""The layers of the program, held by import-linter, and the science's silence, held here."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LAYERS = ("physics", "effects", "model", "identify", "loop")
SCIENCE = [
    path.relative_to(ROOT).as_posix() for layer in LAYERS for path in (ROOT / "twindisc_cli" / layer).rglob("*.py")
]


def test_imports_go_towards_the_physics(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    linter = pytest.importorskip("importlinter.cli", reason="import-linter is not installed (extra `dev`)")
    monkeypatch.chdir(ROOT)
    code = linter.lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True)
    assert code == 0, capsys.readouterr().out


@pytest.mark.parametrize("path", SCIENCE)
def test_the_science_opens_no_file_and_prints_nothing(path: str) -> None:
    calls = {
        node.func.id
        for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert not calls & {"print", "open", "input"}
