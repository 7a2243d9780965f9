"""The test definition as a schema: every key with its unit, its physical range and what it means.

The [effects] tables are built from the catalogue, so that an effect is known here as soon as its file exists.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    TypeAdapter,
    WithJsonSchema,
    WrapValidator,
    create_model,
)
from pydantic.annotated_handlers import GetJsonSchemaHandler
from pydantic_core import core_schema

from twindisc_cli.effects import catalogue
from twindisc_cli.effects._effect import Effect
from twindisc_cli.errors import did_you_mean
from twindisc_cli.laws.covariates import COVARIATES
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.loop.channels import further_channels
from twindisc_cli.loop.channels._channel import Channel

SCHEMA_URL = "https://json-schema.org/draft/2020-12/schema"
TEST_NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"
LAW_NAME = r"^[A-Za-z][A-Za-z0-9_]*$"
COLUMN_NAME = r"^[^\[\]]+(\[[^\[\]]+\])?$"


def _radius(value: float) -> float:
    if value == 0.0 or value != value:
        raise ValueError("must be a radius: positive convex, negative concave, inf straight")
    return value


class Uncertain(float):
    """A number with its standard deviation, in the same unit."""

    std: float


def _maybe_uncertain(given: Any, number: Callable[[Any], float]) -> float:
    """A number, or a table { value, std }."""
    if not isinstance(given, dict):
        return number(given)
    std = given.get("std")
    if not isinstance(std, (int, float)) or isinstance(std, bool) or set(given) != {"value", "std"}:
        std = math.nan
    if not 0.0 < std < math.inf:
        raise ValueError("must be a number, or { value = ..., std = ... } with a finite std above 0")
    uncertain = Uncertain(number(given["value"]))
    uncertain.std = float(std)
    return uncertain


def _written(value: float) -> Any:
    return {"value": float(value), "std": value.std} if isinstance(value, Uncertain) else value


class _Or:
    """Tells the JSON schema what else a value may be, by the schema of the value."""

    def __init__(self, other: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
        self.other = other

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The value's own schema, or the other."""
        return {"anyOf": [handler(schema), self.other(handler(schema))]}


