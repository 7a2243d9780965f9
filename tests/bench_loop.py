"""What the closed loop costs: records of any length, tests with nothing missing, and tests that nothing explains.

Each case runs in a process of its own: processor seconds of the diagnosis, and the most memory the process held.
"""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from rigs import Experiment, Floats, Instruments, Plant, history

COURSE = history((0.02, 0.04, 0.09, 0.03, 0.06, 0.015, 0.05, 0.01, 0.07, 0.025), 6)
SECONDS, MEGABYTES = 45.0, 1000.0


def _hidden(of: str) -> Plant:
    """Friction that goes with what nobody recorded, and heat of a source of its own."""
    draws = np.random.default_rng(11).standard_normal((2, len(COURSE.step)))
    walk = np.cumsum(draws[1]) / np.std(np.cumsum(draws[1]))

    def at(time: Floats) -> Any:
        return np.minimum((time / COURSE.duration[0]).astype(int), len(COURSE.step) - 1)

    def heat(time: Floats) -> Floats:
        if of == "humidity and oil":
            return np.asarray(8.0 * np.sin(time / 131.0) * walk[at(time)])
        return np.asarray(5.0 * np.sign(np.sin(time**1.3 / 900.0)))

    return Plant(COURSE, mu=lambda time, creepage, cycles: 0.6 * (1.0 + 0.08 * draws[0][at(time)]), heat=heat)


def _falling(time: Floats, creepage: Floats, cycles: Floats) -> Floats:
    return np.asarray(0.6 * (0.6 + 0.4 * np.exp(-3.0 * 9.42 * creepage)))


CASES: dict[str, tuple[Callable[[], Plant], int]] = {
    "nothing missing, 240 samples a channel": (lambda: Plant(COURSE), 4),
    "nothing missing, 200,000 samples a channel": (lambda: Plant(COURSE), 3333),
    "falling friction, 200,000 samples a channel": (lambda: Plant(COURSE, mu=_falling), 3333),
    "unexplained, humidity and oil, 240 samples a channel": (lambda: _hidden("humidity and oil"), 4),
    "unexplained, humidity and a heater, 240 samples a channel": (lambda: _hidden("humidity and a heater"), 4),
}


def cost(case: str) -> tuple[float, float, str]:
    """Processor seconds, megabytes and verdict of a case."""
    from twindisc_cli.api import close_loop

    plant, each = CASES[case]
    test: Experiment = Instruments(each=each, correlation=0.5).record(plant(), np.random.default_rng(3))
    began = time.process_time()
    verdict = close_loop(test).verdict
    return time.process_time() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, verdict


def costs(_: np.random.Generator, at_most: Callable[..., Any]) -> Iterator[Any]:
    """Seconds and memory of every case beside their bounds."""
    for case in CASES:
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as alone:
            seconds, megabytes, verdict = alone.submit(cost, case).result()
        yield at_most(f"{case}: {verdict}", seconds, SECONDS, "s")
        yield at_most("  its memory", megabytes, MEGABYTES, "MB")


SECTIONS = {"loop: cost": costs}
