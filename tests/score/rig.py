"""The score's rig: one record with everything that is true of it, and the march through its history.

Every iteration is cut into wear steps; within one the patch is fixed and friction, power and temperature run in
small time steps. Then the discs wear by what was dissipated, spread over the strips of the patch, and are pressed
together anew as soon as enough is gone to show:

    S(y) = K / (H V) * int P_l dt / (q * time of a revolution),   removed volume = K E / H exactly
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from math import hypot, prod

import numpy as np
from numpy.typing import NDArray

from .contact import Ellipse, HalfSpace, hertz_ellipse
from .heat import Plant
from .hidden import NOTHING, Hidden, Moment
from .traction import equivalent_ellipse, linear_force, saturation, strip_share
from .worn_patch import XI, beyond_ellipse

Floats = NDArray[np.float64]
VICKERS = 9.80665e6  # Pa in one HV
_DEEPEST = 1.5
"""What a track is followed to, in sections that full sliding takes off it."""
_MOMENT = tuple(f.name for f in fields(Moment))
# xi, and how far the force has turned: read off the twelve points of CONTACT (open-source release 2025-07-23,
# revision 2707) with longitudinal and lateral creepage together, a/b = 0.63
_TURNED = (
    (0.0, 0.43, 0.72, 0.88, 1.06, 1.69, 1.86, 2.78, 3.3, 4.31, 20.0),
    (0.0, 0.035, 0.06, 0.11, 0.13, 0.25, 0.3, 0.68, 0.74, 0.84, 1.0),
)


@dataclass(frozen=True)
class Rig:
    """Everything that is true of one test but for what is hidden. SI; creepages and mu as ratios."""

    load: float
    rpm: float
    radius: float
    crown: tuple[float, float]  # transverse radii of disc 1 and 2 [m]
    creepage: tuple[float, ...]  # of each step, as the test definition says
    iterations: tuple[int, ...]  # of each step
    revolutions: int  # of one iteration
    capacity: float
    environment: float  # deg C
    contact: str
    law: str  # of traction, as it is
    declared_law: str  # as the test definition says
    mu: float
    wear: float  # K
    convection: float  # h S [W/K]
    creepage_error: tuple[float, ...]  # true minus nominal creepage of each step
    loads: tuple[float, ...] = ()  # of each step over `load`; none: one load
    speeds: tuple[float, ...] = ()  # of each step over `rpm`; none: one speed
    load_tolerance: float = 1.0  # true load over the nominal one
    crown_tolerance: float = 1.0  # true curvature across over the one of `crown`
    modulus_tolerance: float = 1.0  # true modulus over `modulus`
    declared_std: float = 0.0  # of the crown and the modulus, relative, as the definition says
    modulus: float = 206e9
    hardness: float = 700.0  # HV
    presses: int = 12  # how often the discs are pressed together anew while they wear as much as is expected
    longest: float = 8.0  # small time step [s]
    cells: int = 10  # of the half patch along rolling
    strips: int = 14  # of the first half patch across

    poisson = 0.3

    def fine(self) -> Rig:
        """The same rig marched finely enough that its numbers err by less than the noise can show."""
        return replace(self, presses=160 if self.contact == "hertz" else 80, longest=3.0, cells=16, strips=24)

    def undisturbed(self) -> Rig:
        """The same discs marched coarsely and without errors, which hardly matter for what a track transmits."""
        return replace(
            self, presses=24, longest=8.0, cells=10, strips=14, contact="half_space", law="", declared_law="",
            creepage_error=(0.0,) * len(self.creepage), load_tolerance=1.0,
        )  # fmt: skip

    @property
    def speed(self) -> float:
        """V [m/s]."""
        return self.radius * self.rpm * 2.0 * np.pi / 60.0

    def load_over(self, step: int) -> float:
        """Load of a step over `load`."""
        return self.loads[step] if self.loads else 1.0

    def speed_over(self, step: int) -> float:
        """Speed of a step over that of `rpm`."""
        return self.speeds[step] if self.speeds else 1.0

    def duration(self, step: int) -> float:
        """Of one iteration of a step [s]."""
        return self.revolutions * 60.0 / (self.rpm * self.speed_over(step))

    @property
    def ends(self) -> Floats:
        """When each iteration ends [s]."""
        return np.cumsum([self.duration(step) for step in self.steps])

    def iteration_at(self, time: Floats) -> NDArray[np.intp]:
        """The iteration, from 0, at each `time` [s]."""
        return np.searchsorted(self.ends, time, side="right")

    def step_at(self, time: Floats) -> NDArray[np.intp]:
        """The step, from 0, at each `time` [s]."""
        return np.array(self.steps)[self.iteration_at(time)]

    def of_step(self, values: Sequence[float], time: Floats) -> Floats:
        """The value of the step at each `time` [s]; 1 where there are no `values`."""
        if not values:
            return np.ones_like(time)
        return np.array(values)[self.step_at(time)]

    @property
    def shear_modulus(self) -> float:
        """G [Pa]."""
        return self.modulus_tolerance * self.modulus / (2.0 * (1.0 + self.poisson))

    @property
    def contact_modulus(self) -> float:
        """E* [Pa]."""
        return self.modulus_tolerance * self.modulus / (2.0 * (1.0 - self.poisson**2))

    @property
    def curvature_y(self) -> float:
        """Relative transverse curvature of the unworn discs [1/m]."""
        return self.crown_tolerance * (1.0 / self.crown[0] + 1.0 / self.crown[1])

    @property
    def steps(self) -> Sequence[int]:
        """The step of each iteration, from 0."""
        return [step for step, count in enumerate(self.iterations) for _ in range(count)]

    def ellipse(self, curvature_y: float | None = None) -> Ellipse:
        """The Hertz ellipse under the nominal load."""
        curvature_y = self.curvature_y if curvature_y is None else curvature_y
        return hertz_ellipse(self.load, self.contact_modulus, 2.0 / self.radius, curvature_y)

    @property
    def creepage_scale(self) -> float:
        """The creepage [1] at xi = 1 of the unworn discs."""
        return self.mu * self.load / linear_force(self.ellipse(), self.shear_modulus, 1.0)[0]

    @property
    def edge(self) -> float:
        """Half of the track [m] whether it is worn deep or still as wide as the elastic patch."""
        return float(np.cbrt(self.half_width() ** 3 + self.ellipse().b ** 3))

    def half_width(self) -> float:
        """Half of the track [m] when all is dissipated at full sliding; from the circle's segment it cuts."""
        return float(np.cbrt(1.5 * sum(self.section(step) for step in self.steps) / self.curvature_y))

    def section(self, step: int) -> float:
        """Cross-section [m2] that an iteration of a step takes off at full sliding."""
        pressure = self.mu * self.load * self.load_over(step) / (self.hardness * VICKERS)
        return self.wear * pressure * self.revolutions * self.creepage[step]


