import json
import math
import tomllib
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import tomli_w
from definitions import TRACTION, VALID, changed, line_of, write
from hypothesis import given, settings
from hypothesis import strategies as st

from twindisc_cli.definition import dump, load, relocate
from twindisc_cli.definition.lines import locate
from twindisc_cli.definition.parse import parse
from twindisc_cli.definition.schema import json_schema
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import DefinitionError, MeasurementError, Problem, nearest

ROOT = Path(__file__).parents[1]
CONFIGS = sorted((ROOT / "configs").glob("*.toml"))


def problems(text: str) -> tuple[Problem, ...]:
    with pytest.raises(DefinitionError) as error:
        parse(text, "t.toml")
    return error.value.problems


def only_problem(text: str, needle: str) -> str:
    """The one problem of a text, which stands in the line of `needle`."""
    (problem,) = problems(text)
    assert problem.line == line_of(text, needle), str(problem)
    return str(problem)


@pytest.mark.parametrize(("first", "begin"), [(10, 20.0), (100, 20.0), (10, 290.0)])
def test_a_record_in_kelvin_is_refused_and_a_disc_that_begins_hot_is_not(
    tmp_path: Path, first: int, begin: float
) -> None:
    """A new disc is as warm as the definition says; one that has run, or that is said to be hot, may be 293 degC."""
    text = changed(environment_temperature_C=f"environment_temperature_C = 20.0\ninitial_temperature_C = {begin}")
    path = write(tmp_path, text, temperature=f"time [s],temperature [degC]\n{first},293.2\n150,301\n300,322\n")
    if (first, begin) == (10, 20.0):
        with pytest.raises(MeasurementError, match=r"temperature.csv: temperature: begins with 293.2 degC .* in K\?"):
            load(path)
    else:
        assert load(path).experiment.measured.temperature is not None


def test_a_record_in_degrees_celsius_that_is_said_to_be_in_kelvin_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, temperature="time [s],temperature [K]\n10,20.1\n150,28\n300,35\n")
    with pytest.raises(MeasurementError, match=r"begins with -253 degC where the disc begins with .* in degC\?"):
        load(path)


def test_values_are_si(tmp_path: Path) -> None:
    test = load(write(tmp_path)).experiment
    assert test.rig.disc1.transverse_radius == math.inf
    assert test.rig.disc2.rolling_radius == 0.03
    assert test.rig.disc2.youngs_modulus == 206e9
    assert test.rig.disc2.hardness == pytest.approx(700 * 9.80665e6)
    # 30 mm at 3000 rpm; 4200 revolutions at 3000 rpm last 84 s (Chevalier et al. 2006, 3.1)
    assert test.rig.rolling_speed == pytest.approx(0.03 * 100 * math.pi)
    np.testing.assert_allclose(test.history.duration, 84.0)
    np.testing.assert_array_equal(test.history.step, [0, 0, 1, 1, 2])
    np.testing.assert_allclose(test.history.creepage, [0.005, 0.005, 0.01, 0.01, 0.02])
    assert test.thermal is not None
    assert test.thermal.environment_temperature == pytest.approx(293.15)
    assert test.thermal.initial_temperature == pytest.approx(293.15)
    assert math.isnan(test.thermal.convection)


def test_a_wheel_on_a_rail_counts_its_own_revolutions(tmp_path: Path) -> None:
    text = changed(
        mean_speed_rpm="rolling_speed_m_s = 10",
        disc1="disc1 = { rolling_radius_mm = 625, transverse_radius_mm = inf }",
        disc2="disc2 = { rolling_radius_mm = inf, transverse_radius_mm = 300 }",
    )
    test = load(write(tmp_path, text)).experiment
    assert test.rig.rolling_speed == 10.0
    np.testing.assert_allclose(test.history.duration, 4200 * 2 * math.pi * 0.625 / 10)


