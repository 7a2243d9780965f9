"""Runs the closed loop on tests and counts how often it was right.

The loop is run as a user runs it, `twindisc close-loop test.toml --validate other.toml --json`, in a folder without
the truth.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from .judging import Row, judge
from .making import APART, Case, make_test

NEGATIVE = 5  # exit code of a negative finding
_TIMEOUT = 900.0
_BULKY = ("next_experiment", "revised", "explanations")  # parts of an answer that are not kept


def run_loop(folder: Path) -> tuple[Row, float]:
    """The JSON answer to folder/test.toml, and its processor time [s]; {"failed": ...} where there is none."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "twindisc_cli", "close-loop", "test.toml", "--json", "-o", out]
        command += ["--validate", "other.toml"] if (folder / "other.toml").exists() else []
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        environment["PYTHONPATH"] = str(Path(__file__).parents[2])
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # with it each start compiles every module again, for 1.2 s
        start = _spent()
        try:
            done = subprocess.run(
                command, cwd=folder, env=environment, capture_output=True, text=True, timeout=_TIMEOUT, check=False
            )
        except subprocess.TimeoutExpired:
            return {"failed": f"no answer within {_TIMEOUT:.0f} s"}, _TIMEOUT
        seconds = _spent() - start
    if done.returncode not in (0, NEGATIVE):
        return {"failed": f"exit code {done.returncode}: {done.stderr[-2000:]}"}, seconds
    return json.loads(done.stdout), seconds


