"""A small valid test definition, and ways to spoil it, shared by the tests of the files' edge."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path

from twindisc_cli.definition import Test, load
from twindisc_cli.results import Result

CONFIGS = Path(__file__).parents[1] / "configs"

VALID = """\
schema = 1

[test]
name = "small"

[rig]
normal_load_N = 72.0
mean_speed_rpm = 3000.0
disc1 = { rolling_radius_mm = 30.0, transverse_radius_mm = inf }
disc2 = { rolling_radius_mm = 30.0, transverse_radius_mm = 30.0 }

[material]
youngs_modulus_GPa = 206.0
poisson_ratio = 0.30
hardness_HV = 700

[thermal]
environment_temperature_C = 20.0
heat_capacity_J_K = 100.0

[history]
revolutions_per_iteration = 4200
steps = [
  { creepage_percent = 0.5, iterations = 2 },
  { creepage_percent = 1.0, iterations = 2 },
  { creepage_percent = 2.0 },
]

[model]
friction_coefficient = 0.6
"""
"""Three steps of 168, 168 and 84 s."""

TRACTION = "creepage [%],traction ratio [1]\n0.5,0.49\n1,0.55\n2,0.58\n"


@cache
def shipped(name: str) -> Test:
    """A test as it is shipped, read once."""
    return load(CONFIGS / f"{name}.toml")


@cache
def outcome(name: str, command: str) -> Result:
    """What a command makes of a shipped test, computed once."""
    module = import_module(f"twindisc_cli.commands.{command.replace('-', '_')}")
    return module.run(shipped(name))  # type: ignore[no-any-return]


def changed(**replacements: str) -> str:
    """The valid definition with whole lines replaced, by the key they begin with."""
    lines = VALID.split("\n")
    for key, line in replacements.items():
        (place,) = [n for n, text in enumerate(lines) if text.startswith(f"{key} =")]
        lines[place] = line
    return "\n".join(lines)


def line_of(text: str, needle: str) -> int:
    """The line, from 1, in which a text first occurs."""
    return text[: text.index(needle)].count("\n") + 1


def write(folder: Path, text: str = VALID, name: str = "small.toml", **data: str) -> Path:
    """Write a definition, and CSV files that it measures: traction="...", profile="..."."""
    if data:
        text += "\n[measured]\n" + "".join(f'{channel} = "{channel}.csv"\n' for channel in data)
    for channel, content in data.items():
        (folder / f"{channel}.csv").write_text(content, encoding="utf-8")
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def with_wear_coefficient(test: Test, k: float) -> Test:
    """The test with K given, which it leaves to be identified."""
    options = replace(test.experiment.options, wear_coefficient=k)
    return replace(test, experiment=replace(test.experiment, options=options))
