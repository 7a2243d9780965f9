"""Files of makers that are known by their head: what their columns are, or what they hold that is none of ours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import islice

from twindisc_cli.errors import MeasurementError, Problem
from twindisc_cli.measurement.content import Content, unpacked
from twindisc_cli.measurement.header import Named
from twindisc_cli.measurement.readers import parts_of

_HEAD = 6000  # bytes in which a vendor names itself
_HEAD_ROWS = 60  # rows in which a vendor names itself


@dataclass(frozen=True)
class Vendor:
    """A maker's way to write: what its head shows, its columns, or what it holds where it is none of ours."""

    name: str
    sign: re.Pattern[str]
    columns: Mapping[str, Named] = field(default_factory=dict)
    holds: str = ""


VENDORS = (
    Vendor(
        "PCS SLIM mapper", re.compile(r"\A\ufeff?SLIM Mapper Analysis File"),
        holds="a map of pixels with the thickness of a film",
    ),
    Vendor(
        "PCS mapper", re.compile(r"\A\ufeff?Mapper Spacer Calibration File"),
        holds="a calibration of colours to the thickness of a film",
    ),
    Vendor(
        "PCS EHD",
        re.compile(r"(?ms)\A\ufeff?EHD\d* Test Data File(?!.*^Step type\t(?:BOD|TRACTION|STRIBECK))"),
        holds="the thickness of a film over the rolling speed",
    ),
    Vendor(
        "PCS MTM or ETM", re.compile(r"\A\ufeff?(?:MTM|ETM)\d* Test Data File"),
        {
            "time": Named("Step Time"), "creepage": Named("SRR"), "rolling speed": Named("Rolling Speed"),
            "traction ratio": Named("Traction Coeff"), "normal load": Named("Ball Load"),
        },
    ),
    Vendor(
        "Phoenix TE67", re.compile(r"Calibration file\t.*Test control file\t", re.DOTALL),
        {
            "time": Named("Time"), "sliding speed": Named("Sliding Velocity", "m/s"), "normal load": Named("Load", "N"),
            "traction ratio": Named("Friction Coefficient", "1"), "temperature": Named("Specimen Temp", "degC"),
        },
    ),
    Vendor(
        "Mitutoyo SurfTest", re.compile(r"Mitutoyo.*SurfTest", re.DOTALL),
        {"y": Named("#5", "mm"), "height": Named("#6", "um")},
    ),
)  # fmt: skip


def vendor_of(content: Content, file: str) -> Vendor | None:
    """The maker of a file; MeasurementError where it holds what is none of ours."""
    head = _head(content, file)
    result = next((vendor for vendor in VENDORS if vendor.sign.search(head)), None)
    if result and result.holds:
        what = f"is {result.holds} ({result.name}), no traction, profile, temperature or mass; nothing of it is read"
        raise MeasurementError(Problem(what, file))
    return result


def _head(content: Content, file: str) -> str:
    """The beginning of a text, or of each part of another file."""
    content, file = unpacked(content, file)
    parts = parts_of(content, file)
    if parts is None:
        data = content.data[:_HEAD]
        return data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8", errors="replace")
    rows = (row for part in parts for row in islice((part.cells or {}).values(), _HEAD_ROWS))
    return "\n".join("\t".join(cell for cell in row if cell) for row in rows)