def test_discs_of_different_size_share_one_rolling_speed(tmp_path: Path) -> None:
    text = changed(disc1="disc1 = { rolling_radius_mm = 60, transverse_radius_mm = inf }")
    test = load(write(tmp_path, text)).experiment
    # w1 = V/60 mm, w2 = V/30 mm, whose mean is 100 pi rad/s
    assert test.rig.rolling_speed / 2 * (1 / 0.06 + 1 / 0.03) == pytest.approx(100 * math.pi)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ("convection_W_K = 1.6", 1.6),
        ("heat_transfer_W_m2K = 200\nsurface_mm2 = 8000", 1.6),
        ("fluid_conductivity_W_mK = 0.025\nnusselt_per_length_1_m = 8000\nsurface_mm2 = 8000", 1.6),
    ],
)
def test_every_way_to_give_the_convection(tmp_path: Path, keys: str, expected: float) -> None:
    text = changed(heat_capacity_J_K=f"heat_capacity_J_K = 100\n{keys}")
    thermal = load(write(tmp_path, text)).experiment.thermal
    assert thermal is not None
    assert thermal.convection == pytest.approx(expected)


def test_heat_capacity_from_the_volume(tmp_path: Path) -> None:
    text = changed(heat_capacity_J_K="volume_mm3 = 1000\ndensity_kg_m3 = 8000\nspecific_heat_J_kgK = 500")
    thermal = load(write(tmp_path, text)).experiment.thermal
    assert thermal is not None
    assert thermal.heat_capacity == pytest.approx(8000 * 500 * 1e-6)
    assert (thermal.density, thermal.specific_heat) == (8000.0, 500.0)


def test_one_disc_may_differ(tmp_path: Path) -> None:
    text = VALID + "[material.disc1]\nhardness_HV = 300\npoisson_ratio = 0.25\n"
    rig = load(write(tmp_path, text)).experiment.rig
    assert rig.disc1.hardness == pytest.approx(300 * 9.80665e6)
    assert (rig.disc1.poisson_ratio, rig.disc2.poisson_ratio) == (0.25, 0.30)
    assert rig.disc2.hardness == pytest.approx(700 * 9.80665e6)


def test_steps_are_counted_from_one_in_the_file(tmp_path: Path) -> None:
    test = load(write(tmp_path, VALID + "[loop]\nhold_out_steps = [1, 3]\n")).experiment
    assert test.hold_out_steps == (0, 2)


def test_reported_numbers_are_si(tmp_path: Path) -> None:
    text = VALID + "[reported]\ndepth_um = 6\nwidth_mm = 1.8\nwear_coefficient = 1e-4\ntemperature_rise_C = 10\n"
    reported = load(write(tmp_path, text)).experiment.reported
    expected = {"depth": 6e-6, "width": 1.8e-3, "wear_coefficient": 1e-4, "temperature_rise": 10.0}
    assert reported == pytest.approx(expected)


@pytest.mark.parametrize(
    ("second", "says"),
    [
        ("normal_load_N = 80.0", "normal_load_N: stands twice in this table, first in line 7"),
        ("[rig]", "[rig]: this table is there already, above"),
    ],
)
def test_a_key_or_a_table_that_stands_twice_is_named(second: str, says: str) -> None:
    (problem,) = problems(changed(normal_load_N=f"normal_load_N = 72.0\n{second}"))
    assert says in str(problem)


