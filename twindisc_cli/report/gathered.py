"""The report of a test: what every command found, as one HTML page and as two pages for print."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from twindisc_cli.definition import Test, dump
from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.report import pages
from twindisc_cli.results.recorded import Recorded, recorded
from twindisc_cli.version import __version__

TITLES: Mapping[str, str] = {
    "close-loop": "What does the model lack?",
    "check": "Do the files agree with each other?",
    "friction-chart": "From which creepage on is T/N the coefficient of friction?",
    "identify-mu": "Which μ is behind each measured T/N?",
    "fit-k": "Which wear coefficient follows from the wear?",
    "simulate-wear": "How deep and wide does the track become?",
    "thermal": "How warm does the disc become?",
    "contact": "Where does the contact patch stick and slip?",
}
"""The question that each command answers, in the order of the report."""


@dataclass(frozen=True)
class Part:
    """What one command found: its question, its sentences, its JSON and its figure (PNG; empty where it has none).

    warning: that it was made from something else than the others, with which the sentences begin; empty where not.
    """

    command: str
    title: str
    warning: str
    summary: tuple[str, ...]
    json: Mapping[str, Any]
    figure: bytes

    @property
    def encoded(self) -> str:
        """The figure as text for an HTML page."""
        return b64encode(self.figure).decode("ascii")

    @property
    def blocks(self) -> list[tuple[bool, list[str]]]:
        """The sentences in runs: whether a run is a table, whose columns stand two spaces apart, and its lines."""
        return [(is_table, list(lines)) for is_table, lines in groupby(self.summary, lambda line: "  " in line.strip())]


def results_in(folder: Path) -> dict[str, Recorded | str]:
    """The results of all commands that lie in the folder of a test, by command, or why they do not count."""
    paths = {command: folder / f"{command}.h5" for command in TITLES}
    return {command: recorded(path) for command, path in paths.items() if path.exists()}


def parts_of(folder: Path, results: Mapping[str, Recorded | str], test: Test | None = None) -> list[Part]:
    """The results that lie in the folder of a test and are whole.

    Each says so where it was made from something else than the test as it is now, or, where that is None, than the
    first of them.
    """
    parts = []
    known, whose = (_made_from(dump(test.resolved), test.inputs), "the test as it is now") if test else (None, "")
    for command, result in results.items():
        if isinstance(result, Recorded):
            picture = folder / f"{command}.png"
            figure = picture.read_bytes() if picture in result.stored.files else b""
            own = _made_from(result.configs[0], result.sources[0]["inputs"] if result.sources else {})
            known, whose = known or own, whose or command
            warning = ""
            if own != known:
                warning = f"warning: made from another definition or other data than {whose}: run {command} again"
            summary = (*([warning] if warning else []), *result.stored.summary)
            parts.append(Part(command, TITLES[command], warning, summary, result.stored.json, figure))
    if not parts:
        what = f"holds no result of a command; run one first, for example twindisc check. Known: {', '.join(TITLES)}"
        raise DefinitionError(Problem(what, folder))
    return parts


def damaged(results: Mapping[str, Recorded | str]) -> list[str]:
    """Why results do not count, with what mends it."""
    return [
        f"{name}: left out, its result {why}: run {name} again" for name, why in results.items() if isinstance(why, str)
    ]


def _made_from(config: str, inputs: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    return config, dict(inputs)


def key_numbers(parts: Sequence[Part]) -> list[tuple[str, str]]:
    """The numbers that a reader looks for first, each with what it is."""
    from twindisc_cli.report.words import with_error

    by_command = {part.command: part.json for part in parts}
    rows: list[tuple[str, str]] = []
    base = by_command.get("close-loop", {}).get("base", {})
    for key, name in (("mu", "coefficient of friction μ"), ("K", "wear coefficient K"), ("convection_W_K", "hS")):
        result = base.get(key)
        if result:
            rows.append((f"{name}, with what was added", with_error(result["value"], result["std"], result["unit"])))
    wear, worn, heat = (by_command.get(name, {}) for name in ("fit-k", "simulate-wear", "thermal"))
    if wear:
        rows.append(("K of the base model", with_error(wear["K"], wear["K_std"], "1")))
    if worn:
        rows.append(("track, simulated", f"{worn['depth_um']:.3g} µm deep, {worn['width_mm']:.3g} mm wide"))
        rows.append(("dissipated energy", f"{worn['dissipated_energy_kJ']:.3g} kJ"))
    if heat:
        rows.append(("warming of the disc", f"{heat['rise_C']:.3g} K, of the contact above it {heat['flash_C']:.3g} K"))
    return rows


def render(name: str, description: str, provenance: str, parts: Sequence[Part]) -> str:
    """The report as one HTML page that needs nothing beside it."""
    return (
        pages()
        .get_template("gathered.html")
        .render(
            name=name,
            description=description,
            provenance=provenance,
            parts=parts,
            numbers=key_numbers(parts),
            version=__version__,
        )
    )