def _object(required: Sequence[str], properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


_STD = {"type": "number", "exclusiveMinimum": 0}
_OR_TABLE = _Or(lambda number: _object(["value", "std"], {"value": number, "std": _STD}))
_UNCERTAIN = (WrapValidator(_maybe_uncertain), PlainSerializer(_written), _OR_TABLE)
Positive = Annotated[float, Field(gt=0.0)]
Temperature = Annotated[float, Field(ge=-273.15, le=3000.0)]
Friction = Annotated[float, Field(gt=0.0, le=5.0, description="coefficient of friction")]
RollingRadius = Annotated[
    float, Field(ge=0.1, allow_inf_nan=True, description="radius along rolling; inf for a flat rail or plate")
]
TransverseRadius = Annotated[
    float,
    Field(allow_inf_nan=True, description="radius across rolling; inf: straight, negative: concave"),
    AfterValidator(_radius),
    *_UNCERTAIN,
]
Young = Annotated[float, Field(gt=0.0, le=1500.0, description="Young's modulus"), *_UNCERTAIN]
Poisson = Annotated[float, Field(ge=0.0, le=0.5, description="Poisson's ratio")]
Slope = Annotated[
    float, Field(gt=0.0, le=2.0, description="initial slope of the creep curve over Kalker's"), *_UNCERTAIN
]
Density = Annotated[float, Field(ge=100.0, le=30000.0, description="of the disc, for the mass it loses")]
Hardness = Annotated[float, Field(gt=0.0, le=12000.0, description="Vickers hardness"), *_UNCERTAIN]


class Table(BaseModel):
    """A TOML table: unknown keys and wrong types are errors, nothing is coerced."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class TestTable(Table):
    """What the test is called."""

    __test__ = False

    name: str = Field(pattern=TEST_NAME, description="names the results; no spaces")
    description: str = ""
    group: str | None = Field(
        default=None,
        pattern=TEST_NAME,
        description="tests of one group are repeats, which `twindisc campaign` pools",
    )


class DiscTable(Table):
    """The two radii of one disc, and the width of its rim."""

    rolling_radius_mm: RollingRadius
    transverse_radius_mm: TransverseRadius
    width_mm: Positive | None = Field(
        default=None, le=1000.0, description="of the rim; two straight discs touch over the width of the narrower one"
    )


class RigTable(Table):
    """The load, the speed and the two discs. Disc 2 is the one whose profile wears."""

    normal_load_N: Positive = Field(le=1e7)
    mean_speed_rpm: Positive | None = Field(default=None, le=1e6, description="mean of both discs; finite radii only")
    rolling_speed_m_s: Positive | None = Field(default=None, le=1e3, description="instead of mean_speed_rpm")
    initial_slope: Slope | None = Field(
        default=None,
        description="initial slope of the creep curve over Kalker's, below 1 by roughness or a third body; left out, 1 "
        "and close-loop finds a third_body_layer where it is lower; with a std, a slope within it is not a finding",
    )
    disc1: DiscTable
    disc2: DiscTable


class MaterialOverride(Table):
    """What differs on one disc."""

    youngs_modulus_GPa: Young | None = None
    poisson_ratio: Poisson | None = None
    hardness_HV: Hardness | None = None
    density_kg_m3: Density | None = None


class MaterialTable(Table):
    """The material of both discs."""

    youngs_modulus_GPa: Young
    poisson_ratio: Poisson
    hardness_HV: Hardness
    density_kg_m3: Density | None = None
    disc1: MaterialOverride | None = None
    disc2: MaterialOverride | None = None


class ThermalTable(Table):
    """The disc as one heat capacity, what cools it, and its material for the flash temperature."""

    environment_temperature_C: Temperature
    initial_temperature_C: Temperature | None = Field(default=None, description="left out: the environment's")
    heat_capacity_J_K: Positive | None = Field(default=None, description="of the disc; or give volume_mm3")
    volume_mm3: Positive | None = Field(default=None, description="with density and specific heat: the heat capacity")
    density_kg_m3: Density = Field(default=7650.0, description="of the disc; default AISI 440C")
    specific_heat_J_kgK: float = Field(default=460.0, ge=50.0, le=20000.0, description="of the disc; default AISI 440C")
    conductivity_W_mK: float = Field(default=24.2, ge=0.005, le=10000.0, description="of the disc; default AISI 440C")
    convection_W_K: Positive | None = Field(default=None, description="h S; left out: identified from a temperature")
    heat_transfer_W_m2K: Positive | None = Field(default=None, description="h, with surface_mm2")
    fluid_conductivity_W_mK: Positive | None = Field(default=None, description="with nusselt_per_length_1_m")
    nusselt_per_length_1_m: Positive | None = Field(default=None, description="Nu / length, with surface_mm2")
    surface_mm2: Positive | None = Field(default=None, description="S, the cooled surface")


class StepTable(Table):
    """A step of constant creepage, and what differs in it from [rig]; or a pause."""

    creepage_percent: float | None = Field(
        default=None, ge=-200.0, le=200.0,
        description="(R1 w1 - R2 w2) / mean, positive where disc 1 is the faster; 200: disc 2 is held fast",
    )  # fmt: skip
    iterations: int = Field(default=1, ge=1, le=100_000)
    mu: Friction | None = Field(default=None, description="used instead of an identified coefficient of friction")
    normal_load_N: Positive | None = Field(default=None, le=1e7, description="in this step, instead of the rig's")
    mean_speed_rpm: Positive | None = Field(default=None, le=1e6, description="in this step, instead of the rig's")
    rolling_speed_m_s: Positive | None = Field(default=None, le=1e3, description="in this step, instead of the rig's")
    yaw_mrad: float = Field(default=0.0, ge=-100.0, le=100.0, description="angle between the axes, in this step")
    pause_s: Positive | None = Field(default=None, description="stands still so long: cools, does not wear")


MEASURED: Literal["measured"] = "measured"


STEPS = TypeAdapter(Annotated[list[StepTable], Field(min_length=1)])


def _steps(given: Any, _: Callable[[Any], Any]) -> Any:
    """A list of steps, or the word for those that are read from the data."""
    return _measured_or(given, STEPS.validate_python, "a list of steps")


def _measured_or(given: Any, handler: Callable[[Any], Any], what: str) -> Any:
    if isinstance(given, str):
        if given != MEASURED:
            raise ValueError(f'must be {what}, or "measured": read from the log or the traction')
        return given
    return handler(given)


class HistoryTable(Table):
    """The load history: steps of constant creepage, each some iterations of equal length, and pauses."""

    revolutions_per_iteration: Positive
    steps: Annotated[Annotated[list[StepTable], Field(min_length=1)] | Literal["measured"], WrapValidator(_steps)] = (
        Field(description='of constant creepage; or "measured": read from the log or the traction')
    )
    separate: bool = Field(
        default=False,
        description="every step is a test of its own on new discs: no time, wear or warmth is carried over; times in "
        "measured files run on through the steps as written",
    )


def _or_measured(given: Any, _: Callable[[Any], Any]) -> Any:
    """The table of a history, or the word for one that is read from the data."""
    return _measured_or(given, HistoryTable.model_validate, "a table")


class ModelTable(Table):
    """How contact is computed, and the base parameters that are known."""

    contact: Literal["hertz", "half_space"] = "hertz"
    traction: Literal["fastsim", "fastrip", "exact"] | None = Field(
        default=None, description='left out: "exact" on two cylinders, else "fastsim"'
    )
    wear_coefficient: Positive | None = Field(default=None, le=1.0, description="K of disc 2; left out: identified")
    disc1_wear_coefficient: Positive | None = Field(
        default=None, le=1.0, description="K of disc 1; left out: it does not wear, unless an effect says so"
    )
    friction_coefficient: Friction | None = Field(default=None, description="constant base value; left out: identified")
    layer_compliance_mm3_N: float | None = Field(
        default=None,
        ge=0.0,
        le=0.01,
        description="thickness of a third body between the discs over its shear modulus, mm / (N/mm2); left out: none",
    )


def _zero(given: Any, handler: Callable[[Any], Any]) -> float | str:
    is_number = isinstance(given, (int, float)) and not isinstance(given, bool) and math.isfinite(given)
    if not is_number and given not in ("unloaded", "as recorded"):
        raise ValueError('must be "unloaded", "as recorded" or a torque in N m')
    value: float | str = handler(given)
    return value


FileName = Annotated[str, Field(min_length=1)]


def _or_file(given: Any, handler: Callable[[Any], Any]) -> Any:
    """The name of a file, or a table that says how to read it."""
    return FileTable.model_validate(given) if isinstance(given, Mapping) else handler(given)


def _cells(given: Any, handler: Callable[[Any], Any]) -> Any:
    """One text or a list of texts."""
    if not isinstance(given, (str, list)):
        raise ValueError('must be a text, such as "-9999", or a list of texts')
    return handler([given] if isinstance(given, str) else given)


ZeroOfTorque = Annotated[float | str, WrapValidator(_zero)]


class ColumnTable(Table):
    """A column as a measured file has it."""

    column: str | None = Field(default=None, description="its name in the file")
    unit: str | None = Field(default=None, description="its unit, where the file has none or writes it otherwise")
    sign: Literal[1, -1] = 1


class ColumnsTable(Table):
    """Columns whose names or units in the files are not understood."""

    time: ColumnTable | None = None
    step: ColumnTable | None = None
    creepage: ColumnTable | None = None
    traction_ratio: ColumnTable | None = None
    uncertainty: ColumnTable | None = None
    speed_1: ColumnTable | None = None
    speed_2: ColumnTable | None = None
    rolling_speed: ColumnTable | None = None
    sliding_speed: ColumnTable | None = None
    torque: ColumnTable | None = None
    traction_force: ColumnTable | None = None
    normal_load: ColumnTable | None = None
    y: ColumnTable | None = None
    height: ColumnTable | None = None
    disc: ColumnTable | None = None
    trace: ColumnTable | None = None
    iteration: ColumnTable | None = None
    temperature: ColumnTable | None = None
    mass_loss: ColumnTable | None = None
    mass_1: ColumnTable | None = None
    mass_2: ColumnTable | None = None
    cycles: ColumnTable | None = None
    revolutions: ColumnTable | None = None
    distance: ColumnTable | None = None
    sliding_distance: ColumnTable | None = None
    mass: ColumnTable | None = None


MEASURED_FILES = ("traction", "log", "profile", "temperature", "mass")
"""The keys of [measured] that name a file."""
Cells = Annotated[list[str], WrapValidator(_cells)]


class FileTable(Table):
    """A measured file, and how it is read."""

    file: FileName
    sheet: str | None = Field(default=None, description="of a workbook; group of a .tdms, variable of a .mat")
    skip: Cells | None = Field(
        default=None, description="what stands where nothing was measured, such as -9999; [] where every number is one"
    )
    ignore: Cells | None = Field(default=None, description="columns that are not looked at")


_TEXTS = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
_OR_FILE = _Or(
    lambda name: _object(["file"], {"file": name, "sheet": {"type": "string"}, "skip": _TEXTS, "ignore": _TEXTS})
)


def _file_written(value: Any) -> Any:
    """A name as it was, a table with what it says, of a list each."""
    if isinstance(value, list):
        return [_file_written(one) for one in value]
    return value.model_dump(exclude_none=True) if isinstance(value, FileTable) else value


MeasuredFile = Annotated[FileName, WrapValidator(_or_file), PlainSerializer(_file_written), _OR_FILE]


def _or_files(given: Any, handler: Callable[[Any], Any]) -> Any:
    """A file, or a list of files that follow on each other."""
    return FILES.validate_python(given) if isinstance(given, list) else handler(given)


FILES = TypeAdapter(Annotated[list[MeasuredFile], Field(min_length=1)])
MeasuredFiles = Annotated[
    MeasuredFile, WrapValidator(_or_files), _Or(lambda file: {"type": "array", "items": file, "minItems": 1})
]
"""A file, or several in order."""


class MeasuredTable(Table):
    """Measured data: tables, with paths relative to this file."""

    traction: MeasuredFile | None = None
    log: MeasuredFiles | None = Field(
        default=None, description="whatever the rig writes, in place of traction; several files as a list, in order"
    )
    torque_disc: Literal[1, 2] | None = Field(
        default=None, description="the disc whose torque the log holds, where their radii differ"
    )
    torque_zero: ZeroOfTorque | None = Field(
        default=None, description='of the log: "unloaded", from its rows without load, as by default where it has any, '
        'else from slip both ways; a torque in N m; or "as recorded"',
    )  # fmt: skip
    profile: MeasuredFile | None = None
    profile_place: Literal["as recorded"] | None = Field(
        default=None, description="left out: levelled on the unworn flanks and centred on the track"
    )
    temperature: MeasuredFiles | None = Field(default=None, description="a list where it is that of the log")
    mass: MeasuredFile | None = Field(
        default=None, description="mass lost by the discs, or their weights at stops; needs a density"
    )
    balance_mg: Positive | None = Field(
        default=None, description="standard deviation of one weighing, where the table of masses states none"
    )
    covariates: list[Annotated[str, Field(pattern=COLUMN_NAME)]] | None = Field(
        default=None, description="further columns of the traction or log, `name [unit]`, that laws may run over"
    )
    columns: ColumnsTable | None = None
    provenance: Literal["measured", "digitised", "reconstructed", "synthetic"] = "measured"


class BlockMeasuredTable(MeasuredTable):
    """Measured data in a block, and how all files are read that it does not name; other keys are the definition's."""

    model_config = ConfigDict(extra="allow")

    sheet: str | None = None
    skip: Cells | None = None
    ignore: Cells | None = None


class BlockTable(BaseModel):
    """What a .toml beside measured files says of their reading; its other tables go into the definition."""

    measured: BlockMeasuredTable = BlockMeasuredTable()


class LoopTable(Table):
    """Settings of close-loop."""

    hold_out_steps: list[Annotated[int, Field(ge=1)]] | None = Field(
        default=None, description="steps, counted from 1, that are never used to fit or to choose"
    )
    effects: FileName | None = Field(default=None, description="a folder of further effects, one file each")
    channels: FileName | None = Field(default=None, description="a folder of further channels, one file each")


def _one_of(names: Iterable[str]) -> tuple[AfterValidator, WithJsonSchema]:
    """A text that is one of these names."""
    known = list(dict.fromkeys(names))

    def checked(name: str) -> str:
        if name not in known:
            raise ValueError(f"must be {', '.join(known[:-1])} or {known[-1]}{did_you_mean(name, known)}")
        return name

    return AfterValidator(checked), WithJsonSchema({"type": "string", "enum": known})


QuantityName = Annotated[str, *_one_of(QUANTITIES)]
ShapeName = Annotated[str, *_one_of(SHAPES)]


class LawTable(Table):
    """A law learnt from data: a quantity of the model, changed by a formula or a curve over a covariate."""

    quantity: QuantityName = Field(description="what is changed")
    covariate: str = Field(
        description=f"what the change depends on, with its unit or without: {', '.join(COVARIATES)}, "
        "or a column of [measured] covariates"
    )
    shape: ShapeName | None = Field(default=None, description="a formula; or give at with factor or shift")
    parameters: dict[str, float] | None = Field(
        default=None, description="of the formula, along the covariate with its unit"
    )
    at: list[float] | None = Field(default=None, min_length=2, description="places of a curve; constant beyond")
    factor: list[float] | None = Field(default=None, description="the quantity is multiplied by it at each place")
    shift: list[float] | None = Field(default=None, description="is added to the quantity at each place")
    valid: list[float] | None = Field(default=None, min_length=2, max_length=2, description="where data were")
    transfer: Literal["inside", "same_history"] = Field(
        default="inside", description="whether it holds in its range on any history, or on the one it was learnt on"
    )


class ReportedTable(Table):
    """Numbers stated elsewhere, which `check` holds against the physics."""

    depth_um: Positive | None = None
    width_mm: Positive | None = None
    wear_coefficient: Positive | None = None
    temperature_rise_C: float | None = None


class DefinitionBase(Table):
    """One twin-disc test."""

    schema_version: Literal[1] = Field(alias="schema")
    test: TestTable
    rig: RigTable
    material: MaterialTable
    thermal: ThermalTable | None = None
    history: Annotated[HistoryTable | Literal["measured"], WrapValidator(_or_measured)] = Field(
        description='the steps; or "measured": they are read from the log or the traction, and printed'
    )
    model: ModelTable = ModelTable()
    measured: MeasuredTable = MeasuredTable()
    laws: dict[Annotated[str, Field(pattern=LAW_NAME)], LawTable] = Field(
        default_factory=dict, description="Laws learnt from data, one table each."
    )
    loop: LoopTable = LoopTable()
    reported: ReportedTable = ReportedTable()


def _effects_table(known: tuple[tuple[str, Effect], ...]) -> type[Table]:
    tables: dict[str, Any] = {}
    for name, effect in known:
        keys: dict[str, Any] = {}
        for param in effect.params:
            limits = (param.lower, param.upper) if param.off is None else (param.lower, param.upper, param.off)
            text = f"{param.meaning} [{param.unit}]".strip()
            keys[param.name] = (
                Annotated[float, Field(ge=min(limits), le=max(limits), description=text)],
                param.start,
            )
        table = create_model(name, __base__=Table, __doc__=effect.explanation.partition("\n")[0], **keys)
        tables[name] = (table | None, None)
    return create_model("effects", __base__=Table, __doc__="Declared effects, one table each.", **tables)


def _measured_table(further: tuple[tuple[str, Channel], ...]) -> type[MeasuredTable]:
    """The table of measured data with the files, and their columns, of channels that bring their own."""
    if not further:
        return MeasuredTable
    columns = {
        column.name.replace(" ", "_"): (ColumnTable | None, None)
        for _, channel in further
        for column in (channel.file.columns if channel.file else ())
    }
    new: Any = {name: kind for name, kind in columns.items() if name not in ColumnsTable.model_fields}
    every = create_model("ColumnsTable", __base__=ColumnsTable, __doc__=ColumnsTable.__doc__, **new)
    files: Any = {
        name: (MeasuredFile | None, Field(default=None, description=f"{channel.label} of the test"))
        for name, channel in further
    }
    files["columns"] = (every | None, None)
    return create_model("MeasuredTable", __base__=MeasuredTable, __doc__=MeasuredTable.__doc__, **files)


def _channels_table(further: tuple[tuple[str, Channel], ...]) -> type[Table]:
    """A table for each channel with parameters of its own."""
    tables: dict[str, Any] = {}
    for name, channel in further:
        keys: dict[str, Any] = {
            base.key: (
                Annotated[float, Field(ge=base.lower, le=base.upper, description=f"{base.meaning} [{base.unit}]")]
                | None,
                None,
            )
            for base in channel.parameters
            if base.place is None
        }
        table = create_model(name, __base__=Table, __doc__=f"Of the channel {channel.label}.", **keys)
        tables[name] = (table | None, None)
    return create_model("channels", __base__=Table, __doc__="Parameters of channels, one table each.", **tables)


def definition_model() -> type[DefinitionBase]:
    """The schema of a test definition, with a table for every effect of the catalogue and every further channel."""
    return _definition_model(tuple(catalogue().items()), tuple(further_channels().items()))


@cache
def _definition_model(
    known: tuple[tuple[str, Effect], ...], further: tuple[tuple[str, Channel], ...]
) -> type[DefinitionBase]:
    effects, channels, measured = _effects_table(known), _channels_table(further), _measured_table(further)
    tables: Any = {
        "effects": (effects, effects()),
        "channels": (channels, channels()),
        "measured": (measured, measured()),
    }
    return create_model("Definition", __base__=DefinitionBase, __doc__="A twin-disc test definition.", **tables)


def json_schema() -> dict[str, Any]:
    """The JSON schema of a test definition, for editors."""
    return {"$schema": SCHEMA_URL, **definition_model().model_json_schema(by_alias=True)}
