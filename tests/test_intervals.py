"""How sure parameters are: explanations in which a base parameter is the same thing, ends of curved valleys, bounds."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from rigs import Floats, experiment, history, spread, traction_samples

from twindisc_cli.effects import catalogue
from twindisc_cli.laws.trial import formula
from twindisc_cli.loop.diagnosis import Estimate
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import at, carried, fit
from twindisc_cli.loop.intervals import means_the_same
from twindisc_cli.loop.problem import Problem, case_of
from twindisc_cli.loop.term_intervals import term_parameters, unfixed
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


# ------------------------------------------------------------------------------------------------ profile likelihood


@pytest.mark.parametrize("rise", [0.2, 0.5])
def test_the_interval_follows_a_curved_valley(rise: float) -> None:
    """A straight rise of mu: the longer the settling, the larger limit and excess; given it, both are linear."""
    long = history((0.03, 0.05, 0.04, 0.06, 0.05), 4)
    time = spread(long, 8)
    cycles = 4200.0 * time / 84.0
    ratio = 0.3 * (1.0 + rise * cycles / cycles[-1]) + 0.003 * np.random.default_rng(2).standard_normal(len(time))
    test = experiment(long, thermal=None, measured=Measured(traction=traction_samples(long, time, ratio, 0.003)))
    problem = Problem([case_of(test)], ("traction",)).with_terms("running_in_friction")
    found = fit(problem, carried(problem, fit(Problem([case_of(test)], ("traction",)))))
    told = term_parameters(found, "running_in_friction")["settling_cycles"]
    settling = np.geomspace(3e3, 1e6, 4000)
    chi2 = np.array([_of_settling(n, cycles, ratio) for n in settling]) / 0.003**2
    inside = settling[chi2 < chi2.min() + 2.706]
    assert told.low == pytest.approx(inside[0], rel=0.05)
    assert told.high == pytest.approx(inside[-1], rel=0.05)


def _of_settling(settling: float, cycles: Floats, ratio: Floats) -> float:
    """Squared length of what is missed with one settling, limit and excess fitted; inf beyond their bounds."""
    columns = np.stack([np.ones_like(cycles), np.exp(-cycles / settling)], axis=1)
    (limit, drop), *_ = np.linalg.lstsq(columns, ratio)
    inside = limit < 3.0 and -0.95 < drop / limit < 3.0
    return float(np.sum((ratio - columns @ (limit, drop)) ** 2)) if inside else np.inf


def test_a_bound_of_a_size_over_decades_is_near_in_logarithms() -> None:
    """Of a settling between 20 and a million cycles, 34 is not at the bound."""
    effect, of = catalogue()["running_in_friction"], partial(Estimate, std=0.5, unit="1")
    excess = Estimate(-0.2, 0.01, -0.22, -0.18, "1")
    lower = next(p.lower for p in effect.params if p.name == "settling_cycles")
    for value, unsure in ((1.7 * lower, []), (1.001 * lower, ["settling_cycles"])):
        settling = of(value=value, low=value - 1.0, high=value + 1.0)
        assert unfixed(effect, {"excess": excess, "settling_cycles": settling}) == unsure
