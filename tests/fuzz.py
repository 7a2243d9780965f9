"""Broken input by the thousand: python -m tests.fuzz [--seed N] [--definitions N] [--tables N] ...

Real definitions, tables and result files are mutated, and extreme but valid tests made; the program must answer each
within ten seconds by a result or by one of its own failures, never by a traceback, by a warning of Python's, or by a
number that cannot be. Runs are killed at random
moments, and must leave a result that is whole, or none. Each case follows from its seed alone: what fails is printed
with the seed that makes it again (`--only KIND SEED`).
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import io
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import definitions as definitions_of_tests
import numpy as np
import tomli_w

from twindisc_cli import effects
from twindisc_cli.campaign.plan import plan
from twindisc_cli.cli import main as main_of_program
from twindisc_cli.commands import _runner, campaign, import_file
from twindisc_cli.commands._campaign_work import Order, Task, Work, prepare
from twindisc_cli.commands._output import Output
from twindisc_cli.commands._possible import refuse_impossible
from twindisc_cli.definition import load_text
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import TwindiscError
from twindisc_cli.laws.covariates import COVARIATES
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.loop import channels
from twindisc_cli.physics.half_space import ContactError
from twindisc_cli.results.recorded import Recorded, recorded
from twindisc_cli.results.store import images

ROOT = Path(__file__).parents[1]
LIMIT = 10.0
COMMANDS = ("friction-chart", "identify-mu", "simulate-wear", "fit-k", "thermal", "contact", "check")
NUMBERS = ["0", "-1", "1e-300", "1e300", "-1e300", "nan", "inf", "-inf", "1e400", "9" * 400, "0.1", "3", "1_0", "0x7f"]
NUMBERS += ["1e-9", "1e9", "true", '""', '"x"', "[]", "{}", "[1, 2]", "1979-05-27", "-0.0", "1,5", "100000", "2.5"]
VALUES: list[Any] = [0, -1, 1, 2, 1e-300, 1e300, -1e300, float("nan"), float("inf"), 10**30, True, "", "x", [], {}, 0.5]
VALUES += [[1, 2], [{}], {"a": 1}, "1", -0.0, 1e-9, 1e9, 100_000, "\x1b", "a" * 400, [[]], -5, 37.5]
CELLS = [
    "",
    "nan",
    "inf",
    "-inf",
    "1e300",
    "-1e300",
    "1e-300",
    "0",
    "-1",
    "x",
    "1,5",
    '"',
    "1e400",
    "12:30",
    "#N/A",
    "1 000",
]
CELLS += ["[mm]", "time [s]", "y [um]", "=1", "\t", ";", "١", "1e", "2024-01-01 10:00:00", "100", "-0", "9" * 30]


class Hanging(BaseException):
    """No answer within the limit."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Hanging, where what is inside takes longer than the limit."""

    def late(*_: object) -> None:
        raise Hanging

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@dataclass
class Tally:
    """What became of the cases of one kind."""

    kind: str
    limit: float = LIMIT
    tried: int = 0
    hangs: int = 0
    answers: Counter[str] = field(default_factory=Counter)
    failures: dict[str, tuple[int, str]] = field(default_factory=dict)
    failed: int = 0

    def note(self, case: Callable[[random.Random, Path], str], seed: int, folder: Path) -> None:
        """Try the case of a seed."""
        self.tried += 1
        try:
            with limited(self.limit), warnings.catch_warnings():
                warnings.simplefilter("error")
                self.answers[case(random.Random(f"{self.kind} {seed}"), folder)] += 1
        except (TwindiscError, ContactError) as error:
            self.answers[type(error).__name__] += 1
        except Hanging as error:
            self.hangs += 1
            self._keep("hangs", error, seed)
        except Exception as error:
            self.failed += 1
            self._keep(type(error).__name__, error, seed)

    def _keep(self, what: str, error: BaseException, seed: int) -> None:
        own = [f for f in traceback.extract_tb(error.__traceback__) if "twindisc_cli" in f.filename]
        place = f"{Path(own[-1].filename).name}:{own[-1].lineno}" if own else "?"
        self.failures.setdefault(f"{what} at {place}", (seed, " ".join(str(error).split())[:120]))

    def line(self) -> str:
        """One row of the table of reliability."""
        slow = f"{self.hangs:>4} slower than {self.limit:g} s"
        return f"{self.kind:<44} {self.tried:>7} tried {self.failed:>4} tracebacks {slow}"


