"""compare: results of several tests overlaid, one figure a quantity, with the table behind each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from twindisc_cli.campaign.comparison import (
    Quantity,
    Shown,
    excel_bytes,
    labels,
    outcome,
    quantities,
    read,
    table,
)
from twindisc_cli.campaign.table import csv_text, parquet_bytes
from twindisc_cli.commands._message import tell
from twindisc_cli.commands._output import Output
from twindisc_cli.errors import DefinitionError, Problem
from twindisc_cli.results.drawn import drawn_as
from twindisc_cli.results.files import write_all
from twindisc_cli.results.store import plain

FOLDER = "compare"


def run(paths: Sequence[Path], xlsx: bool, output: Output) -> int:
    """Read the results, draw and tabulate every quantity that they share, and say in what the tests differ."""
    tests = read(paths)
    if len(tests) < 2:
        raise DefinitionError(Problem("one test alone cannot be compared; name the results of two or more", paths[0]))
    compared = quantities(tests, output.over or "min")
    files = _files(tests, compared, xlsx, output)
    folder = output.folder / FOLDER
    write_all({folder / name: data for name, data in files.items()})
    answer = outcome(tests, compared)
    tell(_summary(answer), plain(answer), [folder / name for name in files], output, "written")
    return 0


def _files(tests: Sequence[Shown], quantities: Sequence[Quantity], xlsx: bool, output: Output) -> dict[str, bytes]:
    from twindisc_cli.figures.comparison import overlaid
    from twindisc_cli.figures.style import house_style

    texts, names = labels(tests), [test.name for test in tests]
    provenance = ", ".join(sorted({test.provenance for test in tests} - {""}))
    files: dict[str, bytes] = {}
    tables = {quantity.name: table(quantity, tests, texts) for quantity in quantities}
    with house_style(output.style):
        for quantity in quantities:
            figure = overlaid(quantity, names, texts, provenance)
            files |= {f"{quantity.name}.{form}": drawn_as(figure, form, output.dpi) for form in output.formats}
            files[f"{quantity.name}.csv"] = csv_text(tables[quantity.name]).encode()
            if parquet := parquet_bytes(tables[quantity.name]):
                files[f"{quantity.name}.parquet"] = parquet
    if xlsx:
        files["compare.xlsx"] = excel_bytes(tables)
    return files


def _summary(answer: dict[str, Any]) -> tuple[str, ...]:
    differs = answer["differs"]
    lines = [f"{len(answer['tests'])} tests: {', '.join(answer['tests'])}"]
    lines += [f"differs: {key}: {', '.join(values)}" for key, values in differs.items()]
    lines += [] if differs else ["the definitions do not differ but in name and data"]
    lines += [
        f"{q['name'].replace('_', ' ')}: {len(q['tests'])} of {len(answer['tests'])} tests"
        for q in answer["quantities"]
    ]
    return tuple(lines)
