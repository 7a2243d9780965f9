"""What the rules draw on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twindisc_cli.errors import MeasurementError
from twindisc_cli.identify.energy import ratio_and_power, wear_factor
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.identify.track import Track, last_profile, standing_up, worn_track
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, Rig
from twindisc_cli.model.forward import ForwardModel, acts_at
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.physics.archard import worn_volume


@dataclass(frozen=True)
class Facts:
    """What the rules draw on, computed once."""

    test: Experiment

    @cached_property
    def _ratio_and_power(self) -> tuple[Floats, Floats]:
        return ratio_and_power(self.test)

    @property
    def ratio(self) -> Floats:
        """T/N along the creepage of each iteration: measured, else by the model; NaN: not known. (iteration,)."""
        return self._ratio_and_power[0]

    @property
    def power(self) -> Floats:
        """Dissipated power of each iteration [W], (iteration,); NaN: not known."""
        return self._ratio_and_power[1]

    @cached_property
    def energy(self) -> float:
        """Energy dissipated over the test [J]."""
        return float(np.sum(self.power * self.test.history.duration))

    def energy_by(self, stop: int) -> float:
        """Energy dissipated by the end of an entry of the history, from 1, since its test began [J]."""
        begin, spent = self.test.history.begin_time[:stop], self.power * self.test.history.duration
        return float(np.sum(spent[:stop][begin == begin[-1]]))

    @cached_property
    def load(self) -> Floats:
        """Normal load of each iteration [N], (iteration,)."""
        return self.test.rig.normal_load * self.test.history.load_factor

    @cached_property
    def heaviest(self) -> Rig:
        """The rig under the greatest load at which the discs turn."""
        load = np.max(self.load, where=self.test.history.driven, initial=0.0)
        return replace(self.test.rig, normal_load=float(load) or self.test.rig.normal_load)

    @cached_property
    def model(self) -> ForwardModel:
        """The test, ready to be predicted."""
        return ForwardModel(self.test)

    @cached_property
    def prediction(self) -> Prediction:
        """What the model makes of the test with the mu of each step, 1 where none is known."""
        try:
            mu = np.nan_to_num(friction_in_use(self.model).mu, nan=1.0)
        except MeasurementError:
            mu = np.ones(len(self.test.history.step_creepage))
        return self.model.predict(BaseParameters.declared(self.test, mu[None]), profiled=False)

    def part(self, disc: int, stop: int) -> float:
        """Part of the worn depth that a disc bears by the end of an entry of the history, from 1; 1: it wears alone."""
        if np.isnan(self.test.options.disc1_wear_coefficient) and not acts_at(self.test, "wear"):
            return 1.0
        state = self.prediction.state
        first = np.broadcast_to(state.disc1_share, state.energy.shape)[0, self.model.points.of_iteration[stop - 1]]
        return float(first if disc == 1 else 1.0 - first) or 1.0

    def wear_factor(self, stop: int) -> float:
        """K over its base value by the end of an entry of the history, from 1, as declared: its mean by the energy."""
        return wear_factor(self.model, self.prediction.state, stop) if acts_at(self.test, "wear") else 1.0

    @cached_property
    def standing_up(self) -> float:
        """Height [m] by which the last measured profile stands up in place of a track; 0 where it does not."""
        profile = self.test.measured.profile
        if profile is None:
            return 0.0
        last = last_profile(profile)
        return standing_up(profile.y[last], profile.height[last])

    @cached_property
    def track(self) -> Track | None:
        """The track in the last measured profile; None where it stands up."""
        profile = self.test.measured.profile
        if profile is None:
            return None
        last = last_profile(profile)
        if self.standing_up:
            return None
        return worn_track(profile.y[last], profile.height[last], smooth=True)

    @cached_property
    def of_profile(self) -> tuple[int, int]:
        """Disc of the last measured profile, and the entry of the history, from 1, at whose end it was taken."""
        profile = self.test.measured.profile
        assert profile is not None
        last = last_profile(profile)
        return int(profile.disc[last][0]), int(profile.iteration[last][0])

    @cached_property
    def volume(self) -> float:
        """Volume missing in the last measured profile [m3]; NaN without one."""
        profile = self.test.measured.profile
        if profile is None:
            return np.nan
        last, radius = last_profile(profile), self.test.rig.track_radius(self.of_profile[0])
        return float(worn_volume(y=profile.y[last], depth=-profile.height[last], rolling_radius=radius))
