"""Which explanations say how sure a base parameter is: those in which it is the same thing."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import experiment, history, spread, traction_samples

from twindisc_cli.laws.trial import formula
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import at
from twindisc_cli.loop.intervals import means_the_same
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.model.experiment import Measured

COURSE = history((0.02, 0.04, 0.09, 0.03), 2)
TIME = spread(COURSE, 6)
OVER_TIME = formula("mu", "time", "linear", {"size": 0.1, "begin_s": 0.0, "end_s": 600.0}, (0.0, 600.0), 1.0)


def explanation(*terms: str) -> Explanation:
    samples = traction_samples(COURSE, TIME, 0.6 + 0.004 * np.random.default_rng(0).standard_normal(len(TIME)))
    plain = Problem([case_of(experiment(COURSE, thermal=None, measured=Measured(traction=samples)))], ("traction",))
    problem = plain.with_terms(*terms, trial={"mu_over_time": OVER_TIME})
    return Explanation(at(problem, problem.start()), {"mu_over_time": 0.0} if "mu_over_time" in terms else {}, 0.0)


@pytest.mark.parametrize(
    ("member", "answer", "same"),
    [
        ((), (), True),
        (("torque_offset",), (), True),
        (("running_in_friction",), (), False),
        (("running_in_friction",), ("torque_offset",), False),
        (("running_in_friction",), ("falling_friction",), True),
        ((), ("falling_friction",), True),
        (("mu_over_time",), (), False),
        (("mu_over_time",), ("mu_over_time",), True),
        (("running_in_friction",), ("mu_over_time",), False),
    ],
)
def test_mu_beside_friction_that_changes_is_no_mean(
    member: tuple[str, ...], answer: tuple[str, ...], same: bool
) -> None:
    """Where friction changes, mu is its value at one end of the change; where nothing does, it is that of all."""
    assert means_the_same("mu", explanation(*member), explanation(*answer)) == same
    assert means_the_same("K", explanation(*member), explanation(*answer))
