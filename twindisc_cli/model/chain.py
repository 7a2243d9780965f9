"""The stages of the forward model, passed until nothing moves.

The stages feed each other (a worn patch is stiffer, a warm disc may slide more easily), so the chain is passed until
energy, temperature and wear stand still. Everything is vectorised over parameter sets: arrays are (set, point).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from twindisc_cli.effects._effect import Effect, Stage
from twindisc_cli.effects._state import State, summed
from twindisc_cli.laws.law import Law
from twindisc_cli.model import worn
from twindisc_cli.model.base import MODEL_KEYS, BaseParameters
from twindisc_cli.model.experiment import Floats, Ints
from twindisc_cli.model.integration import Setup, Weights
from twindisc_cli.model.patch import AnyPath, OwnPaths, Patch, Paths, WeightedPaths, strips_passed, weighted_paths
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.model.settling import Passes
from twindisc_cli.model.surface import Stops, worn_surface
from twindisc_cli.model.traction_law import slip_of_pressure, traction_law
from twindisc_cli.model.wear_path import (
    SHARES,
    Course,
    LoadHistory,
    Scaled,
    WearPath,
    carried_paths,
    local_paths,
    paths_near,
    weights_on,
)
from twindisc_cli.model.wear_path.path import CROWNED
from twindisc_cli.physics import combined, disc_heat, line_contact, polach, spin, third_body, unlike
from twindisc_cli.physics.flash import Solid, flash_temperature

if TYPE_CHECKING:
    from twindisc_cli.model.forward import ForwardModel

SURE_PASSES, MOST_PASSES = 20, 200
"""Passes that are made in any case, and at the most: between them they end where nothing more is gained, as where a
step in the temperature has no fixed point."""
FEW_PASSES = 8
"""Passes of a first look, at the most: what has not settled by then seldom does."""
CARRIED = ("temperature", "energy", "wear_index", "normalised_creepage", "flash_before")
"""What a pass begins with as the one before it left it; the power left becomes `power_before`."""
SPIN_ARM_OF_A_LINE = 0.5
"""On each strip of a line spin acts on T like a lateral creepage of phi a / 2: in full sliding T = mu N (1 - phi^2
<x^2> / 2 v^2), with <x^2> = a^2 / 4 under the pressure. To the creepage along rolling it adds - phi y."""
RECORDING: Sequence[Stage] = ("surface", "sensor")
"""Stages behind which nothing feeds back."""
_NOTHING = np.zeros((1, 1))
SETTLED, COUNTED = 1e-7, 1e-4
"""Change of the energy in a pass at which the chain stands still, and at which it does so for a first look, and an
integration of local wear may begin."""
KELVINS = 1.0
"""Warming from which on passes are mixed by its logarithm [K]; below, its sign may change."""
MOST_WARMING = 10.0
"""Largest of these logarithms: 11,000 K."""
SAME_WEAR = 1e-9
"""Relative difference of histories of wear that is none: what changes no wear leaves them the same to rounding."""
LITTLE = 0.1
"""Change in a pass over that in the one before it, below which the next is taken to change less by as much again."""
MOST_PASSES_OF_PATHS, PATH_SETTLED = 4, 1e-3
"""How often a history of loads is integrated, and the relative change of the sections at which that ends."""
_STANDING = 1e-9
"""A speed [m/s] at which nothing rolls."""
_SMALLEST_CAPACITY = 1e-30
"""Of friction [N]: what transmits no force is driven far beyond full slip, by a finite number."""


@dataclass(frozen=True)
class Chain:
    """The stages, for one list of parameter sets."""

    model: ForwardModel
    base: BaseParameters
    effects: list[tuple[Effect, dict[str, Floats]]]
    sets: int
    own: Paths | None = None

    def beginning(self, near: State | None) -> State:
        """What the first pass begins from: what settled nearby, or points of which nothing is known yet."""
        shape = self._blank.energy.shape
        if near is None or near.energy.shape[1] != shape[1]:
            return self._blank
        passed = ["temperature", "energy", "wear_index", "normalised_creepage", "power"]
        if self.is_local:
            passed.append("wear_factor")
        known = {name: np.broadcast_to(getattr(near, name), shape) for name in passed}
        return self._blank.replace(**known, flash_before=near.flash_before)

    def settled(self, state: State, within: float = SETTLED) -> State:
        """Pass through the stages until energy, temperature and wear stand still, or a pass would only be repeated.

        Where a pass changed much less than the one before it, so would the next, which is left out if that is nothing.
        """
        passes, last, driven = Passes(), state, self.driven(state)
        state = self.run(driven)
        whole = np.maximum(state.energy.max(axis=1, keepdims=True), 1e-30)
        change = _change(last, state)
        for number in range(1, MOST_PASSES if within < COUNTED else FEW_PASSES):
            if change < within or self._repeats(driven, state):
                break
            if number >= SURE_PASSES and not passes.progress(_moved(last, state, whole) / within):
                break
            last = _mixed(passes, last, state, whole)
            driven = self.driven(last)
            state = self.run(driven)
            before, change = change, _change(last, state)
            if change < LITTLE * before and change * change < within * before:
                break
        return state

    def _repeats(self, driven: State, state: State) -> bool:
        """Whether the pass after a state has the same to work on as the one that led there, to the last digit.

        Where nothing is known to wear and no effect asks how far a test has come, one pass is all.
        """
        if np.any(self._per_energy) or "heat" in self._acts:
            return False
        return _are_same(self.driven(state), driven)

    @property
    def needs_integration(self) -> bool:
        """Whether no path of one load and one K all over holds for the history."""
        return self.is_local or self.model.loads_change

    def on_integrated(self, begin: State, of: slice) -> tuple[Chain, State]:
        """The chain on paths of its own history, and what settles on them.

        Where loads change, the integration goes again until it has passed the sections that are worn on what it finds.
        """
        state = self.settled(begin, COUNTED)
        for _ in range(MOST_PASSES_OF_PATHS):
            passed = self.section(state)
            chain = replace(self, own=self.integrated(state, of))
            state = chain.settled(state)
            section = chain.section(state)
            if self._one_load(state, section) or np.allclose(section, passed, rtol=PATH_SETTLED):
                break
        return chain, state

    def _one_load(self, state: State, section: Floats) -> bool:
        """Whether no set wears under loads that differ, so far as they make a difference."""
        test = self.model.experiment
        if test.rig.is_line or test.history.separate:
            return True
        histories, begun = self._loads(state, section), test.measured.start is not None
        return not any(loads.changes or (begun and loads.departs) for loads in histories)

    def _loads(self, state: State, section: Floats) -> list[LoadHistory]:
        """Sections and loads of every set; the whole history in proportion where it wears beyond the reach."""
        ratio = np.broadcast_to(state.normal_load / state.nominal_load, section.shape)
        worn = np.maximum.accumulate(section, axis=1)
        if self.model.shows_wear:
            most = worn[:, -1:]
            worn = worn * (np.minimum(most, self.model.reach) / np.where(most > 0.0, most, 1.0))
        return [LoadHistory(row, loads) for row, loads in zip(worn, ratio, strict=True)]

    def start(self) -> State:
        """The operating points before anything is known of energy and temperature."""
        declared, first = self.model.declared(self.sets), self._of_disc1()
        return declared.replace(
            creepage=declared.creepage * self._at_points(self.base.creepage_factor),
            mu=np.broadcast_to(self._at_points(self.base.mu), declared.energy.shape),
            wear_factor=1.0 + first,
            disc1_share=first / (1.0 + first),
        )

    def _of_disc1(self) -> Floats:
        """Worn depth of disc 1 over disc 2's, K1 H2 R2 / (K2 H1 R1) where both K are known, (set, 1) [1]."""
        rig = self.model.experiment.rig
        resists = 2.0 * np.pi * rig.track_radius(1) * rig.disc1.hardness / self.model.circumference_hardness
        return np.nan_to_num(self.model.experiment.options.disc1_wear_coefficient / (self.base.K * resists))

    def operation(self) -> State:
        """The operating points as the discs are driven, before anything is known of energy and temperature."""
        return self._apply("operation", self._blank)

    def driven(self, before: State) -> State:
        """What a pass works on: what acts before the traction, with what the last pass left."""
        carried = {name: getattr(before, name) for name in CARRIED}
        fresh = self._blank.replace(power_before=before.power, **carried)
        state = self._apply("friction", self._apply("operation", fresh))
        state = self._apply("contact", self._apply("traction", state))
        return self._local(self._apply("wear", state), before)

    def run(self, driven: State) -> State:
        """One pass from what it works on through all stages but the sensors."""
        return self._heat(self._traction(driven))

    def _apply(self, stage: Stage, state: State) -> State:
        for act in self._acts.get(stage, ()):
            state = act(state)
        return state

    @cached_property
    def _acts(self) -> Mapping[Stage, Sequence[Callable[[State], State]]]:
        """What acts on the whole patch at each stage: effects, then declared laws."""
        acts: dict[Stage, list[Callable[[State], State]]] = {}
        for effect, parameters in self.effects:
            if not effect.local and not effect.is_off(**parameters):
                acts.setdefault(effect.stage, []).append(partial(effect.apply, **parameters))
        for law in self.model.experiment.laws.values():
            acts.setdefault(law.stage, []).append(law.apply)
        return acts

    @cached_property
    def is_local(self) -> bool:
        """Whether K differs from strip to strip."""
        return any(effect.local and not effect.is_off(**parameters) for effect, parameters in self.effects) or bool(
            self._local_laws
        )

    @cached_property
    def _local_laws(self) -> list[Law]:
        """The laws that are asked strip by strip."""
        return [law for law in self.model.experiment.laws.values() if law.local]

    @cached_property
    def _blank(self) -> State:
        """What every pass begins from."""
        return self.start()

    def _factors(self, index: Floats, place: Floats, passes: Floats, of: Ints) -> Floats:
        """K over its base value in strips, as `wear_path.Factors` has it, for some of the sets."""
        by_index = self._by_index(index, of)
        return by_index * self._by_strip(place, passes) if self._local_laws else by_index

    def _by_index(self, index: Floats, of: slice | Ints = slice(None)) -> Floats:
        """K over its base value by what acts on the wear index of strips (set, any) [N/m2]."""
        state = self._blank.replace(wear_index=index, wear_factor=np.ones_like(index))
        for effect, parameters in self.effects:
            if effect.local and not effect.is_off(**parameters):
                state = effect.apply(state, **{name: values[of] for name, values in parameters.items()})
        return state.wear_factor

    def _by_strip(self, place: Floats, passes: Floats) -> Floats:
        """K over its base value by what acts on the place [m] of strips and the passes over them, (set, any)."""
        state = self._blank.replace(place=place, passes=passes, wear_factor=np.ones_like(passes))
        for law in self._local_laws:
            state = law.apply(state)
        return state.wear_factor

    def _local(self, state: State, before: State) -> State:
        """The mean of what differs from strip to strip, each weighted by the energy it dissipates.

        What the wear index does is on a line between some of the points. Place and passes of strips are weighted by
        their load, which it is where all slides. The mean of a product of what the wear index does and what place and
        passes do is taken for the product of both.
        """
        if not self.is_local:
            return state
        points, section = self.model.points, self.section(before)
        ratio = before.normal_load / before.nominal_load
        paths = self._paths(before, section)
        some, load_ratio, index, creepage = (
            np.broadcast_to(values, section.shape)[:, points.of_strips]
            for values in (section, ratio, state.wear_index, state.normalised_creepage)
        )
        strips = index[..., None] * paths.spread(some, load_ratio, creepage)
        factor = points.strips(self._by_index(strips.reshape(self.sets, -1)).reshape(strips.shape) @ SHARES)
        if self._local_laws:
            place, load, passes = strips_passed(paths, section, ratio, state.cycles)
            own = self._by_strip(*(v.reshape(self.sets, -1) for v in (place, passes))).reshape(load.shape)
            factor = factor * np.sum(load * own, axis=-1)
        return state.replace(wear_factor=state.wear_factor * factor)

    def integrated(self, state: State, of: slice) -> Paths:
        """The paths on which the strips wear through a state's history, of every set or of the first."""
        section = self.section(state)
        paths, (distinct, place) = self._weighted(state, section), self._distinct_wear(state, section, of)
        results = [
            self._local_or_carried(path, state, section, distinct) for path in paths.parts if isinstance(path, WearPath)
        ]
        if len(place) < self.sets:
            return replace(paths, parts=[part[0] for part in results])
        weights = [np.broadcast_to(weight, (self.sets, 1)) for weight in paths.weights]
        return OwnPaths(
            [
                WeightedPaths([part[number] for part in results], [weight[i : i + 1] for weight in weights])
                for i, number in enumerate(place)
            ]
        )

    def _distinct_wear(self, state: State, section: Floats, of: slice) -> tuple[Ints, Ints]:
        """Of some sets the first of each history of wear, and the number of the history of each of them."""
        history = [section, state.normal_load, state.power, state.normalised_creepage, state.rolling_speed]
        own = [v for effect, parameters in self.effects if effect.local for v in parameters.values()]
        rows = np.concatenate([*(np.broadcast_to(v, section.shape) for v in history), *own], axis=1)[of]
        distinct, place = list[int](), list[int]()
        for number, row in enumerate(rows):
            same = (n for n, i in enumerate(distinct) if np.allclose(row, rows[i], rtol=SAME_WEAR, atol=0.0))
            if (found := next(same, None)) is None:
                found, distinct = len(distinct), [*distinct, number]
            place.append(found)
        return np.array(distinct), np.array(place)

    def _local_or_carried(self, path: WearPath, state: State, section: Floats, of: Ints) -> list[AnyPath]:
        """The path of each of some sets, with contact, wander and crown of a path of one load and one K."""
        by_place = any(law.covariate == "place" for law in self._local_laws)
        if self._one_load(state, section):
            course = self._course(state, section, path.profile_scale, of)
            factors = partial(self._factors, of=of)
            return [*local_paths(self.model.crowned(path.crown), path, course, factors, by_place=by_place)]
        every = self._loads(state, section)
        histories = [every[i] for i in of]
        setup = Setup(self.model.crowned(path.crown), path.contact, path.wander, path.start)
        if not self.is_local:
            return [*paths_near(setup, histories)]
        course = self._course(state, section, _as_it_is, of)

        def weights(cases: list[int], nodes: Floats, y: Floats) -> Weights:
            return weights_on(nodes, y, course=course.of(cases), factors=partial(self._factors, of=of[cases]))

        return [*carried_paths(setup, histories, weights=weights, by_place=by_place)]

    def _course(self, state: State, section: Floats, scale: Callable[[Floats], Scaled], of: Ints) -> Course:
        """The history of some sets as strips see it, under the load of a path."""
        scaled = scale(np.broadcast_to(state.normal_load / state.nominal_load, section.shape))
        own = np.maximum.accumulate(section / scaled.section, axis=1)
        pace = state.power / np.maximum(state.rolling_speed, _STANDING) / (scaled.along * scaled.across)
        creepage, cycles = (np.broadcast_to(v, own.shape) for v in (state.normalised_creepage, state.cycles))
        return Course(own, pace, creepage, cycles).of(of)

    def _at_points(self, values: Floats) -> Floats:
        """(set, iteration) at the operating points; (set, 1) as it is."""
        return values[:, self.model.points.iteration] if values.shape[1] > 1 else values

    def _traction(self, state: State) -> State:
        """Traction of the patch as worn so far, the power and the energy.

        Where nothing is worn under one load, the patch is the same at every point.
        """
        section, ratio = self.section(state), state.normal_load / state.nominal_load
        test = self.model.experiment
        if not section.any() and np.all(ratio == ratio[:, :1]):
            section, ratio = section[:, :1], ratio[:, :1]
        patch = self._paths(state, section).patch(section, ratio)
        patch = patch.with_layer(test.options.layer_compliance, line=test.rig.is_line)
        force, work, xi = self._rolling(state, patch)
        power = state.rolling_speed * work
        return state.replace(
            traction_ratio=force / state.recorded_load,
            power=power,
            energy=summed(power * state.duration, state.begins),
            wear_index=power / np.maximum(state.rolling_speed, _STANDING) / patch.area,
            normalised_creepage=xi,
            flash_before=partial(self._flash, power, state.creepage, state.rolling_speed, patch),
        )

    def _flash(self, power: Floats, creepage: Floats, speed: Floats, patch: Patch) -> Floats:
        """Mean flash temperature of the patch [K], (set, point)."""
        thermal = self.model.experiment.thermal
        if thermal is None:
            return np.full((1, 1), np.nan)
        return flash_temperature(
            power=power,
            creepage=creepage,
            a=patch.a,
            b=patch.b,
            speed=speed,
            solid=Solid(thermal.conductivity, thermal.density, thermal.specific_heat),
            line=self.model.experiment.rig.is_line,
        ).mean

    def _rolling(self, state: State, patch: Patch) -> tuple[Floats, Floats, Floats]:
        """Longitudinal force, work of all forces and the spin moment per length rolled [N], normalised creepage."""
        if self.model.experiment.rig.is_line:
            return self._rolling_along_a_line(state, patch)
        drive = state.slope / _capacity(state)
        x = patch.stiffness * drive * state.creepage
        along, sideways, size = np.sign(x), _NOTHING, np.abs(x)
        if np.any(state.lateral_creepage) or np.any(state.spin):
            y = patch.stiffness_y * drive * state.lateral_creepage
            z = spin.stiffness(patch.stiffness, patch.stiffness_y, patch.a, patch.b) * drive * state.spin
            along, across, turn = spin.quotients(x, y, z, patch.ratio, self.model.experiment.rig.poisson_ratio)
            sideways = across * state.lateral_creepage + turn * spin.arm(patch.a, patch.b) * state.spin
            size = np.sqrt(x**2 + y**2 + z**2)
        return self._with_pressure(state, patch, np.maximum(size, 1e-30), (along, along * state.creepage + sideways))

    def _with_pressure(
        self, state: State, patch: Patch, size: Floats, quotients: tuple[Floats, Floats]
    ) -> tuple[Floats, Floats, Floats]:
        """Longitudinal force and work [N] at a drive (its size, and quotients of both), and the normalised creepage.

        Between discs of unlike elasticity the pressure drives too.
        """
        capacity, (along, work), rig = _capacity(state), quotients, self.model.experiment.rig
        if not rig.dundurs:
            level = capacity * self._law(state, size, patch)
            return level * along, level * work, size
        slip = slip_of_pressure(rig, patch.a, patch.b, state.normal_load)
        of_slip = patch.stiffness * state.slope / capacity * slip
        both = np.hypot(size, of_slip)
        level = capacity * self._law(state, both, patch)
        acts = unlike.acting(size, of_slip, None if rig.is_line else patch.ratio, rig.poisson_ratio)
        force, of_pressure = acts.force * along + acts.own_force, acts.work * along + acts.own_work
        return level * force, level * (acts.force * work + acts.own_force * state.creepage + of_pressure * slip), both

    def _rolling_along_a_line(self, state: State, patch: Patch) -> tuple[Floats, Floats, Floats]:
        """The same for a line contact: strips across its width, each of which spin gives a creepage of its own."""
        if not np.any(state.spin):
            return self._rolling_of_a_strip(state, patch, state.creepage, state.lateral_creepage)
        sideways = np.hypot(state.lateral_creepage, state.spin * patch.a * SPIN_ARM_OF_A_LINE)
        strips = [
            self._rolling_of_a_strip(state, patch, state.creepage - state.spin * patch.b * place, sideways)
            for place in line_contact.PLACES
        ]
        force, work, square = (
            sum((share * strip[i] ** power for share, strip in zip(line_contact.SHARES, strips, strict=True)), _NOTHING)
            for i, power in ((0, 1), (1, 1), (2, 2))
        )
        return force, work, np.sqrt(square)

    def _rolling_of_a_strip(
        self, state: State, patch: Patch, creepage: Floats, sideways: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Force, work and normalised creepage of a line all of which had these creepages."""
        drive = state.slope / _capacity(state)
        along, across = patch.stiffness * drive * creepage, patch.stiffness_y * drive * sideways
        size = np.maximum(np.hypot(along, across), 1e-30)
        east, north = combined.direction(along, across, creepage, sideways)
        return self._with_pressure(state, patch, size, (east, east * creepage + north * sideways))

    def _law(self, state: State, xi: Floats, patch: Patch) -> Floats:
        """T/(mu N) of the declared traction law, moved towards the exact theory where an effect says so.

        With another slope in the area of slip, the curve is corrected as Polach has it; a third body has a curve of
        its own.
        """
        if np.any(patch.layer):
            plain = self._law(state, xi, replace(patch, layer=np.zeros((1, 1))))
            return third_body.saturation(xi, patch.layer, plain)
        if np.any(state.slip_slope != 1.0):
            plain = self._law(state.replace(slip_slope=np.ones((1, 1))), xi, patch)
            return plain * polach.correction(xi, state.slip_slope)
        rig, declared = self.model.experiment.rig, self.model.experiment.options.traction
        if declared == "exact":
            return self._exact(xi, patch)
        plain = traction_law(rig, declared).saturation(xi, patch.ratio)
        if not np.any(state.exactness):
            return plain
        return (1.0 - state.exactness) * plain + state.exactness * self._exact(xi, patch)

    def _exact(self, xi: Floats, patch: Patch) -> Floats:
        """T/(mu N) of the exact theory on the patch as worn."""
        plain = traction_law(self.model.experiment.rig, "exact").saturation(xi, patch.ratio)
        return plain + worn.departure(xi, patch.ratio, patch.square) if np.any(patch.square) else plain

    def section(self, state: State) -> Floats:
        """Worn section at every point [m2], of both discs together; a law that takes K below zero wears nothing."""
        factor = np.maximum(state.wear_factor, 0.0)
        if factor.shape[1] == 1:
            return state.energy * (factor * self._per_energy)
        before = np.where(state.begins > 0.0, 0.0, np.roll(state.energy, 1, axis=1))
        return summed((state.energy - before) * factor, state.begins) * self._per_energy

    @cached_property
    def _per_energy(self) -> Floats:
        """Worn section per dissipated energy (set, 1) [m2/J]; zero where K is not known."""
        return np.nan_to_num(self.base.K) / self.model.circumference_hardness

    def _paths(self, state: State, section: Floats) -> Paths:
        return self.own or self._weighted(state, section)

    def _weighted(self, state: State, section: Floats) -> WeightedPaths:
        enough = self.model.reach
        if not self.model.shows_wear:
            enough = max(enough, float(np.max(section / (state.normal_load / state.nominal_load))))
        wander = self._wander(state, section)
        asked = enough, state.half_space.tobytes(), wander.tobytes(), state.crown.tobytes()
        if asked not in self._known_paths:
            path = partial(self.model.path, section=enough)
            declared = self.model.experiment.options.contact
            self._known_paths[asked] = weighted_paths(path, declared, state.half_space, wander, state.crown)
        return self._known_paths[asked]

    def _wander(self, state: State, section: Floats) -> Floats:
        """Wander (set, 1) [m] of paths that are scaled to one other load, or all of whose loads are scaled together.

        They scale it with all that lies across.
        """
        test, ratio = self.model.experiment, state.normal_load / state.nominal_load
        if test.rig.is_line or test.history.separate or not np.any(state.wander):
            return state.wander
        one_load = not section.any() or self._one_load(state, section)
        if not one_load and (self.is_local or test.measured.start is not None):
            return state.wander
        load = ratio[:, -1:] if one_load else np.array([[own.first] for own in self._loads(state, section)])
        return np.asarray(state.wander / CROWNED.to(load).across)

    @cached_property
    def _known_paths(self) -> dict[tuple[float, bytes, bytes, bytes], WeightedPaths]:
        """The paths by how far they reach, and shares of half-space contact, wanders and crowns as bytes."""
        return {}

    def _heat(self, state: State) -> State:
        """Disc temperature, exact for a power that is constant within each point."""
        thermal = self.model.experiment.thermal
        if thermal is None:
            return state
        convection = np.broadcast_to(self.base.convection, state.energy.shape)
        state = self._apply("heat", state.replace(heat=state.power, convection=convection))
        known = np.isfinite(state.convection)
        temperature = disc_heat.temperatures(
            power=state.heat,
            duration=state.duration,
            capacity=thermal.heat_capacity,
            convection=np.where(known, state.convection, 0.0),
            environment=state.environment,
            initial=thermal.initial_temperature,
            shaft=disc_heat.Shaft(state.shaft_conductance, state.shaft_capacity),
            begins=state.begins,
        )
        temperature = np.where(known, temperature, np.nan)
        return state.replace(temperature=temperature, disc_temperature=temperature)

    def _give(self, state: State, section: Floats, stops: Stops) -> Floats:
        """2 p / E* at the stops (set, stop, 1), over the share of the half-space contact; infinite without it."""
        test = self.model.experiment
        share = np.ones((1, 1)) if test.options.contact == "half_space" else state.half_space
        if not np.any(share):
            return np.full((1, 1, 1), np.inf)
        load = np.broadcast_to(state.normal_load, section.shape)[:, stops.point]
        area = self._paths(state, section).patch(section[:, stops.point], load / state.nominal_load).area
        return np.asarray(2.0 * load / area / test.rig.effective_modulus / np.maximum(share, 1e-9))[..., None]

    def before_recording(self) -> tuple[Chain, Ints]:
        """The chain of the sets that differ in more than what is recorded, and which of them each set is (set,)."""
        base = {name: getattr(self.base, name) for name in MODEL_KEYS.values()}
        early = [(effect, parameters) for effect, parameters in self.effects if effect.stage not in RECORDING]
        columns = [*base.values(), *(value for _, parameters in early for value in parameters.values())]
        rows = [row.tobytes() for row in np.concatenate(columns, axis=1)]
        distinct = {row: number for number, row in enumerate(dict.fromkeys(rows))}
        place = np.array([distinct[row] for row in rows])
        if len(distinct) == self.sets:
            return self, place
        first = np.unique(place, return_index=True)[1]
        early = [(effect, {key: value[first] for key, value in own.items()}) for effect, own in early]
        few = BaseParameters(**{name: value[first] for name, value in base.items()})
        return Chain(self.model, few, early, len(first), self.own), place

    def read(self, chain: Chain, state: State, place: Ints, *, profiled: bool) -> Prediction:
        """What the sensors record of a state in which a chain settled; place: which of its sets each set is (set,)."""
        points, section = self.model.points, chain.section(state)
        stops, paths = self.model.stops if profiled else None, chain._paths(state, section)
        if stops is not None:
            surface = worn_surface(paths.through(section), state, section, stops)
            state = state.replace(surface=replace(surface, give=chain._give(state, section, stops)))
        if chain.sets < self.sets:
            state, section, paths = state.of_sets(place), section[place], paths.of_sets(place)
        state = self._apply("sensor", self._apply("surface", state))
        wide = section.shape
        height = stops.sample(state.surface) if stops and state.surface else np.empty((self.sets, 0))
        return Prediction(
            traction=points.traction(np.broadcast_to(state.traction_ratio, wide)),
            profile=np.where(np.isfinite(self.base.K), height, np.nan),
            temperature=points.temperature(np.broadcast_to(state.disc_temperature, wide)),
            state=state,
            section=section,
            paths=paths,
            own=self.base.own,
        )


def _change(last: State, state: State) -> float:
    """What a pass changed of the energy (relative), of temperature [K] and wear (a hundredth of both), at the most.

    NaN, below no tolerance and above none, where that is not finite: nothing follows from it.
    """
    warmth = float(np.fmax.reduce(np.abs(state.temperature - last.temperature), axis=None, initial=0.0))
    wear = float(np.max(np.abs(state.wear_factor - last.wear_factor)))
    energy = float(np.max(np.abs(state.energy - last.energy) / np.maximum(state.energy, 1e-30)))
    most = max(energy, warmth / 100.0, wear / 100.0)
    return most if np.isfinite(most) else np.nan


def _moved(last: State, state: State, whole: Floats) -> Floats:
    """How far energy, over the whole (set, 1) [J], and temperature, a hundredth of it [K], moved: (set, point)."""
    warmth = np.nan_to_num(np.abs(state.temperature - last.temperature)) / 100.0
    return np.asarray(np.maximum(np.abs(state.energy - last.energy) / whole, warmth))


def _are_same(one: State, other: State) -> bool:
    """Whether two states are the same at every point, but for what a pass begins with from the one before it."""
    return all(
        value is vars(other)[name] or (isinstance(value, np.ndarray) and np.array_equal(value, vars(other)[name]))
        for name, value in vars(one).items()
        if name not in (*CARRIED, "power_before")
    )


def _mixed(passes: Passes, last: State, state: State, whole: Floats) -> State:
    """Where to pass next: a state with energy and temperature as the last passes let expect them.

    Warming above KELVINS counts by its logarithm, over which powers of it are lines; energy by its share of the whole
    (set, 1) [J].
    """
    around, known, points = state.environment, np.isfinite(state.temperature), state.energy.shape[1]
    if not known.any():
        energy = passes.next(last.energy / whole, state.energy / whole)
        return state.replace(energy=np.maximum(energy * whole, 0.0))
    before, after = (
        np.concatenate([s.energy / whole, np.arcsinh(np.where(known, s.temperature - around, 0.0) / KELVINS)], axis=1)
        for s in (last, state)
    )
    mixed = passes.next(before, after)
    temperature = around + KELVINS * np.sinh(np.clip(mixed[:, points:], -MOST_WARMING, MOST_WARMING))
    return state.replace(
        energy=np.maximum(mixed[:, :points] * whole, 0.0), temperature=np.where(known, temperature, np.nan)
    )


def _as_it_is(load_ratio: Floats) -> Scaled:
    """The scale of what is not taken to another load."""
    one = np.ones_like(load_ratio)
    return Scaled(one, one, one)


def _capacity(state: State) -> Floats:
    """mu N [N], and where that is next to nothing the smallest by which can be divided."""
    capacity = state.mu * state.normal_load
    return np.where(np.abs(capacity) < _SMALLEST_CAPACITY, _SMALLEST_CAPACITY, capacity)
