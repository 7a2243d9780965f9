"""Runs the closed loop on tests and counts how often it was right.

The loop is run as a user runs it, `twindisc close-loop test.toml --json`, in a folder without the truth.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from .making import Case, make_test

Row = dict[str, Any]
NEGATIVE = 5  # exit code of a negative finding
_SLACK = 1.15  # of the held-out error over the noise floor
_FIRM = 8.0  # thresholds beyond what the tolerances of the creepages can imitate
_TIMEOUT = 900.0


def run_loop(folder: Path) -> tuple[Row, float]:
    """The JSON answer to folder/test.toml, and the seconds it took; {"failed": ...} where there is none."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "twindisc_cli", "close-loop", "test.toml", "--json", "-o", out]
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        environment["PYTHONPATH"] = str(Path(__file__).parents[2])
        start = perf_counter()
        try:
            done = subprocess.run(
                command, cwd=folder, env=environment, capture_output=True, text=True, timeout=_TIMEOUT, check=False
            )
        except subprocess.TimeoutExpired:
            return {"failed": f"no answer within {_TIMEOUT:.0f} s"}, _TIMEOUT
        seconds = perf_counter() - start
    if done.returncode not in (0, NEGATIVE):
        return {"failed": f"exit code {done.returncode}: {done.stderr[-2000:]}"}, seconds
    return json.loads(done.stdout), seconds


# ---------------------------------------------------------------------------------------------- judging


def judge(truth: Row, answer: Row) -> Row:
    """What was right in one answer; the keys depend on what was hidden."""
    if "failed" in answer:
        return {"failed": True}
    tolerated = set(truth.get("tolerated", []))
    named = [e for e in answer["effects"] if e["effect"] not in tolerated or e["effect"] in truth["truth"]]
    leftover = answer["unexplained"]
    flags: Row = {"failed": False, "alarm": bool(named or leftover), "named": bool(named)}
    if isinstance(truth["truth"], str):
        return flags | _judge_unknown(truth, named, leftover)
    sets = [{e["effect"], *e.get("alternatives", [])} for e in named]
    for i, name in enumerate(truth["truth"]):
        flags[f"found_{i}"] = any(name in s and len(s) <= 3 for s in sets)
        flags[f"first_{i}"] = any(e["effect"] == name for e in named)
        flags[f"in_any_set_{i}"] = any(name in s for s in sets)
    flags["false"] = sum(not s & {*truth["truth"], *truth.get("alternatives", [])} for s in sets)
    flags["at_floor"] = _at_floor(truth, answer)
    return flags


def _judge_unknown(truth: Row, named: Sequence[Row], leftover: Sequence[Row]) -> Row:
    _, channel, covariate = truth["truth"].split(":")
    covariates = truth.get("covariates") or [covariate]
    right = [u["channel"] == channel and u["covariate"] in covariates for u in leftover]
    return {
        "reported": any(right[:2]),
        "reported_channel": any(u["channel"] == channel for u in leftover),
        "first": right[:1] == [True],
        "falsely_explained": bool(named) and not leftover,
        "also_named": bool(named) and bool(leftover),
    }


def _at_floor(truth: Row, answer: Row) -> bool | None:
    """Whether the held-out error after is within 15 % of the noise in every channel; None where it is not given."""
    verdicts = []
    for channel, error in answer["error"].items():
        after = error.get("held_out_after")
        if after is None:
            continue
        floor = max(error["noise"], _held_out_noise(truth, answer, channel))
        verdicts.append(after <= _SLACK * floor)
    return all(verdicts) if verdicts else None


def _held_out_noise(truth: Row, answer: Row, channel: str) -> float:
    """The true noise (1, um, K) of what the loop held out.

    Steps, and the last iteration of every second other one; in a profile the third of every five bands.
    """
    noise = truth.get("noise", {}).get(channel, 0.0)
    if not isinstance(noise, list):
        return float(noise)
    if channel == "profile":
        return _root_mean(noise, range(2, len(noise), 5))
    steps = {step for held in answer.get("hold_out_steps", {}).values() for step in held}
    ends = np.cumsum(truth["iterations"])
    last = [step for step in range(1, len(ends) + 1) if step not in steps][1::2]
    held = [
        i
        for step, (end, count) in enumerate(zip(ends, truth["iterations"], strict=True), start=1)
        for i in range(end - (count if step in steps else 1 if step in last else 0), end)
    ]
    return _root_mean(noise, [i for i in held if i < len(noise)])


def _root_mean(noise: Sequence[Sequence[float]], parts: Iterable[int]) -> float:
    """Root mean square over some parts of samples and sums of squares."""
    count, total = np.array(noise)[list(parts)].sum(axis=0)
    return float(np.sqrt(total / max(count, 1)))


# ---------------------------------------------------------------------------------------------- running


def score_case(case: Case, keep: Path | None = None) -> Row:
    """Make one test, run the loop on it, judge; `keep` is a folder for the test and its truth."""
    with tempfile.TemporaryDirectory() as temporary:
        start = perf_counter()
        folder, truth_file = _make(case, keep or Path(temporary))
        making = perf_counter() - start
        answer, seconds = run_loop(folder)
        truth = json.loads(truth_file.read_text())
    return _row(case.group, folder.name, truth, answer, seconds) | {"seconds_making": making}


def _make(case: Case, home: Path) -> tuple[Path, Path]:
    """Make a test and its truth, in folders apart."""
    name = f"{case.group}_{case.seed}"
    folder, truth_file = home / "tests" / name, home / "truth" / f"{name}.json"
    make_test(case, folder, truth_file)
    return folder, truth_file


