"""Numbers of docs/paper.md and README.md that come from long loops, against what `make run` wrote, where it has run."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import h5py
import pytest

ROOT = Path(__file__).parents[1]
PAGE = " ".join((ROOT / "docs" / "paper.md").read_text(encoding="utf-8").split())


def outcome(test: str, written_by: str = "make run") -> Any:
    """What close-loop said of a test; skips where it did not run or the file is of another program."""
    file = ROOT / "results" / test / "close-loop.h5"
    if not file.exists():
        pytest.skip(f"{file.relative_to(ROOT)} is not there: {written_by} writes it in a few minutes")
    if file.stat().st_mtime < max(path.stat().st_mtime for path in (ROOT / "twindisc_cli").rglob("*.py")):
        pytest.skip(f"{file.relative_to(ROOT)} is older than the program: {written_by} renews it")
    with h5py.File(file) as data:
        return json.loads(data["outcome"].attrs["json"])


def effects(result: Any) -> dict[str, Any]:
    return {effect["effect"]: effect for effect in result["effects"]}


def on_the_page(pattern: str) -> list[str]:
    """The numbers that stand at the groups of a pattern in the text of the page."""
    match = re.search(pattern, PAGE)
    assert match, f"the page no longer says {pattern!r}"
    return list(match.groups())


def agrees(text: str, value: float) -> bool:
    """Whether a printed number is a value, rounded to the digits it is printed with."""
    digits = len(text.partition("e")[0].partition(".")[2])
    return text == (f"{value:.{digits}e}".replace("e-0", "e-") if "e" in text else f"{value:.{digits}f}")


def test_nitrogen_by_itself() -> None:
    share, creepage, strength, percent = on_the_page(
        r"nitrogen by itself .*? with (\S+) of the wear on disc 1, .*? near (\S+) % creepage .*?\*(\w+)\*, (\d+) %"
    )
    result = effects(outcome("cryogenic"))
    assert {"half_space_contact", "wear_partition", "film_breakdown"} <= set(result)
    film = result["film_breakdown"]
    assert agrees(share, result["wear_partition"]["parameters"]["disc1_share"]["value"])
    assert agrees(creepage, film["parameters"]["critical_creepage_percent"]["value"])
    assert film["strength"] == strength
    assert abs(float(percent) - 100.0 * film["probability"]) <= 1.0


def test_air_by_itself() -> None:
    k, share = on_the_page(r"K = (\S+) and (\S+) of the wear on disc 1")
    result = outcome("ambient")
    assert agrees(share, effects(result)["wear_partition"]["parameters"]["disc1_share"]["value"])
    assert agrees(k, result["base"]["K"]["value"])


@pytest.mark.parametrize("test", ["ambient", "cryogenic"])
def test_the_error_with_the_mu_of_each_step(test: str) -> None:
    printed = dict(
        zip(("ambient", "cryogenic"), on_the_page(r"as before, (\S+) µm in air and (\S+) µm in nitrogen"), strict=True)
    )
    error = outcome(test)["error"]["profile"]
    assert agrees(printed[test], error["before_step_mu"])
    assert error["before_step_mu"] == pytest.approx(error["before"], rel=0.02), "as far off as with one constant mu"


def test_both_tests_together() -> None:
    profile = r"profiles (\S+) to (\S+) µm \(held out (\S+) to (\S+) µm\)"
    share, *errors, k, std = on_the_page(
        rf"half-space contact and (\S+) of the wear on disc 1, and each .*?{profile}, "
        r"T/N (\S+) to (\S+) \(held out (\S+) to (\S+)\)\. K is (\S+)e-4 ± (\S+)e-4"
    )
    command = "twindisc close-loop configs/ambient.toml configs/cryogenic.toml -o results/joint"
    result = outcome("joint/ambient", command)
    kinds = ("before", "after", "held_out_before", "held_out_after")
    values = [result["error"][channel][kind] for channel in ("profile", "traction") for kind in kinds]
    assert [text for text, value in zip(errors, values, strict=True) if not agrees(text, value)] == []
    assert agrees(share, effects(result)["wear_partition"]["parameters"]["disc1_share"]["value"])
    assert agrees(k, 1e4 * result["base"]["K"]["value"])
    assert agrees(std, 1e4 * result["base"]["K"]["std"])


def test_nitrogen_predicted_with_its_own_friction() -> None:
    before, predicted, validated = on_the_page(
        r"profile then falls from (\S+) to (\S+) µm by `--predict`, and to (\S+) µm by `--validate`"
    )
    own = "configs/cryogenic.toml with the mu of each step in place of the traction"
    command = "twindisc close-loop configs/ambient.toml --{0} OWN.toml -o results/own-{0} (OWN.toml: {1})"
    (prediction,) = outcome("own-predict/ambient", command.format("predict", own))["prediction"]
    assert agrees(before, prediction["error"]["profile"]["held_out_before"])
    assert agrees(predicted, prediction["error"]["profile"]["held_out_after"])
    result = outcome("own-validate/ambient", command.format("validate", own))
    assert agrees(validated, result["validation"]["error"]["profile"]["held_out_after"])
    assert set(effects(result)) == {"half_space_contact", "wear_partition", "lubricated_film"}
    assert effects(result)["lubricated_film"]["strength"] == "possible"


@pytest.mark.parametrize(("test", "row"), [("eurosprinter", "a locomotive"), ("mtm_running_in", "running-in of")])
def test_the_errors_of_measured_records(test: str, row: str) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    match = re.search(rf"^\| .*{row}.*\| (\S+) → (\S+) \(\w+ (\S+)\) \|$", readme, re.MULTILINE)
    assert match
    error = outcome(test)["error"]["traction"]
    values = [error[kind] for kind in ("held_out_before", "held_out_after", "noise")]
    assert [text for text, value in zip(match.groups(), values, strict=True) if not agrees(text, value)] == []


def test_a_wrong_digit_is_seen() -> None:
    assert agrees("2.208e-4", 2.2077e-4)
    assert not agrees("2.206e-4", 2.2077e-4)
    assert agrees("0.52", 0.5231)
    assert not agrees("0.53", 0.5231)
