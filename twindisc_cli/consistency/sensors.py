"""Sensors: what no reading of one looks like.

dead sensor         readings of a sensor scatter, by their last digit at least: not all of them are the same
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import Finding, number
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.quantities import for_reading

SENSORS = ("traction", "temperature")
"""Channels of which a record holds readings one after the other."""
FEWEST = 12
"""Readings of a channel that are too many to be the same by chance."""


def dead_sensor(facts: Facts) -> Iterator[Finding]:
    """A sensor that works gives more than one reading in a test."""
    for name in (name for name in measured_channels(facts.test) if name in SENSORS):
        channel = channels()[name]
        values = channel.values(channel.samples(facts.test))
        if len(values) >= FEWEST and np.ptp(values) == 0.0:
            reading = f"{number(float(channel.quantity.shown.of_si(values[0])))} {for_reading(channel.quantity.unit)}"
            yield Finding(
                rule="dead sensor",
                subject=f"the number of different readings of the {channel.label}",
                value=1.0,
                low=2.0,
                high=np.inf,
                unit="1",
                why="a sensor that works",
                sentence=f"all {len(values)} readings of the {channel.label} are {reading}".rstrip(),
                hint="is the sensor dead, or its signal limited or rounded too far?",
            )