@pytest.mark.parametrize(
    ("key", "line", "says"),
    [
        ("normal_load_N", "normal_load_N = 0", "must be greater than 0, not 0"),
        ("normal_load_N", "normal_load_N = -72.0", "must be greater than 0, not -72.0"),
        ("normal_load_N", "normal_load_N = nan", "must be a finite number, not nan"),
        ("normal_load_N", "normal_load_N = inf", "must be a finite number, not inf"),
        ("normal_load_N", 'normal_load_N = "800"', 'must be a number, not "800"'),
        ("normal_load_N", "normal_load_N = true", "must be a number, not true"),
        ("normal_load_N", "normal_load_N = 72,0", "write 72.0"),
        ("normal_load_N", "normal_load_N = 72.0 N", "not TOML"),
        ("normal_load_N", "normal_load_kN = 0.072", "did you mean normal_load_N, with the value in that unit?"),
        ("normal_load_N", "Normal_Load_N = 72.0", "did you mean normal_load_N"),
        ("heat_capacity_J_K", "heat_capacity_J_K = 100 J", "not TOML"),
        ("heat_capacity_J_K", "heat_capcity_J_K = 100", "did you mean heat_capacity_J_K"),
        ("mean_speed_rpm", "mean_sped_rpm = 3000", "did you mean mean_speed_rpm"),
        ("poisson_ratio", "poisson_ratio = 0.51", "must be at most 0.5"),
        ("poisson_ratio", "poisson_ratio = -0.1", "must be at least 0"),
        ("hardness_HV", "hardness_HV = 0", "must be greater than 0"),
        ("environment_temperature_C", "environment_temperature_C = -274", "must be at least -273.15"),
        ("friction_coefficient", "friction_coefficient = -0.6", "must be greater than 0"),
        ("friction_coefficient", 'contact = "herz"', "did you mean 'hertz'?"),
        ("friction_coefficient", "rolling_speed_m_s = 9", "unknown key here; it belongs in [rig]"),
        ("revolutions_per_iteration", "revolutions_per_iteration = 0", "must be greater than 0"),
        ("schema", "schema = 2", "must be 1"),
        ("name", 'name = "a b/c"', "must be letters, digits"),
        ("hardness_HV", "hardness_HV = { value = 700, std = inf }", "{ value = ..., std = ... } with a finite std"),
    ],
)
def test_a_wrong_value_is_one_problem_in_its_line(key: str, line: str, says: str) -> None:
    assert says in only_problem(changed(**{key: line}), line)


@pytest.mark.parametrize(
    ("disc", "says"),
    [
        ("{ rolling_radius_mm = -30.0, transverse_radius_mm = 30.0 }", "must be at least 0.1, not -30.0"),
        ("{ rolling_radius_mm = nan, transverse_radius_mm = 30.0 }", "must be at least 0.1, not nan"),
        ("{ rolling_radius_mm = 0.03, transverse_radius_mm = 30.0 }", "must be at least 0.1, not 0.03"),  # metres
        ("{ rolling_radius_mm = 30.0, transverse_radius_mm = 0 }", "must be a radius"),
        ("{ rolling_radius_mm = 30.0, transverse_radius_mm = inf }", "both are straight: give width_mm"),
        ("{ rolling_radius_mm = 30.0, transverse_radius_mm = -30.0 }", "touch at their edges"),
        ("{ rolling_radius_mm = inf, transverse_radius_mm = 30.0 }", "does not turn: give rolling_speed_m_s"),
        ("{ rolling_radius_m = 0.03, transverse_radius_mm = 30.0 }", "did you mean rolling_radius_mm, with the value"),
        ("{ rolling_radius_mm = 30.0 }", "transverse_radius_mm: is missing"),
    ],
)
def test_radii(disc: str, says: str) -> None:
    text = changed(disc2=f"disc2 = {disc}")
    (problem,) = problems(text)
    assert says in str(problem)
    assert problem.line in (line_of(text, "disc2"), line_of(text, "mean_speed_rpm"))


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("201", "must be at most 200, not 201"),
        ("-200.5", "must be at least -200, not -200.5"),
        ("nan", "must be a finite number"),
        ('"2"', "must be a number"),
    ],
)
def test_creepage_of_a_step(value: str, says: str) -> None:
    text = VALID.replace("creepage_percent = 2.0", f"creepage_percent = {value}")
    message = only_problem(text, f"creepage_percent = {value}")
    assert "history.steps[3].creepage_percent" in message
    assert says in message


def test_hundred_percent_and_no_creepage_are_allowed() -> None:
    parse(VALID.replace("= 2.0", "= 100").replace("= 0.5,", "= 0,"), "t.toml")


