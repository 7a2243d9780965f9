"""Do the definition, the data and the numbers stated elsewhere agree with each other?

General rules, for any test; each compares a value with the range that geometry or a balance allows. `wear`,
`profile`, `heat`, `contact` and `sensors` hold them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from twindisc_cli.consistency.contact import elastic_limit, pressure, shakes_down, small_patch, traction_sign
from twindisc_cli.consistency.facts import Facts
from twindisc_cli.consistency.finding import Finding
from twindisc_cli.consistency.heat import heat_and_temperature, short_record, start_temperature
from twindisc_cli.consistency.profile import hole_in_the_track, lone_height, unit_of_the_track, upside_down
from twindisc_cli.consistency.sensors import dead_sensor
from twindisc_cli.consistency.wear import (
    chord_and_depth,
    mass_and_profile,
    stated_depth,
    volume_and_energy,
    wears_too_fast,
    weighings,
)
from twindisc_cli.model.experiment import Experiment

RULES: tuple[Callable[[Facts], Iterator[Finding]], ...] = (
    upside_down,
    unit_of_the_track,
    chord_and_depth,
    hole_in_the_track,
    lone_height,
    stated_depth,
    volume_and_energy,
    wears_too_fast,
    weighings,
    mass_and_profile,
    short_record,
    heat_and_temperature,
    start_temperature,
    dead_sensor,
    elastic_limit,
    traction_sign,
    pressure,
    shakes_down,
    small_patch,
)


OF_DATA: tuple[Callable[[Facts], Iterator[Finding]], ...] = (
    upside_down,
    unit_of_the_track,
    hole_in_the_track,
    lone_height,
    wears_too_fast,
    weighings,
    mass_and_profile,
    short_record,
    heat_and_temperature,
    start_temperature,
    dead_sensor,
)
"""Rules by which data contradict each other or what was declared, whatever the model lacks."""


OF_FRICTION = (dead_sensor,)
"""Those of them that friction rests on."""


def contradictions(test: Experiment, rules: Sequence[Callable[[Facts], Iterator[Finding]]] = OF_DATA) -> list[str]:
    """What is wrong with the data of a test, for the commands that use them."""
    facts = Facts(test)
    return [f"contradiction: {f.message}" for rule in rules for f in rule(facts) if not f.ok]


def findings(test: Experiment) -> list[Finding]:
    """Every rule that can be applied to a test, with its outcome."""
    facts = Facts(test)
    return [finding for rule in RULES for finding in rule(facts)]