@dataclass
class Trace:
    """What happened. Small steps: time (step + 1,) at their ends, the rest (step,) within them.

    ratio is T over the nominal load; moments holds every covariate by its name in a `Moment`; profiles maps
    iterations completed to the depth [m] worn off disc 1 and 2.
    """

    time: Floats
    ratio: Floats
    power: Floats
    rise: Floats
    y: Floats
    moments: dict[str, Floats]
    profiles: dict[int, tuple[Floats, Floats]] = field(default_factory=dict)

    @property
    def wear_index(self) -> Floats:
        """Power per length rolled and area of the patch [N/m2] (step,)."""
        return self.moments["wear_index"]

    @property
    def energy(self) -> float:
        """Dissipated in all [J]."""
        return float(self.power @ np.diff(self.time))


class _Patch:
    """The contact patch as it wears: half-space or the ellipse of the best circle."""

    def __init__(self, rig: Rig, hidden: Sequence[Hidden]) -> None:
        self._rig = rig
        self.kind = next((h.contact for h in hidden if h.contact), rig.contact)
        self._nominal = rig.load * rig.load_tolerance * float(np.prod([h.load for h in hidden]))
        self.load, first = self._nominal * rig.load_over(0), rig.ellipse()
        heaviest = float(np.cbrt(max(rig.loads, default=1.0)))
        self._spread, self._evenly = max(h.wander for h in hidden), any(h.wanders_evenly for h in hidden)
        reach = 1.15 * max(1.3 * rig.half_width(), 1.3 * first.b * heaviest) + 2.5 * self._spread
        count = 2 * int(np.ceil(reach / first.b * rig.strips))
        self.dy = 2.0 * reach / count
        self._longest = 1.2 * first.a * heaviest * float(np.cbrt(max(self._nominal / rig.load, 1.0)))
        self._lay(count)
        self.worn = np.zeros((2, count))
        self._due, self._pending = np.zeros(count), 0.0
        self._gone, self._expected = 0.0, sum(rig.section(step) for step in rig.steps)
        self._other_disc = sum(h.other_disc for h in hidden)
        self.press()

    def _lay(self, count: int) -> None:
        """Lay so many strips beside each other."""
        self.y = (np.arange(count) + 0.5 - 0.5 * count) * self.dy
        self._spreading = spreading(self.y, self._spread, evenly=self._evenly)
        if self.kind == "half_space":
            self._solver = HalfSpace(
                load=self.load, modulus=self._rig.contact_modulus, curvature_x=2.0 / self._rig.radius, y=self.y,
                half_length=self._longest, cells=self._rig.cells,
            )  # fmt: skip

    def press(self, *, wears: bool = False) -> None:
        """Press the discs together; wears: what is due of wear is taken implicitly in half-space contact.

        A patch that comes near the outermost strips gets more of them: some effects wear more than was planned.
        """
        gap = 0.5 * self._rig.curvature_y * self.y**2 + self.worn.sum(axis=0)
        if self.kind == "half_space":
            self.line_load = self._solver.solve(gap, self._step if wears else None)
            self.half_length = self._solver.half_lengths()
            self.ellipse = equivalent_ellipse(self.half_length, self.dy)
            widest = float(np.abs(self.y[self.line_load > 0.0]).max())
        else:
            self.ellipse = self._best_ellipse(gap)
            across = np.maximum(1.0 - (self.y / self.ellipse.b) ** 2, 0.0)
            self.half_length = self.ellipse.a * np.sqrt(across)
            self.line_load = self.load * across / (across.sum() * self.dy)
            widest = self.ellipse.b
        if widest > 0.9 * self.y[-1]:
            more = len(self.y) // 8
            self.worn, self._due = np.pad(self.worn, ((0, 0), (more, more))), np.pad(self._due, more, mode="edge")
            self._lay(len(self.y) + 2 * more)
            self.press(wears=wears)

    @property
    def _step(self) -> Floats:
        """Depth over line load (y, y') [m2/N] of the wear that is due."""
        return np.asarray(self._due[:, None] ** 0.5 * self._spreading * self._due[None, :] ** 0.5)

    def _best_ellipse(self, gap: Floats) -> Ellipse:
        """The Hertz ellipse of the best circle through the gap within the ellipse's own half-width, by bisection."""

        def ellipse(half_width: float) -> Ellipse:
            weight = np.clip((half_width - np.abs(self.y)) / self.dy + 0.5, 0.0, 1.0)
            curvature = 2.0 * float(np.polyfit(self.y, gap, 2, w=np.sqrt(weight))[0])
            rig = self._rig
            return hertz_ellipse(
                self.load, rig.contact_modulus, 2.0 / rig.radius, max(curvature, 1e-3 * rig.curvature_y)
            )

        low, high = 3.0 * self.dy, float(self.y[-1])
        while high - low > 1e-5 * high:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if ellipse(middle).b > middle else (low, middle)
        return ellipse(high)

    def wear(self, removed: Floats, volume: float) -> None:
        """Take off `removed` [m2/N] (y,) times the line load, `volume` [m2] of cross-section in all."""
        self._due += removed
        self._pending += volume
        if self._pending >= 0.75 * self.enough:
            self._take_off()

    def _take_off(self) -> None:
        """Take off what is due, and press the discs together anew."""
        self.press(wears=True)
        self.worn += self._shared(self._step @ self.line_load)
        self._gone += self._pending
        self._due, self._pending = np.zeros_like(self.y), 0.0

    def carry(self, load_over: float) -> None:
        """Go on under so many times the rig's load."""
        if self._nominal * load_over == self.load:
            return
        if self._pending > 0.0:
            self._take_off()
        self.load = self._nominal * load_over
        if self.kind == "half_space":
            self._solver.press_with(self.load)
        self.press()

    @property
    def gone(self) -> float:
        """Cross-section [m2] worn off when the discs were last pressed together."""
        return self._gone

    @property
    def enough(self) -> float:
        """Cross-section [m2] after which the discs are pressed together anew: a part of all, or of what shapes them."""
        elastic = 2.0 / 3.0 * self._rig.curvature_y * self._rig.ellipse().b ** 3
        return min(self._expected, 2.0 * (elastic + self._gone)) / self._rig.presses

    def depths(self) -> tuple[Floats, Floats]:
        """Worn off disc 1 and 2 [m] (y,), with what has been taken off since they were pressed together."""
        worn = self.worn
        if self._pending > 0.0:
            worn = worn + self._shared(self._step @ self.line_load)
        return worn[0].copy(), worn[1].copy()

    def _shared(self, depth: Floats) -> Floats:
        """A depth (y,) brought to the volume that is due and shared between the discs (2, y)."""
        depth = depth * (self._pending / max(depth.sum() * self.dy, 1e-300))
        return np.outer([self._other_disc, 1.0 - self._other_disc], depth)

    @property
    def area(self) -> float:
        """Of the patch [m2]."""
        return float(2.0 * self.half_length.sum() * self.dy)