def test_all_mistakes_come_in_one_go() -> None:
    text = changed(
        normal_load_N="normal_load_N = -1,5",
        mean_speed_rpm="mean_speed_rpm = 3000\nrolling_speed_m_s = 9.4",
        poisson_ratio="poison_ratio = 0.3",
        hardness_HV="hardness_HV = 700 HV",
    )
    text += '\n[measured]\nlog = "log.csv"\ntorque_disk = 2\n[effect.falling_friction]\nratio = 0.4\n'
    found: dict[int, str] = {}
    for problem in problems(text):
        found[problem.line] = found.get(problem.line, "") + str(problem)
    expected = {
        "normal_load_N": "write -1.5",
        "rolling_speed_m_s": "keep one of them",
        "poison_ratio": "did you mean poisson_ratio",
        "hardness_HV": "not TOML",
        "torque_disk": "did you mean torque_disc",
        "[effect.": "did you mean effects",
    }
    for needle, says in expected.items():
        assert says in found[line_of(text, needle)], (needle, found)
    and_the_load_is_negative = 1
    assert len(problems(text)) == len(expected) + and_the_load_is_negative


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        ("[loop]\nhold_out_steps = [4]\n", "there is no step 4; the history has 3"),
        ("[loop]\nhold_out_steps = [1, 1]\n", "named twice"),
        ("[loop]\nhold_out_steps = [1, 2, 3]\n", "none is left to fit"),
        ("[loop]\nhold_out_steps = [0]\n", "must be at least 1"),
        ('[measured]\ntraction = "a.csv"\nlog = "b.csv"\ntorque_disc = 2\n', "keep one of them"),
        ("[measured]\ntorque_disc = 2\n", "only a log has a torque"),
        (
            '[measured]\ntraction = ""\n',
            "measured.traction: must name a file; leave the key out where nothing was measured",
        ),
        ('[measured]\nprovenance = "guessed"\n', "must be 'measured'"),
    ],
)
def test_rules_between_keys(extra: str, says: str) -> None:
    (problem,) = problems(VALID + extra)
    assert says in str(problem)


@pytest.mark.parametrize(
    ("table", "line", "says"),
    [
        ("material", "density_kg_m3 = 7.85", "must be at least 100, not 7.85"),  # g/cm3
        ("thermal", "density_kg_m3 = 7.85", "must be at least 100, not 7.85"),
        ("thermal", "specific_heat_J_kgK = 0.46", "must be at least 50, not 0.46"),  # kJ/(kg K)
        ("thermal", "conductivity_W_mK = 24200", "must be at most 10000, not 24200"),  # mW/(m K)
    ],
)
def test_no_solid_is_like_that(table: str, line: str, says: str) -> None:
    assert says in only_problem(VALID.replace(f"[{table}]\n", f"[{table}]\n{line}\n"), line)


@pytest.mark.parametrize(
    ("replacement", "says"),
    [
        ("", "no heat capacity"),
        ("heat_capacity_J_K = 100\nvolume_mm3 = 1000", "keep one of them"),
        ("heat_capacity_J_K = 100\nsurface_mm2 = 1000", "convection is given by surface_mm2"),
        ("heat_capacity_J_K = 100\nconvection_W_K = 1\nheat_transfer_W_m2K = 9", "it takes convection_W_K; or"),
    ],
)
def test_heat_is_given_in_one_way(replacement: str, says: str) -> None:
    (problem,) = problems(changed(heat_capacity_J_K=replacement))
    assert says in str(problem)


@pytest.mark.parametrize(
    ("extra", "needle", "says"),
    [
        (
            "torque_zero = nan",
            "torque_zero",
            'torque_zero: must be "unloaded", "as recorded" or a torque in N m, not nan',
        ),
        ("torque_zero = true", "torque_zero", "or a torque in N m, not true"),
        ('temperature = { file = "b.csv", shet = "x" }', "shet", "shet: unknown key, did you mean sheet?"),
        ('temperature = ["c.csv", { file = "b.csv", x = 1 }]', "b.csv", "known here: file, sheet, skip, ignore"),
        (
            'temperature = { file = "b.csv", skip = -9999 }',
            "skip",
            'must be a text, such as "-9999", or a list of texts',
        ),
        ('covariates = ["[%]"]', "covariates", "must be the name of a column, with its unit in [ ] where it has one"),
        (
            '[laws.1x]\nquantity = "mu"\ncovariate = "time"\nat = [0, 1]\nfactor = [1, 1]',
            "laws.1x",
            "laws.1x: must be letters",
        ),
        ("[[laws]]\nx = 1", "laws", "laws: must be a table, not "),
    ],
)
def test_what_is_wrong_in_measured_and_in_names(extra: str, needle: str, says: str) -> None:
    assert says in only_problem(f'{VALID}\n[measured]\nlog = "a.csv"\n{extra}\n', needle)


