"""The definition in SI units: units are converted here and nowhere behind."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import numpy as np

from twindisc_cli import measurement
from twindisc_cli.definition.parse import parse
from twindisc_cli.definition.record import Test
from twindisc_cli.definition.schema import (
    MEASURED_FILES,
    DefinitionBase,
    HistoryTable,
    LawTable,
    MaterialOverride,
    MaterialTable,
    RigTable,
    StepTable,
    ThermalTable,
    Uncertain,
)
from twindisc_cli.digests import digest_of
from twindisc_cli.errors import DefinitionError, MeasurementError, Problem, ValidityError
from twindisc_cli.laws.covariates import covariate_named, covariate_of
from twindisc_cli.laws.law import Law
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.loop.channels import further_channels
from twindisc_cli.loop.channels._channel import Channel
from twindisc_cli.model.experiment import Disc, Experiment, History, Options, Rig, Thermal, mean_radius
from twindisc_cli.model.traction_law import theory_for
from twindisc_cli.physics.half_space import ContactError
from twindisc_cli.quantities import CELSIUS, UNITS
from twindisc_cli.reading import LARGEST_DEFINITION, read_regular

NEAR_KELVIN = 25.0
"""By how much the first temperature of a record in another unit may miss that of the disc, but for 273 K [K]."""
SOON = 0.05  # of the test: a record that begins later begins with a warm disc


def load(path: Path | str) -> Test:
    """Read a test definition and the measured data it names.

    DefinitionError lists every mistake of the definition, MeasurementError every mistake of the data.
    """
    return load_text(_text(Path(path)), Path(path))


def load_text(text: str, path: Path, *, as_recorded: bool = False) -> Test:
    """A definition by its text; measured files are sought beside `path`, which the messages name.

    as_recorded: the measured creepages keep the noise of their measurement.
    """
    definition = parse(text, str(path))
    rig = _rig(definition.rig, definition.material)
    history, per_iteration = _history_of(definition.history, rig)
    table = definition.measured
    columns = table.columns.model_dump(exclude_none=True) if table.columns else {}
    naming = {key.replace("_", " "): measurement.Named(**named) for key, named in columns.items()}
    settings: dict[str, Any] = table.model_dump(exclude={"provenance", "columns"}, exclude_none=True)
    further = further_channels()
    read = {key: _sources if key in ("log", "temperature") else _source for key in (*MEASURED_FILES, *further)}
    settings |= {key: how(settings[key]) for key, how in read.items() if key in settings}
    settings["covariates"] = tuple(settings.get("covariates", ()))
    others = {name: _other(settings.pop(name), channel) for name, channel in further.items() if name in settings}
    sources = measurement.Sources(path.parent, **settings, per_iteration=per_iteration, columns=naming, others=others)
    try:
        recorded = measurement.read(
            sources, rig=rig, history=history, provenance=table.provenance, as_recorded=as_recorded
        )
    except ContactError as error:
        raise ValidityError(str(error)).of(path) from error
    resolved = _resolved(definition, rig)
    _check_hold_out(definition, recorded.history, path)
    held_out = definition.loop.hold_out_steps
    thermal = _thermal(definition.thermal) if definition.thermal else None
    if warmth := sources.temperature or sources.log:
        _check_unit(recorded, thermal, path.parent / warmth[0].file)
    experiment = Experiment(
        name=definition.test.name,
        description=definition.test.description,
        rig=rig,
        history=recorded.history,
        options=_options(definition, rig),
        thermal=thermal,
        effects=resolved.get("effects", {}),
        laws={name: _law(table, recorded.measured.columns) for name, table in definition.laws.items()},
        tolerances=_tolerances(definition.rig, definition.material),
        measured=recorded.measured,
        hold_out_steps=None if held_out is None else tuple(step - 1 for step in held_out),
        reported=_reported(definition),
        own_parameters={key: v for table in resolved.get("channels", {}).values() for key, v in table.items()},
    )
    digest = sha256(text.encode()).hexdigest()
    folders = [folder for folder in (definition.loop.effects, definition.loop.channels) if folder]
    hashes = recorded.hashes | {folder: digest_of(path.parent / folder) for folder in folders}
    return Test(path, experiment, resolved, hashes, recorded.rows, digest)


def _source(given: str | Mapping[str, Any]) -> measurement.Source:
    """A measured file, by its name or by a table."""
    table: Mapping[str, Any] = {"file": given} if isinstance(given, str) else given
    settings: dict[str, Any] = {k: tuple(value) if isinstance(value, list) else value for k, value in table.items()}
    return measurement.Source(**settings)


def _sources(given: Any) -> tuple[measurement.Source, ...]:
    """A measured file, or several that follow on each other."""
    return tuple(_source(one) for one in given) if isinstance(given, list) else (_source(given),)


def _other(source: measurement.Source, channel: Channel) -> measurement.Other:
    """The file of a channel that says itself how it is read."""
    assert channel.file is not None
    columns = [measurement.column(c.name, c.unit, required=c.required) for c in channel.file.columns]
    ranges = {c.name: (c.lower, c.upper) for c in channel.file.columns}
    return measurement.Other(source, columns, ranges, channel.file.samples, channel.file.fewest)


def _check_hold_out(definition: DefinitionBase, history: History, path: Path) -> None:
    """Steps held out are those of a history that was read from the data."""
    steps = len(history.step_creepage)
    beyond = [step for step in definition.loop.hold_out_steps or () if step > steps]
    if beyond:
        what = f"there is no step {beyond[0]}; the history found has {steps}"
        raise DefinitionError(Problem(what, path, 0, "loop.hold_out_steps"))


def _check_unit(recorded: measurement.Recorded, thermal: Thermal | None, file: Path) -> None:
    """A disc that begins 273 K hotter or colder than it is said to is in another unit than is written."""
    samples = recorded.measured.temperature
    if samples is None or thermal is None or samples.time[0] > SOON * recorded.history.end_time[-1]:
        return
    first = float(samples.temperature[0])
    for off, unit in ((CELSIUS, "K"), (-CELSIUS, "degC")):
        if abs(first - thermal.initial_temperature - off) < NEAR_KELVIN:
            what = (
                f"begins with {first - CELSIUS:.4g} degC where the disc begins with "
                f"{thermal.initial_temperature - CELSIUS:.4g}: are its values in {unit}? then the column is "
                f"temperature [{unit}]"
            )
            raise MeasurementError(Problem(what, file, 0, "temperature"))


def _text(path: Path) -> str:
    """The text of a definition file, or a clear reason why there is none."""
    try:
        text = read_regular(path, largest=LARGEST_DEFINITION).decode("utf-8-sig")
    except FileNotFoundError:
        near = ", ".join(sorted(p.name for p in path.parent.glob("*.toml"))[:5]) if path.parent.is_dir() else ""
        raise DefinitionError(Problem(f"no such file{f'; here are {near}' if near else ''}", path)) from None
    except IsADirectoryError:
        raise DefinitionError(Problem("is a folder; name a test definition in it", path)) from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise DefinitionError(Problem("is not UTF-8 text; save it as UTF-8", path, line)) from None
    except OSError as error:
        raise DefinitionError(Problem(f"cannot be read: {error.strerror or error}", path)) from None
    if not text.strip():
        raise DefinitionError(Problem("is empty; `twindisc init` writes a commented definition", path))
    return text


def _resolved(definition: DefinitionBase, rig: Rig) -> dict[str, Any]:
    """The definition as plain tables, defaults included, empty tables left out."""
    plain = definition.model_dump(by_alias=True, exclude_none=True)
    plain["model"]["traction"] = theory_for(rig, definition.model.traction)
    return {key: value for key, value in plain.items() if value != {}}


def _rig(rig: RigTable, material: MaterialTable) -> Rig:
    discs = []
    for table, override in ((rig.disc1, material.disc1), (rig.disc2, material.disc2)):
        own = {key: value for key, value in dict(override or MaterialOverride()).items() if value is not None}
        values = {**dict(material), **own}
        disc = Disc(
            rolling_radius=table.rolling_radius_mm * 1e-3,
            transverse_radius=table.transverse_radius_mm * 1e-3,
            youngs_modulus=values["youngs_modulus_GPa"] * 1e9,
            poisson_ratio=float(values["poisson_ratio"]),
            hardness=values["hardness_HV"] * UNITS["HV"].factor,
            density=_or_nan(values["density_kg_m3"]),
            width=math.inf if table.width_mm is None else table.width_mm * 1e-3,
        )
        discs.append(disc)
    speed = _speed_of(rig, mean_radius(*discs))
    assert speed is not None  # a rule of the definition
    return Rig(disc1=discs[0], disc2=discs[1], normal_load=float(rig.normal_load_N), rolling_speed=speed)


def _tolerances(rig: RigTable, material: MaterialTable) -> dict[str, float]:
    """Relative standard deviations of what the definition says is uncertain; of two discs the larger."""
    tables = [table for table in (material, material.disc1, material.disc2) if table is not None]
    given: dict[str, list[float | None]] = {
        "transverse_radius": [rig.disc1.transverse_radius_mm, rig.disc2.transverse_radius_mm],
        "youngs_modulus": [table.youngs_modulus_GPa for table in tables],
        "hardness": [table.hardness_HV for table in tables],
        "initial_slope": [rig.initial_slope],
    }
    shares = {name: [v.std / abs(v) for v in values if isinstance(v, Uncertain)] for name, values in given.items()}
    return {name: max(each) for name, each in shares.items() if each}


def _law(table: LawTable, columns: Iterable[str]) -> Law:
    """A declared law; a formula begins at 0 of its covariate where it does not say."""
    covariate = covariate_named(table.covariate, columns)
    assert covariate is not None  # a rule of the definition
    parameters = dict(table.parameters or {})
    if table.shape is not None and "origin" in SHAPES[table.shape].along:
        parameters.setdefault(covariate_of(covariate).key("origin"), 0.0)
    return Law(
        quantity=table.quantity,
        covariate=covariate,
        shape=table.shape,
        parameters=parameters,
        at=tuple(table.at or ()),
        value=tuple(table.factor or table.shift or ()),
        valid=(table.valid[0], table.valid[1]) if table.valid else None,
        transfer=table.transfer,
    )


def _speed_of(table: RigTable | StepTable, radius: float) -> float | None:
    """Rolling speed [m/s] of the rig or of a step; None where none is given."""
    if table.mean_speed_rpm is not None:
        return float(table.mean_speed_rpm) * 2.0 * math.pi / 60.0 * radius
    return table.rolling_speed_m_s


def _history_of(given: HistoryTable | Literal["measured"], rig: Rig) -> tuple[History | None, float]:
    """The history, None where it is read from the data, and then the revolutions of an iteration, NaN if not said."""
    if isinstance(given, str):
        return None, math.nan
    if isinstance(given.steps, str):
        return None, float(given.revolutions_per_iteration)
    return _history(given, given.steps, rig), math.nan


def _history(table: HistoryTable, steps: Sequence[StepTable], rig: Rig) -> History:
    """Every iteration of the history; its duration is that of its revolutions at the mean angular speed."""
    radius = mean_radius(rig.disc1, rig.disc2)
    counts = [step.iterations for step in steps]
    pause = np.repeat([_or_nan(step.pause_s) for step in steps], counts)
    speed = np.repeat([_speed_of(step, radius) or rig.rolling_speed for step in steps], counts)
    revolutions = np.where(np.isnan(pause), float(table.revolutions_per_iteration), 0.0)
    return History(
        step=np.repeat(np.arange(len(counts)), counts),
        creepage=np.repeat([(step.creepage_percent or 0.0) / 100.0 for step in steps], counts),
        duration=np.where(np.isnan(pause), revolutions * (2.0 * math.pi * radius / speed), pause),
        revolutions=revolutions,
        given_mu=np.repeat([_or_nan(step.mu) for step in steps], counts),
        load_factor=np.repeat([(step.normal_load_N or rig.normal_load) / rig.normal_load for step in steps], counts),
        speed_factor=np.where(np.isnan(pause), speed / rig.rolling_speed, 0.0),
        yaw=np.repeat([step.yaw_mrad * 1e-3 for step in steps], counts),
        separate=table.separate,
    )


def _options(definition: DefinitionBase, rig: Rig) -> Options:
    model = definition.model
    return Options(
        contact=model.contact,
        traction=theory_for(rig, model.traction),
        wear_coefficient=_or_nan(model.wear_coefficient),
        disc1_wear_coefficient=_or_nan(model.disc1_wear_coefficient),
        friction_coefficient=_or_nan(model.friction_coefficient),
        layer_compliance=(model.layer_compliance_mm3_N or 0.0) * 1e-9,
        initial_slope=float(definition.rig.initial_slope or 1.0),
    )


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _thermal(table: ThermalTable) -> Thermal:
    """The heat capacity and the conductance, whichever way they are given."""
    capacity = table.heat_capacity_J_K
    if capacity is None:
        assert table.volume_mm3 is not None  # a rule of the definition
        capacity = table.density_kg_m3 * table.specific_heat_J_kgK * table.volume_mm3 * 1e-9
    initial = table.initial_temperature_C
    return Thermal(
        environment_temperature=table.environment_temperature_C + CELSIUS,
        heat_capacity=float(capacity),
        initial_temperature=(table.environment_temperature_C if initial is None else initial) + CELSIUS,
        convection=_convection(table),
        conductivity=float(table.conductivity_W_mK),
        density=float(table.density_kg_m3),
        specific_heat=float(table.specific_heat_J_kgK),
    )


def _convection(table: ThermalTable) -> float:
    """Return h S [W/K], NaN where it is not given."""
    if table.surface_mm2 is None:
        return _or_nan(table.convection_W_K)
    coefficient = table.heat_transfer_W_m2K
    if coefficient is None:
        assert table.fluid_conductivity_W_mK is not None  # a rule of the definition
        assert table.nusselt_per_length_1_m is not None
        coefficient = table.fluid_conductivity_W_mK * table.nusselt_per_length_1_m
    return coefficient * table.surface_mm2 * 1e-6


def _reported(definition: DefinitionBase) -> Mapping[str, float]:
    table = definition.reported
    values = {
        "depth": None if table.depth_um is None else table.depth_um * 1e-6,
        "width": None if table.width_mm is None else table.width_mm * 1e-3,
        "wear_coefficient": table.wear_coefficient,
        "temperature_rise": table.temperature_rise_C,
    }
    return {name: float(value) for name, value in values.items() if value is not None}
