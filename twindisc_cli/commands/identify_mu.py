"""identify-mu: the coefficient of friction behind the measured T/N of each step, with its interval and its state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.consistency import OF_FRICTION, contradictions
from twindisc_cli.definition import Test
from twindisc_cli.identify.friction import ABOVE_LIMIT, AGAINST_CREEPAGE, CONFIDENCE
from twindisc_cli.identify.steps import StepFriction, identify_friction, softness, zero_error
from twindisc_cli.model.experiment import Experiment, Ints
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.report.words import listed
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOFT = 0.9
"""Share of the theory's slope below which it is reported."""

WHY = {
    ABOVE_LIMIT: "exceeds what linear theory allows: the zero of the creepage (speeds, radii), the contact's stiffness "
    "(moduli, curvatures) or the load is off",
    AGAINST_CREEPAGE: "lies against the creepage, and no friction makes it so: the sign or the zero of the torque, or "
    "which disc is the faster one, is off in this step",
}
"""Why no mu explains the T/N of a step, by its state."""


def run(test: Test) -> Result:
    """Invert the measured traction of a test, step by step."""
    experiment = test.experiment
    result = identify_friction(ForwardModel(experiment))
    return Result(
        command="identify-mu",
        summary=(
            *_summary(result),
            *_no_interval(result),
            *_zero(experiment),
            *_approximate(result),
            *_wide(result),
            *_note(experiment),
            *_softer(experiment, result),
            *contradictions(experiment, OF_FRICTION),
        ),
        json={
            "interval_percent": 100.0 * CONFIDENCE,
            "zero_std": or_null(float(np.max(zero_error(experiment))) or np.nan),
            "steps": [_step(result, i) for i in range(len(result.mu))],
        },
        dataset=_dataset(result),
        figure=lambda: _figure(experiment, result),
    )


def _wide(friction: StepFriction) -> tuple[str, ...]:
    """The steps whose interval is as wide as their mu."""
    known = np.flatnonzero(np.isfinite(friction.mu))
    wide = np.array([i for i in known if friction.high[i] - friction.low[i] > friction.mu[i]])
    steps = _steps(wide)
    return (
        (f"warning: at {steps} the 90 % interval is as wide as mu itself: these data hardly fix it",)
        if len(wide)
        else ()
    )


def _zero(test: Experiment) -> tuple[str, ...]:
    """What the error of the torque's zero makes of T/N, or that it is in no interval."""
    zero, error = test.measured.torque_zero, zero_error(test)
    if zero is None:
        return ()
    if not zero.taken_off:
        return ("the torque is as recorded: the error of its zero is in no interval",)
    if not np.any(error > 0.0):
        return ("the zero of the torque is as stated: its error is in no interval",)
    least, most = float(error[error > 0.0].min()), float(error.max())
    span = f"{most:.2g}" if least > 0.9 * most else f"{least:.2g} to {most:.2g}"
    return (f"the zero of the torque is known to ± {span} of T/N (one standard deviation), which is in every interval",)


def _approximate(friction: StepFriction) -> tuple[str, ...]:
    """What FASTSIM makes of mu on two cylinders, where the exact law is known."""
    most = float(np.max(np.abs(friction.approximate), initial=0.0))
    if not most > 0.0:
        return ()
    exact = 'traction = "exact" under [model] is without it'
    return (
        f"FASTSIM is an approximation on two cylinders: up to {most:.2g} in mu, which is in the intervals; {exact}",
    )


def _note(test: Experiment) -> tuple[str, ...]:
    """What mu is where declared effects or laws change the friction or the traction."""
    acting = ", ".join([*sorted(test.effects), *sorted(test.laws)])
    return (f"mu is the base coefficient on which the declared effects and laws act: {acting}",) if acting else ()


def _softer(test: Experiment, friction: StepFriction) -> tuple[str, ...]:
    """What steps in partial slip say of the contact, where all of them say it."""
    of_step = softness(test, friction)
    steps = np.flatnonzero(np.isfinite(of_step))
    slope = of_step[steps]
    if len(slope) < 2 or slope.max() > SOFT:
        return ()
    return (
        f"if mu were that of full sliding in all steps, T/N of {_steps(steps)}, which is below it at a small creepage, "
        f"would need {slope.min():.2f} to {slope.max():.2f} of the theoretical initial slope: the contact is softer "
        "than smooth discs, or friction is lower there (mu and state given are those of each step by itself)",
    )


