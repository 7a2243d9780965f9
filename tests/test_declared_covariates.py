"""Columns of the user's file that laws may run over: `[measured] covariates`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write

from twindisc_cli.definition import load
from twindisc_cli.errors import DefinitionError, MeasurementError
from twindisc_cli.loop.diagnose import diagnose
from twindisc_cli.loop.terms import LawTerm
from twindisc_cli.model.forward import ForwardModel

RIG = VALID.partition("[history]")[0].partition("[thermal]")[0]
SLIDING = (
    RIG
    + """
[history]
revolutions_per_iteration = 500
steps = [
  { creepage_percent = 3, iterations = 30 },
  { creepage_percent = 4, iterations = 30 },
  { creepage_percent = 5, iterations = 30 },
  { creepage_percent = 6, iterations = 30 },
]
[model]
friction_coefficient = 0.3
[measured]
traction = "traction.csv"
covariates = ["relative humidity [%]", "oil temperature [degC]"]
"""
)
"""Four steps of 300 s, in which all of the patch slides: T/N is the coefficient of friction."""


def table(ratio: np.ndarray, time: np.ndarray, **columns: np.ndarray) -> str:
    """Traction over time with columns that the program does not know."""
    creepage = np.array([3, 4, 5, 6])[np.minimum((time / 300.0).astype(int), 3)]
    names = ["time [s]", "creepage [%]", "traction ratio", *columns]
    rows = np.stack([time, creepage, ratio, *columns.values()], axis=1)
    return "\n".join([",".join(names), *(",".join(f"{v:.6g}" for v in row) for row in rows)]) + "\n"


def measured(folder: Path, text: str, data: str) -> Path:
    """A definition beside its table of traction."""
    (folder / "traction.csv").write_text(data)
    return write(folder, text)


def wandering(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, and a humidity and an oil temperature that have nothing to do with the history."""
    rng, time = np.random.default_rng(seed), np.linspace(5.0, 1195.0, 160)
    humidity = 45.0 + 15.0 * np.sin(time / 90.0) + np.cumsum(rng.normal(0.0, 1.0, len(time)))
    return time, humidity, 25.0 + 10.0 * (1.0 - np.exp(-time / 500.0)) + rng.normal(0.0, 0.05, len(time))


def test_a_law_over_a_declared_column_follows_its_rows(tmp_path: Path) -> None:
    time, humidity, oil = wandering(1)
    law = """
[laws.damp]
quantity = "mu"
covariate = "relative humidity"
at = [0.0, 100.0]
factor = [1.0, 0.5]
"""
    data = table(
        np.full(160, 0.3), time, **{"relative humidity [%]": humidity, "oil temperature [degF]": 1.8 * oil + 32}
    )
    test = load(measured(tmp_path, SLIDING + law, data)).experiment
    predicted = ForwardModel(test).predict({"mu": np.array([0.3])}).traction[0]
    np.testing.assert_allclose(predicted, 0.3 * (1.0 - 0.005 * humidity), rtol=1e-4)
    assert np.allclose(test.measured.columns["oil temperature [degC]"].values, oil + 273.15, atol=1e-3)


@pytest.mark.parametrize("seed", [11, 12])
def test_friction_that_follows_the_humidity_is_found_over_that_column(tmp_path: Path, seed: int) -> None:
    time, humidity, oil = wandering(seed)
    rng = np.random.default_rng(seed)
    ratio = 0.3 / (1.0 + np.exp((humidity - 55.0) / 20.0)) + rng.normal(0.0, 0.002, len(time))
    data = table(ratio, time, **{"relative humidity [%]": humidity, "oil temperature [degC]": oil})
    diagnosis = diagnose([load(measured(tmp_path, SLIDING, data)).experiment], validate=None, progress=lambda *_: None)
    (term,) = [found.law for found in diagnosis.laws]
    rivals = [other.term for found in diagnosis.laws for other in found.alternatives]
    covariates = {term.covariate, *(other.covariate for other in rivals if isinstance(other, LawTerm))}
    assert covariates == {"relative humidity [%]"}


def test_a_column_that_says_nothing_is_not_found(tmp_path: Path) -> None:
    time, humidity, oil = wandering(21)
    ratio = 0.3 + np.random.default_rng(21).normal(0.0, 0.002, len(time))
    data = table(ratio, time, **{"relative humidity [%]": humidity, "oil temperature [degC]": oil})
    diagnosis = diagnose([load(measured(tmp_path, SLIDING, data)).experiment], validate=None, progress=lambda *_: None)
    assert diagnosis.verdict == "no_missing_effect"


