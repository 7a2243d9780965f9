"""Heat: the temperatures belong to the dissipated power and to where the disc is said to start.

heat                a rise is at most P / (h S), and at most E / C (Eq. 18 without and with only storage)
times               samples of a test are not all of its first moments
start temperature   the first readings are those of the disc as it is said to start
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import LIMIT_MARGIN, Finding, number
from twindisc_cli.loop.noise_estimate import scatter
from twindisc_cli.model.experiment import Floats
from twindisc_cli.model.forward import acts_at
from twindisc_cli.quantities import CELSIUS

NOISES, FEWEST_READINGS = 3.0, 12
"""Standard deviations of the noise by which the coldest reading may lie below the disc, and readings that show it."""
START, AT_START = 0.02, 3
"""Share of the test within which readings are of its start, and how many of these at the most are taken."""
STARTS = 5.0
"""[K] by which the disc may start off what the definition says: zeros of thermometers, heat of a running-up."""
MANY, SHORT = 20, 0.05
"""Samples of a file that records a test, and share of the history before which it does not end."""
FAHRENHEIT = 3.0  # [K] within which a reading is the declared temperature in degrees Fahrenheit
COLDER = 2.0  # [K]; thermocouples err by 1.5 (class 1) to 2.5 (class 2), IEC 60584-1


def heat_and_temperature(facts: Facts) -> Iterator[Finding]:
    """A temperature rise must be paid for by the dissipated heat, where no other heat or cooling is declared."""
    test, thermal, samples = facts.test, facts.test.thermal, facts.test.measured.temperature
    other = acts_at(test, "heat") or any(law.of.channel == "temperature" for law in test.laws.values())
    if thermal is None or other or not facts.energy > 0.0:
        return
    rises = {"the reported temperature rise": facts.test.reported.get("temperature_rise", np.nan)}
    if samples is not None:
        rises[f"the {facts.test.measured.provenance} temperature rise"] = (
            float(samples.temperature.max()) - thermal.initial_temperature
        )
        coldest = min(thermal.environment_temperature, thermal.initial_temperature)
        yield Finding(
            rule="heat and temperature",
            subject="the disc below its environment",
            value=max(coldest - float(samples.temperature.min()), 0.0),
            low=0.0,
            high=COLDER + NOISES * _noise(samples.temperature),
            unit="K",
            why="friction, which only heats,",
        )
    drift = max(thermal.environment_temperature - thermal.initial_temperature, 0.0)
    limits = {
        f"storing {number(facts.energy * 1e-3)} kJ without any loss": facts.energy / thermal.heat_capacity,
        f"losing {number(facts.power.max())} W by the convection given": facts.power.max() / thermal.convection,
    }
    for subject, rise in rises.items():
        for why, limit in limits.items():
            if np.isfinite(rise) and np.isfinite(limit):
                yield Finding("heat and temperature", subject, rise, 0.0, (limit + drift) * LIMIT_MARGIN, "K", why)


def short_record(facts: Facts) -> Iterator[Finding]:
    """A file of many samples does not end soon after the beginning of the history."""
    end = float(facts.test.history.end_time[-1])
    for name in ("traction", "temperature"):
        samples = getattr(facts.test.measured, name)
        if samples is None or len(samples.time) < MANY or not np.isfinite(samples.time).all():
            continue
        last = float(samples.time.max())
        if last < SHORT * end:
            minutes = 0.5 * end < 60.0 * last < 1.01 * end
            yield Finding(
                rule="times",
                subject=f"the time of the last sample of the {name}",
                value=last,
                low=SHORT * end,
                high=np.inf,
                unit="s",
                why="a record of the test",
                sentence=f"the {len(samples.time)} samples of the {name} end {number(last)} s after the beginning of a "
                f"history of {end:.4g} s",
                hint=f"{'are they minutes' if minutes else 'is the time in the unit of its header'}, and is the "
                "history the one that was recorded?",
            )


def start_temperature(facts: Facts) -> Iterator[Finding]:
    """The first readings are of a disc as warm as it is said to start, beside what can have changed it by then.

    That is the friction's heat and, of readings that go on away from the declared temperature, twice what they change
    in as long again: a source of heat that is not known has done no more up to 0.7 of the time in which it settles.
    """
    thermal, samples, history = facts.test.thermal, facts.test.measured.temperature, facts.test.history
    if thermal is None or samples is None:
        return
    first = np.flatnonzero(samples.time <= START * history.end_time[-1])[:AT_START]
    if not len(first):
        return
    time, reading = float(np.median(samples.time[first])), float(np.median(samples.temperature[first]))
    declared = thermal.initial_temperature
    warming = float(np.max(facts.power[history.end_time - history.duration <= time])) * time / thermal.heat_capacity
    again = float(np.interp(2.0 * time, samples.time, samples.temperature)) - reading
    away = max(float(np.sign(reading - declared)) * again, 0.0)
    if not np.isfinite(warming):
        return
    shown, said = reading - CELSIUS, declared - CELSIUS
    in_fahrenheit = "; or are the readings in degF?" if abs(shown - (1.8 * said + 32.0)) < FAHRENHEIT else ""
    begin = f"the disc at the start is {number(shown)} °C, the definition says {number(said)} °C"
    yield Finding(
        rule="start temperature",
        subject=f"{begin}: the difference",
        value=abs(reading - declared),
        low=0.0,
        high=STARTS + NOISES * _noise(samples.temperature) + warming + 2.0 * away,
        unit="K",
        why="what can have changed it by then",
        hint=f"declare initial_temperature_C under [thermal]{in_fahrenheit}",
    )


def _noise(readings: Floats) -> float:
    """Standard deviation of what readings (sample,) scatter from one to the next; 0 where they are too few."""
    return scatter(np.diff(readings, 2)) / np.sqrt(6.0) if len(readings) >= FEWEST_READINGS else 0.0
