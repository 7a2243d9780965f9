"""The forward model: base parameters and effects give the traction, profile and temperature at the measured points.

    operation -> friction -> traction -> contact -> wear -> heat -> sensor

    xi = k G a b C11 v / (mu N),  T = mu N f(xi),  P = V v T                      traction, power
    T, Ty, M = mu N f(r) (q1, q2, q3 l),  P = V (v T + vy Ty + phi M)              with lateral creepage and spin
    T = mu N f(r) q,  P = mu N f(r) V (q v + m v_p)                                discs of unlike elasticity
    S  = integral of (K/H) P dt / (2 pi R),  profile and patch from the wear path  wear
    C dT/dt = P - hS (T - T_env)                                                   heat (Eq. 18)

v, vy are the creepages along and across rolling, V the rolling speed, phi the spin; C is the heat capacity of the disc,
hS its convection coefficient times surface; the other symbols are those of the modules that compute them.
Load, speed and yaw are those of each step; in a pause nothing rolls, and the disc cools. Every load finds the profile
that those before it have left.
The stages feed each other, so the `chain` is passed until they stand still. Everything is vectorised over parameter
sets: arrays are (set, point).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect, Stage
from twindisc_cli.effects._state import State
from twindisc_cli.model.base import BaseParameters, column
from twindisc_cli.model.chain import SETTLED, Chain
from twindisc_cli.model.experiment import Contact, Experiment, Floats, Ints, Rig
from twindisc_cli.model.patch import CROWNS, Paths
from twindisc_cli.model.points import Points, operating_points
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.model.surface import Stops, recorded_sections
from twindisc_cli.model.wear_path import CREEPAGES, WearPath, first_section, is_tabulated, wear_path
from twindisc_cli.model.wear_path.carried import PIECE

Parameters = Mapping[str, Floats]
IntegratedSets = Literal["each", "first", "none"]


@dataclass(frozen=True, eq=False)
class ForwardModel:
    """One test, ready to be predicted many times. Equal to itself alone: what was found of it can be kept by it."""

    experiment: Experiment

    @cached_property
    def points(self) -> Points:
        """Where the model is evaluated."""
        return operating_points(self.experiment)

    def read_at(self, times: Floats, values: Floats) -> Floats:
        """Values (set, point) at times [s] (sample,), each from the points of its own iteration: (set, sample)."""
        return self.points.reading(self.experiment.history, times, within=True)(values)

    @cached_property
    def circumference_hardness(self) -> float:
        """2 pi R H: K E per worn section [N/m]; R is disc 2's, or disc 1's where disc 2 is straight."""
        disc = self.experiment.rig.disc2
        return 2.0 * np.pi * self.radius * disc.hardness

    @property
    def radius(self) -> float:
        """Rolling radius of the disc whose profile wears [m]."""
        return float(self.experiment.rig.track_radius(2))

    @cached_property
    def loads_change(self) -> bool:
        """Whether the profile depends on the history of the load: neither along a line nor in steps of their own.

        Recorded new discs have heights of their own, which no other load than the rig's scales.
        """
        history = self.experiment.history
        loads = history.load_factor[history.driven]
        if self.experiment.rig.is_line or history.separate or not len(loads):
            return False
        scaled = np.append(loads, loads[0] if self.experiment.measured.start is None else 1.0)
        return bool(np.ptp(np.log(scaled)) > PIECE)

    @cached_property
    def slips(self) -> NDArray[np.bool_]:
        """Whether the discs slip in each step, along rolling, across or by spin, as declared effects say, (step,)."""
        acting = [(catalogue()[name], columns) for name, columns in self._all_effects({}, 1).items()]
        state = Chain(self, BaseParameters(np.ones(1)).columns(1), acting, 1).operation()
        creepage = np.abs(state.creepage) + np.abs(state.lateral_creepage) + np.abs(state.spin)
        slips = (state.rolling_speed * creepage)[0, self.points.of_cut] > 0.0
        step = self.experiment.history.step[self.points.iteration[self.points.of_cut]]
        return np.asarray(np.bincount(step, slips) > 0.0)

    @cached_property
    def reach(self) -> float:
        """Largest worn section the paths are made for [m2]: four times the recorded or the declared one."""
        rig, history = self.experiment.rig, self.experiment.history
        pace = history.duration * history.speed_factor * history.load_factor
        slid = np.cumsum(pace * np.abs(history.creepage)) * rig.rolling_speed
        sections = [first_section(rig), *(4.0 * section for section in self._recorded_sections(slid))]
        wear_coefficient = self.experiment.options.wear_coefficient
        if np.isfinite(wear_coefficient):
            sections.append(1.2 * wear_coefficient * rig.normal_load * float(slid[-1]) / self.circumference_hardness)
        return max(sections) / min(1.0, float(history.load_factor.min()))

    def _recorded_sections(self, slid: Floats) -> list[float]:
        """Worn sections [m2] that profiles and a balance show, by the end of the distance slid [m].

        slid: so far, (iteration,).
        """
        profile, mass, rig = self.experiment.measured.profile, self.experiment.measured.mass, self.experiment.rig

        def grown(iteration: Ints) -> float:
            by_then = float(slid[iteration.max() - 1])
            return float(slid[-1]) / by_then if by_then > 0.0 else 1.0

        sections = [] if profile is None else [grown(profile.iteration) * max(recorded_sections(profile))]
        if mass is not None:
            volume = mass.loss / rig.density_of(mass.disc)
            lost = sum(float(volume[mass.disc == disc].max()) for disc in np.unique(mass.disc))
            sections.append(grown(mass.iteration) * lost / (2.0 * np.pi * self.radius))
        return sections

    @property
    def shows_wear(self) -> bool:
        """Whether a profile or a balance shows how far the wear went."""
        return self.experiment.measured.profile is not None or self.experiment.measured.mass is not None

    @cached_property
    def unbounded(self) -> ForwardModel:
        """The same without what shows how far the wear went: it is followed as far as a known K takes it."""
        if not self.shows_wear:
            return self
        measured = replace(self.experiment.measured, profile=None, mass=None)
        return ForwardModel(replace(self.experiment, measured=measured))

    def path(self, contact: Contact, wander: float, crown: float = 1.0, section: float = 0.0) -> WearPath:
        """The wear path of this rig; beyond `reach` only where nothing shows how far the wear went.

        crown: transverse radius over the declared one; of discs whose unworn profiles were recorded it is none.
        """
        enough = self.reach if self.shows_wear else max(self.reach, section)
        start = self.experiment.measured.start
        crown = crown if start is None else 1.0
        asked = contact, wander, crown, enough
        if asked not in self._known_paths:
            path = wear_path(self.crowned(crown), contact=contact, section=enough, wander=wander, start=start)
            path = replace(path, crown=crown)
            self._known_paths.update({asked: path} if enough == self.reach else {})
            return path
        return self._known_paths[asked]

    @cached_property
    def knows_crowns(self) -> bool:
        """Whether wear under one load is tabulated for all crowns, so that none has to be integrated."""
        rigs, start = (self.crowned(float(crown)) for crown in (CROWNS[0], CROWNS[-1])), self.experiment.measured.start
        return not self.loads_change and all(is_tabulated(rig, self.reach, start=start) for rig in rigs)

    def crowned(self, crown: float) -> Rig:
        """The rig with transverse radii of so many times the declared ones."""
        rig = self.experiment.rig
        return rig if crown == 1.0 else rig.with_discs("transverse_radius", crown)

    @cached_property
    def _known_paths(self) -> dict[tuple[Contact, float, float, float], WearPath]:
        """Paths that have been asked for, by contact, wander, crown and reach [m2], that go no further than `reach`."""
        return {}

    @cached_property
    def stops(self) -> Stops | None:
        """Where profiles were recorded; None where there are none."""
        profile = self.experiment.measured.profile
        return Stops.of(profile, self.points) if profile is not None else None

    def declared(self, sets: int) -> State:
        """The operating points as the test is declared, for so many parameter sets, with nothing of these."""
        if sets not in self._declared:
            test, points = self.experiment, self.points
            shape = (sets, len(points.time))
            environment = test.thermal.environment_temperature if test.thermal else np.nan
            initial = test.thermal.initial_temperature if test.thermal else environment
            history, load = test.history, test.rig.normal_load * test.history.last_load[points.iteration]
            self._declared[sets] = State(
                time=points.own_time,
                begins=points.begins,
                duration=points.duration,
                cycles=points.cycles,
                time_in_step=points.time_in_step,
                time_since_pause=points.time_since_pause,
                greatest_creepage=points.greatest_creepage,
                order=points.order,
                direction=points.direction,
                columns=points.columns,
                rolling_radius=self.radius,
                nominal_load=test.rig.normal_load,
                recorded_load=load,
                initial_temperature=initial,
                creepage=np.broadcast_to(points.creepage, shape),
                normal_load=np.broadcast_to(load, shape),
                rolling_speed=np.broadcast_to(test.rig.rolling_speed * history.speed_factor[points.iteration], shape),
                lateral_creepage=np.broadcast_to(history.yaw[points.iteration], shape),
                environment=np.broadcast_to(environment, shape),
                temperature=np.full(shape, initial),
                energy=np.zeros(shape),
                wear_index=np.full(shape, 1e-30),
                normalised_creepage=np.full(shape, CREEPAGES[-1]),
                power_before=np.full(shape, 1e-30),
                power=np.full(shape, 1e-30),
                slope=np.full((1, 1), test.options.initial_slope),
            )
        return self._declared[sets]

    @cached_property
    def _declared(self) -> dict[int, State]:
        """The operating points as declared, by the number of sets."""
        return {}

    def predict(
        self,
        base: BaseParameters | Parameters,
        effects: Mapping[str, Parameters] | None = None,
        trial: Mapping[str, Effect] | None = None,
        *,
        integrated: IntegratedSets | Paths = "each",
        profiled: bool = True,
        near: State | None = None,
        within: float = SETTLED,
    ) -> Prediction:
        """Predict every channel.

        effects  parameters of each effect, (set,), beside those that the test declares
        trial    effects by name that are not in the catalogue
        integrated  where K differs from strip to strip or the load changes, the sets for which an integration tells
                 what that makes of profile and patch: each; the first, after which all of them go; none, and only what
                 is taken off is counted; or the paths of a prediction nearby, which all of them go
        profiled whether the measured profiles are asked for; without them there is no worn surface
        near     the state of one set nearby, or of each set, from which the passes begin: it saves some of them, at as
                 many points
        within   change of the energy in a pass at which it stands still
        """
        base = BaseParameters.of(base)
        sets = max([base.sets, *(len(np.atleast_1d(value)) for value in _values(effects))])
        known = {**catalogue(), **(trial or {})}
        acting = [(known[name], columns) for name, columns in self._all_effects(effects or {}, sets).items()]
        every = Chain(self, base.columns(sets), acting, sets, None if isinstance(integrated, str) else integrated)
        of_each = near is not None and len(near.energy) > 1
        chain, place = (every, np.arange(sets)) if of_each else every.before_recording()
        begin = chain.beginning(near)
        if integrated in ("each", "first") and chain.needs_integration:
            chain, state = chain.on_integrated(begin, slice(1 if integrated == "first" else None))
        else:
            state = chain.settled(begin, within)
        return every.read(chain, state, place, profiled=profiled)

    def _all_effects(self, effects: Mapping[str, Parameters], sets: int) -> dict[str, dict[str, Floats]]:
        declared = {
            name: {key: np.full((1,), value) for key, value in parameters.items()}
            for name, parameters in self.experiment.effects.items()
            if name not in effects
        }
        return {
            name: {key: column(value, sets) for key, value in parameters.items()}
            for name, parameters in {**declared, **effects}.items()
        }


def _values(effects: Mapping[str, Parameters] | None) -> list[Floats]:
    return [value for parameters in (effects or {}).values() for value in parameters.values()]


def acts_at(test: Experiment, stage: Stage) -> bool:
    """Whether an effect or a law is declared that acts at a stage of the model."""
    stages = {catalogue()[name].stage for name in test.effects} | {law.stage for law in test.laws.values()}
    return stage in stages
