"""What the packages say of themselves: one version, requirements with lower bounds, a description that stands alone."""

from __future__ import annotations

import re
from importlib import metadata
from pathlib import Path

import pytest
from minimum_versions import PROJECT, pins

from twindisc_cli import __version__

ROOT = Path(__file__).parents[1]


def test_the_version_is_one() -> None:
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    assert cited is not None
    assert cited[1] == __version__ == metadata.version("twindisc")
    assert "version" in PROJECT["dynamic"]


def test_the_description_shows_outside_of_a_checkout() -> None:
    text = (ROOT / PROJECT["readme"]).read_text(encoding="utf-8")
    assert all("://" in target for target in re.findall(r"\]\(([^)]+)\)", text))
    commands = re.findall(r"^twindisc (\S+)", text, re.MULTILINE)
    from typer.main import get_command

    from twindisc_cli.cli import app

    assert set(commands) <= set(get_command(app).commands)  # type: ignore[attr-defined]


def test_every_requirement_has_a_lowest_version_that_can_be_tested() -> None:
    wanted = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"]]
    assert {pin.partition("==")[0] for pin in pins()} >= {re.split(r"[>=]", name)[0] for name in wanted}
    assert any(line.endswith(":: 3.13") for line in PROJECT["classifiers"])


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "docs/campaigns.md"])
def test_no_link_of_a_page_is_broken(name: str) -> None:
    text = re.sub(r"^```.*?^```", "", (ROOT / name).read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)#\s]+)\)", text):
        assert "://" in target or ((ROOT / name).parent / target).exists(), target
