"""How large a hidden effect is, in units of the detection threshold.

The size is the length, in noise standard deviations over all channels, of what the effect leaves in the noiseless
readings after mu, K and h S have been fitted to them. Length 1 is the threshold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .effects import Drawn
from .hidden import NOTHING, Hidden
from .rig import March, Rig, Trace
from .sensors import CHANNELS, Channels, Plan, read, whiten

Floats = NDArray[np.float64]
_BASE = ("mu", "wear", "convection")
_STEP = 0.01  # change of a base parameter's logarithm for its slope
_DISCS = 0.005  # relative standard deviation of crown and modulus where a definition tells none
_LOAD = 0.007  # relative standard deviation of what a load cell is calibrated to
_SMALL = 0.02  # step of the fit below which the slopes hold


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

    def __init__(self, bench: Bench, faults: Sequence[str] = ()) -> None:
        """March the rig with each base parameter a little changed; `faults` of the sensors are fitted with them."""
        self._bench, self._faults = bench, faults
        self._start = bench.readings([NOTHING])
        self._base = [_minus(self._moved(np.eye(len(_BASE))[i] * _STEP), self._start) for i in range(len(_BASE))]

    def _moved(self, logarithms: Floats) -> Channels:
        """What the sensors read with the base parameters moved, and nothing hidden."""
        factors = np.exp(logarithms)
        changed = {name: getattr(self._bench.rig, name) * float(f) for name, f in zip(_BASE, factors, strict=True)}
        rig = replace(self._bench.rig, **changed)
        return read(rig, March(rig).run(), [NOTHING], self._bench.plan)

    def _seen(self, plan: Plan, readings: Channels) -> Floats:
        """Readings in units of the noise, without what faults of the sensors and tolerances of the discs may be.

        A tolerance is taken off as far as its own standard deviation lets it.
        """
        value = _whitened(plan, readings)
        faults = [_whitened(plan, line) for line in self._lines(plan, readings)]
        tolerances = [_whitened(plan, change) for change in self._off]
        columns = np.column_stack([*faults, *tolerances])
        prior = np.eye(columns.shape[1])[len(faults) :]
        system, value = np.vstack([columns, prior]), np.concatenate([value, np.zeros(len(prior))])
        return np.asarray(value - system @ np.linalg.lstsq(system, value, rcond=None)[0])

    def _lines(self, plan: Plan, readings: Channels) -> list[Channels]:
        """What a torque that was not zeroed and a profile that was not levelled may add to the readings."""
        silent = {name: np.zeros_like(readings[name]) for name in CHANNELS}
        lines, rig = [], self._bench.rig
        if "torque_offset" in self._faults:
            lines.append(silent | {"traction": 1.0 / rig.of_step(rig.loads, plan.traction_time)})
        if "profile_tilt" in self._faults:
            across = np.resize(plan.y / plan.y[-1], readings["profile"].size)
            lines += [silent | {"profile": line} for line in (np.ones_like(across), across)]
        return lines

    @cached_property
    def _off(self) -> list[Channels]:
        """What the readings change when the crown, the modulus and the load are off by one standard deviation."""
        rig, std = self._bench.rig, max(self._bench.rig.declared_std, _DISCS)
        changed = (
            replace(rig, crown_tolerance=rig.crown_tolerance * (1.0 + std)),
            replace(rig, modulus_tolerance=rig.modulus_tolerance * (1.0 + std)),
        )
        discs = [read(other, March(other).run(), [NOTHING], self._bench.plan) for other in changed]
        return [_minus(off, self._start) for off in (*discs, self._bench.readings([Hidden(load=1.0 + _LOAD)]))]

    def size(self, readings: Channels, plan: Plan, *, steps: int = 12) -> float:
        """How far `readings` are from what the base model can be fitted to, in noise units of `plan`.

        With one of the `steps` of the fit it is the length left by the slopes, for which no march is needed.
        """
        slopes = np.column_stack([self._seen(plan, column) / _STEP for column in self._base])
        moved, rest = np.zeros(len(_BASE)), self._seen(plan, _minus(readings, self._start))
        for i in range(steps):
            full = np.linalg.lstsq(slopes, rest, rcond=None)[0]
            step = np.clip(full, -0.4, 0.4)
            if np.abs(full).max() < _SMALL or i == steps - 1:
                break
            moved = moved + step
            after = self._seen(plan, _minus(readings, self._moved(moved)))
            slopes += np.outer(rest - after - slopes @ step, step) / (step @ step)  # Broyden
            rest = after
        return float(np.linalg.norm(rest - slopes @ full))

    def beyond_tolerances(self, readings: Channels, plan: Plan) -> float:
        """The size that is left when the creepages may also err within their tolerance; by slopes only."""
        base = [self._seen(plan, column) / _STEP for column in self._base]
        step = self._bench.rig.step_at(plan.traction_time)
        nominal = np.array(self._bench.rig.creepage)
        tolerances = [self._of_traction(self._creepage_slope, nominal[step] == c, plan) * _tolerance(c) / c
                      for c in np.unique(nominal)]  # fmt: skip
        columns = np.column_stack([*base, *tolerances])
        prior = np.eye(columns.shape[1])[-len(tolerances) :]
        rest = np.concatenate([self._seen(plan, _minus(readings, self._start)), np.zeros(len(tolerances))])
        system = np.vstack([columns, prior])
        return float(np.linalg.norm(rest - system @ np.linalg.lstsq(system, rest, rcond=None)[0]))

    def beside(self, readings: Channels, others: Sequence[Channels], plan: Plan) -> float:
        """The size that is left when other effects, of any size, are fitted beside the base; by slopes only."""
        base = [self._seen(plan, column) / _STEP for column in self._base]
        columns = np.column_stack([*base, *(self._seen(plan, _minus(other, self._start)) for other in others)])
        rest = self._seen(plan, _minus(readings, self._start))
        return float(np.linalg.norm(rest - columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]))

    @cached_property
    def _creepage_slope(self) -> Channels:
        """Change of the readings over the relative change of all creepages."""
        rig = self._bench.rig
        more = replace(
            rig, creepage_error=tuple(e + _STEP * c for e, c in zip(rig.creepage_error, rig.creepage, strict=True))
        )
        change = _minus(read(rig, March(more).run(), [NOTHING], self._bench.plan), self._start)
        return {name: change[name] / _STEP for name in CHANNELS}

    def _of_traction(self, change: Channels, where: NDArray[np.bool_], plan: Plan) -> Floats:
        """A change of the samples `where` of the traction alone, in units of the noise."""
        silent = {name: np.zeros_like(change[name]) for name in CHANNELS}
        return self._seen(plan, silent | {"traction": np.where(where, change["traction"], 0.0)})

    def amount(self, drawn: Drawn, target: float) -> float:
        """How much of the effect is `target` thresholds large, or its largest amount if it cannot be."""
        if drawn.fixed:
            return 1.0
        plan, readings = self._bench.plan, self._bench.readings
        near = _invert(lambda x: self.size(readings([drawn.at(x)]), plan, steps=1), target, drawn.largest)
        return _invert(lambda x: self.size(readings([drawn.at(x)]), plan), target, drawn.largest, near)


def _tolerance(creepage: float) -> float:
    """Standard deviation of a creepage that errs evenly within 0.5 % and 1e-5."""
    return float(np.hypot(0.005 * creepage, 1e-5) / np.sqrt(3.0))


def _minus(one: Channels, other: Channels) -> Channels:
    return {name: one[name] - other[name] for name in CHANNELS}


def _whitened(plan: Plan, readings: Channels) -> Floats:
    return np.concatenate([whiten(plan, name, readings[name]) for name in CHANNELS])


def _invert(measure: Callable[[float], float], target: float, largest: float, start: float = 0.0) -> float:
    """x in (0, largest] with measure(x) = target within 3 %, by secants in the logarithms from `start`."""
    points: list[tuple[float, float]] = []
    x = start or 0.1 * largest
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