class _WornTrack:
    """What a track beyond an ellipse transmits (`worn_patch`), over the section worn off it at full sliding."""

    def __init__(self, rig: Rig) -> None:
        patch = _Patch(rig, [NOTHING])
        nodes = [(0.0, beyond_ellipse(patch.y, patch.half_length, patch.line_load))]
        while nodes[-1][0] < _DEEPEST * sum(rig.section(step) for step in rig.steps):
            patch.wear(np.full_like(patch.y, patch.enough / rig.load), patch.enough)
            if patch.gone > 1.2 * nodes[-1][0]:
                nodes.append((patch.gone, beyond_ellipse(patch.y, patch.half_length, patch.line_load)))
        self._section = np.array([section for section, _ in nodes])
        self._beyond = [beyond for _, beyond in nodes]
        self._stiffening = np.array([beyond.stiffening for beyond in self._beyond])

    def stiffening(self, section: float) -> float:
        """Linear stiffness over that of the equivalent ellipse [1] at a worn section [m2]."""
        return float(np.interp(section, self._section, self._stiffening))

    def departure(self, section: float, xi: float) -> float:
        """T / (mu N) of the exact theory beyond that of the equivalent ellipse [1]."""
        after = min(max(int(np.searchsorted(self._section, section)), 1), self._section.size - 1)
        part = (section - self._section[after - 1]) / (self._section[after] - self._section[after - 1])
        before, behind = (self._beyond[node].departure for node in (after - 1, after))
        return float(np.interp(xi, XI, before + min(part, 1.0) * (behind - before)))


