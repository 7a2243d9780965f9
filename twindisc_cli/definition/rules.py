"""Rules between keys of a test definition, which no single key can break alone.

Each takes the raw tables, which may hold anything, and yields (key, what is wrong). They run even where other keys
are wrong, so that all mistakes come in one go.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from typing import Any

from twindisc_cli.definition.lines import Key
from twindisc_cli.definition.schema import ColumnsTable
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import did_you_mean
from twindisc_cli.laws.covariates import COVARIATES, LOCAL, covariate_named, covariate_of, identifier
from twindisc_cli.laws.quantities import QUANTITIES, Quantity
from twindisc_cli.laws.shapes import SHAPES

Finding = tuple[Key, str]
Raw = Mapping[str, Any]
POSITIVE = frozenset({"scale", "width", "period", "reference"})
"""Parameters of formulas that are lengths along the covariate."""


def _table(raw: object, name: str) -> Raw:
    """A table of the raw document, empty where it is missing or not a table."""
    table = raw.get(name) if isinstance(raw, Mapping) else None
    return table if isinstance(table, Mapping) else {}


def _numbers(raw: Raw, name: str) -> list[float]:
    """A length of both discs, NaN where it is missing or not a number."""
    values = (_table(raw, disc).get(name) for disc in ("disc1", "disc2"))
    values = (value.get("value") if isinstance(value, Mapping) else value for value in values)
    return [float(v) if isinstance(v, (int, float)) and not isinstance(v, bool) else math.nan for v in values]


def speed(raw: Raw) -> Iterator[Finding]:
    """One speed, and one that the discs allow."""
    rig = _table(raw, "rig")
    given = [key for key in ("mean_speed_rpm", "rolling_speed_m_s") if key in rig]
    radii = _numbers(rig, "rolling_radius_mm")
    if len(given) == 2:
        yield ("rig", "rolling_speed_m_s"), "mean_speed_rpm is given too; keep one of them"
    elif not given and rig:
        yield ("rig", "mean_speed_rpm"), "no speed: give mean_speed_rpm or rolling_speed_m_s"
    elif given == ["mean_speed_rpm"] and any(math.isinf(r) for r in radii):
        yield ("rig", "mean_speed_rpm"), "a disc of radius inf does not turn: give rolling_speed_m_s instead"
    if all(math.isinf(r) for r in radii):
        yield ("rig", "disc2", "rolling_radius_mm"), "both rolling radii are inf; at least one disc must roll"


def curvature(raw: Raw) -> Iterator[Finding]:
    """The discs must touch at a point, or along a line of known width, not at two edges."""
    radii = _numbers(_table(raw, "rig"), "transverse_radius_mm")
    if any(math.isnan(r) or r == 0.0 for r in radii):
        return
    total = sum(1.0 / r for r in radii)
    if total < 0.0:
        why = "1/R1 + 1/R2 across rolling must not be negative: the discs touch at their edges"
        yield ("rig", "disc2", "transverse_radius_mm"), why
    if total == 0.0 and all(math.isnan(width) for width in _numbers(_table(raw, "rig"), "width_mm")):
        yield (
            ("rig", "disc2", "transverse_radius_mm"),
            "both are straight: give width_mm, at least of the narrower disc",
        )


def heat(raw: Raw) -> Iterator[Finding]:
    """One way to give the heat capacity, at most one to give the convection, each complete."""
    thermal = _table(raw, "thermal")
    if not thermal:
        return
    if "heat_capacity_J_K" not in thermal and "volume_mm3" not in thermal:
        yield (
            ("thermal", "heat_capacity_J_K"),
            "no heat capacity: give heat_capacity_J_K, or volume_mm3 with density and specific heat",
        )
    if "heat_capacity_J_K" in thermal and "volume_mm3" in thermal:
        yield ("thermal", "volume_mm3"), "heat_capacity_J_K is given too; keep one of them"
    ways = (
        {"convection_W_K"},
        {"heat_transfer_W_m2K", "surface_mm2"},
        {"fluid_conductivity_W_mK", "nusselt_per_length_1_m", "surface_mm2"},
    )
    given = set().union(*ways) & set(thermal)
    if given and given not in ways:
        text = "; or ".join(" with ".join(sorted(way)) for way in ways)
        yield ("thermal", min(given)), f"convection is given by {' and '.join(sorted(given))}; it takes {text}"


def measured(raw: Raw) -> Iterator[Finding]:
    """Traction comes from one file; only a log has a torque."""
    table = _table(raw, "measured")
    if "log" in table and "traction" in table:
        yield ("measured", "log"), "traction is given too; keep one of them"
    material = _table(raw, "material")
    if "mass" in table and "density_kg_m3" not in material:
        for disc in ("disc1", "disc2"):
            if "density_kg_m3" not in _table(material, disc):
                yield ("material", "density_kg_m3"), "is missing: a weighed mass says nothing of a volume without it"
                return
    if "balance_mg" in table and "mass" not in table:
        yield ("measured", "balance_mg"), "only weighings have a balance; remove it or give mass"
    for key in ("torque_disc", "torque_zero"):
        if key in table and "log" not in table:
            yield ("measured", key), "only a log has a torque; remove it or give log"


def steps(raw: Raw) -> Iterator[Finding]:
    """A step has a creepage and at most one speed, or it is a pause and nothing else."""
    listed = _table(raw, "history").get("steps")
    result = [step if isinstance(step, Mapping) else {} for step in listed] if isinstance(listed, list) else []
    flat = any(math.isinf(r) for r in _numbers(_table(raw, "rig"), "rolling_radius_mm"))
    for index, step in enumerate(result):
        key: Key = ("history", "steps", index)
        if "pause_s" in step:
            more = [name for name in step if name not in ("pause_s", "iterations", "yaw_mrad")]
            if more or step.get("iterations", 1) != 1 or step.get("yaw_mrad", 0.0) != 0.0:
                yield key, f"a pause is a step of its own: {{ pause_s = {step['pause_s']} }}"
        elif step and "creepage_percent" not in step:
            yield (*key, "creepage_percent"), "is missing; a step has a creepage_percent, or is a pause (pause_s)"
        if "mean_speed_rpm" in step and "rolling_speed_m_s" in step:
            yield (*key, "rolling_speed_m_s"), "mean_speed_rpm is given too; keep one of them"
        elif "mean_speed_rpm" in step and flat:
            yield (*key, "mean_speed_rpm"), "a disc of radius inf does not turn: give rolling_speed_m_s instead"
    measured = _table(raw, "measured")
    if "measured" in (raw.get("history"), listed) and not {"log", "traction"} & set(measured):
        yield (
            ("history",) if isinstance(raw.get("history"), str) else ("history", "steps"),
            '"measured" needs a log or a traction under [measured] to be read from',
        )
    if result and all("pause_s" in step for step in result):
        yield ("history", "steps"), "all steps are pauses"


def separate(raw: Raw) -> Iterator[Finding]:
    """Steps that are tests of their own have no pause between them, and no profile that they wore together."""
    history = _table(raw, "history")
    if history.get("separate") is not True:
        return
    steps = history.get("steps")
    if steps == "measured":
        yield ("history", "separate"), "steps that are read from a log follow on each other; remove it"
    for index, step in enumerate(steps if isinstance(steps, list) else []):
        if isinstance(step, Mapping) and "pause_s" in step:
            yield ("history", "steps", index), "a pause between separate steps does nothing; remove it"
    own = "wear is not carried over from one separate step to the next; give each test a definition of its own"
    for key in ("profile", "mass"):
        if key in _table(raw, "measured"):
            yield ("measured", key), own
    for name in _table(raw, "effects"):
        if name in catalogue() and catalogue()[name].local:
            yield ("effects", name), own
    for name in _table(raw, "laws"):
        if covariate_named(str(_table(_table(raw, "laws"), name).get("covariate"))) in LOCAL:
            yield ("laws", name), own


def hold_out(raw: Raw) -> Iterator[Finding]:
    """Steps held out must exist, once each, and leave some to fit."""
    steps = _table(raw, "history").get("steps")
    held = _table(raw, "loop").get("hold_out_steps")
    if not isinstance(steps, list) or not isinstance(held, list):
        return
    for index, step in enumerate(held):
        if isinstance(step, int) and step > len(steps):
            yield ("loop", "hold_out_steps", index), f"there is no step {step}; the history has {len(steps)}"
        if step in held[:index]:
            yield ("loop", "hold_out_steps", index), f"step {step} is named twice"
    if steps and len({s for s in held if isinstance(s, int)}) >= len(steps):
        yield ("loop", "hold_out_steps"), "all steps are held out; none is left to fit"


def _declared_columns(raw: Raw) -> list[str]:
    """Columns of [measured] covariates; none where they are no list of texts."""
    columns = _table(raw, "measured").get("covariates")
    return [column for column in columns if isinstance(column, str)] if isinstance(columns, list) else []


def covariates(raw: Raw) -> Iterator[Finding]:
    """Declared columns stand beside a traction, and have names of their own."""
    columns, measured = _declared_columns(raw), _table(raw, "measured")
    key = ("measured", "covariates")
    if columns and not ("traction" in measured or "log" in measured):
        yield key, "are columns of a traction or a log, of which there is none"
    names = [identifier(column) for column in columns]
    for index, (column, name) in enumerate(zip(columns, names, strict=True)):
        if name in COVARIATES or name in ColumnsTable.model_fields:
            yield (*key, index), f"{column} is read anyway; a covariate {name} is known without"
        elif name in names[:index]:
            yield (*key, index), f"{column} is named twice"


def laws(raw: Raw) -> Iterator[Finding]:
    """A law is a formula with its parameters or a curve, over a covariate that its quantity can depend on."""
    columns = _declared_columns(raw)
    for name in _table(raw, "laws"):
        law = _table(_table(raw, "laws"), name)
        of, given = QUANTITIES.get(str(law.get("quantity"))), str(law.get("covariate"))
        over = covariate_named(given, columns)
        if over is None and "covariate" in law:
            known = [*COVARIATES, *columns]
            what = f"must be {', '.join(known)}{did_you_mean(given, known)}"
            yield ("laws", name, "covariate"), f"{what}; further columns are declared in [measured] covariates"
        if of is None or over is None:
            continue
        across = of.covariates == ("y_over_edge",)
        if across != (over == "y_over_edge") or (over in LOCAL and law["quantity"] != "wear"):
            apart = ("y_over_edge",) if law["quantity"] == "wear" else ("y_over_edge", *LOCAL)
            known = [c for c in (*COVARIATES, *columns) if (c in of.covariates if across else c not in apart)]
            yield ("laws", name, "covariate"), f"{law['quantity']} can depend on {', '.join(known)}"
        kinds = [key for key in ("shape", "at") if key in law]
        if len(kinds) != 1:
            what = (
                "a law is a formula or a curve; keep shape or at"
                if kinds
                else "no law: give shape with parameters, or at"
            )
            yield ("laws", name, kinds[-1] if kinds else "shape"), what
        elif kinds == ["shape"]:
            yield from _formula(law, of, over, ("laws", name))
        else:
            yield from _curve(law, of, ("laws", name))
        valid = law.get("valid")
        if _rising(valid) is False:
            yield ("laws", name, "valid"), "must rise: from the least to the greatest place where data were"


def _rising(values: object) -> bool | None:
    """Whether numbers rise; None where they are no list of numbers."""
    if not isinstance(values, list) or not all(isinstance(v, (int, float)) for v in values):
        return None
    return all(b > a for a, b in pairwise(values))


def _formula(law: Raw, of: Quantity, over: str, key: Key) -> Iterator[Finding]:
    """The parameters of a formula, by name and sign."""
    shape = SHAPES.get(str(law.get("shape")))
    if shape is None:
        return
    given, along = _table(law, "parameters"), {covariate_of(over).key(name): name for name in shape.along}
    needed = {of.size_key, *along, *shape.pure}
    optional = {key_ for key_, name in along.items() if name == "origin"}
    unknown, missing = sorted(set(given) - needed), sorted(needed - optional - set(given))
    for name in unknown:
        yield (*key, "parameters", name), f"unknown parameter{did_you_mean(name, needed)}; {_takes(law, needed)}"
    if missing and not unknown:
        yield (*key, "parameters"), f"{' and '.join(missing)} missing; {_takes(law, needed)}"
    for key_, name in along.items():
        value = given.get(key_)
        if name in POSITIVE and isinstance(value, (int, float)) and not value > 0.0:
            yield (*key, "parameters", key_), f"must be greater than 0, not {value:g}"


def _takes(law: Raw, needed: Iterable[str]) -> str:
    return f"{law['shape']} of {law['quantity']} over {law['covariate']} takes {', '.join(sorted(needed))}"


def _curve(law: Raw, of: Quantity, key: Key) -> Iterator[Finding]:
    """A curve: as many values as places, which rise."""
    other = {"factor": "shift", "shift": "factor"}[of.kind]
    at, values = law.get("at"), law.get(of.kind)
    if of.kind not in law:
        yield (*key, other if other in law else of.kind), f"{law['quantity']} is changed by a {of.kind}: give {of.kind}"
    elif other in law:
        yield (*key, other), f"{of.kind} is given too, and {law['quantity']} takes no {other}; remove it"
    elif isinstance(at, list) and isinstance(values, list) and len(at) != len(values):
        yield (*key, of.kind), f"{len(values)} values at {len(at)} places"
    if _rising(at) is False:
        yield (*key, "at"), "the places must rise"
    if "parameters" in law:
        yield (*key, "parameters"), "only a formula has parameters; remove them or give shape"


RULES = (speed, curvature, heat, measured, steps, separate, hold_out, covariates, laws)


def broken(raw: Raw) -> list[Finding]:
    """Every rule that the document breaks."""
    return [finding for rule in RULES for finding in rule(raw)]