# Mutations


def mutated_bytes(rng: random.Random, data: bytes) -> bytes:
    """A few bytes flipped, doubled, moved or cut."""
    text = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        if not text:
            return b""
        at, size = rng.randrange(len(text)), rng.choice((1, 1, 2, 7, 60))
        how = rng.randrange(6)
        if how == 0:
            text[at] ^= 1 << rng.randrange(8)
        elif how == 1:
            del text[at : at + size]
        elif how == 2:
            text[at:at] = text[at : at + size]
        elif how == 3:
            text[at:at] = bytes(rng.randrange(256) for _ in range(size))
        elif how == 4:
            text[at : at + 1] = rng.choice(
                (b"\n", b"\r", b"\0", b'"', b",", b";", b"[", b"]", b"=", b"\xff", b"#", b"{")
            )
        elif rng.random() < 0.1:
            del text[at:]
    return bytes(text)


def mutated_lines(rng: random.Random, text: str, atoms: list[str], number: str) -> str:
    """Numbers exchanged, lines dropped, doubled or swapped."""
    lines = text.split("\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(lines))
        how = rng.randrange(6)
        if how < 3:
            found = list(re.finditer(number, lines[at]))
            if found:
                place = rng.choice(found)
                lines[at] = lines[at][: place.start()] + rng.choice(atoms) + lines[at][place.end() :]
        elif how == 3 and len(lines) > 1:
            del lines[at]
        elif how == 4:
            lines.insert(at, rng.choice(lines))
        else:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
    return "\n".join(lines)


def mutated_values(rng: random.Random, text: str) -> str:
    """Values of a definition exchanged for others, keys dropped or moved."""
    document = tomllib.loads(text)
    for _ in range(rng.choice((1, 1, 2, 4))):
        table: Any = document
        while True:
            keys = list(table) if isinstance(table, dict) else list(range(len(table)))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(table[key], (dict, list)) and table[key] and rng.random() < 0.8:
                table = table[key]
                continue
            if rng.random() < 0.15:
                del table[key]
            elif rng.random() < 0.15 and isinstance(table, dict):
                table[rng.choice(ALL_KEYS)] = table[key]
            else:
                table[key] = copy.deepcopy(rng.choice(VALUES))
            break
    return tomli_w.dumps(document)


@cache
def definitions() -> tuple[tuple[str, Path], ...]:
    """Definitions that are valid, with the paths they lie at."""
    from definitions import VALID
    from test_line_contact import SUROS

    template = (ROOT / "twindisc_cli/definition/template.toml").read_text(encoding="utf-8")
    every = re.sub(r"^# (?=[\w.]+ = |\[)", "", template, flags=re.MULTILINE)
    made = {"x": VALID, "y": VALID + EFFECTS, "z": template, "w": every, "v": SUROS}
    return (*shipped(), *((text, ROOT / f"configs/{name}.toml") for name, text in made.items()))


@cache
def shipped() -> tuple[tuple[str, Path], ...]:
    """The definitions of the checkout, with their paths."""
    return tuple((path.read_text(encoding="utf-8"), path) for path in sorted((ROOT / "configs").glob("*.toml")))


EFFECTS = """
[effects.falling_friction]
ratio = 0.4
decay_s_m = 0.6
[effects.half_space_contact]
[effects.thermocouple_lag]
[laws.mu_over_time]
quantity = "mu"
covariate = "time_s"
at = [0.0, 100.0]
factor = [0.9, 1.1]
"""
VALID_THAT_WEARS = f"{definitions_of_tests.VALID}wear_coefficient = 7e-5\n".replace(
    "heat_capacity_J_K = 100.0", "heat_capacity_J_K = 100.0\nconvection_W_K = 2.0"
)
SCHEMA = ROOT / "twindisc_cli/definition/test.schema.json"
ALL_KEYS = sorted(set(re.findall(r'"(\w+)": \{', SCHEMA.read_text("utf-8"))))


# Cases: each takes its random numbers and a folder of its own, and gives the name of what came out


def broken_definition(rng: random.Random, folder: Path) -> str:
    """A definition with mistakes; one that is valid all the same is checked."""
    text, path = rng.choice(definitions())
    how = rng.random()
    if how < 0.25:
        text = mutated_bytes(rng, text.encode()).decode("utf-8", "surrogateescape").encode("utf-8", "ignore").decode()
    elif how < 0.6 or path.name == "w.toml":
        text = mutated_lines(rng, text, NUMBERS, r"-?\d[\w.+-]*|true|\"[^\"]*\"")
    else:
        text = mutated_values(rng, text)
    import_module("twindisc_cli.commands.check").run(load_text(text, path))
    return "valid"


@cache
def tables() -> tuple[tuple[bytes, str, str], ...]:
    """Tables with the key they are named by and the definition that names them."""
    from definitions import VALID

    named = [(key, name, text, path.parent) for text, path in shipped()
             for key, name in tomllib.loads(text).get("measured", {}).items() if key in KEYS]  # fmt: skip
    read = [((folder / name).read_bytes()[:20_000], key, text) for key, name, text, folder in named]
    return (*read, *((text.encode(), key, VALID) for key, text in MADE.items()))


KEYS = ("traction", "log", "profile", "temperature", "mass")
MADE = {
    "temperature": "time [s];temperature [degC]\n"
    + "".join(f"{t};{20 + t // 30},{t % 30}\n" for t in range(0, 400, 20)),
    "mass": "iteration,mass loss [mg],uncertainty [mg]\n1,0.5,0.1\n3,1.5,0.1\n5,2.5,0.1\n",
    "log": "Prüfstand 7\n\ntime [s],speed 1 [rpm],speed 2 [rpm],torque [N m],normal load [N]\n"
    + "".join(f"{t},{3000 + 7.5},{3000 - 7.5},{0.9 + 0.01 * (t % 3)},72\n" for t in range(0, 420, 4)),
}  # fmt: skip


def broken_table(rng: random.Random, folder: Path) -> str:
    """A measured table with mistakes; one that can be read all the same is checked."""
    data, key, definition = rng.choice(tables())
    (folder / "table").write_bytes(mutated_table(rng, data))
    document = tomllib.loads(definition)
    own = {"torque_disc": 2} if key == "log" else {}
    document["measured"] = {key: "table", **own}
    test = load_text(tomli_w.dumps(document), folder / "test.toml")
    import_module("twindisc_cli.commands.check").run(test)
    return "valid"


def mutated_table(rng: random.Random, data: bytes) -> bytes:
    """Bytes or cells of a table exchanged, and sometimes its coding."""
    how = rng.random()
    if how < 0.3:
        return mutated_bytes(rng, data)
    text = mutated_lines(rng, data.decode("utf-8", "replace"), CELLS, r"[^,;\t\n]+")
    coding = rng.choice(("utf-16", "utf-8-sig", "cp1252", "utf-32")) if how > 0.8 else "utf-8"
    return text.encode(coding, "replace")


@cache
def records() -> dict[str, tuple[bytes, ...]]:
    """Files as rigs write them: those that hold a traction, and those that go with one."""
    from test_found_steps import sweeps, timed_steps
    from test_import import vendor

    of = {kind: tuple(data for data, key, _ in tables() if (key in ("traction", "log")) == (kind == "traction"))
          for kind in ("traction", "beside")}  # fmt: skip
    return of | {"traction": (*of["traction"], vendor().encode("cp1252"), sweeps().encode(), timed_steps().encode())}


def broken_import(rng: random.Random, folder: Path) -> str:
    """A rig's own file with mistakes, sometimes with one beside it, to tables and a definition."""
    files = {"rig.txt": mutated_table(rng, rng.choice(records()["traction"]))}
    if rng.random() < 0.3:
        files["beside.csv"] = mutated_table(rng, rng.choice(records()["beside"]))
    for name, data in files.items():
        (folder / name).write_bytes(data)
    import_file.run([folder / name for name in files], folder / "mine", force=True)
    return "imported"


CAMPAIGN = """base = "base.toml"
[vary]
rig.normal_load_N = { from = 20.0, to = 200.0, count = 3, spacing = "log" }
"history.steps[2].creepage_percent" = [0.25, 0.5]
model.friction_coefficient = [0.4, 0.6]
[[variations]]
name = "soft"
material.hardness_HV = 300
"history.steps[*].iterations" = 2
"""


def broken_campaign(rng: random.Random, folder: Path) -> str:
    """A campaign file with mistakes; of one that is valid all the same two tests are read or computed."""
    from definitions import VALID

    (folder / "base.toml").write_text(VALID)
    few = [number for number in NUMBERS if number != "100000"]  # a valid campaign, but a long one
    pattern = r"-?\d[\w.+-]*|true|\"[^\"]*\"|[\w.\[\]*]+(?= =)"
    how = rng.random()
    text = mutated_lines(rng, CAMPAIGN, few, pattern) if how < 0.5 else mutated_values(rng, CAMPAIGN)
    data = mutated_bytes(rng, CAMPAIGN.encode()) if how > 0.8 else text.replace("100000", "7").encode()
    (folder / "map.toml").write_bytes(data)
    jobs = plan([str(folder / "map.toml")])
    order = Order("check", folder / "results", force=True)
    whole = rng.random() < 0.05
    rows = [Work(order)(job) if whole else prepare(order, job) for job in rng.sample(jobs, min(2, len(jobs)))]
    found = [row.row if isinstance(row, Task) else row for row in rows]
    for row in found:
        if row.exit_code == 1:
            raise AssertionError(row.error)
    result, extra = campaign._result("map-check", "check", found, [])
    if whole or any(row.failed for row in found):
        images(replace(result, figure=None), campaign._origin("map-check", found), extra)
    return "computed" if whole else "planned"


def broken_loop(rng: random.Random, folder: Path) -> str:
    """close-loop --quick, to its files, on a table with mistakes that can be read all the same."""
    data, key, definition = rng.choice(tables())
    document = tomllib.loads(definition)
    own = {"torque_disc": 2} if key == "log" else {}
    (folder / "table").write_bytes(mutated_table(rng, data))
    document["measured"] = {key: "table", **own}
    (folder / "test.toml").write_text(tomli_w.dumps(document))
    output = Output(folder / "results", quiet=True, force=True)
    code = _runner.run_close_loop([folder / "test.toml"], {"validate": False, "fitted": 1, "quick": True}, output)
    return f"exit code {code}"


def broken_result(rng: random.Random, folder: Path) -> str:
    """A result of which one file was damaged: it must not count."""
    stored = folder / "results/small"
    whole = _whole(folder)
    name = rng.choice(sorted(whole))
    damaged = mutated_bytes(rng, whole[name])
    (stored / name).write_bytes(damaged)
    found = recorded(stored / "check.h5")
    (stored / name).write_bytes(whole[name])
    if isinstance(found, Recorded) != (damaged == whole[name]):
        raise AssertionError(f"{name} was damaged and counts")
    return "refused" if isinstance(found, str) else "the same"


@cache
def _whole(folder: Path) -> dict[str, bytes]:
    from definitions import VALID

    (folder / "small.toml").write_text(VALID)
    _runner.run_command("check", folder / "small.toml", Output(folder / "results", quiet=True, force=True))
    return {path.name: path.read_bytes() for path in (folder / "results/small").iterdir()}


def extreme(rng: random.Random, folder: Path) -> str:
    """A test at the ends of what is valid, through one command, to its files."""
    document = _extreme_document(rng)
    return _possible(rng, rng.choice(COMMANDS), document, folder)


def _extreme_document(rng: random.Random) -> dict[str, Any]:
    def spread(low: float, high: float) -> float:
        return float(f"{low * (high / low) ** rng.random():.4g}")

    def disc() -> dict[str, Any]:
        radius = rng.choice((float("inf"), spread(0.5, 1e4), spread(5.0, 200.0), -spread(50.0, 1e4)))
        return {"rolling_radius_mm": spread(1.0, 1000.0), "transverse_radius_mm": radius}

    def straight() -> dict[str, Any]:
        return {"rolling_radius_mm": spread(1.0, 1000.0), "transverse_radius_mm": float("inf"),
                "width_mm": spread(0.1, 100.0)}  # fmt: skip

    def step() -> dict[str, Any]:
        own = {"creepage_percent": rng.choice((0.0, spread(1e-4, 150.0), -spread(1e-3, 100.0)))}
        own |= {"iterations": rng.choice((1, 1, 2, 5))}
        own |= {"mu": spread(1e-3, 3.0)} if rng.random() < 0.2 else {}
        own |= {"normal_load_N": spread(1.0, 1e5)} if rng.random() < 0.1 else {}
        own |= {"rolling_speed_m_s": spread(1e-2, 100.0)} if rng.random() < 0.1 else {}
        own |= {"yaw_mrad": spread(1e-2, 50.0)} if rng.random() < 0.1 else {}
        return {"pause_s": spread(1.0, 1e5)} if rng.random() < 0.1 else own

    document: dict[str, Any] = {"schema": 1, "test": {"name": "extreme"}}
    document["rig"] = {"normal_load_N": spread(1e-2, 1e6), "rolling_speed_m_s": spread(1e-3, 200.0)}
    if rng.random() < 0.25:
        document["rig"] |= {"disc1": straight(), "disc2": straight()}
    else:
        document["rig"] |= {"disc1": disc(), "disc2": {**disc(), "transverse_radius_mm": spread(0.5, 1e4)}}
    document["material"] = {"youngs_modulus_GPa": spread(1e-3, 1200.0), "poisson_ratio": round(0.49 * rng.random(), 3)}
    document["material"] |= {"hardness_HV": spread(1.0, 5000.0), "density_kg_m3": spread(500.0, 2e4)}
    document["history"] = {"revolutions_per_iteration": rng.choice((1, 100, 4200, 10**6))}
    document["history"]["steps"] = [step() for _ in range(rng.choice((1, 2, 4)))]
    document["model"] = {"friction_coefficient": spread(1e-3, 3.0), "wear_coefficient": spread(1e-12, 1e-2)}
    document["model"]["contact"] = rng.choice(("hertz", "hertz", "half_space"))
    document["model"]["traction"] = rng.choice(("fastsim", "fastsim", "exact"))
    if rng.random() < 0.7:
        document["thermal"] = {"environment_temperature_C": rng.uniform(-196.0, 500.0)}
        document["thermal"] |= {"heat_capacity_J_K": spread(1e-2, 1e5), "convection_W_K": spread(1e-4, 1e4)}
    return document


def impossible(rng: random.Random, folder: Path) -> str:
    """Laws and effects whose parameters are drawn far beyond what can be: refused, or numbers that can be."""
    document = tomllib.loads(VALID_THAT_WEARS)
    for name in ("one", "other")[: rng.choice((1, 1, 2))]:
        quantity, covariate = rng.choice(sorted(QUANTITIES)), rng.choice(sorted(COVARIATES))
        kind = QUANTITIES[quantity].kind
        law: dict[str, Any] = {"quantity": quantity, "covariate": covariate}
        if rng.random() < 0.7:
            law |= {"at": [0.0, _size(rng)], kind: [_signed(rng), _signed(rng)]}
        else:
            size = QUANTITIES[quantity].size_key
            law |= {"shape": "exponential", "parameters": {size: _signed(rng)}}
            law["parameters"][COVARIATES[covariate].key("scale")] = _size(rng)
        document.setdefault("laws", {})[name] = law
    if rng.random() < 0.5:
        document["effects"] = _effects(rng, 1)
    return _possible(rng, rng.choice(FORWARD), document, folder)


def combined(rng: random.Random, folder: Path) -> str:
    """Pauses, yaw, loads and speeds by step, with up to four effects at or inside their bounds."""
    document = tomllib.loads(VALID_THAT_WEARS)
    steps: list[dict[str, Any]] = [{"creepage_percent": rng.choice((0.5, 2.0))}]
    for _ in range(rng.choice((1, 2, 5))):
        own: dict[str, Any] = {"creepage_percent": rng.choice((0.0, 0.01, 0.5, 3.0, -1.0, 100.0))}
        own |= {"yaw_mrad": rng.choice((0.0, 1.0, -30.0))} if rng.random() < 0.5 else {}
        own |= {"normal_load_N": rng.choice((1.0, 500.0))} if rng.random() < 0.3 else {}
        own |= {"rolling_speed_m_s": rng.choice((0.01, 50.0))} if rng.random() < 0.3 else {}
        steps.append({"pause_s": rng.choice((1e-3, 60.0, 1e6))} if rng.random() < 0.4 else own)
    rng.shuffle(steps)
    document["history"]["steps"] = steps
    document["effects"] = _effects(rng, rng.choice((1, 2, 4)))
    return _possible(rng, rng.choice(FORWARD), document, folder)


def _size(rng: random.Random) -> float:
    return float(10.0 ** rng.uniform(-6.0, 6.0))


def _signed(rng: random.Random) -> float:
    return rng.choice((0.0, 1.0, -2.0, 1e6, -_size(rng), _size(rng)))


def _effects(rng: random.Random, most: int) -> dict[str, dict[str, float]]:
    """Effects of the catalogue with parameters at their bounds, where they are off, or between."""
    chosen = rng.sample(sorted(catalogue()), most)
    return {
        name: {p.name: rng.choice((p.lower, p.upper, p.start, rng.uniform(p.lower, p.upper)))
               for p in catalogue()[name].params}
        for name in chosen
    }  # fmt: skip


FORWARD = ("friction-chart", "simulate-wear", "thermal", "contact", "check")
BETWEEN = {"apparent_friction": (-3.0, 3.0), "volume": (0.0, 1.0), "p0": (0.0, 1e12)}
BETWEEN |= {"height": (-1.0, 1e-8), "disc1_height": (-1.0, 1e-8)}  # between wanders, 1e-4 of the depth beyond
"""What an array can hold, by its name, in SI units."""


def _possible(rng: random.Random, command: str, document: dict[str, Any], folder: Path) -> str:
    """Run a command on a definition; AssertionError where a number of its outcome cannot be.

    Its figures are made; one case in eight lays them out and writes them, which takes ten times as long as the rest.
    """
    test = load_text(tomli_w.dumps(document), folder / "drawn.toml")
    if rng.random() < 0.125:
        result, _ = _runner.quiet(command, test, folder)
    else:
        refuse_impossible(test.experiment)
        result = import_module(f"twindisc_cli.commands.{command.replace('-', '_')}").run(test)
        images(replace(result, figure=None, figures={}), _runner.single_origin(command, test), {})
        for draw in [*result.figures.values(), *([result.figure] if result.figure else [])]:
            draw()
    given = document["model"]["friction_coefficient"], *(step.get("mu", 0.0) for step in document["history"]["steps"])
    between = BETWEEN | {"mu": (0.0, max(2.0, *given))}
    for array in result.dataset.arrays:
        values = array.values if array.values.dtype.kind == "f" else []
        low, high = between.get(array.name, (-float("inf"), float("inf")))
        if any(not low <= value <= high for value in np.ravel(values) if value == value):
            raise AssertionError(f"{array.name} beyond {low:g} ... {high:g} with exit code {result.exit_code}")
    return f"exit code {result.exit_code}"


def odd_files(rng: random.Random, folder: Path) -> str:
    """Folders, pipes, devices, links and nothing at all in the place of files, through the command line."""
    from definitions import VALID

    (folder / "small.toml").write_text(f'{VALID}\n[measured]\ntraction = "odd"\n')
    (folder / "map.toml").write_text('base = "odd"\n[vary]\nrig.normal_load_N = [1.0, 2.0]\n')
    odd = folder / "odd"
    odd.unlink(missing_ok=True) if odd.is_symlink() or not odd.is_dir() else odd.rmdir()
    kind = rng.choice(("folder", "pipe", "device", "loop", "empty", "nothing"))
    if kind == "folder":
        odd.mkdir()
    elif kind == "pipe":
        os.mkfifo(odd)
    elif kind in ("device", "loop"):
        odd.symlink_to({"device": rng.choice(("/dev/null", "/dev/zero", "/dev/tty")), "loop": "odd"}[kind])
    elif kind == "empty":
        odd.touch()
    own, given = rng.choice(("small.toml", "map.toml", "odd", "od*")), rng.choice(sorted(COMMANDS))
    call = rng.choice((
        [given, own], ["campaign", "check", own, "--workers", "1"], ["close-loop", own, "--quick"],
        ["import", "odd", "-o", "mine", "--force"], ["effects", "--from", "odd"], ["effects", "--test", "odd"],
        ["check", own, "--effects", "odd"], ["check", own, "--depfile", "odd"], ["check", own, "-o", "odd"],
    ))  # fmt: skip
    command = [*call, *(["--force"] if call[0] in COMMANDS else [])]
    with contextlib.chdir(folder), redirect_stderr(io.StringIO()) as said, redirect_stdout(io.StringIO()):
        try:
            main_of_program(command)
        except SystemExit as left:
            if left.code == 1 or "a bug in twindisc" in said.getvalue():
                raise AssertionError(f"{kind} in {command}: {said.getvalue()[:200]}") from None
            return f"exit code {left.code}"
    return "no exit"


CHECK = ("check", "small.toml", "--format", "png,svg")
PROGRAM = (sys.executable, "-m", "twindisc_cli", *CHECK)


def killed(rng: random.Random, folder: Path) -> str:
    """Runs of two definitions in turn into one folder, the second one killed at some moment: no mixture counts."""
    from definitions import VALID

    number = rng.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
    duration, definition = _duration(folder), folder / "small.toml"
    definition.write_text(VALID)
    quiet = redirect_stderr(io.StringIO()), redirect_stdout(io.StringIO())
    with contextlib.chdir(folder), quiet[0], quiet[1], contextlib.suppress(SystemExit):
        main_of_program([*CHECK, "-o", "out", "--force"])
    definition.write_text(VALID.replace("hardness_HV = 700", f"hardness_HV = {rng.randrange(100, 600)}"))
    command = [*PROGRAM, "-o", "out", "--force"]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    time.sleep(rng.uniform(0.25, duration))
    process.send_signal(number)
    told = process.communicate(timeout=60)[1]
    if "Traceback" in told and "twindisc_cli/" in told:
        raise AssertionError(f"{number.name}: {told[-200:]}")
    found = recorded(folder / "out/small/check.h5")
    if isinstance(found, str) and found != "is not there":
        raise AssertionError(f"{number.name} left a mixture: {found}")
    return f"{number.name}: {'none' if isinstance(found, str) else 'whole'}"


@cache
def _duration(folder: Path) -> float:
    """Seconds that a run takes here."""
    from definitions import VALID

    (folder / "small.toml").write_text(VALID)
    began = time.perf_counter()
    subprocess.run([*PROGRAM, "-o", "timed"], cwd=folder, capture_output=True, check=False)
    return time.perf_counter() - began


Case = Callable[[random.Random, Path], str]
CASES: dict[str, tuple[str, Case, int, float]] = {
    "definitions": ("mutated definitions", broken_definition, 30_000, LIMIT),
    "tables": ("mutated tables", broken_table, 24_000, LIMIT),
    "imports": ("import of mutated files", broken_import, 15_000, LIMIT),
    "campaigns": ("mutated campaigns", broken_campaign, 10_000, LIMIT),
    "results": ("damaged results, refused", broken_result, 20_000, LIMIT),
    "physics": ("extreme but valid tests, all commands", extreme, 700, LIMIT),
    "impossible": ("laws and parameters that cannot be", impossible, 2_000, LIMIT),
    "combined": ("pauses, yaw and effects together", combined, 2_000, LIMIT),
    "odd": ("folders, pipes and devices as files", odd_files, 3_000, LIMIT),
    "loops": ("close-loop --quick on mutated tables", broken_loop, 300, 6.0 * LIMIT),
    "kills": ("runs killed, none leaving a mixture", killed, 100, 12.0 * LIMIT),
}
"""What each kind is called, its case, how many are tried, and the seconds that a case may take."""


def run(kind: str, seeds: range, limit: float | None = None) -> Tally:
    """Try the cases of one kind, each within so many seconds; the working folder is one of its own.

    What they add to the catalogues of effects and channels is forgotten afterwards.
    """
    name, case, _, usual = CASES[kind]
    tally = Tally(name, limit or usual)
    os.environ["MPLBACKEND"] = "agg"
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            tally.note(case, seed, Path(folder))
    effects.forget_folders()
    channels.forget_folders()
    return tally


def main() -> None:
    """Run the cases that are asked for and print the table, and what failed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=0, help="where the seeds begin")
    parser.add_argument("--only", nargs=2, metavar=("KIND", "SEED"), help="one case again, with its traceback")
    for kind, (_, _, usual, _) in CASES.items():
        parser.add_argument(f"--{kind}", type=int, default=usual, metavar="N")
    given = parser.parse_args()
    if given.only:
        kind, seed = given.only
        name, case, _, _ = CASES[kind]
        with tempfile.TemporaryDirectory() as folder:
            print(case(random.Random(f"{name} {seed}"), Path(folder)))
        return
    tallies = []
    for kind in CASES:
        tallies.append(run(kind, range(given.seed, given.seed + getattr(given, kind))))
        print(tallies[-1].line(), flush=True)
        print(f"    {dict(tallies[-1].answers.most_common())}", flush=True)
        for what, (seed, message) in tallies[-1].failures.items():
            print(f"    --only {kind} {seed}: {what}: {message}", flush=True)
    sys.exit(any(tally.failed or tally.hangs for tally in tallies))


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    main()
