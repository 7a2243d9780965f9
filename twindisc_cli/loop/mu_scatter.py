"""Scatter of mu from one step of a test to the next, as a noise: how large it is likeliest to be.

    log p(r | s) = -sum_k [ a_k^2 / (1 + s^2 d_k^2) + log(1 + s^2 d_k^2) ] / 2

    s         standard deviation of the mu of a step over its mean [1]
    d_k, a_k  lengths of what the steps' mu change in the white prediction, and the white residual along each [1]

What something unrecorded changes from step to step is found as a law over whatever the steps differ in, unless levels
of the steps are held against it. Separate tests have such levels in any case (`identify.repeats`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.identify.span import span_of
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.problem import Effort, Problem
from twindisc_cli.loop.ties import first_of_most
from twindisc_cli.loop.tolerances import step_by_step
from twindisc_cli.model.experiment import Floats

FEWEST_LEVELS = 5
"""Steps of a test in which levels are held against laws: fewer are as many as a law has parameters."""
SIZES = np.concatenate([[0.0], np.geomspace(0.003, 0.3, 14)])
SMALL = 0.01  # change of mu by which its slopes are taken


def likeliest_scatter(fitted: Fit) -> list[float]:
    """The likeliest scatter of mu over the steps that a fit leaves, of each test [1]."""
    nearby = fitted.problem.followed(fitted.theta)
    return [_of_test(fitted, nearby, number) for number in range(len(nearby.cases))]


def with_scatter(problem: Problem, sizes: Sequence[float]) -> Problem:
    """A problem in which the mu of each step of a test may be off by so much (test,) [1], for a search of its own."""
    cases = [replace(case, mu_scatter=size) for case, size in zip(problem.cases, sizes, strict=True)]
    return replace(problem, cases=cases, effort=Effort())


def _of_test(fitted: Fit, nearby: Problem, number: int) -> float:
    case, history = nearby.cases[number], nearby.cases[number].test.history
    if "traction" not in case.noise or history.separate or len(np.unique(history.step)) < FEWEST_LEVELS:
        return 0.0
    moved = step_by_step(nearby, number, fitted.theta, "mu", SMALL) - nearby.white(nearby.predict(fitted.theta[None]))
    columns, reached = nearby.discount(moved).T / SMALL, span_of(fitted.jacobian)
    left, length, _ = np.linalg.svd(columns - reached @ (reached.T @ columns), full_matrices=False)
    return likeliest(left.T @ fitted.residual, length)


def likeliest(along: Floats, length: Floats) -> float:
    """The scatter of most likelihood, by the white residual along each direction and its length (direction,)."""
    spread = 1.0 + (SIZES[:, None] * length) ** 2
    likely = -0.5 * np.sum(along**2 / spread + np.log(spread), axis=1)
    return float(SIZES[first_of_most(likely)])
