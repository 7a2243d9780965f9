"""What the repeats of each group lack together, and how the level that each of them has wanders."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twindisc_cli.campaign.groups import few
from twindisc_cli.campaign.plan import Job, read
from twindisc_cli.campaign.table import Row
from twindisc_cli.loop.group import SINGLE, GroupDiagnosis, Shared, diagnose_group
from twindisc_cli.loop.members import SharedParameter
from twindisc_cli.report.levels import level_json, level_text
from twindisc_cli.report.words import p_value, with_interval

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Common:
    """A group and what its tests lack."""

    group: str
    found: GroupDiagnosis

    @property
    def summary(self) -> tuple[str, ...]:
        """The outcome in lines."""
        return tuple(f"group {self.group}{line}" for line in self._lines())

    def _lines(self) -> Iterator[str]:
        count = f", {len(self.found.tests)} tests"
        if not self.found.shared:
            yield f"{count}: nothing that these tests show holds for the group"
        yield from (f"{count}: {_term(term, self.found.tests)}" for term in self.found.shared)
        yield from (f": {name} is refused: {why}" for name, why in self.found.refused.items())
        yield from (f": {level_text(levels)}" for levels in self.found.levels.values())
        for channel, error in self.found.errors.items():
            if np.isfinite(error.left_out):
                yield (
                    f": error of the {channel} {error.constant:.3g} {error.unit} without, {error.left_out:.3g} in "
                    f"tests left out, by the others; {error.left_out_at_own_level:.3g} with the level of each known"
                )
        if self.found.next_experiment:
            yield f": next: {self.found.next_experiment.why}"

    @property
    def json(self) -> dict[str, Any]:
        """The outcome for scripts."""
        planned = self.found.next_experiment
        return {
            "group": self.group,
            "tests": list(self.found.tests),
            "terms": [_json(term, self.found.tests) for term in self.found.shared],
            "levels": {key: level_json(levels, self.found.tests) for key, levels in self.found.levels.items()},
            "refused": dict(self.found.refused),
            "error": {channel: vars(error) for channel, error in self.found.errors.items()},
            "next_experiment": None if planned is None else vars(planned),
        }

    @property
    def columns(self) -> dict[str, dict[str, float]]:
        """For each test, how probably each term acts in it, given the whole group."""
        return {
            test: {f"{term.name} in group [1]": float(term.probability[i]) for term in self.found.shared}
            for i, test in enumerate(self.found.tests)
        }


def common_of(jobs: Sequence[Job], rows: Sequence[Row], progress: Progress) -> list[Common]:
    """Every group of at least two tests that close-loop could diagnose."""
    groups: dict[str, list[Job]] = {}
    for job, row in zip(jobs, rows, strict=True):
        if row.group and not row.failed:
            groups.setdefault(row.group, []).append(job)
    return [
        Common(group, diagnose_group([read(job).experiment for job in members], progress))
        for group, members in groups.items()
        if len(members) > 1
    ]


def _term(term: Shared, tests: Sequence[str]) -> str:
    count = f"{len(term.acts)} of {term.shown}{few([tests[i] for i in term.acts], len(tests))}"
    values = ", ".join(f"{key} = {_value(p)}" for key, p in term.parameters.items())
    one = ""
    if np.isfinite(term.p_one):
        one = f"; one set of parameters {'agrees' if term.p_one > SINGLE else 'is refused'} ({p_value(term.p_one)})"
    others = f"; the group cannot separate it from {', '.join(term.alternatives)}" if term.alternatives else ""
    share = f"90 %: {100.0 * term.low:.0f} to {100.0 * term.high:.0f} % of such tests"
    return f"{term.name} in {term.holds} ({count}; {share}): {values}{one}{others}"


def _value(p: SharedParameter) -> str:
    unit = "" if p.unit == "1" else f" {p.unit}"
    if not np.isfinite(p.low):
        return f"{p.mean:.3g}{unit}"
    return f"{with_interval(p.mean, p.low, p.high)}{unit}"


def _json(term: Shared, tests: Sequence[str]) -> dict[str, Any]:
    return {
        "term": term.name,
        "holds": term.holds,
        "tests": [tests[i] for i in term.acts],
        "probability": term.probability.tolist(),
        "share": {"value": term.share, "low": term.low, "high": term.high},
        "gain": term.gain,
        "parameters": {
            key: {**vars(p), "value": p.value.tolist(), "std": p.std.tolist()} for key, p in term.parameters.items()
        },
        "p_one_set": term.p_one,
        "one_set": bool(term.p_one > SINGLE) if np.isfinite(term.p_one) else None,
        "alternatives": list(term.alternatives),
    }
