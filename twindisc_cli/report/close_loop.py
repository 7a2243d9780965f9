"""The page of the closed loop: one HTML file that needs nothing beside it and reads well when printed."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from twindisc_cli.definition import Test
from twindisc_cli.effects import catalogue
from twindisc_cli.loop.channels import channels, measured_channels
from twindisc_cli.loop.channels._held_out import BANDS, EVERY
from twindisc_cli.loop.diagnosis import Curve, Diagnosis, FoundEffect, NextExperiment
from twindisc_cli.report import pages, sentences, words
from twindisc_cli.version import __version__


def render(
    diagnosis: Diagnosis,
    tests: Sequence[Test],
    validate: Test | None,
    *,
    figures: Mapping[str, bytes],
    plots: Sequence[Mapping[str, Any]] = (),
) -> str:
    """The page as HTML, the figure of each channel (a PNG) and the numbers of plots to zoom inside."""
    environment = pages()
    environment.globals |= {"sentences": sentences, "words": words, "channels": channels(), "catalogue": catalogue()}
    environment.globals |= {"meaning": meaning, "measured": _measured, "held_out": held_out, "history": history_toml}
    environment.tests["effect"] = lambda term: isinstance(term, FoundEffect)
    template = environment.get_template("close_loop.html")
    return template.render(
        diagnosis=diagnosis,
        tests=tests,
        validate=validate,
        title=words.listed([test.experiment.name for test in tests]),
        provenance=sentences.provenance([test.experiment.measured.provenance for test in tests]),
        figures={channel: b64encode(figure).decode("ascii") for channel, figure in figures.items()},
        plots=plots,
        numbers=json.dumps(plots).replace("<", "\\u003c"),
        library={name: _beside(name) for name in ("uplot.min.js", "uplot.min.css", "plots.js")} if plots else {},
        version=__version__,
    )


def _beside(name: str) -> str:
    """A file of this folder."""
    return (Path(__file__).parent / name).read_text(encoding="utf-8")


def meaning(effect: str, key: str) -> str:
    """What a parameter of an effect is."""
    return next(p.meaning for p in catalogue()[effect].params if p.name == key)


def history_toml(planned: NextExperiment, tests: Sequence[Test]) -> str:
    """The planned history as a [history] table ready for a definition, with the iterations of its test."""
    history = next((test for test in tests if test.experiment.name == planned.test), tests[0]).experiment.history
    revolutions = float(np.median(history.revolutions[history.driven]))
    lines = [
        f"  {{ creepage_percent = {float(step['creepage_percent']):.6g}, iterations = {int(step['iterations'])} }},"
        for step in planned.steps
    ]
    return "\n".join(["[history]", f"revolutions_per_iteration = {revolutions:.10g}", "steps = [", *lines, "]"])


def _measured(test: Test) -> str:
    return words.listed([words.channel_name(channel) for channel in measured_channels(test.experiment)]) or "nothing"


def held_out(test: Test, diagnosis: Diagnosis) -> str:
    """Steps held out, from 1 as the user counts them, and how many samples of each channel."""
    curves = [curve for curve in diagnosis.curves if curve.test == test.experiment.name]
    if not any(np.any(curve.held_out) for curve in curves):
        return "no sample"
    creepage = test.experiment.history.step_creepage
    steps = diagnosis.held_out_steps.get(test.experiment.name, ())
    named = [f"{step + 1} ({100.0 * creepage[step]:g} %)" for step in steps]
    parts = [f"step{'s' if len(named) > 1 else ''} {words.listed(named)}"] if named else []
    parts.append("the last iteration of every second other step where it is long enough")
    if any("y" in curve.covariates for curve in curves):
        parts.append(f"every {EVERY}th of {BANDS} bands across the track")
    return f"{words.listed(parts)}; in samples, {words.listed([_share(curve) for curve in curves])}"


def _share(curve: Curve) -> str:
    return f"{int(np.sum(curve.held_out))} of {len(curve.held_out)} of the {words.channel_name(curve.channel)}"
