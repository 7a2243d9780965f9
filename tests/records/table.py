"""The table of errors on samples that were held out, and of what comes back in halves and thirds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .errors import Errors

KIND = {"b": "blocks", "f": "folds", "l": "groups"}


@dataclass(frozen=True)
class Halves:
    """Of every name in a part of a record its probability, and whether it is in the set of another part."""

    record: str
    kind: str
    back: list[tuple[float, bool]]


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
            share, reported = (float(np.mean([pair[i] for pair in part.back])) for i in (1, 0))
            lines.append(f"{part.record}, {part.kind}: named in another's set {share:.0%}, reported {reported:.2f}")
    if sum(bool(part.back) for part in parts) > 1:
        back = [pair for part in parts for pair in part.back]
        share, reported = (float(np.mean([pair[i] for pair in back])) for i in (1, 0))
        lines.append(f"all parts: named in another's set {share:.0%} (>= 80 %), reported {reported:.2f} (within 0.1)")
    return "\n".join(lines)


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
