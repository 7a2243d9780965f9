"""check: do the definition, the data and the numbers stated elsewhere agree with each other?"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.consistency import findings
from twindisc_cli.consistency.finding import Finding, number
from twindisc_cli.definition import Test
from twindisc_cli.errors import NEGATIVE_FINDING
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.quantities import for_reading
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def measured(test: Experiment) -> dict[str, dict[str, Any]]:
    """What was measured, by channel: how many samples, and from where to where they reach in the unit shown."""
    results = {}
    for name in measured_channels(test):
        channel = channels()[name]
        values = channel.quantity.shown.of_si(channel.values(channel.samples(test)))
        low, high = (float(end) for end in (values.min(), values.max()))
        results[name] = {"samples": len(values), "range": {"low": low, "high": high, "unit": channel.quantity.unit}}
    return results


def _range(name: str, ends: dict[str, Any]) -> str:
    return f"{name} {number(ends['low'])} to {number(ends['high'])} {for_reading(ends['unit'])}".rstrip()


def run(test: Test) -> Result:
    """Check a test; exit code 5 where anything contradicts."""
    result = findings(test.experiment)
    problems = [finding for finding in result if not finding.ok]
    seen = measured(test.experiment)
    summary = [f"{len(result)} checks, {len(problems)} contradiction{'' if len(problems) == 1 else 's'}"]
    summary += [f"measured: {', '.join(_range(name, its['range']) for name, its in seen.items())}"] if seen else []
    summary += [f"  contradiction: {finding.message}" for finding in problems]
    summary += [f"  ok: {finding.message}" for finding in result if finding.ok]
    return Result(
        command="check",
        summary=tuple(summary),
        json={
            "problems": [_json(finding) for finding in problems],
            "findings": [_json(finding) for finding in result if finding.ok],
            "measured": seen,
        },
        dataset=_dataset(result),
        figure=lambda: _figure(test.experiment, result),
        exit_code=NEGATIVE_FINDING if problems else 0,
    )


def _json(finding: Finding) -> dict[str, Any]:
    """A finding for scripts."""
    keys = ("rule", "subject", "value", "low", "high", "unit", "message")
    row: dict[str, Any] = or_null({key: getattr(finding, key) for key in keys})
    return row


def _figure(test: Experiment, result: list[Finding]) -> Figure:
    from twindisc_cli.figures.consistency import consistency

    several = Counter(finding.subject for finding in result)
    labels = [f"{f.subject}, {f.why.split()[0]}" if several[f.subject] > 1 else f.subject for f in result]
    strains = [finding.strain for finding in result]
    return consistency(labels, strains, title=f"{test.name}: consistency", note=test.measured.provenance)


def _dataset(result: list[Finding]) -> Dataset:
    strain = np.array([finding.strain for finding in result])
    return Dataset(
        axes=(Axis("finding", np.arange(1, len(result) + 1), "1", "number of the check"),),
        arrays=(
            Array("rule", ("finding",), np.array([f.rule for f in result], dtype=object), "1", "rule applied"),
            Array("message", ("finding",), np.array([f.message for f in result], dtype=object), "1", "what was found"),
            Array(
                "strain",
                ("finding",),
                strain,
                "1",
                "share of the allowed range that is used; above 1 contradicts",
                True,
            ),
        ),
    )
