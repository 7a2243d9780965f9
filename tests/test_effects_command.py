"""`twindisc effects`: what it lists, what it explains, and what it says of a name it does not know."""

from __future__ import annotations

import json
import tomllib

import pytest
from definitions import VALID

from twindisc_cli import cli
from twindisc_cli.commands.effects import run
from twindisc_cli.definition.parse import parse
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import DefinitionError
from twindisc_cli.loop.channels import channels


def called(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        cli.main(["effects", *arguments])
    return int(left.value.code or 0)


def test_lists_every_effect_once_under_its_channel() -> None:
    lines = run(None).summary
    places = {channel: lines.index(f"seen first in the {channel}") for channel in channels() if channel != "mass"}
    for name, effect in catalogue().items():
        (place,) = [i for i, line in enumerate(lines) if line.split()[:1] == [name]]
        above = max((at, channel) for channel, at in places.items() if at < place)[1]
        assert above == effect.channel
        assert lines[place].endswith(".")
        assert len(lines[place]) <= 140


def test_list_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert called("--json") == 0
    listed = json.loads(capsys.readouterr().out)["effects"]
    assert [e["effect"] for e in listed] == sorted(catalogue())
    (polach,) = [e for e in listed if e["effect"] == "falling_friction"]
    assert polach["channel"] == "traction"
    assert polach["summary"] == "the local coefficient of friction drops as the sliding speed grows."


def test_explains_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert called("falling_friction") == 0
    text = capsys.readouterr().out
    for needed in (
        "mu(w) = mu_0 [A + (1 - A) exp(-B w)]",
        "Leaves behind",
        "Valid for",
        "O. Polach, Wear 258 (2005) 992-1000",
        "Seen in: traction, temperature, profile; first in the traction.",
        "1 switches it off",
        "[s m-1], 0.05 to 30",
    ):
        assert needed in text


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_the_declaration_shown_is_ready_to_copy(name: str) -> None:
    lines = run(name).summary
    shown = "\n".join(line.strip() for line in lines[lines.index(f"  [effects.{name}]") :])
    assert tomllib.loads(shown)["effects"][name] == {p.name: p.start for p in catalogue()[name].params}
    parse(f"{VALID}\n{shown}\n", "small.toml")


def test_one_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert called("thermocouple_lag", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["effect"] == "thermocouple_lag"
    assert told["seen_in"] == ["temperature"]
    (parameter,) = told["parameters"]
    assert (parameter["name"], parameter["unit"], parameter["off"]) == ("time_constant_s", "s", 0.0)
    assert told["source"] == catalogue()["thermocouple_lag"].source


def test_an_unknown_name_gets_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert called("faling_friction") == DefinitionError.exit_code
    assert "did you mean falling_friction?" in capsys.readouterr().err
    with pytest.raises(DefinitionError, match="twindisc effects"):
        run("quux")
