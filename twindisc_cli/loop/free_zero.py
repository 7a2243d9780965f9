"""What mu is with the zero of the torque left free, where no test says what the torque meter reads at rest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.loop.fit import Fit, carried, fit
from twindisc_cli.loop.thresholds import SEARCH

ZERO = "torque_offset"


def where_free(fitted: Fit) -> Iterator[str]:
    """A note for each mu of a fit that is another with a free zero: each outside of the 90 % interval of the other.

    None where a zero is fitted, declared or known from the measurement, or would be implausibly large.
    """
    problem = fitted.problem
    tests = [case.test for case in problem.cases]
    zeros = [test.measured.torque_zero for test in tests]
    known = [ZERO in test.effects or bool(of and of.taken_off) for test, of in zip(tests, zeros, strict=True)]
    mus = [i for i, p in enumerate(problem.parameters) if p.term is None and p.key == "mu"]
    if all(known) or not mus or any(name.startswith(ZERO) for name in fitted.terms):
        return
    freed = problem.with_terms(*fitted.terms, ZERO)
    free = fit(freed, carried(freed, fitted))
    zero = next(i for i, p in enumerate(freed.parameters) if p.term == ZERO)
    offset, spread = _estimate(free, zero)
    if abs(freed.parameters[zero].size(offset)) > SEARCH.typical_sizes:
        return
    for number in mus:
        given, at = _estimate(fitted, number), _estimate(free, number)
        if abs(at[0] - given[0]) > NINETY * max(at[1], given[1]):
            case = problem.parameters[number].case
            name = f"{tests[case or 0].name}: " if len(tests) > 1 else ""
            yield (
                f"{name}mu {given[0]:.4f} ± {given[1]:.4f} holds if the torque meter reads zero at rest, which is not "
                f"recorded; left free, its zero is {offset:.4f} ± {spread:.4f} of T/N and mu {at[0]:.4f} ± "
                f"{at[1]:.4f}; the wear coefficient and the convection rest on the same power"
            )


def _estimate(fitted: Fit, number: int) -> tuple[float, float]:
    """A parameter and its standard error, widened by what the fit leaves."""
    value, std = fitted.value(fitted.problem.parameters[number])
    return value, std * float(np.sqrt(fitted.excess))