def make(cases: Iterable[Case], home: Path, processes: int = 2) -> None:
    """Make the tests of the cases in home/tests, their truths in home/truth."""
    with ProcessPoolExecutor(processes) as pool:
        for future in [pool.submit(_make, case, home) for case in cases]:
            future.result()


def tests_with_truth(folder: Path) -> list[tuple[Path, Path]]:
    """Tests and their truth: folder/tests/NAME with folder/truth/NAME.json, or folder/NAME with its truth.json."""
    if (folder / "tests").is_dir():
        return [(folder / "tests" / path.stem, path) for path in sorted((folder / "truth").glob("*.json"))]
    return [(path.parent, path) for path in sorted(folder.glob("*/truth.json"))]


def score_folder(folder: Path, truth_file: Path) -> Row:
    """Run the loop on a copy of the test in `folder`, from which the truth is left out; judge."""
    truth = json.loads(truth_file.read_text())
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary) / folder.name
        shutil.copytree(folder, home, ignore=shutil.ignore_patterns("truth*"), copy_function=shutil.copyfile)
        answer, seconds = run_loop(home)
    hidden = truth["truth"]
    group = "unknown" if isinstance(hidden, str) else ("null", "single", "two")[min(len(hidden), 2)]
    return _row(truth.get("group") or group, folder.name, truth, answer, seconds)


def _row(group: str, name: str, truth: Row, answer: Row, seconds: float) -> Row:
    kept = {
        k: answer[k]
        for k in ("verdict", "effects", "unexplained", "error", "base", "hold_out_steps", "failed")
        if k in answer
    }
    return {
        "group": group, "name": name, "truth": truth, "answer": kept, "seconds": seconds,
        "judged": judge(truth, answer),
    }  # fmt: skip


def score(cases: Iterable[Case], *, keep: Path | None = None, processes: int = 2) -> Iterator[Row]:
    """Make and score the cases, `processes` at once, in the order in which they finish."""
    with ProcessPoolExecutor(processes) as pool:
        for future in as_completed([pool.submit(score_case, case, keep) for case in cases]):
            yield future.result()


def score_existing(folder: Path, *, processes: int = 2) -> Iterator[Row]:
    """Score the tests that lie in a folder."""
    with ProcessPoolExecutor(processes) as pool:
        for future in as_completed([pool.submit(score_folder, *pair) for pair in tests_with_truth(folder)]):
            yield future.result()


# ---------------------------------------------------------------------------------------------- counting


def is_right(row: Row) -> bool:
    """Whether one answer is right as a whole: nothing found where nothing is, the effects, or the covariate."""
    flags, count = row["judged"], len(row["truth"]["truth"])
    if flags["failed"]:
        return False
    if row["group"] == "null":
        return not flags["alarm"]
    if row["group"] == "unknown":
        return bool(flags["reported"] and not flags["falsely_explained"])
    return all(flags[f"found_{i}"] for i in range(count)) and not flags["false"]


Line = tuple[str, int, int, str]  # what, successes, of, target


def table(rows: Sequence[Row]) -> list[Line]:
    """The lines of the score: what was counted, how often, of how many, and the target."""
    null = _flags(rows, "null")
    sized = [r for r in rows if r["group"] == "single" and _is_sized(r)]
    single = [r["judged"] for r in sized]
    firm = [r["judged"] for r in sized if min(r["truth"].get("sizes_beyond_tolerances", [np.inf])) >= _FIRM]
    two, unknown = _flags(rows, "two"), _flags(rows, "unknown")
    both = [f.get("found_0", False) and f.get("found_1", False) and not f["false"] for f in two]
    floor = [f["at_floor"] for f in single if f.get("at_floor") is not None]
    return [
        _line("nothing missing: false alarm", [f["alarm"] for f in null], "<= 5 %"),
        _line("    an effect named", [f["named"] for f in null], ""),
        _line("one effect at 12 thresholds: in a set of at most three", [f["found_0"] for f in single], ">= 92 %"),
        _line("    named first", [f["first_0"] for f in single], ">= 78 %"),
        _line("    something detected", [f["alarm"] for f in single], ""),
        _line(f"    those {_FIRM:g} beyond the input tolerances: in such a set", [f["found_0"] for f in firm], ""),
        _line("        named first", [f["first_0"] for f in firm], ""),
        _line("    a false effect beside it or instead", [f["false"] > 0 for f in single], ""),
        _line("    held-out error within 15 % of the noise floor", floor, ">= 90 %"),
        _line("two effects in different channels: both, nothing false", both, ">= 75 %"),
        _line("    both, in sets of any size", [f["in_any_set_0"] and f["in_any_set_1"] for f in two], ""),
        _line("in no catalogue: unexplained, covariate in the first two", [f["reported"] for f in unknown], ">= 80 %"),
        _line("    unexplained in the right channel", [f["reported_channel"] for f in unknown], ""),
        _line("    falsely explained", [f["falsely_explained"] for f in unknown], "<= 12 %"),
        _line("    a false effect named beside the leftover", [f["also_named"] for f in unknown], ""),
        _line("no answer", [r["judged"]["failed"] for r in rows], "0"),
    ]


def _is_sized(row: Row) -> bool:
    """Whether the effect could be made as large as asked, and the loop answered."""
    sizes, target = row["truth"].get("sizes", []), row["truth"].get("target_size", 0.0)
    return not row["judged"]["failed"] and all(size >= 0.85 * target for size in sizes)


def _flags(rows: Sequence[Row], group: str) -> list[Row]:
    return [row["judged"] for row in rows if row["group"] == group and not row["judged"]["failed"]]


def _line(what: str, flags: Sequence[object], target: str) -> Line:
    return what, sum(bool(f) for f in flags), len(flags), target
