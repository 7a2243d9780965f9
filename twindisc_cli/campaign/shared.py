"""What the repeats of each group lack together: what `close-loop` named in single tests, fitted in all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twindisc_cli.campaign.plan import Job, read
from twindisc_cli.campaign.table import Row
from twindisc_cli.definition import load
from twindisc_cli.effects import catalogue
from twindisc_cli.laws.law import Law
from twindisc_cli.loop.group import SINGLE, GroupDiagnosis, Shared, SharedParameter, diagnose_group
from twindisc_cli.report.words import p_value

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Common:
    """A group and what its tests lack."""

    group: str
    found: GroupDiagnosis

    @property
    def summary(self) -> tuple[str, ...]:
        """The outcome in lines."""
        where = f"group {self.group}, {len(self.found.tests)} tests"
        if not self.found.shared:
            return (f"{where}: nothing that was found in one of them holds for the group",)
        terms = [f"{where}: {_term(term)}" for term in self.found.shared]
        errors = [
            f"group {self.group}: error of the {channel} {error.constant:.3g} {error.unit} without, "
            f"{error.left_out:.3g} in each test by the parameters of the others"
            for channel, error in self.found.errors.items()
            if np.isfinite(error.left_out)
        ]
        planned = self.found.next_experiment
        return (*terms, *errors, *([f"group {self.group}: next: {planned.why}"] if planned else []))

    @property
    def json(self) -> dict[str, Any]:
        """The outcome for scripts."""
        planned = self.found.next_experiment
        return {
            "group": self.group,
            "tests": list(self.found.tests),
            "terms": [_json(term, self.found.tests) for term in self.found.shared],
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


def common_of(jobs: Sequence[Job], rows: Sequence[Row], folder: Path, progress: Progress) -> list[Common]:
    """Every group of at least two tests that close-loop could diagnose."""
    groups: dict[str, list[tuple[Job, Row]]] = {}
    for job, row in zip(jobs, rows, strict=True):
        if row.group and not row.failed:
            groups.setdefault(row.group, []).append((job, row))
    results = []
    for group, members in groups.items():
        if len(members) > 1:
            tests = [read(job).experiment for job, _ in members]
            laws = _laws([row for _, row in members], folder)
            names = [name for name in _named([row for _, row in members]) if name in catalogue()]
            results.append(Common(group, diagnose_group(tests, names, laws, progress)))
    return results


def _named(rows: Sequence[Row]) -> list[str]:
    """What the tests were told to lack, and what that could not be told from."""
    names: list[str] = []
    for row in rows:
        terms = [*_cell(row, "effects"), *_cell(row, "laws")]
        names += terms
        names += [
            other for term in terms for kind in ("alternatives", "resembles") for other in _cell(row, f"{term} {kind}")
        ]
    return list(dict.fromkeys(names))


def _cell(row: Row, column: str) -> list[str]:
    return [name for name in str(row.found.get(column) or "").split("; ") if name]


def _laws(rows: Sequence[Row], folder: Path) -> dict[str, Law]:
    """The laws learnt on the tests, as their revised definitions have them; of one name the most probable."""
    best: dict[str, tuple[float, Law]] = {}
    for row in rows:
        if names := _cell(row, "laws"):
            learnt = load(folder / row.test / "revised.toml").experiment.laws
            for name in names:
                probability = float(row.found.get(f"{name} probability [1]") or 0.0)
                if name not in best or probability > best[name][0]:
                    best[name] = (probability, learnt[name])
    return {name: law for name, (_, law) in best.items()}


def _term(term: Shared) -> str:
    count = f"{len(term.acts)} of {term.shown}"
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
    return f"{p.mean:.3g} ({p.low:.3g} to {p.high:.3g}){unit}"


def _json(term: Shared, tests: Sequence[str]) -> dict[str, Any]:
    return {
        "term": term.name,
        "holds": term.holds,
        "tests": [tests[i] for i in term.acts],
        "probability": term.probability.tolist(),
        "share": {"value": term.share, "low": term.low, "high": term.high},
        "gain": term.gain,
        "parameters": {key: _parameter(p) for key, p in term.parameters.items()},
        "p_one_set": term.p_one,
        "one_set": bool(term.p_one > SINGLE) if np.isfinite(term.p_one) else None,
        "alternatives": list(term.alternatives),
    }


def _parameter(p: SharedParameter) -> Mapping[str, Any]:
    return {**vars(p), "value": p.value.tolist(), "std": p.std.tolist()}
