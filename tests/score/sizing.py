"""How large a hidden effect is, in units of the detection threshold.

The size is the length, in noise standard deviations over all channels, of what the effect changes in the noiseless
readings after everything that mu, K and h S could absorb is projected out. Length 1 is the threshold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .effects import Drawn
from .hidden import NOTHING, Hidden
from .rig import March, Rig, Trace
from .sensors import CHANNELS, Channels, Plan, read, whiten

Floats = NDArray[np.float64]
_STEP = 0.01  # relative change of a base parameter


@dataclass(frozen=True)
class Bench:
    """A rig with its plan, its undisturbed march, and what the base parameters can absorb."""

    rig: Rig
    plan: Plan
    trace: Trace

    def readings(self, hidden: Sequence[Hidden]) -> Channels:
        """What noiseless sensors read while `hidden` acts; marches again only where it must."""
        trace = March(self.rig, hidden).run() if any(h.marches for h in hidden) else self.trace
        return read(self.rig, trace, hidden, self.plan)


class Ruler:
    """Measures sizes on one bench."""

    def __init__(self, bench: Bench) -> None:
        """March the rig with each base parameter a little changed."""
        self._bench = bench
        self._start = bench.readings([NOTHING])
        bases = [
            replace(bench.rig, **{name: getattr(bench.rig, name) * (1.0 + _STEP)})
            for name in ("mu", "wear", "convection")
        ]
        self._base = [self._minus_start(read(rig, March(rig).run(), [NOTHING], bench.plan)) for rig in bases]

    def _minus_start(self, readings: Channels) -> Channels:
        return {name: readings[name] - self._start[name] for name in CHANNELS}

    def change(self, hidden: Sequence[Hidden]) -> Channels:
        """What `hidden` changes in the readings."""
        return self._minus_start(self._bench.readings(hidden))

    def size(self, change: Channels, plan: Plan) -> float:
        """The length of a change in units of the detection threshold under the noise of `plan`."""
        base = np.linalg.qr(np.column_stack([_whitened(plan, column) for column in self._base]))[0]
        white = _whitened(plan, change)
        return float(np.linalg.norm(white - base @ (base.T @ white)))

    def amount(self, drawn: Drawn, target: float) -> float:
        """How much of the effect is `target` thresholds large, or its largest amount if it cannot be."""
        if drawn.fixed:
            return 1.0
        return _invert(lambda x: self.size(self.change([drawn.at(x)]), self._bench.plan), target, drawn.largest)


def _whitened(plan: Plan, readings: Channels) -> Floats:
    return np.concatenate([whiten(plan, name, readings[name]) for name in CHANNELS])


def _invert(measure: Callable[[float], float], target: float, largest: float) -> float:
    """x in (0, largest] with measure(x) = target within 3 %, by secants in the logarithms."""
    points: list[tuple[float, float]] = []
    x = 0.1 * largest
    for _ in range(9):
        value = measure(x)
        points.append((float(np.log(x)), float(np.log(max(value, 1e-9)))))
        if abs(value / target - 1.0) < 0.03 or (x == largest and value < target):
            break
        below = max((p for p in points if p[1] < np.log(target)), default=None)
        above = min((p for p in points if p[1] >= np.log(target)), default=None)
        if below and above:
            share = (np.log(target) - below[1]) / max(above[1] - below[1], 1e-9)
            x = float(np.exp(below[0] + np.clip(share, 0.1, 0.9) * (above[0] - below[0])))
        else:
            x = min(x * float(np.clip(target / max(value, 1e-9), 0.02, 20.0)) * (1.05 if below else 0.95), largest)
    return x
