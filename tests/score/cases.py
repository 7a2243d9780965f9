"""Which tests a score consists of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .effects import CATALOGUE
from .hiding import near_misses
from .making import Case
from .unknowns import STAGES, kinds

GROUPS = {"null": 0.18, "single": 0.22, "sizes": 0.06, "pairs": 0.13, "unknown": 0.27, "near": 0.14}
"""Share of each group.

Nothing hidden; one effect of the catalogue at 12 thresholds, at other sizes; two effects; a law that is in no
catalogue; an effect of the catalogue by another formula.
"""
SAME_CHANNEL = 0.4
"""Share of the pairs whose effects show in one channel."""
OTHER_SIZES = (3.0, 6.0, 25.0, 50.0)
_UNSEEN = ("misalignment",)  # without a declared yaw or a lateral force its T/N is that of a softer contact
_FIXED = ("exact_elasticity", "half_space_contact")  # are there or not, at a size that nobody chooses


def plan(tests: int, seed: int, groups: Sequence[str] = tuple(GROUPS)) -> list[Case]:
    """About `tests` cases, the same for the same `seed`; of the `groups` only."""
    total = sum(GROUPS[g] for g in groups)
    return [
        case
        for number, group in enumerate(GROUPS)
        if group in groups
        for case in _group(group, max(round(tests * GROUPS[group] / total), 1), 1_000_000 * seed + 100_000 * number)
    ]


def _group(group: str, count: int, first: int) -> Iterator[Case]:
    rng = np.random.default_rng(first)
    shown = set(CATALOGUE) - set(_UNSEEN)
    names, quantities, near = (list(rng.permutation(sorted(table))) for table in (shown, STAGES, near_misses()))
    sizeable = [name for name in names if name not in _FIXED]
    for i in range(count):
        size = 12.0
        if group == "null":
            effects: tuple[str, ...] = ()
        elif group == "single":
            effects = (str(names[i % len(names)]),)
        elif group == "sizes":
            effects = (str(sizeable[i % len(sizeable)]),)
            size = OTHER_SIZES[i % len(OTHER_SIZES)]
        elif group == "pairs":
            effects, size = _pair(rng, same_channel=rng.random() < SAME_CHANNEL), 15.0
        elif group == "near":
            effects, size = (str(near[i % len(near)]),), (12.0, 30.0)[i % 2]
        else:
            effects = (str(rng.choice(kinds(str(quantities[i % len(quantities)])))),)
            size = 12.0 if (i // len(quantities)) % 2 == 0 else 25.0
        yield Case(first + i, effects, size, group)


def _pair(rng: np.random.Generator, *, same_channel: bool) -> tuple[str, ...]:
    """Two effects that show first in the same channel, or in two."""
    names = [name for name in CATALOGUE if name not in (*_FIXED, *_UNSEEN)]
    while True:
        one, other = (str(name) for name in rng.choice(names, size=2, replace=False))
        if (CATALOGUE[one][0] == CATALOGUE[other][0]) is same_channel:
            return one, other