def test_missing_tables_are_named() -> None:
    found = {str(p) for p in problems("schema = 1\n")}
    assert {f"t.toml:1: {name}: is missing" for name in ("test", "rig", "material", "history")} <= found


def test_what_cannot_be_read(tmp_path: Path) -> None:
    def message(path: Path) -> str:
        with pytest.raises(DefinitionError) as error:
            load(path)
        return str(error.value)

    write(tmp_path, name="real.toml")
    assert "no such file; here are real.toml" in message(tmp_path / "absent.toml")
    assert "is a folder" in message(tmp_path)
    (tmp_path / "empty.toml").write_text("\n")
    assert "is empty; `twindisc init`" in message(tmp_path / "empty.toml")
    (tmp_path / "latin.toml").write_bytes(VALID.replace("small", "sm\xe4ll").encode("latin-1"))
    assert "latin.toml:4: is not UTF-8" in message(tmp_path / "latin.toml")


def test_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / "bom.toml").write_bytes(VALID.replace("\n", "\r\n").encode("utf-8-sig"))
    assert load(tmp_path / "bom.toml").experiment.name == "small"


# Effects: everything comes from the catalogue.


@pytest.mark.parametrize("name", catalogue())
def test_a_declared_effect_starts_at_its_typical_size(tmp_path: Path, name: str) -> None:
    test = load(write(tmp_path, VALID + f"[effects.{name}]\n"))
    assert test.experiment.effects == {name: {p.name: p.start for p in catalogue()[name].params}}


@pytest.mark.parametrize("name", catalogue())
def test_a_parameter_beyond_its_bounds_is_an_error(name: str) -> None:
    param = catalogue()[name].params[0]
    top = max(v for v in (param.upper, param.off) if v is not None)
    line = f"{param.name} = {top + 1.0 + abs(top)!r}"
    assert "must be at most" in only_problem(VALID + f"[effects.{name}]\n{line}\n", line)


def test_unknown_effects_and_parameters_get_the_nearest_name() -> None:
    assert "did you mean falling_friction?" in only_problem(VALID + "[effects.faling_friction]\n", "[effects.")
    text = VALID + "[effects.falling_friction]\nratoi = 0.4\n"
    assert "effects.falling_friction.ratoi: unknown key, did you mean ratio?" in only_problem(text, "ratoi")


@pytest.mark.parametrize(
    ("name", "choice"),
    [("herz", "hertz"), ("FALLING_friction", "falling_friction"), ("faling", "falling_friction"), ("xyz", None)],
)
def test_the_nearest_name(name: str, choice: str | None) -> None:
    assert nearest(name, ["hertz", "half_space", "falling_friction"]) == choice


# Lines


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_an_unknown_key_is_reported_in_its_line(data: st.DataObject) -> None:
    lines = VALID.split("\n")
    places = [n for n in range(2, len(lines)) if not lines[n].startswith(("  {", "]"))]
    place = data.draw(st.sampled_from(places))
    name = "zz" + data.draw(st.text("abcdefghij_0123456789", min_size=3, max_size=12))
    value = data.draw(st.sampled_from(["1", "2.5", '"text"', "[1, 2]", "{ a = 1 }", "true", "1979-05-27"]))
    comments = data.draw(st.lists(st.sampled_from(["", "# note = 1", "  "]), max_size=3))
    lines[place:place] = [*comments, f"{name} = {value}  # why"]
    (problem,) = problems("\n".join(lines))
    assert problem.line == place + len(comments) + 1
    assert problem.key.rpartition(".")[2] == name
    assert "unknown key" in problem.what


def _paths(value: object, path: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    items: list[tuple[str | int, object]] = []
    if isinstance(value, dict):
        items = list(value.items())
    elif isinstance(value, list):
        items = list(enumerate(value))
    return {(*path, key) for key, _ in items}.union(*(_paths(v, (*path, key)) for key, v in items))


_scalars = st.one_of(st.integers(), st.floats(allow_nan=False), st.booleans(), st.text(max_size=8), st.dates())
_values = st.recursive(
    _scalars,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text("abc", min_size=1, max_size=3), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.text("abcd", min_size=1, max_size=4), _values, max_size=5))
