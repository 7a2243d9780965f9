"""A picture of every effect: a test without it and with it at its typical size, in the channel that shows it first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

CREEPAGE = np.repeat([0.001, 0.02, 0.09, 0.002, 0.004, 0.01, 0.04], 3)
REVOLUTIONS = 4200.0
STEEL = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": 700 * 9.80665e6}
BASE = {"mu": 0.5, "K": 6e-5, "convection_W_K": 2.0}


def model() -> Any:
    """The test of the pictures: seven steps, from partial slip to full sliding, seen in all channels."""
    from twindisc_cli import Disc, Rig, Thermal, experiment
    from twindisc_cli.model.forward import ForwardModel

    rig = Rig(Disc(0.03, np.inf, **STEEL), Disc(0.03, 0.03, **STEEL), normal_load=72.0, rolling_speed=9.42)
    end = 84.0 * len(CREEPAGE)
    time, y = np.linspace(4.0, end, 200), np.linspace(-1.2e-3, 1.2e-3, 161)
    test = experiment(
        rig,
        CREEPAGE,
        np.full(len(CREEPAGE), REVOLUTIONS),
        traction_ratio=np.zeros(len(time)),
        traction_time=time,
        profile=(y, np.zeros(len(y))),
        temperature=(time, np.full(len(time), 293.15)),
        thermal=Thermal(293.15, 100.0, 293.15),
    )
    return ForwardModel(test)


def draw_effects(folder: Path) -> None:
    """Write NAME.png for every effect of the catalogue."""
    from twindisc_cli.effects import catalogue

    made = model()
    base: Any = {key: np.array([value]) for key, value in BASE.items()}
    plain = made.predict(base)
    measured = made.experiment.measured
    for name, effect in catalogue().items():
        with_it = made.predict(base, {name: {p.name: np.array([p.start]) for p in effect.params}})
        channel = effect.channel
        before, after = (np.asarray(getattr(p, channel))[0] for p in (plain, with_it))
        draw(folder / f"{name}.png", channel, measured, before, after)


def draw(path: Path, channel: str, measured: Any, before: Any, after: Any) -> None:
    """Both curves of a channel and their difference, small enough for a table."""
    figure = Figure(figsize=(3.2, 2.5), layout="constrained")
    axes, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    if channel == "profile":
        x, scale, shift, labels = 1e3 * measured.profile.y, 1e6, 0.0, ("y [mm]", "height [µm]")
    else:
        x = getattr(measured, channel).time / 60.0
        scale, shift = 1.0, -273.15 if channel == "temperature" else 0.0
        labels = ("time [min]", "disc [°C]" if channel == "temperature" else "T/N")
    axes.plot(x, scale * before + shift, color="#7F7F7F", linestyle="--", linewidth=1.1, label="without")
    axes.plot(x, scale * after + shift, color="#0072B2", linewidth=1.4, label="with the effect")
    below.plot(x, scale * (after - before), color="#D55E00", linewidth=1.2)
    below.set_xlabel(labels[0], fontsize=7)
    below.set_ylabel("left behind", fontsize=7)
    axes.set_ylabel(labels[1], fontsize=7)
    for panel in (axes, below):
        panel.tick_params(labelsize=6.5)
        panel.grid(True, color="#DDDDDD", linewidth=0.4)
    axes.legend(fontsize=6.5, frameon=False)
    figure.savefig(path, dpi=130)
