"""Laws declared in a definition: what is read, what is refused, what acts, and the effect file made of one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from definitions import TRACTION, VALID, changed, write

from twindisc_cli import cli, effects
from twindisc_cli.commands.close_loop import DIGITS
from twindisc_cli.definition import Test, dump, law_table, load, load_text
from twindisc_cli.errors import DefinitionError
from twindisc_cli.identify.chart import friction_chart
from twindisc_cli.laws.law import Law
from twindisc_cli.laws.quantities import QUANTITIES
from twindisc_cli.laws.shapes import SHAPES
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.model.experiment import Measured, ProfileSamples, TemperatureSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

FORMULA = """
[laws.mu_over_time_in_step]
quantity = "mu"
covariate = "time_in_step_s"
shape = "exponential"
parameters = { size = -0.123, scale_s = 68.1 }
valid = [0.0, 420.0]
transfer = "inside"
"""
CURVE = """
[laws.fouling]
quantity = "convection"
covariate = "time"
at = [0.0, 100.0, 300.0]
factor = [1.0, 0.9, 0.8]
"""
AT = Path("small.toml")


def read(text: str) -> Test:
    return load_text(VALID + text, AT)


def law(**keys: str) -> str:
    """A table of a law of mu over time, with keys added or replaced."""
    lines = {"quantity": '"mu"', "covariate": '"time"', **keys}
    return "\n[laws.a]\n" + "".join(f"{key} = {value}\n" for key, value in lines.items())


def test_a_formula_and_a_curve_are_read_in_the_units_of_their_keys() -> None:
    laws = read(FORMULA + CURVE).experiment.laws
    formula, curve = laws["mu_over_time_in_step"], laws["fouling"]
    assert (formula.quantity, formula.covariate, formula.valid) == ("mu", "time_in_step", (0.0, 420.0))
    x = np.array([0.0, 68.1, 136.2])
    assert formula.change(x) == pytest.approx(-0.123 * np.exp([0.0, -1.0, -2.0]))
    assert curve.change(np.array([-5.0, 50.0, 200.0, 900.0])) == pytest.approx([0.0, -0.05, -0.15, -0.2])
    assert (curve.valid, curve.transfer) == (None, "inside")


@pytest.mark.parametrize(
    ("keys", "needed"),
    [
        ({"quantity": '"muu"', "shape": '"step"'}, "laws.a.quantity: must be .* did you mean mu"),
        ({"covariate": '"time_in_stp_s"', "shape": '"step"'}, "did you mean time_in_step"),
        ({"shape": '"exponentil"'}, "did you mean exponential"),
        ({"shape": '"exponential"', "parameters": "{ size = 0.1, scal_s = 3.0 }"}, "scal_s: .* did you mean scale_s"),
        ({"shape": '"exponential"', "parameters": "{ size = 0.1 }"}, "laws.a.parameters: scale_s missing"),
        ({"shape": '"exponential"', "parameters": "{ size = 0.1, scale_s = -3.0 }"}, "scale_s: must be greater than 0"),
        ({"at": "[0.0, 1.0]", "shift": "[0.0, 1.0]"}, "mu is changed by a factor: give factor"),
        ({"at": "[0.0, 1.0]", "factor": "[1.0]"}, "1 values at 2 places"),
        ({"at": "[1.0, 0.0]", "factor": "[1.0, 1.0]"}, "laws.a.at: the places must rise"),
        ({"shape": '"step"', "at": "[0.0, 1.0]"}, "keep shape or at"),
        ({}, "laws.a.shape: no law"),
        ({"covariate": '"y_over_edge"', "at": "[0.0, 1.0]", "factor": "[1.0, 1.0]"}, "mu can depend on creepage"),
        ({"at": "[0.0, 1.0]", "factor": "[1.0, 1.0]", "valid": "[3.0, 1.0]"}, "laws.a.valid: must rise"),
        ({"at": "[0.0, 1.0]", "factr": "[1.0, 1.0]"}, "factr: unknown key, did you mean factor"),
    ],
)
def test_a_mistake_in_a_law_is_told_with_what_was_meant(keys: dict[str, str], needed: str) -> None:
    with pytest.raises(DefinitionError, match=needed):
        read(law(**keys))


def test_geometry_and_material_take_an_uncertainty() -> None:
    text = changed(youngs_modulus_GPa="youngs_modulus_GPa = { value = 206.0, std = 4.12 }")
    text = text.replace("transverse_radius_mm = 30.0", "transverse_radius_mm = { value = 30.0, std = 0.3 }")
    test = load_text(text, AT)
    assert test.experiment.tolerances == {
        "transverse_radius": pytest.approx(0.01),
        "youngs_modulus": pytest.approx(0.02),
    }
    assert test.experiment.rig == load_text(VALID, AT).experiment.rig
    assert load_text(dump(test.resolved), AT).experiment.tolerances == test.experiment.tolerances
    with pytest.raises(DefinitionError, match="must be a number, or"):
        load_text(text.replace("std = 0.3", "sd = 0.3"), AT)


# --- what acts


def all_channels(test: Test) -> ForwardModel:
    """The test with samples in every channel."""
    time = np.linspace(5.0, 420.0, 60)
    y = np.linspace(-1e-3, 1e-3, 81)
    measured = Measured(
        traction=load_text(VALID, AT).experiment.measured.traction,
        profile=ProfileSamples(y, -1e-6 * np.exp(-((y / 3e-4) ** 2)), np.full(81, 2), np.full(81, 5)),
        temperature=TemperatureSamples(time, np.full(60, 300.0)),
    )
    return ForwardModel(replace(test.experiment, measured=measured))


def predicted(test: Test) -> Prediction:
    return all_channels(test).predict({"mu": np.array([0.5]), "K": np.array([1e-4]), "convection_W_K": np.array([1.6])})


def same(one: Prediction, two: Prediction, rel: float) -> bool:
    pairs = [(one.profile, two.profile), (one.temperature, two.temperature)]
    pairs += [(one.state.traction_ratio, two.state.traction_ratio)]
    return all(np.allclose(a, b, rtol=rel, atol=1e-12) for a, b in pairs)


def declared(of: Law) -> Test:
    test = read("")
    return replace(test, experiment=replace(test.experiment, laws={"learnt": of}))


def every_law() -> Iterator[tuple[str, Law]]:
    """Each quantity over each of its covariates as a curve, and each formula of each kind of quantity."""
    size = {"1": 0.1, "%": 0.05, "W": 5.0, "K": 2.0, "um": 0.1}
    for quantity, of in QUANTITIES.items():
        for covariate in of.covariates:
            change = np.array([0.0, 1.0, 0.4]) * size[of.unit] + (1.0 if of.kind == "factor" else 0.0)
            at = (-0.5, 0.1, 0.6) if covariate == "y_over_edge" else (0.1, 2.0, 90.0)
            yield f"{quantity}-{covariate}", Law(quantity, covariate, at=at, value=tuple(change), valid=(0.0, 90.0))
    lengths = {
        "at": 100.0,
        "begin": 50.0,
        "end": 200.0,
        "origin": 10.0,
        "scale": 80.0,
        "reference": 90.0,
        "width": 40.0,
    }
    lengths |= {"period": 130.0, "exponent": 0.7, "phase": 0.3}
    for shape, form in SHAPES.items():
        own = {f"{name}_s": lengths[name] for name in form.along} | {name: lengths[name] for name in form.pure}
        yield shape, Law("wear", "time", shape, {"size": 0.2, **own}, valid=(0.0, 420.0))
    yield "flash", Law("mu", "flash_temperature", at=(0.0, 40.0, 90.0), value=(1.0, 0.9, 0.8), valid=(0.0, 90.0))
    yield "across", Law("profile", "y_over_edge", "bump", {"size_um": 0.2, "at": 0.1, "width": 0.3}, valid=(-1.0, 1.0))


LAWS = dict(every_law())


@pytest.mark.parametrize("name", LAWS)
def test_a_law_written_and_read_again_predicts_the_same(name: str) -> None:
    document = dump(read("").resolved, None, {"learnt": law_table(LAWS[name], digits=DIGITS)})
    again = load_text(document, AT)
    assert same(predicted(again), predicted(declared(LAWS[name])), 1e-6)
    assert again.experiment.laws["learnt"].valid == LAWS[name].valid


def test_the_chart_is_that_of_the_law() -> None:
    """In full sliding T/N is mu, which the law takes to 0.7 of its base value above 1 % of creepage."""
    test = read(law(covariate='"creepage"', at="[0.999, 1.001]", factor="[1.0, 0.7]")).experiment
    chart = friction_chart(test, mu=np.array([0.1, 0.4]), creepage=np.array([0.009, 0.05]))
    assert chart.apparent == pytest.approx(np.array([[0.1, 0.07], [0.4, 0.28]]), rel=1e-6)


def called(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        cli.main(list(arguments))
    return int(left.value.code or 0)


def test_a_command_inverts_the_law_and_warns_beyond_its_range(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = VALID.replace("friction_coefficient = 0.6\n", "") + law(
        covariate='"creepage"', at="[0.9, 1.1]", factor="[1.0, 0.8]", valid="[0.0, 1.0]", transfer='"same_history"'
    )
    path = write(tmp_path, text, traction=TRACTION)
    assert called("identify-mu", str(path), "-o", str(tmp_path / "out")) == 0
    told = capsys.readouterr().out
    assert "0.7250" in told  # at 2 %: 0.58 / 0.8
    assert "warning: small: a is used outside of the range it was learnt on (0 to 1 %) in 20 % of the test" in told
    assert "warning: small: a cannot be carried over with certainty to another history" in told


# --- an effect of it


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A folder of effects; what it adds to the catalogue is forgotten afterwards."""
    yield tmp_path
    effects.forget_folders()


