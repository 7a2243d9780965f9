"""python -m tests.score: run the score and print its table."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np

from .cases import GROUPS, plan
from .judging import Row
from .scoring import Line, is_right, is_sized, make, score, score_existing, table, tests_with_truth


def main() -> int:
    """The command line of the score, and of the benchmark behind `make` and `judge`."""
    if sys.argv[1:2] in (["make"], ["judge"]):
        from .benchmark import main as benchmark

        return benchmark(sys.argv[1:])
    options = _options()
    cases = plan(options.tests, options.seed, options.cases)
    if options.make:
        make(cases, options.make, options.processes)
        return 0
    start = perf_counter()
    if options.folder:
        running, count = (
            score_existing(options.folder, processes=options.processes),
            len(tests_with_truth(options.folder)),
        )
    else:
        running, count = score(cases, keep=options.keep, processes=options.processes), len(cases)
    rows: list[Row] = []
    for row in running:
        rows.append(row)
        print(f"{len(rows)}/{count} {_summary(row)}", file=sys.stderr, flush=True)
    rows.sort(key=lambda row: str(row["name"]))
    _print_table(table(rows))
    print(f"right as a whole: {sum(is_right(row) for row in rows)} of {len(rows)}")
    small = sum(not is_sized(row) and not row["judged"]["failed"] for row in rows)
    print(f"left out, because the effect could not be made so large or separated from its pair: {small}")
    seconds = [row["seconds"] for row in rows]
    print(
        f"{len(rows)} tests in {perf_counter() - start:.0f} s; processor time of the loop {np.median(seconds):.1f} s a "
        f"test (median), {np.max(seconds):.1f} s at most"
    )
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    if options.figure:
        from .figure import draw

        options.figure.parent.mkdir(parents=True, exist_ok=True)
        draw(rows).savefig(options.figure, dpi=160)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.score", description=__doc__)
    parser.add_argument("--tests", type=int, default=220, help="how many tests (default 220)")
    parser.add_argument("--seed", type=int, default=1, help="seed of them all")
    parser.add_argument("--cases", type=_groups, default=tuple(GROUPS), help=f"which groups: {','.join(GROUPS)}")
    parser.add_argument("--processes", type=int, default=2, help="how many at once")
    parser.add_argument("--json", type=Path, help="file for one row per test")
    parser.add_argument("--figure", type=Path, help="file for the figure over effect size")
    parser.add_argument("--keep", type=Path, help="folder where the tests and, apart, their truth are kept")
    parser.add_argument("--make", type=Path, help="only make the tests, in this folder")
    parser.add_argument(
        "--folder", type=Path, help="score the tests of this folder (kept, made, or with a truth.json) instead"
    )
    return parser.parse_args()


def _groups(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in GROUPS]
    if unknown:
        raise argparse.ArgumentTypeError(f"no such group: {', '.join(unknown)}; there are {', '.join(GROUPS)}")
    return names


def _summary(row: Row) -> str:
    truth, answer = row["truth"], row["answer"]
    law = truth.get("law")
    names = truth["truth"] if isinstance(truth["truth"], list) else [truth["truth"]]
    hidden = " + ".join(truth.get("hidden", names)) or "nothing"
    hidden += f" ({'|'.join(law['equivalent'])})" if law else ""
    if "failed" in answer:
        return f"{row['name']}: {hidden} -> failed, {answer['failed'][-200:]!r}"
    named = ["|".join([e["effect"], *map(str, e.get("alternatives", []))]) for e in answer["effects"]]
    laws = [f"{one['quantity']} over {one['covariate']}" for one in answer.get("laws", [])]
    left = [f"unexplained {u['channel']}:{u['covariate']}" for u in answer["unexplained"][:2]]
    mark = "right" if is_right(row) else "WRONG"
    ratios = row["judged"].get("elsewhere", {})
    errors = ", ".join(f"{channel} {before:.2f}->{after:.2f}" for channel, (before, after) in ratios.items())
    said = " + ".join([*named, *laws, *left]) or "nothing"
    return f"{row['name']}: {hidden} -> {said}: {mark}, {row['seconds']:.1f} s; elsewhere {errors}"


def _print_table(lines: Sequence[Line]) -> None:
    for line in lines:
        share = f"{100.0 * line.count / line.of:5.1f} %" if line.of else "    -  "
        counted = f"{line.count:4d} of {line.of:4d}  {share}"
        if line.value is not None:
            counted = f"{line.value:9.3f} of {line.of:4d}  "
        print(f"{line.what:58s} {counted:22s}  {line.target}".rstrip())


if __name__ == "__main__":
    sys.exit(main())
