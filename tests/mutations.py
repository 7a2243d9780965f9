"""Right files spoilt in one way: markers, cut lines, swapped, renamed and rescaled columns, lost and doubled rows.

python tests/mutations.py --seed 0 --count 2000 prints what became of them: read right, said, refused, silently wrong.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import makers
import numpy as np

from twindisc_cli.commands.import_file import run
from twindisc_cli.definition import load
from twindisc_cli.errors import TwindiscError

Cells = list[list[str]]
Spoil = Callable[[Cells, np.random.Generator], tuple[Cells, str]]
MARKERS = ("-999", "-9999", "-99.99", "1e30", "9.9e37", "", "NaN", "---", "0", "-999.0", "99999", "1372")
NAMES = ("Channel 4", "x", "AE", "M_R", "Kraft", "Signal", "Wert", "Load", "Torque", "Time", "Speed")


def marked(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    column, marker = int(rng.integers(0, 5)), str(rng.choice(MARKERS))
    rows = rng.choice(np.arange(1, len(table)), size=int(rng.integers(1, 25)), replace=False)
    for row in rows:
        table[row][column] = marker
    return table, f"{marker} in column {column}"


def run_of_markers(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    column, marker = int(rng.integers(1, 5)), str(rng.choice(MARKERS))
    begin = int(rng.integers(1, len(table) - 60))
    for row in range(begin, begin + int(rng.integers(2, 50))):
        table[row][column] = marker
    return table, f"a run of {marker} in column {column} from {begin}"


def swapped(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    one, other = (int(n) for n in rng.choice(5, size=2, replace=False))
    table[0][one], table[0][other] = table[0][other], table[0][one]
    return table, f"headers {one} and {other} swapped"


def renamed(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    column, name = int(rng.integers(0, 5)), str(rng.choice(NAMES))
    unit = table[0][column].partition("[")[2]
    table[0][column] = f"{name} [{unit}" if rng.random() < 0.5 else name
    return table, f"column {column} called {table[0][column]}"


def rescaled(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    """Numbers in another unit without the unit being said: only a factor of 1000 is sure to be seen."""
    column, factor = int(rng.integers(3, 5)), float(rng.choice((1e-3, 1e3)))
    for row in table[1:]:
        row[column] = f"{float(row[column]) * factor:.9g}"
    return table, f"column {column} times {factor:g}"


def lost(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    begin, count = int(rng.integers(1, len(table) - 40)), int(rng.integers(1, 30))
    return [*table[:begin], *table[begin + count :]], f"{count} rows lost from {begin}"


def doubled(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    row = int(rng.integers(1, len(table)))
    return [*table[:row], list(table[row - 1]) if row > 1 else list(table[1]), *table[row:]], f"row {row} doubled"


def spike(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    column, row = int(rng.integers(1, 5)), int(rng.integers(1, len(table)))
    table[row][column] = f"{float(table[row][column]) * 10 ** rng.uniform(-2, 6):.6g}"
    return table, f"a spike {table[row][column]} in column {column}, row {row}"


def unit_changed(table: Cells, rng: np.random.Generator) -> tuple[Cells, str]:
    column = int(rng.integers(0, 5))
    unit = str(rng.choice(("s", "rpm", "Nm", "N", "V", "", "mm", "degC", "kg")))
    table[0][column] = f"{table[0][column].partition(' [')[0]} [{unit}]"
    return table, f"column {column}: {table[0][column]}"


SPOILS: tuple[Spoil, ...] = (
    marked, run_of_markers, swapped, renamed, rescaled, lost, doubled, spike, unit_changed,
)  # fmt: skip


def spoilt(rng: np.random.Generator) -> tuple[bytes, str]:
    """A file that is spoilt, and in which way."""
    table = [[f"{name} [{unit}]" for name, unit, _, _ in makers.PLAIN], *makers.cells(makers.PLAIN, "{:.4f}")]
    if rng.random() < 0.12:
        data = "\n".join(";".join(row) for row in table).encode()
        end = len(data) - int(rng.integers(1, 60))
        return data[:end], f"cut at {end}: ...{data[max(end - 12, 0) : end]!r}"
    how = SPOILS[int(rng.integers(len(SPOILS)))]
    table, what = how(table, rng)
    return ("\n".join(";".join(row) for row in table) + "\n").encode(), what


def outcome(folder: Path, data: bytes) -> tuple[str, float]:
    """What becomes of a file: "right", "said", "refused" or "silently wrong", and the error of mu."""
    file = folder / "rig.csv"
    file.write_bytes(data)
    try:
        told = run([file], folder / "to", force=True)
        path = Path(str(told.json["definition"]))
        path.write_text(path.read_text(encoding="utf-8").replace("23.5", "30.0"), encoding="utf-8")
        test = load(path)
    except TwindiscError:
        return "refused", np.nan
    samples = test.experiment.measured.traction
    assert samples is not None
    steps = [float(np.mean(samples.ratio[samples.step == k])) for k in np.unique(samples.step)]
    error = max(abs(abs(mu) / makers.MU - 1.0) for mu in steps)
    if error <= 0.01:
        return "right", error
    expected = {"unloaded", "at a change of step", "running up", "running down"}
    causes = [reason for count in test.rows for reason in count.left_out if reason not in expected]
    notes = [note for count in test.rows for note in count.notes if "taken for no number" in note or "zero" not in note]
    notes = [note for note in notes if "the history found" not in note]
    guesses = [g for g in test_guesses(told.json) if "by its unit" in g or "not read" in g or "no file says" in g]
    return ("said" if causes or notes or _of_columns(guesses) else "silently wrong"), error


def test_guesses(told: object) -> list[str]:
    assert isinstance(told, dict)
    return [guess["guess"] for guess in told["guesses"]]


def _of_columns(guesses: list[str]) -> bool:
    """Whether a guess names a column or the load."""
    return any(guess.startswith(("columns.", "not read", "normal_load_N")) for guess in guesses)


def tally(seed: int, count: int, *, show: bool = False) -> Counter[str]:
    """How many of so many files end in which way."""
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as name:
        for n in range(count):
            data, what = spoilt(np.random.default_rng((seed, n)))
            found, error = outcome(Path(name), data)
            counts[found] += 1
            if show and found == "silently wrong":
                print(f"{seed}/{n}: {what}: mu off by {100 * error:.3g} %")
    return counts


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=2000)
    given = parser.parse_args()
    found = tally(given.seed, given.count, show=True)
    print(dict(found))
    sys.exit(1 if found["silently wrong"] else 0)
