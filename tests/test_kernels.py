"""The verdict does not depend on how a processor rounds: the same diagnoses under two kernels of the linear algebra."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parent
KERNELS = ("Haswell", "Nehalem")
"""Both run on every x86-64 processor of the last ten years; they differ in the order of their sums."""
CASES = (
    ("burst", "traction", "temperature"),
    ("film", "traction"),
    ("running in", "traction"),
    ("displaced", "traction", "profile"),
)
DIAGNOSE = """
import json, sys
from test_diagnose import recorded, run

answers = []
for plant, *channels in json.loads(sys.argv[1]):
    found = run(recorded(plant, *channels))
    terms = {t.name: [t.strength, [str(a.term) for a in t.alternatives]] for t in (*found.effects, *found.laws)}
    answers.append([found.verdict, terms])
print(json.dumps(answers))
"""


def answers(kernel: str) -> list[object]:
    """Verdict, terms, strengths and alternatives of every case under one kernel."""
    environment = os.environ | {
        "OPENBLAS_CORETYPE": kernel,
        "PYTHONPATH": os.pathsep.join([str(TESTS), str(TESTS.parent)]),
    }
    done = subprocess.run(
        [sys.executable, "-c", DIAGNOSE, json.dumps(CASES)], env=environment, capture_output=True, text=True, check=True
    )
    found: list[object] = json.loads(done.stdout)
    return found


def test_two_kernels_give_one_verdict() -> None:
    one, two = (answers(kernel) for kernel in KERNELS)
    assert one == two
