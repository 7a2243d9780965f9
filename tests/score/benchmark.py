"""The score for other programs: tests to be answered, their truth sealed, and the count of anybody's answers.

python -m tests.score make FOLDER --seed N --tests 100
python -m tests.score judge FOLDER ANSWERS
"""

from __future__ import annotations

import argparse
import json
import shutil
import zlib
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from .cases import plan
from .judging import Row, judge
from .scoring import is_right, make, table

SEALED, SEAL = "truth.sealed", "truth.sha256"
NO_ANSWER = {"failed": "no answer"}


def main(arguments: Sequence[str]) -> int:
    """The command line of the benchmark."""
    parser = argparse.ArgumentParser(prog="python -m tests.score", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="write tests and, sealed, their truth")
    making.add_argument("folder", type=Path)
    making.add_argument("--seed", type=int, required=True, help="seed of them all")
    making.add_argument("--tests", type=int, default=100, help="how many (default 100)")
    making.add_argument("--processes", type=int, default=2, help="how many at once")
    judging = commands.add_parser("judge", help="count the answers of any program")
    judging.add_argument("folder", type=Path)
    judging.add_argument("answers", type=Path, help="folder with NAME.json for each test")
    judging.add_argument("--json", type=Path, help="file for one row per test")
    options = parser.parse_args(arguments)
    if options.command == "make":
        seal(options.folder, tests=options.tests, seed=options.seed, processes=options.processes)
        return 0
    rows = judged(options.folder, options.answers)
    for line in report(rows):
        print(line)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


def seal(folder: Path, *, tests: int, seed: int, processes: int = 2) -> None:
    """Write folder/tests/NAME and, compressed so that nobody reads it by chance, their truth with its sha256."""
    make(plan(tests, seed), folder, processes)
    truth = folder / "truth"
    every = {path.stem: json.loads(path.read_text()) for path in sorted(truth.glob("*.json"))}
    data = zlib.compress(json.dumps(every, sort_keys=True).encode(), 9)
    (folder / SEALED).write_bytes(data)
    (folder / SEAL).write_text(sha256(data).hexdigest() + "\n")
    shutil.rmtree(truth)


def unsealed(folder: Path) -> dict[str, Row]:
    """The truth of every test by name; ValueError where it is not what was sealed."""
    data = (folder / SEALED).read_bytes()
    if sha256(data).hexdigest() != (folder / SEAL).read_text().strip():
        raise ValueError(f"{folder / SEALED} is not the truth that was sealed with these tests")
    truth: dict[str, Row] = json.loads(zlib.decompress(data))
    return truth


def judged(folder: Path, answers: Path) -> list[Row]:
    """One row for each test; a test without an answer counts as one that was missed."""
    rows = []
    for name, truth in unsealed(folder).items():
        path = answers / f"{name}.json"
        answer = json.loads(path.read_text()) if path.is_file() else NO_ANSWER
        rows.append(
            {"group": name.rpartition("_")[0], "name": name, "truth": truth, "answer": answer, "seconds": 0.0,
             "judged": judge(truth, answer)}
        )  # fmt: skip
    return rows


def report(rows: Sequence[Row]) -> list[str]:
    """The table of the score, and how many answers are right as a whole."""
    lines = []
    for line in table(rows):
        counted = f"{line.value:.3f} of {line.of}" if line.value is not None else f"{line.count} of {line.of}"
        lines.append(f"{line.what:58s} {counted:>14s}  {line.target}".rstrip())
    return [*lines, f"right as a whole: {sum(is_right(row) for row in rows)} of {len(rows)}"]
