"""What several commands need before they can simulate: the friction of each step, and the wear coefficient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twindisc_cli.commands._possible import as_declared
from twindisc_cli.definition import Test
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.mass import identify_from_mass
from twindisc_cli.identify.steps import FrictionInUse, friction_in_use
from twindisc_cli.identify.wear import identify_wear
from twindisc_cli.laws.law import warnings
from twindisc_cli.measurement import RowCount
from twindisc_cli.model.experiment import Experiment, Floats
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.results import Array, Axis, Dataset, Result

LIKE, OFF_UNDER_YAW = 1e-3, 0.22
"""Dundurs' second constant that is none, and what T/(mu N) was off at worst under lateral creepage between discs of
unlike elasticity (`make bench`)."""
UNLIKE_UNDER_YAW = (
    "discs of unlike elasticity under lateral creepage or spin: their traction is approximate, up to "
    f"{OFF_UNDER_YAW:g} mu N off below full slip; contact solves for it"
)


def friction_of_steps(model: ForwardModel) -> FrictionInUse:
    """The mu of each step.

    A step without creepage, yaw and spin needs none; for any other an unknown one is an error of the definition.
    """
    friction = friction_in_use(model)
    mu = np.where(np.isnan(friction.mu) & ~model.slips, 1.0, friction.mu)
    unknown = [str(i + 1) for i in np.flatnonzero(np.isnan(mu))]
    if unknown:
        what = (
            f"no friction is known for step {', '.join(unknown)}: no traction was measured there that a mu explains; "
            "give friction_coefficient under [model], or mu in the step"
        )
        raise DefinitionError(what)
    return friction._replace(mu=mu)


def wear_coefficient(model: ForwardModel, mu: Floats) -> tuple[float, str]:
    """K [1] and where it is from: given, fitted to the measured profile, or to the mass; NaN where there is none."""
    given = model.experiment.options.wear_coefficient
    if np.isfinite(given):
        return given, "given"
    measured = model.experiment.measured
    if measured.profile is None and measured.mass is None:
        return np.nan, "unknown"
    if measured.profile is None:
        return identify_from_mass(model, mu).wear_coefficient, "from the weighed mass"
    wear_fit = identify_wear(model, mu)
    return wear_fit.wear_coefficient, f"from the measured profile by {wear_fit.method}"


def with_data(result: Result, tests: Sequence[Test]) -> Result:
    """A result that also says what became of each row of its files, and of what is declared in vain."""
    named = [f"{t.experiment.name}: {c.file}" if len(tests) > 1 else c.file for t in tests for c in t.rows]
    counts = [count for test in tests for count in test.rows]
    rows = [replace(count, file=name) for count, name in zip(counts, named, strict=True)]
    own = [] if result.command == "close-loop" else [test.experiment for test in tests]
    in_vain = [line for test in own for line in left_out(test)]
    beyond = [f"warning: {what}" for test in own for what in laws_beyond(test)]
    beyond += [f"warning: {t.experiment.name}: {UNLIKE_UNDER_YAW}" for t in tests if _is_approximate(t.experiment)]
    return replace(
        result,
        summary=(*result.summary, *in_vain, *beyond, *(line for count in rows for line in count.lines)),
        json={**result.json, "rows": [count.json() for count in rows]},
        dataset=_with_rows(result.dataset, rows),
    )


def _with_rows(dataset: Dataset, rows: Sequence[RowCount]) -> Dataset:
    """A dataset with the rows used and left out of each file."""
    reasons = sorted({reason for count in rows for reason in count.left_out}) or ["none"]
    left = np.array([[count.left_out.get(reason, 0) for reason in reasons] for count in rows])
    files = np.array([count.file for count in rows], dtype=object)
    axes = (Axis("data_file", files, "1", "measured file"), Axis("reason", np.array(reasons, dtype=object), "1", "why"))
    arrays = (
        Array("rows_used", ("data_file",), np.array([count.used for count in rows]), "1", "rows that were used"),
        Array("rows_left_out", ("data_file", "reason"), left, "1", "rows left out, by reason"),
    )
    return replace(dataset, axes=(*dataset.axes, *axes), arrays=(*dataset.arrays, *arrays)) if rows else dataset


def left_out(test: Experiment) -> tuple[str, ...]:
    """What the definition declares and nothing can be made of, a line each."""
    if test.thermal is not None and np.isfinite(test.thermal.convection):
        return ()
    needing = [name for name in test.effects if catalogue()[name].needs_temperature]
    needing += [name for name, law in test.laws.items() if "temperature" in (law.quantity, law.covariate)]
    names = ", ".join(sorted(needing))
    return (
        (f"no convection is known, so that {names} is left out: give convection_W_K under [thermal]",) if names else ()
    )


def _is_approximate(test: Experiment) -> bool:
    """Whether discs of unlike elasticity roll with lateral creepage or spin, for which there is no table."""
    return abs(test.rig.dundurs) > LIKE and bool(np.any(test.history.yaw) or "misalignment" in test.effects)


def laws_beyond(test: Experiment) -> list[str]:
    """Where declared laws are used outside of their range, or on a history they may not hold on, a line each."""
    if not test.laws:
        return []
    return warnings(test.laws, as_declared(test)[0], test.name)