_worn_track = lru_cache(maxsize=32)(_WornTrack)


class _OwnTrack:
    """The same of a patch itself, whose loads change: found anew under another load or where a fifth more is gone."""

    def __init__(self, patch: _Patch) -> None:
        self._patch, self._known = patch, (0.0, 0.0)

    def stiffening(self, section: float) -> float:
        """Linear stiffness over that of the equivalent ellipse [1] at a worn section [m2]."""
        self._renew(section)
        return self._stiffening

    def departure(self, section: float, xi: float) -> float:
        """T / (mu N) of the exact theory beyond that of the equivalent ellipse [1]."""
        self._renew(section)
        return float(np.interp(xi, XI, self._beyond.departure))

    def _renew(self, section: float) -> None:
        patch, (load, gone) = self._patch, self._known
        if load != patch.load or section > max(1.2 * gone, patch.enough):
            self._beyond = beyond_ellipse(patch.y, patch.half_length, patch.line_load)
            self._stiffening, self._known = self._beyond.stiffening, (patch.load, section)


def spreading(y: Floats, spread: float, *, evenly: bool) -> Floats:
    """The matrix that spreads wear over the lateral positions of the contact; identity without wander.

    Evenly: two shafts, each between two ends. Of one alone the matrix has negative eigenvalues: waves across the track
    would grow that a disc wears off, since they stay in their place on it however the other disc moves.
    """
    if spread == 0.0:
        return np.eye(y.size)
    away = np.abs(y[:, None] - y[None, :])
    if evenly:
        one = np.clip((1.5**0.5 * spread - away) / (y[1] - y[0]) + 0.5, 0.0, 1.0)
        kernel = one @ one
    else:
        kernel = np.exp(-0.5 * (away / spread) ** 2)
    return np.asarray(kernel / kernel.sum(axis=1).max())


