"""friction-chart: apparent friction over creepage for a family of mu, the 98 % line, and the measured points on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from twindisc_cli.commands._possible import refuse_impossible
from twindisc_cli.definition import Test
from twindisc_cli.identify.chart import Chart, at_creepages, friction_chart
from twindisc_cli.identify.friction import NO_CREEPAGE, NO_LONGITUDINAL, SATURATED
from twindisc_cli.identify.steps import StepFriction, identify_friction
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FAMILY = np.round(np.arange(0.05, 0.701, 0.05), 2)
CREEPAGES = 200  # of a curve: closer than the pixels of a bend


def run(test: Test) -> Result:
    """Compute the chart of a test's unworn discs."""
    experiment = test.experiment
    creepage = _creepages(experiment)
    refuse_impossible(at_creepages(experiment, creepage))
    measured = identify_friction(ForwardModel(experiment)) if experiment.measured.traction is not None else None
    many = friction_chart(experiment, mu=FAMILY, creepage=creepage)
    typical, origin = _typical_mu(experiment, measured)
    one = friction_chart(experiment, mu=np.array([typical]), creepage=creepage)
    return Result(
        command="friction-chart",
        summary=_summary(one, many, measured),
        json={
            "mu": many.mu,
            "creepage_percent": many.creepage * 100.0,
            "apparent_friction": many.apparent,
            "full_slip_creepage_percent": or_null(many.full_slip * 100.0),
            "light_line_creepage_percent": or_null(many.light_line * 100.0),
            "measured": [] if measured is None else _points(measured),
        },
        dataset=_dataset(many, measured),
        figure=lambda: _figure(experiment, one, many, measured, origin),
    )


def _creepages(test: Experiment) -> Floats:
    """Creepages [1] up to a little beyond the test's own, closer together where the curves bend."""
    largest = 1.05 * float(np.abs(test.history.creepage).max(initial=0.01))
    return np.asarray(largest * np.geomspace(1e-4, 1.0, CREEPAGES))


def _typical_mu(test: Experiment, measured: StepFriction | None) -> tuple[float, str]:
    """The declared constant mu; else the median identified one; else the paper's 0.6; and which of them it is."""
    result = np.empty(0) if measured is None else measured.mu[np.isfinite(measured.mu)]
    constant = test.options.friction_coefficient
    if np.isfinite(constant):
        return constant, "declared"
    return (float(np.median(result)), "median of the steps") if len(result) else (0.6, "as in the paper")


def _summary(one: Chart, many: Chart, measured: StepFriction | None) -> tuple[str, ...]:
    lines = [
        f"full slip at mu = {one.mu[0]:.3g} {_from(one.full_slip[0], ' creepage')}, "
        f"98 % of mu {_from(one.light_line[0])}",
        f"full slip {_from(many.full_slip[0])} (mu = {many.mu[0]}), {_from(many.full_slip[-1])} (mu = {many.mu[-1]})",
    ]
    if measured is not None:
        passed = (None, SATURATED, NO_CREEPAGE, NO_LONGITUDINAL)
        left = [i + 1 for i, state in enumerate(measured.state) if state not in passed]
        named = f"all but step {', '.join(map(str, left))}" if left else "all"
        lines.append(f"measured steps on the saturated part, where T/N is mu: {named}")
    return tuple(lines)


def _from(creepage: float, what: str = "") -> str:
    """Where a line of the chart lies; it may not be reached."""
    return f"from {creepage * 100.0:.3g} %{what}" if np.isfinite(creepage) else f"nowhere below 200 %{what}"


def _points(measured: StepFriction) -> list[dict[str, object]]:
    rows = zip(measured.creepage, measured.ratio, measured.half, measured.state, strict=True)
    return [
        {
            "creepage_percent": or_null(creepage * 100.0),
            "traction_ratio": or_null(ratio),
            "half_interval": or_null(half),
            "state": state,
        }
        for creepage, ratio, half, state in rows
    ]


def _figure(test: Experiment, one: Chart, many: Chart, measured: StepFriction | None, origin: str) -> Figure:
    from twindisc_cli.figures.friction import chart

    provenance = "" if measured is None else test.measured.provenance
    return chart(one, many, measured, name=test.name, origin=origin, provenance=provenance)


def _dataset(many: Chart, measured: StepFriction | None) -> Dataset:
    axes = [
        Axis("mu", many.mu, "1", "coefficient of friction"),
        Axis("creepage", many.creepage, "1", "longitudinal creepage"),
    ]
    arrays = [
        Array("apparent_friction", ("mu", "creepage"), many.apparent, "1", "apparent friction T/N"),
        Array("light_line_creepage", ("mu",), many.light_line, "1", "creepage at which T/N is 98 % of mu", True),
        Array("full_slip_creepage", ("mu",), many.full_slip, "1", "smallest creepage of full slip", True),
    ]
    if measured is not None:
        axes.append(Axis("step", np.arange(1, len(measured.ratio) + 1), "1", "number of the step"))
        arrays += [
            Array("measured_creepage", ("step",), measured.creepage, "1", "mean measured creepage", True),
            Array("measured_traction_ratio", ("step",), measured.ratio, "1", "mean measured T/N", True),
            Array("measured_half_interval", ("step",), measured.half, "1", "half the 90 % interval of T/N", True),
            Array("identified_mu", ("step",), measured.mu, "1", "coefficient of friction behind T/N", True),
            Array("identified_mu_low", ("step",), measured.low, "1", "lower end of its 90 % interval", True),
            Array("identified_mu_high", ("step",), measured.high, "1", "upper end of its 90 % interval", True),
        ]
    return Dataset(axes=tuple(axes), arrays=tuple(arrays))
