"""Runs the closed loop on tests and counts how often it was right.

The loop is run as a user runs it, `twindisc close-loop test.toml --validate other.toml --json`, in a folder without
the truth.
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

from .judging import Row, judge
from .making import APART, Case, make_test

NEGATIVE = 5  # exit code of a negative finding
_TIMEOUT = 900.0
_BULKY = ("next_experiment", "revised", "explanations")  # parts of an answer that are not kept


def run_loop(folder: Path) -> tuple[Row, float]:
    """The JSON answer to folder/test.toml, and the seconds it took; {"failed": ...} where there is none."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "twindisc_cli", "close-loop", "test.toml", "--json", "-o", out]
        command += ["--validate", "other.toml"] if (folder / "other.toml").exists() else []
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
    group = "unknown" if isinstance(hidden, str) else ("null", "single", "pairs")[min(len(hidden), 2)]
    return _row(truth.get("group") or group, folder.name, truth, answer, seconds)


def _row(group: str, name: str, truth: Row, answer: Row, seconds: float) -> Row:
    kept = {key: value for key, value in answer.items() if key not in _BULKY}
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
    """Whether one answer is right as a whole: nothing found where nothing is, the effects, or the law."""
    flags = row["judged"]
    if flags["failed"]:
        return False
    if row["group"] == "null":
        return not flags["alarm"]
    if row["group"] == "unknown":
        return bool(flags["pair"] and not flags["false"])
    if row["group"] == "near":
        return bool(flags["mechanism"] and not flags["false"])
    return all(flags[f"found_{i}"] for i in range(len(row["truth"]["truth"]))) and not flags["false"]


Line = tuple[str, int, int, str]  # what, successes, of, target


def table(rows: Sequence[Row]) -> list[Line]:
    """The lines of the score: what was counted, how often, of how many, and the target (must / aim)."""
    null = _flags(rows, "null")
    single = [r["judged"] for r in rows if r["group"] == "single" and _is_sized(r)]
    near = [r["judged"] for r in rows if r["group"] == "near" and _is_sized(r)]
    pairs = [r["judged"] for r in rows if r["group"] == "pairs" and _is_sized(r)]
    sized = [r for r in rows if r["group"] == "unknown" and _is_sized(r)]
    unknown = [r["judged"] for r in sized]
    at_12 = [r["judged"] for r in sized if r["truth"]["target_size"] == 12.0]
    both = [f["found_0"] and f["found_1"] and not f["false"] for f in pairs]
    return [
        _line("nothing missing: alarm", [f["alarm"] for f in null], "<= 4 / 2 %"),
        _line("    a law learnt", [f["law"] for f in null], "<= 2 / 0.5 %"),
        _line("one effect at 12 thresholds: in a set of at most three", [f["found_0"] for f in single], ">= 95 / 97 %"),
        _line("    named first", [f["first_0"] for f in single], ">= 90 / 94 %"),
        _line("    something detected", [f["alarm"] for f in single], ""),
        _line("    a false effect or law beside it or instead", [f["false"] > 0 for f in single], ""),
        _line("by another formula: mechanism right, name or law", [f["mechanism"] for f in near], ">= 80 / 92 %"),
        _line("    the name in a set of at most three", [f["found_0"] for f in near], ""),
        _line("    a false effect or law beside it or instead", [f["false"] > 0 for f in near], ""),
        _line("in no catalogue, 12 thresholds: stage right", [f["stage"] for f in at_12], ">= 80 / 90 %"),
        _line("    quantity and covariate in the set", [f["pair"] for f in at_12], ">= 90 / 95 %"),
        _line("in no catalogue, all sizes: stage right", [f["stage"] for f in unknown], ""),
        _line("    quantity and covariate in the set", [f["pair"] for f in unknown], ""),
        _line("    a wrong name without the law in its set", [f["wrong_name"] for f in unknown], "<= 8 / 3 %"),
        _line("    left unexplained", [f["left"] for f in unknown], ""),
        _line("two effects: both, nothing false", both, ">= 80 / 90 %"),
        *_errors(rows),
        _line("no answer", [r["judged"]["failed"] for r in rows], "0"),
    ]


def _errors(rows: Sequence[Row]) -> list[Line]:
    """Held-out errors where something was missing, and errors on the history that was never fitted."""
    missing = [r for r in rows if r["group"] != "null" and _is_sized(r)]
    floor = [r["judged"]["at_floor"] for r in missing if r["judged"]["at_floor"] is not None]
    elsewhere = [r for r in missing if "elsewhere" in r["judged"]]
    separable = [r["judged"] for r in elsewhere if r["truth"]["separable"]]
    other = [r["judged"] for r in elsewhere if not r["truth"]["separable"]]
    unwarned = [r["judged"] for r in rows if "elsewhere" in r["judged"]]
    return [
        _line("something missing: held-out error <= 1.15 x noise", floor, ">= 80 / 90 %"),
        _line(
            "another history, separable: error <= 1.25 x noise", [f["transferred"] for f in separable], ">= 80 / 92 %"
        ),
        _line("    not separable: error <= 1.25 x noise", [f["transferred"] for f in other], ""),
        _line("    worse than the base without a warning", [f["worse"] and not f["warned"] for f in unwarned], "0"),
    ]


def _is_sized(row: Row) -> bool:
    """Whether the effects could be made as large as asked, told apart by size, and the loop answered."""
    sizes, target = row["truth"].get("sizes", []), row["truth"].get("target_size", 0.0)
    large = all(size >= 0.85 * target for size in sizes)
    apart = all(size >= 0.85 * APART for size in row["truth"].get("sizes_apart", []))
    return not row["judged"]["failed"] and large and apart


def _flags(rows: Sequence[Row], group: str) -> list[Row]:
    return [row["judged"] for row in rows if row["group"] == group and not row["judged"]["failed"]]


def _line(what: str, flags: Sequence[object], target: str) -> Line:
    return what, sum(bool(f) for f in flags), len(flags), target