def _spent() -> float:
    """Processor time of the commands that have ended in this process [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


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


class Line(NamedTuple):
    """What was counted, how often, of how many, the target (must / aim); a `value` where it is no share."""

    what: str
    count: int
    of: int
    target: str
    value: float | None = None


def table(rows: Sequence[Row]) -> list[Line]:
    """The lines of the score."""
    missing = [r for r in rows if r["group"] != "null" and is_sized(r)]
    return [
        *_names(rows),
        *_laws(rows),
        *_errors(rows, missing),
        *_probabilities(rows),
        _line("no answer", [r["judged"]["failed"] for r in rows], "0"),
    ]


def _names(rows: Sequence[Row]) -> list[Line]:
    """Nothing missing, and what the catalogue holds."""
    null, single, pairs, near = (_flags(rows, group) for group in ("null", "single", "pairs", "near"))
    both = [f["found_0"] and f["found_1"] and not f["false"] for f in pairs]
    return [
        _line("nothing missing: alarm", [f["alarm"] for f in null], "<= 4 / 2 %"),
        _line("    a law learnt", [f["law"] for f in null], "<= 2 / 0.5 %"),
        _line("one effect at 12 thresholds: in a set of at most three", [f["found_0"] for f in single], ">= 95 / 97 %"),
        _line("    named first, not displaced by a law", [f["first_0"] for f in single], ">= 90 / 94 %"),
        _line("    something detected", [f["alarm"] for f in single], ""),
        _line("    a false effect or law beside it or instead", [f["false"] > 0 for f in single], ""),
        _line("by another formula: mechanism right, name or law", [f["mechanism"] for f in near], ">= 80 / 92 %"),
        _line("    the name in a set of at most three", [f["found_0"] for f in near], ""),
        _line("    a false effect or law beside it or instead", [f["false"] > 0 for f in near], ""),
        _line("two effects, in one channel too: both, nothing false", both, ">= 80 / 90 %"),
        _line("    both, in sets of any size", [f["in_any_set_0"] and f["in_any_set_1"] for f in pairs], ""),
    ]


def _laws(rows: Sequence[Row]) -> list[Line]:
    """What is in no catalogue."""
    at_12, large = _flags(rows, "unknown", 12.0), _flags(rows, "unknown", 25.0)
    return [
        _line("in no catalogue, 12 thresholds: stage right", [f["stage"] for f in at_12], ">= 80 / 90 %"),
        _line("    its quantity, or one that shows the same, as a law", [f["quantity"] for f in at_12], ""),
        _line("    quantity and covariate in the set", [f["pair"] for f in at_12], ">= 90 / 95 %"),
        _line("    25 thresholds: stage right", [f["stage"] for f in large], ""),
        _line("        quantity and covariate in the set", [f["pair"] for f in large], ""),
        _line("    a wrong name without the law in its set", [f["wrong_name"] for f in at_12 + large], "<= 8 / 3 %"),
        _line("    left unexplained", [f["left"] for f in at_12 + large], ""),
    ]


def _errors(rows: Sequence[Row], missing: Sequence[Row]) -> list[Line]:
    """Held-out errors where something was missing, and errors on the history that was never fitted."""
    floor = [r["judged"]["at_floor"] for r in missing if r["judged"]["at_floor"] is not None]
    predicted = [r for r in missing if r["judged"].get("elsewhere")]
    separable, other = (
        [r["judged"] for r in predicted if r["truth"].get("separable") is told] for told in (True, False)
    )
    worse = [r["judged"]["worse"] and not r["judged"]["warned"] for r in rows if r["judged"].get("elsewhere")]
    return [
        _line("something missing: held-out error <= 1.15 x noise", floor, ">= 80 / 90 %"),
        _line("another history, separable: error <= 1.25 x noise", _transferred(separable), ">= 80 / 92 %"),
        _line("    not separable: error <= 1.25 x noise", _transferred(other), ""),
        _line("    worse than the base without a warning", worse, "0"),
    ]


def _transferred(flags: Sequence[Row]) -> list[bool]:
    return [f["transferred"] for f in flags]


def _probabilities(rows: Sequence[Row]) -> list[Line]:
    """Whether what is told to be probable comes true as often, and whether intervals hold the truth."""
    told = told_of(rows)
    covered = [c for r in rows if r["group"] in ("null", "single", "near") for c in r["judged"].get("covered", [])]
    return [
        Line("probabilities: calibration error", len(told), len(told), "<= 0.07 / 0.04", calibration_error(told)),
        _line("90 % intervals of mu, K and h S hold the truth", covered, "80-95 / 87-93 %"),
    ]


def told_of(rows: Sequence[Row]) -> list[tuple[float, bool]]:
    """Every probability told, and whether what it was told of is right."""
    return [(float(p), bool(right)) for row in rows for p, right in row["judged"].get("told", [])]


def reliability(told: Sequence[tuple[float, bool]]) -> list[tuple[float, float, int]]:
    """Mean probability told, share that was right and count, in bins of a fifth."""
    bins: dict[int, list[tuple[float, bool]]] = {}
    for probability, right in told:
        bins.setdefault(min(int(5.0 * probability), 4), []).append((probability, right))
    return [
        (float(np.mean([p for p, _ in part])), float(np.mean([right for _, right in part])), len(part))
        for _, part in sorted(bins.items())
    ]


def calibration_error(told: Sequence[tuple[float, bool]]) -> float:
    """Mean distance of the probability told from the share that was right, over the bins by their count."""
    parts = reliability(told)
    return sum(count * abs(mean - share) for mean, share, count in parts) / max(len(told), 1)


def is_sized(row: Row) -> bool:
    """Whether the effects could be made as large as asked, told apart by size, and the loop answered."""
    sizes, target = row["truth"].get("sizes", []), row["truth"].get("target_size", 0.0)
    large = all(size >= 0.85 * target for size in sizes)
    apart = all(size >= 0.85 * APART for size in row["truth"].get("sizes_apart", []))
    return not row["judged"]["failed"] and large and apart


def _flags(rows: Sequence[Row], group: str, size: float | None = None) -> list[Row]:
    """How the answers to a group were judged, of the effects that could be made as large as asked."""
    return [
        row["judged"]
        for row in rows
        if row["group"] == group and is_sized(row) and size in (None, row["truth"].get("target_size"))
    ]


def _line(what: str, flags: Sequence[object], target: str) -> Line:
    return Line(what, sum(bool(f) for f in flags), len(flags), target)
