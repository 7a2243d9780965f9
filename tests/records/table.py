"""The table of errors on samples that were held out, and of what comes back in halves and thirds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .answers import Back
from .errors import Errors

KIND = {"b": "blocks", "f": "folds", "l": "groups"}


@dataclass(frozen=True)
class Halves:
    """What becomes of every name in a part of a record in the other parts."""

    record: str
    kind: str
    back: list[Back]


def table(errors: Sequence[Errors], parts: Sequence[Halves]) -> str:
    """Errors of T/N of every split, and what they come to."""
    heads = " ".join(f"{head:>7s}" for head in ("base", "loop", "student", "average", "process"))
    lines = [f"{'held out':34s} {heads}  named; the student's law"]
    for one in errors:
        row = f"{one.base:7.4f} {one.loop:7.4f} {one.student:7.4f} {one.average:7.4f} {one.process:7.4f}"
        names = f"{', '.join(one.named) or 'nothing'}; {one.chosen}"
        lines.append(f"{f'{one.record}, {one.split}':34s} {row}  {names}")
        if np.isfinite(one.level[0]):
            lines.append(f"    level of each test known{'':13s} {one.level[0]:7.4f} {one.level[1]:7.4f}")
        if np.isfinite(one.warm[0]):
            lines.append(f"    temperature [K]{'':14s} {one.warm[1]:7.2f} {one.warm[0]:7.2f}")
    for kind in ("blocks", "folds", "groups"):
        lines += _summary(kind, [one for one in errors if KIND[one.split[0]] == kind])
    for part in parts:
        if part.back:
            lines.append(f"{part.record}, {part.kind}: {_shares(part.back)}")
    if sum(bool(part.back) for part in parts) > 1:
        lines.append(f"all parts (>= 80 %): {_shares([back for part in parts for back in part.back])}")
    return "\n".join(lines)


def _shares(back: Sequence[Back]) -> str:
    """How often a name is in another's set, beside what is reported of it and of its set."""
    found, name, of_set = (float(np.mean([getattr(b, of) for b in back])) for of in ("found", "probability", "of_set"))
    return f"named in another's set {found:.0%}; reported of the set {of_set:.0%}, of the name {name:.0%}"


def _summary(kind: str, errors: Sequence[Errors]) -> list[str]:
    """Ratio of the loop's error to the student's over the splits of one kind."""
    if not errors:
        return []
    ratio, to_average = (np.array([one.loop / getattr(one, of) for one in errors]) for of in ("student", "average"))
    pooled, beside = (float(np.exp(np.mean(np.log(values)))) for values in (ratio, to_average))
    above = sum(one.loop > 1.001 * one.base for one in errors)
    return [
        f"{kind}: loop / student {pooled:.2f} (geometric mean; / average {beside:.2f}), "
        f"at most 1.1 in {np.mean(ratio <= 1.1):.0%}; above the base model in {above} of {len(errors)}"
    ]
