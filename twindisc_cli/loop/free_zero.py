"""What mu is with the zero of the torque left free, where no test says what the torque meter reads at rest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.loop.fit import Fit, carried, fit
from twindisc_cli.loop.problem import Parameter
from twindisc_cli.loop.thresholds import SEARCH

ZERO = "torque_offset"


def with_free_zero(fitted: Fit) -> Fit | None:
    """The fit with a free zero, where some mu is another with it: each outside of the 90 % interval of the other.

    None where a zero is fitted, declared or known from the measurement, or would be implausibly large.
    """
    problem = fitted.problem
    tests = [case.test for case in problem.cases]
    zeros = [test.measured.torque_zero for test in tests]
    known = [ZERO in test.effects or bool(of and of.taken_off) for test, of in zip(tests, zeros, strict=True)]
    if all(known) or not _mus(fitted) or any(name.startswith(ZERO) for name in fitted.terms):
        return None
    freed = problem.with_terms(*fitted.terms, ZERO)
    free = fit(freed, carried(freed, fitted))
    plausible = abs(_zero(free).size(_estimate(free, _zero(free))[0])) <= SEARCH.typical_sizes
    return free if plausible and any(_differs(fitted, free, mu) for mu in _mus(fitted)) else None


def notes(fitted: Fit, free: Fit) -> Iterator[str]:
    """A note for each mu that is another in the fit with a free zero."""
    cases = fitted.problem.cases
    offset, spread = _estimate(free, _zero(free))
    for mu in (mu for mu in _mus(fitted) if _differs(fitted, free, mu)):
        given, at = _estimate(fitted, mu), _estimate(free, mu)
        name = f"{cases[mu.case or 0].test.name}: " if len(cases) > 1 else ""
        yield (
            f"{name}mu {given[0]:.4f} ± {given[1]:.4f} holds if the torque meter reads zero at rest, which is not "
            f"recorded; left free, its zero is {offset:.4f} ± {spread:.4f} of T/N and mu {at[0]:.4f} ± "
            f"{at[1]:.4f}: the intervals of mu, and of the wear coefficient and the convection, which rest on the same "
            "power, hold both"
        )


def _mus(fitted: Fit) -> list[Parameter]:
    return [p for p in fitted.problem.parameters if p.term is None and p.key == "mu"]


def _zero(free: Fit) -> Parameter:
    return next(p for p in free.problem.parameters if p.term == ZERO)


def _differs(fitted: Fit, free: Fit, mu: Parameter) -> bool:
    (given, std), (at, wide) = _estimate(fitted, mu), _estimate(free, mu)
    return abs(at - given) > NINETY * max(std, wide)


def _estimate(fitted: Fit, parameter: Parameter) -> tuple[float, float]:
    """A parameter and its standard error, widened by what the fit leaves."""
    value, std = fitted.value(parameter)
    return value, std * float(np.sqrt(fitted.excess))