def _steps(steps: Ints) -> str:
    """Steps, from 0, in words: `step 1`, `steps 1, 2 and 4`, `steps 1 to 8`."""
    names = [str(step + 1) for step in steps]
    if len(names) > 2 and steps[-1] - steps[0] == len(steps) - 1:
        return f"steps {names[0]} to {names[-1]}"
    return f"step{'s' if names[1:] else ''} {listed(names)}"


def _no_interval(friction: StepFriction) -> tuple[str, ...]:
    """Why an interval in the table has no end, or only a lower one."""
    known = np.isfinite(friction.mu)
    neither = np.flatnonzero(known & np.isnan(friction.half))
    no_end = np.flatnonzero(known & np.isfinite(friction.low) & ~np.isfinite(friction.high))
    return (
        *(
            (f"no interval in {_steps(neither)}: a single row without a column uncertainty shows no scatter",)
            if len(neither)
            else ()
        ),
        *(
            (
                f"no upper end in {_steps(no_end)}: within its error T/N reaches the elastic limit, where it no longer "
                "depends on mu",
            )
            if len(no_end)
            else ()
        ),
    )


def _step(friction: StepFriction, i: int) -> dict[str, Any]:
    state = friction.state[i]
    report: dict[str, Any] = {
        "step": i + 1,
        "creepage_percent": or_null(friction.creepage[i] * 100.0),
        "traction_ratio": or_null(friction.ratio[i]),
        "mu": or_null(friction.mu[i]),
        "mu_low": or_null(friction.low[i]),
        "mu_high": or_null(friction.high[i]),
        "naive_mu": or_null(abs(friction.ratio[i])),
        "saturation": None if state is None or state in WHY else or_null(friction.share[i]),
        "state": state,
    }
    if state in WHY:
        report["message"] = _message(friction, i)
    return report


def _message(friction: StepFriction, i: int) -> str:
    """Why no mu explains T/N, and what could make it so."""
    measured = f"T/N = {friction.ratio[i]:.3g} at {friction.creepage[i] * 100.0:.3g} %"
    return f"{measured} {WHY[str(friction.state[i])]}"


def _summary(friction: StepFriction) -> tuple[str, ...]:
    lines = ["step  creepage    T/N     mu      90 % interval     state"]
    for i, state in enumerate(friction.state):
        if state is None:
            lines.append(f"{i + 1:>4}  not measured")
            continue
        mu, low, high = (
            f"{v:.4f}" if np.isfinite(v) else "none" for v in (friction.mu[i], friction.low[i], friction.high[i])
        )
        measured = f"{friction.creepage[i] * 100.0:>6.3g} % {friction.ratio[i]:>7.4f}"
        lines.append(f"{i + 1:>4}  {measured}  {mu:>6}  {low:>6} ... {high:<6}  {state}")
    return (
        *lines,
        *(f"step {i + 1}: {_message(friction, i)}" for i, s in enumerate(friction.state) if s in WHY),
    )


def _figure(test: Experiment, friction: StepFriction) -> Figure:
    from twindisc_cli.figures.friction import identified

    return identified(friction, test, sentence=" ".join(_softer(test, friction)))


def _dataset(friction: StepFriction) -> Dataset:
    rows = (
        ("creepage", friction.creepage, "mean measured creepage"),
        ("traction_ratio", friction.ratio, "mean measured T/N, the naive coefficient of friction"),
        ("traction_ratio_half_interval", friction.half, "half the 90 % interval of the mean T/N"),
        ("mu", friction.mu, "coefficient of friction; inf above the elastic limit, NaN against the creepage"),
        ("mu_low", friction.low, "lower end of the 90 % interval of mu"),
        ("mu_high", friction.high, "upper end of the 90 % interval of mu"),
        ("saturation", friction.share, "T/(mu N)"),
    )
    state = np.array([s or "not measured" for s in friction.state], dtype=object)
    return Dataset(
        axes=(Axis("step", np.arange(1, len(friction.mu) + 1), "1", "number of the step"),),
        arrays=(
            *(Array(name, ("step",), values, "1", long_name, optional=True) for name, values, long_name in rows),
            Array("state", ("step",), state, "1", "state of the contact"),
        ),
    )
