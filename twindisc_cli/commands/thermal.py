"""thermal: the temperature of the disc over the test (Eq. 19, Fig. 13), and the flash temperature of the contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.commands._base import friction_of_steps, wear_coefficient
from twindisc_cli.consistency import contradictions
from twindisc_cli.definition import Test
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.convection import identify_convection
from twindisc_cli.identify.jump import Jump, largest_jump
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.identify.steps import energy_of_steps, identify_friction
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.experiment import Experiment, Floats, History, Ints, Thermal
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction
from twindisc_cli.physics.disc_heat import implicit_step
from twindisc_cli.physics.flash import Flash, Solid, flash_temperature
from twindisc_cli.quantities import CELSIUS
from twindisc_cli.report.words import listed, with_error
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure
APART = 1.5
"""Causes that leave this much more than the best of them, or than the noise, are separated from it."""


@dataclass(frozen=True)
class Heat:
    """Time [s], temperature of the disc [K] and dissipated power [W] at each point, flash rise [K]: each (point,).

    recorded: what the thermometer would read at its samples [K], (sample,).
    of_iteration: the last point of each iteration; eq_19: the disc [K] there by Eq. 19 as the paper steps it, one
    implicit step an iteration: each (iteration,). convection [W/K], its standard error, whence it is;
    patch, which patch the flash is of.
    """

    time: Floats
    temperature: Floats
    recorded: Floats
    power: Floats
    flash: Flash
    of_iteration: Ints
    eq_19: Floats
    convection: float
    std: float
    source: str
    patch: str

    def peak(self, start: float) -> tuple[float, float]:
        """Highest temperature of a disc that begins at `start` [K], and when it has it [s]."""
        hottest = int(np.argmax(self.temperature))
        return max((start, 0.0), (float(self.temperature[hottest]), float(self.time[hottest])), key=lambda at: at[0])

    @property
    def interval(self) -> tuple[float, float]:
        """The 90 % interval of the convection [W/K], not below zero; NaN where it was given."""
        if not np.isfinite(self.std):
            return np.nan, np.nan
        return max(self.convection - NINETY * self.std, 0.0), self.convection + NINETY * self.std


def run(test: Test) -> Result:
    """Warm the disc through the history of a test."""
    experiment = test.experiment
    thermal = experiment.thermal
    if thermal is None:
        raise DefinitionError("no [thermal] table: the heat capacity and the environment are needed")
    model = ForwardModel(experiment)
    heat = _heat(model, thermal)
    jump = _jump(model, heat, thermal)
    start = thermal.initial_temperature
    return Result(
        command="thermal",
        summary=(
            *_summary(heat, start),
            *_missed(heat, experiment),
            *_jump_lines(jump, model, thermal),
            *contradictions(experiment),
        ),
        json={
            "rise_C": heat.peak(start)[0] - start,
            "peak_C": heat.peak(start)[0] - CELSIUS,
            "flash_C": float(heat.flash.maximum.max()),
            "flash_mean_C": float(heat.flash.mean.max()),
            "convection_W_K": heat.convection,
            "convection_W_K_std": or_null(heat.std),
            "convection_W_K_low": or_null(heat.interval[0]),
            "convection_W_K_high": or_null(heat.interval[1]),
            "interval_percent": 90.0,
            "convection_source": heat.source,
            "patch": heat.patch,
            "iterations": [_iteration(heat, i, int(point)) for i, point in enumerate(heat.of_iteration)],
            **_jump_json(jump),
        },
        dataset=_dataset(heat),
        figure=lambda: _figure(experiment, heat),
        figures={"thermal-friction": lambda: _jump_figure(jump, experiment)} if jump else {},
    )


def _jump(model: ForwardModel, heat: Heat, thermal: Thermal) -> Jump | None:
    """The jump of the recorded friction between steps, if there is one, with what came before each step."""
    history = model.experiment.history
    if model.experiment.measured.traction is None or not history.driven.all():
        return None
    first = history.step_begin
    last = np.append(first[1:], len(history.step)) - 1
    before = np.append(thermal.initial_temperature, heat.temperature[heat.of_iteration[last[:-1]]])
    flash = np.array([heat.flash.maximum[model.points.iteration == i].max() for i in last])
    return largest_jump(
        creepage=history.step_creepage,
        mu=identify_friction(model).mu,
        disc=np.full_like(before, thermal.initial_temperature) if history.separate else before,
        flash=flash,
    )


def _jump_lines(jump: Jump | None, model: ForwardModel, thermal: Thermal) -> tuple[str, ...]:
    """What the steps say about the jump, and what they cannot say."""
    if jump is None:
        return ()
    creepage, disc, flash = (cause.values[jump.step] for cause in jump.causes)
    left = [f"{cause.name} {cause.left:.2g}" for cause in jump.causes]
    noise = _noise(model)
    near = [cause.name for cause in jump.causes if cause.left <= APART * max(jump.best.left, noise)]
    apart = f"{listed(near)} cannot be separated by these {len(jump.mu)} steps" if near[1:] else f"{near[0]} is nearest"
    above = disc - thermal.environment_temperature
    return (
        f"friction jumps from {jump.before:.2g} to {jump.after:.2g} in step {jump.step + 1}, at "
        f"{creepage * 100.0:.3g} % creepage; before it the disc was {above:.2g} K above the environment, and the flash "
        f"with the friction until then {flash:.2g} K: the later heating is a consequence of the jump",
        f"a friction that only rises with one of them leaves, rms: {listed(left)} (uncertainty of a step {noise:.2g}): "
        f"{apart}",
    )


def _noise(model: ForwardModel) -> float:
    """The standard error of the mean T/N of a step [1], 0 where none is known."""
    half = identify_friction(model).half
    return float(np.nanmedian(half)) / NINETY if np.any(np.isfinite(half)) else 0.0


def _jump_json(jump: Jump | None) -> dict[str, Any]:
    if jump is None:
        return {}
    causes = [
        {"covariate": c.name, "unit": c.unit, "before_the_jump": c.values[jump.step], "rms_left": c.left}
        for c in jump.causes
    ]
    return {
        "friction_jump": {"step": jump.step + 1, "mu_before": jump.before, "mu_after": jump.after, "causes": causes}
    }


def _jump_figure(jump: Jump | None, test: Experiment) -> Figure:
    from twindisc_cli.figures.thermal import jump_over

    if jump is None:
        raise AssertionError
    return jump_over(jump, name=test.name, provenance=test.measured.provenance)


def _heat(model: ForwardModel, thermal: Thermal) -> Heat:
    test = model.experiment
    friction = friction_of_steps(model)
    mu = friction.mu
    convection, std, source = thermal.convection, np.nan, "given"
    if not np.isfinite(convection):
        fit = identify_convection(model, mu)
        of_power = fit.value * friction.error_of(energy_of_steps(model, mu))
        convection, std, source = fit.value, float(np.hypot(fit.std, of_power)), "from the measured temperature"
    k, wear = wear_coefficient(model, mu)
    base = BaseParameters.declared(test, mu[None])
    prediction = model.unbounded.predict(replace(base, K=np.array([k]), convection=np.array([convection])))
    energy = prediction.state.energy[0, model.points.of_iteration]
    return Heat(
        time=model.points.time,
        temperature=prediction.state.temperature[0],
        recorded=prediction.temperature[0],
        power=prediction.state.power[0],
        flash=_flash(model, prediction, thermal),
        of_iteration=model.points.of_iteration,
        eq_19=_paper_steps(energy, test.history, thermal, convection),
        convection=convection,
        std=std,
        source=source,
        patch="of the unworn discs" if np.isnan(k) else f"worn with K = {k:.3g}, {wear}",
    )


def _paper_steps(energy: Floats, history: History, thermal: Thermal, convection: float) -> Floats:
    """Eq. 19, one implicit step an iteration, from the energy dissipated by the end of each [J], (iteration,)."""
    begins = np.isclose(history.begin_time, history.end_time - history.duration)
    power = (energy - np.where(begins, 0.0, np.roll(energy, 1))) / history.duration
    steps: list[Floats] = []
    for first, watts, seconds in zip(begins, power, history.duration, strict=True):
        now = implicit_step(
            thermal.initial_temperature if first else steps[-1],
            power=watts,
            duration=seconds,
            capacity=thermal.heat_capacity,
            convection=convection,
            environment=thermal.environment_temperature,
        )
        steps.append(np.asarray(now))
    return np.array(steps)


def _flash(model: ForwardModel, prediction: Prediction, thermal: Thermal) -> Flash:
    """The flash temperature at each point, of the patch as worn by then."""
    state = prediction.state
    patch = prediction.paths.patch(prediction.section, state.normal_load / state.nominal_load)
    return flash_temperature(
        power=state.power[0],
        creepage=state.creepage[0],
        a=patch.a[0],
        b=patch.b[0],
        speed=state.rolling_speed[0],
        solid=Solid(thermal.conductivity, thermal.density, thermal.specific_heat),
        line=model.experiment.rig.is_line,
    )


def _iteration(heat: Heat, i: int, point: int) -> dict[str, Any]:
    return {
        "iteration": i + 1,
        "time_s": heat.time[point],
        "power_W": heat.power[point],
        "temperature_C": heat.temperature[point] - CELSIUS,
        "temperature_eq19_C": heat.eq_19[i] - CELSIUS,
        "flash_C": heat.flash.maximum[point],
    }


def _summary(heat: Heat, start: float) -> tuple[str, ...]:
    low, high = heat.interval
    level = f" (one standard deviation; 90 % interval {low:.4g} to {high:.4g})" if np.isfinite(low) else ""
    peak, when = heat.peak(start)
    flash, mean = heat.flash.maximum.max(), heat.flash.mean.max()
    return (
        f"convection {with_error(heat.convection, heat.std, 'W K-1')}{level}, {heat.source}",
        *(
            ("warning: the 90 % interval is as wide as the convection itself: these data hardly fix it",)
            if high - low > heat.convection
            else ()
        ),
        f"disc: rises by {peak - start:.3g} K to {peak - CELSIUS:.4g} °C, at {when:.0f} s",
        f"flash: up to {flash:.3g} K at the hottest point above the disc, {mean:.3g} K on average over the patch",
        f"patch: {heat.patch}",
    )


def _missed(heat: Heat, test: Experiment) -> tuple[str, ...]:
    """What the convection leaves of the measured temperature."""
    samples = test.measured.temperature
    if samples is None:
        return ()
    missed = samples.temperature - heat.recorded
    worst = int(np.argmax(np.abs(missed)))
    return (
        f"one convection leaves {np.sqrt(np.mean(missed**2)):.2g} K rms of the measured temperature, "
        f"most at {samples.time[worst]:.0f} s: what was read there is {abs(missed[worst]):.2g} K "
        f"{'warmer' if missed[worst] > 0.0 else 'colder'} than it explains",
    )


def _figure(test: Experiment, heat: Heat) -> Figure:
    from twindisc_cli.figures.thermal import temperatures

    return temperatures(
        time=heat.time,
        disc=heat.temperature - CELSIUS,
        steps=(heat.time[heat.of_iteration], heat.eq_19 - CELSIUS),
        power=heat.power,
        hottest=heat.flash.maximum,
        mean=heat.flash.mean,
        test=test,
        sentence=" ".join(_missed(heat, test)),
    )


def _dataset(heat: Heat) -> Dataset:
    inside = np.concatenate([[True], np.diff(heat.time) > 0.0])
    rows = (
        ("temperature", heat.temperature, "K", "temperature of the disc"),
        ("power", heat.power, "W", "dissipated power"),
        ("flash_maximum", heat.flash.maximum, "K", "rise of the hottest point of the contact above the discs"),
        ("flash_mean", heat.flash.mean, "K", "mean rise of the contact above the discs"),
    )
    return Dataset(
        axes=(
            Axis("time", heat.time[inside], "s", "time"),
            Axis("iteration_end", heat.time[heat.of_iteration], "s", "time at the end of the iteration"),
        ),
        arrays=(
            *(Array(name, ("time",), values[inside], unit, what) for name, values, unit, what in rows),
            Array("temperature_eq19", ("iteration_end",), heat.eq_19, "K", "disc by one implicit step an iteration"),
        ),
        attrs={"convection_W_K": heat.convection, "convection_source": heat.source},
    )