@settings(max_examples=150, deadline=None)
def test_every_key_of_any_document_is_found(document: dict[str, object]) -> None:
    text = tomli_w.dumps(document)
    assert _paths(tomllib.loads(text)) == set(locate(text))


def test_lines_of_nested_keys() -> None:
    text = 'a.b = 1\ns = """\nq = 1\n"""\nt = [\n  1, # ]\n  { c = [2,\n 3] },\n]\n[x]\n[[y.z]]\n[[y.z]]\n"k k" = "}"\n'
    found = locate(text)
    expected = {("a", "b"): 1, ("s",): 2, ("t", 0): 6, ("t", 1, "c"): 7, ("t", 1, "c", 1): 8, ("y", "z", 1, "k k"): 13}
    assert {key: found[key] for key in expected} == expected
    assert ("q",) not in found


# Writing back


def test_a_resolved_definition_loads_as_the_same_test(tmp_path: Path) -> None:
    first = load(write(tmp_path, VALID + "[effects.falling_friction]\nratio = 0.4\n", traction=TRACTION))
    second = load_text(tmp_path, dump(first.resolved))
    assert second.resolved == first.resolved
    assert second.inputs == first.inputs


def load_text(folder: Path, text: str):  # type: ignore[no-untyped-def]
    (folder / "again.toml").write_text(text)
    return load(folder / "again.toml")


def test_effects_are_added_when_written(tmp_path: Path) -> None:
    test = load(write(tmp_path, VALID + "[effects.falling_friction]\nratio = 0.4\n"))
    again = load_text(tmp_path, dump(test.resolved, {"creepage_offset": {}}))
    assert set(again.experiment.effects) == {"falling_friction", "creepage_offset"}
    assert again.experiment.effects["falling_friction"]["ratio"] == 0.4
    assert "creepage_offset" not in test.resolved["effects"]


def test_a_definition_moved_elsewhere_finds_its_data(tmp_path: Path) -> None:
    test = load(write(tmp_path, traction=TRACTION))
    target = tmp_path / "results" / "small"
    target.mkdir(parents=True)
    moved = load_text(target, relocate(dump(test.resolved), source=tmp_path, target=target))
    assert moved.experiment.measured.traction is not None
    assert list(moved.inputs.values()) == list(test.inputs.values())


# Shipped files


def test_the_shipped_schema_is_the_models() -> None:
    shipped = (files("twindisc_cli.definition") / "test.schema.json").read_text(encoding="utf-8")
    assert json.loads(shipped) == json_schema(), "run `make schema`"


@pytest.mark.parametrize("path", CONFIGS, ids=lambda p: p.stem)
def test_shipped_definitions_load_and_name_the_schema(path: Path) -> None:
    test = load(path)
    assert test.experiment.name == path.stem
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith("#:schema ")
    assert (path.parent / first.split()[1]).is_file()
    jsonschema.validate(tomllib.loads(path.read_text(encoding="utf-8")), json_schema())


def test_the_schema_refuses_what_the_program_refuses() -> None:
    for bad in (changed(normal_load_N="normal_load_N = -1"), changed(hardness_HV="hardnes_HV = 1")):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(tomllib.loads(bad), json_schema())


def test_repeats_are_named_by_their_group(tmp_path: Path) -> None:
    assert load(write(tmp_path, VALID)).resolved["test"].get("group") is None
    grouped = load(write(tmp_path, changed(name='name = "small"\ngroup = "dry_steel"')))
    assert grouped.resolved["test"]["group"] == "dry_steel"
    with pytest.raises(DefinitionError, match=r"small\.toml:5: test\.group: must be letters"):
        load(write(tmp_path, changed(name='name = "small"\ngroup = "dry steel"')))


def test_a_key_of_a_disc_is_sent_to_the_discs() -> None:
    text = VALID.replace("[rig]\n", "[rig]\nwidth_mm = 10.0\n")
    assert "it belongs in disc1 or disc2: disc1 = { width_mm = ..., ... }" in only_problem(text, "width_mm = 10")