@pytest.mark.parametrize("name", LAWS)
def test_an_effect_file_predicts_what_its_law_predicts(name: str, folder: Path) -> None:
    of = LAWS[name]
    definition = folder / "revised.toml"
    definition.write_text(dump(read("").resolved, None, {"learnt": law_table(of, digits=DIGITS)}), encoding="utf-8")
    module = f"as_effect_{name.replace('-', '_over_')}"
    assert called("effects", "--from", str(definition), "-o", str(folder / f"{module}.py")) == 0
    effects.add_folder(folder)
    effect = effects.catalogue()[module]
    test = declared(of)
    table = {module: {p.name: p.start for p in effect.params}}
    as_effect = replace(test, experiment=replace(test.experiment, laws={}, effects=table))
    plain = replace(test, experiment=replace(test.experiment, laws={}))
    assert same(predicted(as_effect), predicted(test), 1e-9)
    assert not same(predicted(as_effect), predicted(plain), 1e-5)
    assert effect.is_off(**{p.name: np.array([p.off if p.off is not None else p.start]) for p in effect.params})
    assert all(p.lower <= p.start <= p.upper for p in effect.params)
    assert "on the test small" in effect.source
    assert effect.explanation.startswith("Learnt: ")
    assert "Leaves behind" in effect.explanation and "Valid for" in effect.explanation