class March:
    """One run through the history of a rig."""

    def __init__(self, rig: Rig, hidden: Sequence[Hidden] = (NOTHING,)) -> None:
        """`hidden`: the effects that act."""
        self._hidden = tuple(hidden) or (NOTHING,)
        self._rig = rig = replace(rig, crown_tolerance=rig.crown_tolerance * prod(h.crown for h in self._hidden))
        self._patch = _Patch(rig, self._hidden)
        self._plant = Plant(capacity=rig.capacity, convection=rig.convection, hidden=self._hidden)
        self._law = next((h.law for h in self._hidden if h.law), rig.law)
        self._track: _WornTrack | _OwnTrack | None = None
        if self._patch.kind == "half_space":
            self._track = _OwnTrack(self._patch) if rig.loads else _worn_track(rig.undisturbed())
        self._moment, self._heat = Moment(), (0.0, 0.0)
        self._rows: list[tuple[float, ...]] = []

    def run(self) -> Trace:
        """March through all iterations."""
        rig, profiles = self._rig, {}
        last = -1
        for done, step in enumerate(rig.steps, start=1):
            nominal = rig.creepage[step] + rig.creepage_error[step]
            creepage = nominal + sum(h.creepage for h in self._hidden)
            if step != last:
                self._moment.time_in_step, last = 0.0, step
                self._patch.carry(rig.load_over(step))
                self._nominal, self._speed = rig.load * rig.load_over(step), rig.speed * rig.speed_over(step)
            parts = int(np.ceil(rig.section(step) / self._patch.enough))
            small = int(np.ceil(rig.duration(step) / parts / rig.longest))
            for _ in range(parts):
                self._wear_step(creepage, small, rig.duration(step) / parts / small)
            profiles[done] = self._patch.depths()
        strips = len(self._patch.y)
        profiles = {
            stop: (np.pad(one, (strips - len(one)) // 2), np.pad(other, (strips - len(other)) // 2))
            for stop, (one, other) in profiles.items()
        }
        rows = np.array(self._rows)
        moments = dict(zip(_MOMENT, rows.T[1:], strict=True))
        time = np.concatenate([[0.0], moments["time"]])
        rise = np.concatenate([[0.0], moments["rise"]])
        return Trace(time, rows[:, 0], moments["power"], rise, self._patch.y, moments, profiles)

    def _wear_step(self, creepage: float, count: int, step: float) -> None:
        patch, moment, rig = self._patch, self._moment, self._rig
        flexibility = float(np.prod([h.flexibility for h in self._hidden]))
        stiffer = self._track.stiffening(patch.gone) if self._track else 1.0
        stiffness = linear_force(patch.ellipse, rig.shear_modulus, flexibility / stiffer)
        moment.creepage, moment.sliding_speed = creepage, abs(creepage) * self._speed
        moment.greatest_creepage = max(moment.greatest_creepage, creepage)
        moment.power = self._force(creepage, stiffness)[1]  # what a law of power asks in the first small step
        worn, slid, xi = 0.0, 0.0, 0.0
        for _ in range(count):
            ratio, power, xi = self._force(creepage, stiffness)
            moment.power, moment.wear_index = power, power / (self._speed * patch.area)
            worn += step * power * prod(h.wear(moment) for h in self._hidden if h.wear)
            slid += step * power
            self._warm(power, step)
            moment.time += step
            moment.time_in_step += step
            moment.cycles += step * self._speed / (2.0 * np.pi * rig.radius)
            moment.energy += step * power
            moment.rise = self._heat[0]
            self._rows.append((ratio, *(getattr(moment, name) for name in _MOMENT)))
        self._wear_off(worn, xi, slid / (count * step))

    def _warm(self, power: float, step: float) -> None:
        """Let the disc take `power` [W] for a `step` [s]."""
        moment = self._moment
        entering = power * prod(h.warming(moment) for h in self._hidden if h.warming)
        cooling = prod(h.cooling(moment) for h in self._hidden if h.cooling)
        room = sum(h.room(moment) for h in self._hidden if h.room)
        self._heat = self._plant.advance(moment.time, self._heat, entering, step, cooling, room)

    def _force(self, creepage: float, stiffness: tuple[float, float]) -> tuple[float, float, float]:
        """T over the nominal load, dissipated power [W] and xi at this moment."""
        load, moment = self._patch.load, self._moment
        mu = self._rig.mu * prod(h.friction(moment) for h in self._hidden if h.friction)
        creepage += sum(h.slip(moment) for h in self._hidden if h.slip)
        slope = prod(h.slope(moment) for h in self._hidden if h.slope)
        side = sum(h.lateral for h in self._hidden)
        along, across = slope * stiffness[0] * creepage, slope * stiffness[1] * side
        xi = hypot(along, across) / (mu * load)
        level = saturation(xi, self._law)
        if self._track and self._law == "exact":
            level += self._track.departure(self._patch.gone, xi)
        total, slip = hypot(along, across), hypot(creepage, side)
        if total == 0.0:
            return 0.0, 0.0, 0.0
        # the force turns from the linear theory's direction to that of the slip as the patch slides
        turned = float(np.interp(xi, *_TURNED))
        east = (1.0 - turned) * along / total + turned * creepage / slip
        north = (1.0 - turned) * across / total + turned * side / slip
        force = mu * load * level / hypot(east, north)
        power = self._speed * force * (creepage * east + side * north)
        return force * east / self._nominal, power, xi

    def _wear_off(self, energy: float, xi: float, power: float) -> None:
        """Wear by `energy` [J] dissipated with a mean `power` [W] at the normalised creepage `xi`."""
        rig, patch = self._rig, self._patch
        if energy <= 0.0:
            return
        volume = rig.wear / (rig.hardness * VICKERS) * energy / (2.0 * np.pi * rig.radius)
        share = np.ones_like(patch.y)
        if xi > 0.0 and saturation(xi, self._law) < 0.999:
            share = strip_share(patch.line_load, patch.half_length, patch.ellipse, xi, patch.load)
            share[patch.line_load == 0.0] = 1.0
        for h in self._hidden:
            if h.wear_across:
                share = share * h.wear_across(patch.y / rig.edge)
        share = share / (share @ patch.line_load * patch.dy)
        removed = share * volume
        for h in self._hidden:
            if h.wear_locally:
                # an empty strip has the index of a vanishing one
                length = np.maximum(2.0 * patch.half_length, 1e-12)
                removed = removed * h.wear_locally(power * share * patch.line_load / (self._speed * length))
        patch.wear(removed, float(removed @ patch.line_load * patch.dy))