def test_friction_that_follows_a_valve_is_found_over_its_two_states(tmp_path: Path) -> None:
    time = wandering(5)[0]
    valve = (np.floor(time / 70.0) % 3.0 == 0.0).astype(float)
    ratio = 0.3 * (1.0 - 0.1 * valve) + np.random.default_rng(5).normal(0.0, 0.002, len(time))
    text = SLIDING.replace('["relative humidity [%]", "oil temperature [degC]"]', '["valve [1]"]')
    test = load(measured(tmp_path, text, table(ratio, time, **{"valve [1]": valve}))).experiment
    (law,) = diagnose([test], validate=None, progress=lambda *_: None).laws
    assert (law.law.quantity, law.law.covariate) == ("mu", "valve [1]")


def test_a_log_has_columns_too(tmp_path: Path) -> None:
    time = np.arange(0.0, 1200.0, 0.5)
    creepage = np.array([3, 4, 5, 6])[np.minimum((time / 300.0).astype(int), 3)]
    humidity = 40.0 + time / 100.0
    noise = np.random.default_rng(3).normal(0.0, 0.002, len(time))
    columns = [time, creepage, np.full_like(time, 9.4248), np.full_like(time, 72.0), 0.3 + noise, humidity]
    header = "time [s],creepage [%],rolling speed [m/s],normal load [N],traction ratio,relative humidity [%]\n"
    log = header + "\n".join(",".join(f"{v:.6g}" for v in row) for row in zip(*columns, strict=True))
    text = SLIDING.replace('traction = "traction.csv"', 'log = "log.csv"').replace(', "oil temperature [degC]"', "")
    (tmp_path / "log.csv").write_text(log)
    column = load(write(tmp_path, text)).experiment.measured.columns["relative humidity [%]"]
    np.testing.assert_allclose(100.0 * column.values, 40.0 + column.time / 100.0, atol=0.05)


@pytest.mark.parametrize(
    ("written", "what"),
    [
        ('["oil temperature [degC]", "oil_temperature"]', "named twice"),
        ('["temperature [degC]"]', "is read anyway"),
        ('["humidity [%"]', "covariates"),
    ],
)
def test_columns_that_cannot_be_declared_are_refused(tmp_path: Path, written: str, what: str) -> None:
    time, humidity, oil = wandering(1)
    data = table(np.full(160, 0.3), time, **{"relative humidity [%]": humidity, "oil temperature [degC]": oil})
    text = SLIDING.partition("covariates")[0] + f"covariates = {written}\n"
    with pytest.raises(DefinitionError, match=what):
        load(measured(tmp_path, text, data))


def test_a_column_that_is_not_in_the_file_is_named(tmp_path: Path) -> None:
    time, humidity, _ = wandering(1)
    data = table(np.full(160, 0.3), time, **{"relative humidity [%]": humidity})
    with pytest.raises(MeasurementError, match="oil temperature"):
        load(measured(tmp_path, SLIDING, data))


def test_a_law_over_a_column_that_is_not_declared_is_refused(tmp_path: Path) -> None:
    law = '[laws.damp]\nquantity = "mu"\ncovariate = "humidty"\nat = [0, 1]\nfactor = [1, 2]\n'
    with pytest.raises(DefinitionError, match=r"declared in \[measured\] covariates"):
        load(write(tmp_path, VALID + law))


def test_columns_need_a_file(tmp_path: Path) -> None:
    text = VALID + '[measured]\ncovariates = ["humidity [%]"]\n'
    with pytest.raises(DefinitionError, match="of which there is none"):
        load(write(tmp_path, text))


def test_a_declared_unit_is_that_of_the_file_however_it_is_written(tmp_path: Path) -> None:
    time, humidity, oil = wandering(1)
    names = {"Öltemperatur [°C]": oil, "Schlag [µm]": humidity, "Reibmoment [Nm]": humidity}
    columns = ", ".join(f'"{name}"' for name in names)
    text = SLIDING.replace('"relative humidity [%]", "oil temperature [degC]"', columns)
    recorded = load(measured(tmp_path, text, table(np.full(len(time), 0.3), time, **names))).experiment.measured.columns
    np.testing.assert_allclose(recorded["Öltemperatur [°C]"].values, oil + 273.15, rtol=1e-5)
    np.testing.assert_allclose(recorded["Schlag [µm]"].values, humidity * 1e-6, rtol=1e-5)
    np.testing.assert_allclose(recorded["Reibmoment [Nm]"].values, humidity, rtol=1e-5)