def test_the_effect_file_of_which_law_must_be_clear(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, VALID + FORMULA + CURVE)
    assert called("effects", "--from", str(path)) == 2
    assert "name one of mu_over_time_in_step, fouling" in capsys.readouterr().err
    assert called("effects", "foulin", "--from", str(path)) == 2
    assert "did you mean fouling" in capsys.readouterr().err
    assert called("effects", "fouling", "--from", str(path)) == 0
    assert "def apply(s: State, *, strength: Floats) -> State:" in capsys.readouterr().out
    bare = write(tmp_path, name="bare.toml")
    assert called("effects", "--from", str(bare)) == 2


def test_a_definition_with_laws_loads_from_its_file(tmp_path: Path) -> None:
    assert set(load(write(tmp_path, VALID + FORMULA + CURVE)).experiment.laws) == {"mu_over_time_in_step", "fouling"}


def test_close_loop_where_the_definition_leaves_nothing_to_fit(tmp_path: Path) -> None:
    """A revised definition gives mu and its law: on data made by them (full sliding, T/N = mu) nothing is missing."""
    time = np.arange(1.0, 85.0) * 5.0
    begin, creepage = np.array([[0.0, 2.0], [168.0, 2.5], [336.0, 3.0]])[np.searchsorted([168.0, 336.0], time)].T
    ratio = 0.6 * (1.0 - 0.123 * np.exp(-(time - begin) / 68.1))
    ratio += 0.004 * np.random.default_rng(5).standard_normal(len(time))
    rows = "".join(f"{t},{c},{r}\n" for t, c, r in zip(time, creepage, ratio, strict=True))
    text = VALID
    for old, new in (("2.0", "3.0"), ("1.0", "2.5"), ("0.5", "2.0")):
        text = text.replace(f"creepage_percent = {old}", f"creepage_percent = {new}")
    path = write(tmp_path, text + FORMULA, traction=f"time [s],creepage [%],traction ratio [1]\n{rows}")
    found = diagnose([load(path).experiment], validate=None, progress=lambda _what, _fraction: None)
    assert (found.verdict, found.base) == ("no_missing_effect", {})
    assert found.errors["traction"].after == pytest.approx(0.004, rel=0.2)
