"""python -m tests.records: the loop on real records beside a student and a Gaussian process, as a table and a figure.

Samples that are held out are removed from the data before anything is done. `--record NAME --kind blocks` runs a part.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

from .answers import come_back, of_parts
from .errors import Errors, of_group, of_split
from .sources import groups, records
from .splits import SEED, held_out
from .table import Halves, table

KINDS = ("blocks", "folds", "groups", "halves", "thirds")
FEWEST = 24
"""Samples that a record has at least to be cut into halves or thirds."""


def main() -> int:
    """Print the table; write and draw it where asked."""
    options = _options()
    os.environ["OMP_NUM_THREADS"] = "1"
    errors, parts = [], []
    with ProcessPoolExecutor(options.processes) as pool:
        running = [pool.submit(_run, *job, options.splits) for job in _jobs(options.record, options.kind)]
        for done in running:
            one = done.result()
            (errors if isinstance(one, Errors) else parts).append(one)
            print(one, file=sys.stderr, flush=True)
    print(table(errors, parts))
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps([asdict(one) for one in (*errors, *parts)], indent=1) + "\n")
    if options.figure:
        from .figure import draw

        options.figure.parent.mkdir(parents=True, exist_ok=True)
        draw(errors).savefig(options.figure, dpi=160)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.records", description=__doc__)
    every = [*records(), *groups()]
    parser.add_argument("--record", choices=every, action="append", help="only this record, or several by repeating it")
    parser.add_argument("--kind", choices=KINDS, action="append", help="only this kind of split")
    parser.add_argument("--splits", type=int, default=4, help="how many random splits into halves and thirds each")
    parser.add_argument("--processes", type=int, default=2, help="how many at once")
    parser.add_argument("--json", type=Path, help="file for one entry a split")
    parser.add_argument("--figure", type=Path, help="file for the figure")
    return parser.parse_args()


def _jobs(names: list[str] | None, kinds: list[str] | None) -> Iterator[tuple[str, str, int]]:
    """Record, kind and number of every split that is asked for."""
    for kind in kinds or KINDS:
        for name in groups() if kind == "groups" else records():
            if names and name not in names:
                continue
            if kind == "groups":
                count = len(groups()[name]().learnt)
            elif kind in ("halves", "thirds"):
                measured = records()[name]().measured.traction
                count = 1 if measured is not None and len(measured.ratio) >= FEWEST else 0
            else:
                count = len(list(held_out(records()[name](), kind)))
            yield from ((name, kind, number) for number in range(count))


def _run(name: str, kind: str, number: int, splits: int) -> Errors | Halves:
    """One split of a record, or all of its random halves or thirds."""
    if kind == "groups":
        group = groups()[name]()
        return of_group(name, group.tests, group.learnt[number])
    test = records()[name]()
    if kind in ("halves", "thirds"):
        parts = 2 if kind == "halves" else 3
        return Halves(name, kind, come_back(of_parts(test, parts, SEED + i) for i in range(splits)))
    split, masks = list(held_out(test, kind))[number]
    return of_split(name, test, split, masks)


if __name__ == "__main__":
    raise SystemExit(main())
