"""What close-loop shows of a diagnosis: figure, page, summary, JSON, arrays and the revised definition.

The diagnosis is made up: seeded curves about a known course, so that what is drawn and told has a known answer.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from base64 import b64decode
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
from definitions import TRACTION, VALID, write
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twindisc_cli import cli
from twindisc_cli.commands import _runner, close_loop
from twindisc_cli.commands._loop_data import dataset_of
from twindisc_cli.commands._output import Output
from twindisc_cli.commands.close_loop import result_of, revised, run, summary
from twindisc_cli.definition import Test, load
from twindisc_cli.effects import catalogue
from twindisc_cli.errors import DefinitionError
from twindisc_cli.figures._loop_view import strongest, views_of
from twindisc_cli.figures.close_loop import figure
from twindisc_cli.identify.hierarchy import wander
from twindisc_cli.laws.law import Law, formula_text
from twindisc_cli.loop.diagnosis import (
    BaseEstimate,
    CandidateResult,
    ChannelError,
    Curve,
    Diagnosis,
    Estimate,
    FoundEffect,
    FoundLaw,
    LawCurve,
    NextExperiment,
    PredictedErrors,
    Unexplained,
)
from twindisc_cli.loop.levels import ENVIRONMENT, Follows, Levels
from twindisc_cli.loop.refusal import Refusal
from twindisc_cli.loop.terms import Alternative, EffectTerm, LawTerm
from twindisc_cli.report import sentences, words
from twindisc_cli.report.close_loop import held_out
from twindisc_cli.results import Result
from twindisc_cli.results.store import plain

NOISE = {"traction": 0.004, "profile": 0.1e-6, "temperature": 0.15}
SAMPLES = 60
DURATION = 420.0
"""Three steps of two, two and one iterations of 84 s (see definitions.VALID)."""


@pytest.fixture(scope="module", name="test")
def small(tmp_path_factory: pytest.TempPathFactory) -> Test:
    return made(tmp_path_factory.mktemp("small"), "small")


def made(folder: Path, name: str, extra: str = "") -> Test:
    """A test with three measured channels, two profiles of disc 2, one of disc 1."""
    time = DURATION * (np.arange(SAMPLES) + 1.0) / SAMPLES
    creepage = np.where(time <= 168.0, 0.5, np.where(time <= 336.0, 1.0, 2.0))
    y = np.linspace(-2.0, 2.0, SAMPLES)
    tables = {
        "traction": ("time [s],creepage [%],traction ratio [1]", np.stack([time, creepage, 0.5 + 0 * time], axis=1)),
        "profile": (
            "y [mm],height [um],disc,iteration",
            np.concatenate(
                [np.stack([y, 0 * y - 1, 0 * y + d, 0 * y + i], axis=1) for d, i in ((1, 5), (2, 3), (2, 5))]
            ),
        ),
        "temperature": ("time [s],temperature [degC]", np.stack([time, 20.0 + 0.01 * time], axis=1)),
    }
    for channel, (head, table) in tables.items():
        rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in table)
        (folder / f"{name}_{channel}.csv").write_text(f"{head}\n{rows}\n", encoding="utf-8")
    measured = "".join(f'{channel} = "{name}_{channel}.csv"\n' for channel in tables)
    text = VALID.replace('name = "small"', f'name = "{name}"\ndescription = "dry <b>& slow</b>"')
    text = text.replace("friction_coefficient = 0.6\n", "")
    path = folder / f"{name}.toml"
    path.write_text(f'{text}{extra}\n[measured]\n{measured}provenance = "reconstructed"\n', encoding="utf-8")
    return load(path)


def curves(test: Test, seed: int = 3) -> list[Curve]:
    """Measured = a course + noise; the model after is the course; the model before misses a known part of it."""
    draw = np.random.default_rng(seed)
    measured = test.experiment.measured
    assert measured.traction and measured.profile and measured.temperature
    time, y = measured.traction.time, measured.profile.y
    thermal = {"time": time, "creepage": measured.traction.creepage, "cycles": 50.0 * time, "energy": 20.0 * time}
    thermal["temperature"] = 293.15 + 0.01 * time
    truth = {
        "traction": (0.5 - 5.0 * thermal["creepage"], 5.0 * (thermal["creepage"] - 0.01), thermal),
        "profile": (
            -4e-6 * np.exp(-((y / 1e-3) ** 2)),
            -1e-6 * np.exp(-((y / 1e-3) ** 2)),
            {"y": y, "disc": measured.profile.disc, "iteration": measured.profile.iteration},
        ),
        "temperature": (thermal["temperature"], 2e-3 * (time - 210.0), thermal),
    }
    made = []
    for channel, (course, miss, covariates) in truth.items():
        noisy = course + NOISE[channel] * draw.standard_normal(len(course))
        held, kept = np.arange(len(course)) % 5 == 2, np.arange(len(course)) != 7
        name = test.experiment.name
        models = (course + miss, course)
        made.append(Curve(name, channel, noisy, *models, *models, held, kept, covariates, "reconstructed"))
    return made


def error(channel: str, before: float, after: float) -> ChannelError:
    unit, factor = {"traction": ("1", 1.0), "profile": ("um", 1e6), "temperature": ("K", 1.0)}[channel]
    noise = factor * NOISE[channel]
    return ChannelError(unit, noise, 0.0, before * noise, after * noise, 1.1 * before * noise, 1.02 * after * noise)


LESS = Refusal("explains less")


def tried(channel: str, label: str, gain: float, *, of: str = "", **more: Any) -> CandidateResult:
    values = {"probability": 0.01, "remains": 0.1, "at_bound": (), "refused": None, "chosen": label == of, **more}
    quantity, over, covariate = label.partition(" over ")
    term = LawTerm(quantity, covariate) if over else EffectTerm(label)
    return CandidateResult(channel, of, term, gain, 0.4 * gain, **values)


def found(test: Test) -> Diagnosis:
    """Two effects in two channels, one of them with a twin."""
    twins = (Alternative(EffectTerm("film_breakdown"), 0.29),)
    ratio, decay = Estimate(0.412, 0.011, 0.394, 0.430, "1"), Estimate(3.2, 0.4, 2.6, 3.9, "s m-1")
    return Diagnosis(
        verdict="effects_found",
        effects=[
            FoundEffect("falling_friction", "traction", {"ratio": ratio, "decay_s_m": decay}, twins, 0.71, "probable"),
            FoundEffect("lateral_wander", "profile", {"std_mm": Estimate(0.2, 0.01, 0.18, 0.22, "mm")}, (), 0.999,
                        "established", remains=0.17),
        ],
        laws=[],
        unexplained=[],
        errors={"traction": error("traction", 15.0, 1.0), "profile": error("profile", 4.0, 1.01),
                "temperature": error("temperature", 1.0, 1.0)},
        base={"mu": BaseEstimate(0.6, 0.001, 0.598, 0.602, "1", "mu"),
              "K": BaseEstimate(7e-5, 4e-7, 6.9e-5, 7.1e-5, "1", "K")},
        tried=[
            tried("traction", "film_breakdown", 900.0, of="falling_friction", probability=0.29),
            tried("traction", "sensor_drift", 950.0, of="falling_friction", refused=LESS),
            tried("traction", "falling_friction", 910.0, of="falling_friction", probability=0.71),
            tried("traction", "misalignment", 700.0, of="falling_friction", at_bound=("misalignment.yaw_mrad",),
                  refused=Refusal("at a bound", "yaw_mrad at a bound")),
            tried("temperature", "mu over energy", 640.0, of="falling_friction",
                  refused=Refusal("raises the error", "raises the error of the disc temperature")),
            tried("profile", "lateral_wander", 400.0, of="lateral_wander", probability=0.999),
            tried("profile", "wear_across over y_over_edge", 300.0, of="lateral_wander", refused=LESS),
        ],
        curves=curves(test),
        p_values={"traction": 1e-6, "profile": 1e-4, "temperature": 0.43},
        held_out_steps={test.experiment.name: (1,)},
        notes=["the humidity was not recorded"],
        next_experiment=NextExperiment(
            why="low and high creepages in turn: expected to separate falling_friction from film_breakdown",
            steps=[{"creepage_percent": 0.5, "iterations": 3.0}, {"creepage_percent": 2.0, "iterations": 2.0}],
            rivals=("falling_friction", "film_breakdown"),
            separation=8.1,
            separation_now=1.2,
            channel_wanted="temperature",
        ),
        validation=None,
        predictions=[],
        step_scatter=[],
        same_on_all=True,
        blind=True,
        seconds=2.0,
    )  # fmt: skip


def nothing(test: Test) -> Diagnosis:
    return replace(found(test), verdict="no_missing_effect", effects=[], tried=[], next_experiment=None, notes=[])


def unknown(test: Test) -> Diagnosis:
    left = [
        Unexplained("traction", "time", "smooth", 0.31, 1e-9),
        Unexplained("traction", "energy", "smooth", 0.3, 1e-9),
    ]
    refused = [
        replace(t, replaces="", refused=LESS, chosen=False) for t in found(test).tried if t.channel == "traction"
    ]
    return replace(found(test), verdict="unexplained", effects=[], unexplained=left, tried=refused)


DIFFERS = "the answer was found without the samples held out: fitted to all samples, the evidence is for mu over time"


def learnt(test: Test) -> Diagnosis:
    """A formula over the time in the step, and a curve over the energy that these data cannot tell from time."""
    size, scale = Estimate(-0.123, 0.004, -0.130, -0.116, "1"), Estimate(68.1, 5.0, 60.0, 77.0, "s")
    parameters = {"size": -0.123, "origin_s": 0.0, "scale_s": 68.1}
    others = (Alternative(LawTerm("wear", "time"), 0.3), Alternative(EffectTerm("running_in_wear"), 0.1))
    formula = Law("mu", "time_in_step", "exponential", parameters, valid=(0.0, 168.0))
    curve = Law("wear", "energy", at=(0.0, 2.0, 4.0), value=(0.7, 0.9, 1.1), valid=(0.0, 8.4), transfer="same_history")
    return replace(
        found(test),
        verdict="law_learned",
        effects=[],
        laws=[
            FoundLaw("mu_over_time_in_step", "traction", {"size": size, "scale_s": scale}, (), 0.95, "established",
                     law=formula, formula=formula_text(formula), curve=banded(formula),
                     resembles=(("running_in_friction", 0.93),)),
            FoundLaw("wear_over_energy", "profile", {}, others, math.nan, "possible", 0.4, law=curve,
                     formula=formula_text(curve), curve=banded(curve), resembles=()),
        ],
        tried=[
            tried("traction", "mu over time_in_step", 900.0, of="mu_over_time_in_step", chosen=True, probability=0.95),
            tried("profile", "wear over energy", 800.0, of="wear_over_energy", chosen=True, probability=0.6),
            tried("profile", "wear over time", 790.0, of="wear_over_energy", probability=0.3),
            tried("profile", "running_in_wear", 780.0, of="wear_over_energy", probability=0.1),
        ],
        notes=["the humidity was not recorded"],
        difference=DIFFERS,
    )  # fmt: skip


def banded(law: Law) -> LawCurve:
    """The curve of a law over its range, with a band of one hundredth to either side."""
    assert law.valid is not None
    at = np.linspace(*law.valid, 60)
    value = 1.0 + law.change(at)
    return LawCurve(at, value, value - 0.01, value + 0.01)


RESULTS: dict[tuple[str, str], Result] = {}


def result(kind: Any, test: Test) -> Result:
    """The result of a diagnosis of one test, drawn once."""
    key = (kind.__name__, str(test.path))
    if key not in RESULTS:
        RESULTS[key] = result_of(kind(test), [test], None)
    return RESULTS[key]


def title_of(axes: Axes) -> str:
    """What a panel shows, without its letter."""
    return re.sub(r"^\$.*?\$ *", "", axes.get_title(loc="left")).replace("\n", " ")


def text_of(drawn: Figure) -> str:
    parts = [text.get_text() for text in drawn.texts]
    for axes in drawn.axes:
        legend = axes.get_legend()
        parts += [title_of(axes), axes.get_xlabel(), axes.get_ylabel().replace("\n", " ")]
        parts += [*(t.get_text() for t in axes.texts)]
        parts += [text.get_text() for text in legend.get_texts()] if legend else []
    suptitle = drawn.get_suptitle()
    return "\n".join([*parts, suptitle])


def line(axes: Any, label: str) -> Any:
    return next(drawn for drawn in axes.get_lines() if drawn.get_label() == label)


# --- words


def test_numbers_for_reading() -> None:
    # Rules of GUM 7.2.6: the error with two digits, the value to the same decimal.
    assert words.with_error(0.41231, 0.01149) == "0.412 ± 0.011"
    assert words.with_error(6.931e-5, 4.2e-7) == "(6.931 ± 0.042)e-5"
    assert words.with_error(30123.0, 512.0, "W K-1") == "30123 ± 512 W K⁻¹"
    assert words.with_error(1.0, 0.0, "N mm-2") == "1.00 N mm⁻²"
    assert words.with_error(0.00199, 1.2e-9) == "0.00199000 ± 1e-9"
    assert words.with_error(0.00199, 1.2e-7) == "0.00199000 ± 0.00000012"
    assert words.apart(0.394, 0.430) == ("0.394", "0.430")
    assert words.apart(0.00199, 0.0019901) == ("0.00199000", "0.00199010")
    assert words.apart(2.0, 2.0) == ("2.00", "2.00")
    assert words.with_interval(0.00199005, 0.00199, 0.0019901) == "0.00199005 (0.00199000 to 0.00199010)"
    assert words.with_interval(0.41, 0.394, 0.430) == "0.410 (0.394 to 0.430)"
    assert [words.number(v) for v in (0.0, 4200.0, 0.00412, 7e-5, math.nan)] == ["0", "4200", "0.00412", "7.00e-5", "–"]
    assert [words.percent(v) for v in (0.31, 0.999, 0.001)] == ["31 %", "> 99 %", "< 1 %"]
    assert [words.p_value(v) for v in (0.0, 0.03)] == ["p < 0.001", "p = 0.03"]
    assert words.listed(["a", "b", "c"], "or") == "a, b or c"


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_effects_are_named_as_in_their_explanation(name: str) -> None:
    assert words.plain_name(name)[0].islower()
    assert catalogue()[name].explanation.lower().startswith(words.plain_name(name).lower() + ":")
    assert "point)" not in words.explanation(name)


# --- verdict and summary


def test_where_data_cannot_tell_no_single_name_is_told(test: Test) -> None:
    first = sentences.sentences(found(test))[0]
    assert first == (
        "The model lacks in the traction falling friction (probable, 71 %; or film breakdown); "
        "in the worn profile lateral wander (established, > 99 %)."
    )
    assert "cannot separate" in sentences.sentences(found(test))[1]
    sure = replace(found(test), effects=found(test).effects[1:])
    assert sentences.sentences(sure)[0] == "The model lacks lateral wander (established, > 99 %)."
    assert "Lateral wander takes away 83 % of the misfit." in sentences.sentences(sure)
    assert not any("cannot separate" in sentence for sentence in sentences.sentences(sure))


@pytest.mark.parametrize("kind", [nothing, unknown])
def test_what_is_not_excluded_where_nothing_is_named(test: Test, kind: Any) -> None:
    others = Alternative(EffectTerm("third_body_layer"), 0.4), Alternative(LawTerm("mu", "creepage"), 0.07)
    diagnosis = replace(kind(test), not_excluded=others)
    names = "third-body layer (40 %) or a change of the coefficient of friction with creepage (7 %)"
    assert any(said.startswith("Not excluded") and names in said for said in sentences.sentences(diagnosis))
    assert "not excluded" not in " ".join(sentences.sentences(kind(test))).lower()
    (line,) = [text for text in summary(diagnosis) if text.startswith("not excluded")]
    assert line.endswith(": third_body_layer (40 %) or mu over creepage (7 %)")
    assert result_of(diagnosis, [test], None).json["not_excluded"] == [
        {"effect": "third_body_layer", "probability": 0.4},
        {"quantity": "mu", "covariate": "creepage", "probability": 0.07},
    ]


def test_the_headline_error_is_on_data_held_out(test: Test) -> None:
    # 15 times the noise of 0.004, 1.1 times that where it is held out: 0.066; after 1.02 times the noise: 0.00408.
    assert "falls from 0.0660 to 0.00408 on data held out" in " ".join(sentences.sentences(found(test)))
    held = replace(error("traction", 15.0, 1.0), held_out_before=math.nan, held_out_after=math.nan)
    diagnosis = replace(found(test), errors={**found(test).errors, "traction": held})
    assert "falls from 0.0600 to 0.00400 on the data fitted, for none" in " ".join(sentences.sentences(diagnosis))


@pytest.mark.parametrize("kind", [found, nothing, unknown, learnt])
def test_summary_is_ten_lines_with_the_verdict_first(test: Test, kind: Any) -> None:
    diagnosis = kind(test)
    crowded = replace(diagnosis, notes=[f"note {i}" for i in range(20)])
    for lines in (summary(diagnosis), summary(crowded)):
        assert len(lines) <= 10
        assert lines[0].startswith(f"{diagnosis.verdict}: ")
        assert not any("nan" in text for text in lines)
    assert "notes in close-loop.html" in summary(crowded)[-1]


def test_details_of_terms_give_way_to_what_decides(test: Test) -> None:
    """Five terms, two that are open, another test: mu and K, what is open, and how the other test is met stay."""
    diagnosis = found(test)
    other = PredictedErrors("other", diagnosis.errors, {}, {}, {})
    left = [Unexplained("traction", "time", "wave", 0.4, 1e-5)]
    terms = {
        name: replace(diagnosis.effects[0], name=name) for name in ("film_breakdown", "sensor_drift", "load_error")
    }
    crowded = replace(
        diagnosis,
        effects=[*diagnosis.effects, *terms.values()],
        unexplained=left,
        validation=other,
        notes=["one", "two"],
    )
    lines = summary(crowded)
    assert len(lines) == 10
    for beginning in ("unexplained: ", "base, ", "predicted, not fitted", "next: "):
        assert sum(line.startswith(beginning) for line in lines) == 1
    assert "5 terms in close-loop.html" in lines
    assert lines[-1] == "2 notes in close-loop.html"


def test_summary_holds_what_decides(test: Test) -> None:
    text = "\n".join(summary(found(test)))
    for needed in (
        "error 0.0600 -> 0.00400, held out 0.0660 -> 0.00408, noise 0.00400",
        "ratio = 0.412 ± 0.011, decay_s_m = 3.20 ± 0.40 s m⁻¹",
        "cannot be separated from film_breakdown",
        "K = (7.000 ± 0.040)e-5",
        "next: low and high creepages in turn",
        "humidity",
    ):
        assert needed in text
    assert "depends on time (31 % of the variance) or dissipated energy" in summary(unknown(test))[0]
    follows_none = [replace(each, share_of_variance=0.004) for each in unknown(test).unexplained]
    text = summary(replace(unknown(test), unexplained=follows_none))[0]
    assert "follows no covariate: time or dissipated energy explains < 1 % of its variance" in text


def test_a_standard_deviation_larger_than_its_value_gives_way_to_the_interval(test: Test) -> None:
    loose = Estimate(1.0006e-4, 0.91, 1e-4, 1.6, "m s-1")
    effect = replace(found(test).effects[0], parameters={"eyring_speed_m_s": loose})
    base = {"mu": BaseEstimate(0.51, 0.4, 0.049, 1.0, "1", "mu")}
    text = "\n".join(summary(replace(found(test), effects=[effect], base=base)))
    assert "eyring_speed_m_s = 1.0e-4 m s⁻¹ (90 %: 1.0e-4 to 1.6)" in text
    assert "mu = 0.51 (90 %: 0.049 to 1.0)" in text
    assert "±" not in text


# --- figure


@pytest.mark.parametrize("kind", [found, nothing, unknown, learnt])
def test_figure_has_three_panels_a_channel_and_says_where_data_are_from(test: Test, kind: Any) -> None:
    drawn = figure(kind(test), [test.experiment], title="small: a verdict", provenance="reconstructed")
    text = text_of(drawn)
    assert "reconstructed data" in text
    assert "small: a verdict" in text
    assert sum("− model" in axes.get_ylabel() for axes in drawn.axes) == 3
    for needed in (
        "reconstructed, held out",
        "outlier",
        "model before",
        "model after",
        "creepage [%]",
        "noise, ±2 std",
    ):
        assert needed in text


def test_panels_show_the_samples_in_the_units_of_their_labels(test: Test) -> None:
    diagnosis = found(test)
    drawn = figure(diagnosis, [test.experiment], title="", provenance="reconstructed")
    by_title = {(title_of(axes), axes.get_ylabel()): axes for axes in drawn.axes}
    traction, _, temperature = diagnosis.curves
    left = by_title["traction: reconstructed and model", "traction ratio T/N [1]"]
    assert np.array_equal(
        line(left, "model after").get_xydata(), np.stack([traction.covariates["time"], traction.after], 1)
    )
    held = traction.held_out & traction.kept
    assert np.array_equal(line(left, "reconstructed, held out").get_ydata(), traction.measured[held])
    assert left.get_xlim() == (0.0, DURATION)
    celsius = by_title["temperature: reconstructed and model", "disc temperature [°C]"]
    assert np.allclose(line(celsius, "model before").get_ydata(), temperature.before - 273.15)
    height = by_title["profile: reconstructed and model", "height change [µm]"]
    drawn_heights = np.concatenate([np.asarray(drawn_line.get_ydata()) for drawn_line in height.get_lines()])
    deepest = float(drawn_heights.min())
    assert deepest == pytest.approx(-5.0, abs=0.3)
    assert {"disc 1, iteration 5", "disc 2, iteration 3", "disc 2, iteration 5"} <= set(text_of(drawn).splitlines())
    rest = by_title["what the model leaves", "reconstructed\n− model [µm]"]
    (band,) = [patch for patch in rest.patches if patch.get_label() == "noise, ±2 std"]
    assert band.get_extents().transformed(rest.transData.inverted()).intervaly == pytest.approx((-0.2, 0.2))


def test_the_course_of_the_leftover_is_its_mean_at_each_level(test: Test) -> None:
    # Before, the model is 5 (creepage - 1 %) too high; without noise the mean unexplained residual at 0.5, 1 and 2 %
    # follows.
    clean = [replace(c, measured=c.after) for c in found(test).curves]
    drawn = figure(replace(found(test), curves=clean), [test.experiment], title="", provenance="synthetic")
    panel = next(axes for axes in drawn.axes if axes.get_ylabel().endswith("− model [1]"))
    assert line(panel, "before, mean").get_xydata() == pytest.approx(np.array([[0.5, 0.025], [1.0, 0.0], [2.0, -0.05]]))
    assert line(panel, "after, mean").get_ydata() == pytest.approx(0.0)
    dots = next(drawn_line for drawn_line in panel.get_lines() if drawn_line.get_marker() == ".")
    assert sorted(set(np.round(np.asarray(dots.get_ydata()), 9))) == [-0.05, 0.0, 0.025]


def test_the_leftover_is_drawn_over_what_it_depends_on(test: Test) -> None:
    assert strongest(found(test), "traction") == "creepage"
    assert strongest(found(test), "profile") == "y"
    assert strongest(found(test), "temperature") in ("time", "cycles", "energy", "temperature")
    assert strongest(unknown(test), "traction") == "time"


def test_ranking_puts_what_holds_first_and_says_why_others_do_not(test: Test) -> None:
    drawn = figure(found(test), [test.experiment], title="", provenance="synthetic")
    first, second = [axes for axes in drawn.axes if "explanations that were tried" in title_of(axes)]
    assert [text.get_text().replace("\n", " ") for text in first.texts if "why not" not in text.get_text()] == [
        "falling friction", "71 %",
        "film breakdown", "29 %",
        "sensor drift", "explains less",
        "misalignment", "at a bound",
        "a change of the coefficient of friction with dissipated energy", "raises the error",
    ]  # fmt: skip
    assert [text.get_fontweight() for text in first.texts[:4]] == ["bold", "normal", "normal", "normal"]
    assert first.patches[0].get_width() == pytest.approx(math.sqrt(910.0))
    assert second.texts[2].get_text().replace("\n", " ") == "a change of the wear across the track"
    assert "nothing else is missing here" in text_of(drawn)


def test_a_law_is_drawn_with_its_band_its_formula_and_where_data_were(test: Test) -> None:
    diagnosis = learnt(test)
    drawn = figure(diagnosis, [test.experiment], title="", provenance="synthetic")
    formula, curve = drawn.axes[-2:]
    assert title_of(formula) == "learnt: 1 - 0.123 exp(-τ / 68.1 s) (established, 95 %)"
    assert formula.get_xlabel() == "time since the creepage changed τ [s]"
    assert formula.get_ylabel().replace("\n", " ") == "factor on the coefficient of friction [1]"
    assert line(formula, "learnt").get_xydata() == pytest.approx(
        np.stack([diagnosis.laws[0].curve.at, 1.0 - 0.123 * np.exp(-diagnosis.laws[0].curve.at / 68.1)], axis=1)
    )
    (band,) = formula.collections
    assert np.ptp(band.get_paths()[0].vertices[:, 1]) == pytest.approx(0.02 + 0.123 * (1 - math.exp(-168.0 / 68.1)))
    assert title_of(curve) == "learnt: curve over E, 3 places (possible)"
    assert curve.get_xlabel() == "dissipated energy E [kJ]"
    assert line(curve, "data").get_xdata() == pytest.approx(20e-3 * DURATION * (np.arange(SAMPLES) + 1.0) / SAMPLES)


def test_a_formula_that_jumps_is_drawn_with_upright_sides(test: Test) -> None:
    jumping = Law("mu", "time", "window", {"size": 0.2, "begin_s": 100.0, "end_s": 200.0}, valid=(0.0, 420.0))
    law = replace(learnt(test).laws[0], law=jumping, formula=formula_text(jumping), curve=banded(jumping))
    drawn = figure(replace(learnt(test), laws=[law]), [test.experiment], title="", provenance="synthetic")
    x, y = np.asarray(line(drawn.axes[-1], "learnt").get_xydata()).T
    assert y[x == 100.0] == pytest.approx([1.0, 1.2])
    assert y[x == 200.0] == pytest.approx([1.2, 1.0])
    assert set(np.round(y, 9)) == {1.0, 1.2}


def test_samples_without_times_are_drawn_over_creepage(tmp_path: Path) -> None:
    test = made(tmp_path, "small")
    samples = test.experiment.measured.traction
    assert samples is not None
    untimed = replace(samples, time=np.full(SAMPLES, np.nan))
    experiment = replace(test.experiment, measured=replace(test.experiment.measured, traction=untimed))
    view = views_of(found(test), [experiment])[0]
    assert view.along == "creepage"
    assert view.spans == []


def test_the_line_of_the_model_has_a_gap_in_a_pause_without_samples(test: Test) -> None:
    """The second step, from 168 s to 336 s, is a pause; the temperature is recorded in it, the traction is not."""
    history = test.experiment.history
    still = replace(history, revolutions=history.revolutions * (history.step != 1))
    diagnosis = found(test)
    traction, temperature, profile = diagnosis.curves
    outside = (traction.covariates["time"] <= 168.0) | (traction.covariates["time"] > 336.0)
    samples = {key: getattr(traction, key)[outside] for key in ("measured", "before", "after", "held_out", "kept")}
    cut = replace(traction, **samples, covariates={key: of[outside] for key, of in traction.covariates.items()})
    paused = replace(diagnosis, curves=[cut, temperature, profile])
    views = views_of(paused, [replace(test.experiment, history=still)])
    drawn = {view.channel: view.broken(view.traces[0].x, view.traces[0].after) for view in views}
    x, y = drawn["traction"]
    assert np.isnan(y).sum() == 1
    assert 168.0 < x[np.isnan(y)].item() < 336.0
    assert np.all(np.diff(x) > 0.0)
    assert np.isfinite(drawn["temperature"][1]).all()
    assert np.isfinite(drawn["profile"][1]).all()


def test_tests_fitted_together_follow_each_other(tmp_path: Path) -> None:
    first, second = made(tmp_path, "one"), made(tmp_path, "two")
    diagnosis = replace(found(first), curves=[*curves(first), *curves(second)])
    tests = [first.experiment, second.experiment]
    traction, _, profile = views_of(diagnosis, tests)
    assert [t.label for t in traction.traces] == ["one", "two"]
    assert traction.traces[1].x.min() > traction.traces[0].x.max()
    assert traction.spans[3].begin > traction.spans[2].end
    assert profile.traces[-1].label == "two disc 2, iteration 5"
    drawn = figure(diagnosis, tests, title="", provenance="measured and synthetic")
    assert "one disc 1, iteration 5" in text_of(drawn)
    left = next(axes for axes in drawn.axes if axes.get_ylabel().endswith("− model [1]"))
    means = [drawn_line for drawn_line in left.get_lines() if drawn_line.get_label() == "after, mean"]
    assert len({str(drawn_line.get_color()) for drawn_line in means}) == 2
    course = next(axes for axes in drawn.axes if title_of(axes).startswith("traction: "))
    key = course.get_legend()
    assert key is not None
    colours = {
        text.get_text(): handle.get_color() for text, handle in zip(key.get_texts(), key.get_lines(), strict=True)
    }
    assert colours["model after"] not in (colours["one"], colours["two"])
    data = result_of(diagnosis, [first, second], None).dataset
    assert {"traction_1_sample", "traction_2_sample"} <= {axis.name for axis in data.axes}


# --- page


class Reader(HTMLParser):
    """The text of a page by element, its links, and whether every element is closed."""

    VOID = ("meta", "img", "br", "link", "input")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.seen: list[tuple[str, str]] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value or "" for key, value in attrs if key in ("src", "href")]
        self.seen.append((tag, ""))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.seen.append((self.open[-1], data))

    def text(self, *tags: str) -> str:
        return " ".join(" ".join(data for tag, data in self.seen if not tags or tag in tags).split())


def page(of: Result) -> str:
    html = of.extra_files["close-loop.html"]
    assert isinstance(html, str)
    return html


@pytest.mark.parametrize("kind", [found, nothing, unknown, learnt])
def test_page_is_whole_and_needs_nothing_beside_it(test: Test, kind: Any) -> None:
    html = page(result(kind, test))
    reader = Reader(html)
    assert reader.open == []
    images = [b64decode(link.removeprefix("data:image/png;base64,")) for link in reader.links]
    assert images == list(result(kind, test).drawn.values())
    assert len(images) == len(kind(test).errors)
    assert all(image[:8] == b"\x89PNG\r\n\x1a\n" for image in images)
    text = "".join(re.split("|".join(map(re.escape, reader.links)), html))
    assert "http" not in text
    assert not re.search(r"<(script|link)[^>]*(src|href)=", html)
    assert len(text) < 1_000_000
    assert "nan" not in reader.text("td", "p", "li").split()
    assert "reconstructed data" in reader.text("span")
    assert "dry <b>& slow</b>" in reader.text("h3")
    assert ("b", "") not in reader.seen
    assert "@media print" in html


def test_the_page_carries_the_samples_for_plots_that_zoom(test: Test) -> None:
    diagnosis = found(test)
    html = page(result(found, test))
    carried = re.search(r'<script type="application/json" id="plots">(.*?)</script>', html, re.DOTALL)
    assert carried
    plots = json.loads(carried[1])
    assert {plot["title"].partition(":")[0] for plot in plots} == set(diagnosis.errors)
    curve = next(c for c in diagnosis.curves if c.channel == "traction")
    course, residual = plots[0]["data"], plots[1]["data"]
    assert sorted(course[1]) == pytest.approx(sorted(curve.measured), rel=1e-5)
    assert sum(v**2 for v in residual[2]) == pytest.approx(np.sum((curve.measured - curve.before) ** 2), rel=1e-4)
    for number in range(len(plots)):
        assert f'<div id="plot{number}"' in html


def test_a_term_has_one_probability_wherever_it_stands(test: Test) -> None:
    odd = replace(found(test), tried=[replace(t, probability=0.51) if t.chosen else t for t in found(test).tried])
    outcome = result_of(odd, [test], None)
    reader = Reader(page(outcome))
    assert "51 %" not in reader.text("td", "p", "dd", "li")
    assert reader.text("dd").count("71 %") == 1
    chosen = [e for rows in outcome.json["explanations"].values() for e in rows if e["chosen"]]
    assert [e["probability"] for e in chosen] == [effect.probability for effect in odd.effects]
    drawn = figure(odd, [test.experiment], title="", provenance="synthetic")
    assert not any(text.get_text() == "51 %" for axes in drawn.axes for text in axes.texts)


def test_what_is_named_beside_the_answer_has_one_probability_and_is_not_excluded(test: Test) -> None:
    bound = Refusal("at a bound", "film_ratio at a bound")
    film = tried("traction", "film_breakdown", 900.0, of="falling_friction", probability=0.11, refused=bound)
    odd = replace(found(test), tried=[film, *found(test).tried[1:]])
    assert [t.term for t in sentences.ranked(odd, "traction")][1] == film.term
    assert sentences.share(odd, film) == "29 %"
    said = "cannot be separated from what was added; not the answer itself: film_ratio at a bound"
    assert sentences.outcome(odd, film) == said
    drawn = figure(odd, [test.experiment], title="", provenance="synthetic")
    assert "29 % (at a bound)" in text_of(drawn)
    assert "11 %" not in text_of(drawn)


def test_what_was_tried_in_two_places_is_told_apart(test: Test) -> None:
    drift = tried("profile", "sensor_drift", 300.0, of="lateral_wander", refused=LESS)
    twice = replace(found(test), tried=[*found(test).tried, drift])
    names = [sentences.tried_name(twice, t) for t in twice.tried]
    assert "sensor drift (instead of falling friction)" in names
    assert "sensor drift (instead of lateral wander)" in names
    assert "film breakdown" in names


def test_the_page_answers_what_a_reader_asks(test: Test) -> None:
    asked = dict(sentences.answers(found(test)))
    assert asked["How sure is it?"][0].startswith("Falling friction: probable; it is chosen in 71 %")
    assert "film breakdown" in asked["What else could it be?"][0]
    assert asked["What changed?"][0].startswith("Added: falling friction; mu at infinite sliding speed over mu at rest")
    assert "0.412 (90 % interval 0.394 to 0.430)" in asked["What changed?"][0]
    assert any("from 0.0660 to 0.00408" in line for line in asked["What changed?"])
    assert "How sure is it?" not in dict(sentences.answers(nothing(test)))


def test_without_resamples_no_alternative_has_a_probability(test: Test) -> None:
    quick = replace(found(test), effects=[replace(e, probability=np.nan) for e in found(test).effects])
    assert "%" not in dict(sentences.answers(quick))["What else could it be?"][0]
    assert "29 %" in dict(sentences.answers(found(test)))["What else could it be?"][0]


def test_what_explains_the_samples_and_does_not_predict_others_is_said(test: Test) -> None:
    why = "raises the error of the traction of samples held out: it explains these samples and does not predict others"
    left = unknown(test)
    refused = [
        replace(t, refused=Refusal("does not predict", why)) if t.term == EffectTerm("film_breakdown") else t
        for t in left.tried
    ]
    said = "Film breakdown explains these samples and does not predict others."
    assert said in sentences.sentences(replace(left, tried=refused))
    assert said not in sentences.sentences(left)
    (film,) = [t for t in refused if t.why_not == why]
    assert sentences.outcome(left, film) == f"refused: {why}"


def test_what_is_as_good_is_named_where_the_answer_stands_alone(test: Test) -> None:
    alone = replace(found(test), effects=[replace(e, alternatives=()) for e in found(test).effects])
    asked = dict(sentences.answers(alone))["What else could it be?"]
    assert "less probable but not excluded: film breakdown (29 %)" in asked[0]
    (film,) = [t for t in alone.tried if sentences.term_name(t.term) == "film breakdown"]
    assert sentences.outcome(alone, film) == "fits less well, but by no more than the formulas may err; less probable"
    assert sentences.outcome(alone, replace(film, gain=909.0)) == "fits as well, less probable"
    renamed = replace(film, refused=Refusal("in other words"))
    assert sentences.share(alone, renamed) == "–"
    assert sentences.outcome(alone, renamed) == "the same in other words, counted there"


class Structure(HTMLParser):
    """Tables with captions and header cells, images, headings, and the ids of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tables: list[Counter[str]] = []
        self.scopes: list[str | None] = []
        self.images: list[str] = []
        self.headings: list[int] = []
        self.ids: list[str] = []
        self.lang = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.ids += [given["id"] or ""] if "id" in given else []
        if tag == "html":
            self.lang = given.get("lang") or ""
        if tag == "table":
            self.tables.append(Counter())
        if tag in ("caption", "th", "td", "tr"):
            self.tables[-1][tag] += 1
        if tag == "th":
            self.tables[-1][f"scope {given.get('scope')}"] += 1
        if tag == "img":
            self.images.append(given.get("alt") or "")
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))


@pytest.mark.parametrize("kind", [found, nothing, unknown, learnt])
def test_page_can_be_heard(test: Test, kind: Any) -> None:
    structure = Structure(page(result(kind, test)))
    assert structure.lang == "en"
    assert structure.tables
    for cells in structure.tables:
        assert cells["caption"] == 1
        rows = cells["tr"] - 1
        assert cells["th"] == cells["scope col"] + cells["scope row"]
        assert cells["scope col"] >= 2
        assert cells["scope row"] == rows >= 1
        assert cells["th"] + cells["td"] == cells["scope col"] * cells["tr"]
    assert structure.headings[0] == 1
    assert structure.headings.count(1) == 1
    assert all(deeper <= before + 1 for before, deeper in pairwise(structure.headings))
    assert len(structure.ids) == len(set(structure.ids))


def test_page_says_what_is_seen_in_its_figures(test: Test) -> None:
    traction, *others = Structure(page(result(found, test))).images
    assert "Traction: 60 samples; the model before is off by 0.0600 (root mean square), the model after by" in traction
    assert "longest sensor drift, chosen: falling friction" in traction
    assert not any("falling friction" in seen for seen in others)
    assert all("Nothing was tried." in seen for seen in Structure(page(result(nothing, test))).images)
    seen = Structure(page(result(learnt, test))).images
    assert ["1 - 0.123 exp(-τ / 68.1 s)" in of for of in seen] == [
        channel == "traction" for channel in learnt(test).errors
    ]


def test_the_k_of_a_model_with_other_wear_is_not_to_be_used_alone(test: Test) -> None:
    assert "lateral wander" in sentences.base_note(found(test))
    assert "use it with revised.toml" in " ".join(Reader(page(result(found, test))).text("p").split())
    assert sentences.base_note(nothing(test)) == ""
    (line,) = [line for line in summary(found(test)) if line.startswith("base")]
    assert "use them with revised.toml" in line
    assert "± one standard deviation" in line


def test_page_begins_with_the_verdict(test: Test) -> None:
    for kind in (found, nothing, unknown, learnt):
        diagnosis = kind(test)
        text = Reader(page(result(kind, test))).text("h1", "h2", "p", "td", "th")
        assert text.index(sentences.sentences(diagnosis)[0]) < text.index("Error before and after")


def test_page_tells_effects_with_formula_source_and_interval(test: Test) -> None:
    reader = Reader(page(result(found, test)))
    assert "mu(w) = mu_0 [A + (1 - A) exp(-B w)]" in reader.text("pre")
    assert "mu(v) = mu_0 [r + (1 - r)" in reader.text("pre"), "the alternative is explained too"
    for name in ("falling_friction", "film_breakdown", "lateral_wander"):
        assert catalogue()[name].source in reader.text("p")
    assert "0.412 0.394 to 0.430" in reader.text("td")
    assert "mu at infinite sliding speed over mu at rest" in reader.text("td")


def test_page_lists_every_explanation_tried(test: Test) -> None:
    cells = Reader(page(result(found, test))).text("td", "th")
    for needed in (
        "falling friction 30.2 71 % added to the model traction",
        "film breakdown 30.0 29 % cannot be separated from what was added",
        "sensor drift 30.8 1 % refused: explains less",
        "refused: yaw_mrad at a bound",
        "a change of the coefficient of friction with dissipated energy 25.3",
        "refused: raises the error of the disc temperature",
        "a change of the wear across the track",
    ):
        assert needed in cells


def test_what_so_few_samples_leave_untried_is_not_said_to_explain_nothing(test: Test) -> None:
    few = replace(unknown(test), too_few_samples=("traction",))
    said, plain = (sentences.sentences(diagnosis)[0] for diagnosis in (few, unknown(test)))
    assert "no learnt law explains, of those that so few samples allow to be tried: what is left" in said
    assert "so few" not in plain
    assert sentences.sentences(replace(few, too_few_samples=("mass",)))[0] == plain


def test_page_says_where_to_look_for_what_is_unexplained(test: Test) -> None:
    cells = Reader(page(result(unknown, test))).text("td", "th")
    assert "traction time a smooth trend 31 % p < 0.001 what changes as the test goes on" in cells


def test_what_the_levels_go_with_follows_nothing_is_missing(test: Test) -> None:
    """On the terminal, the page and in the JSON; a temperature around the discs is no covariate of a law."""
    place = np.arange(3)
    of = Levels("mu", "1", place, wander(np.log([0.39, 0.35, 0.31]), np.full(3, 1e-3), place))
    speed = Follows("rolling_speed", power=True, slope=-0.18, std=0.003, share=0.99, p_value=0.01)
    room = Follows(ENVIRONMENT, power=False, slope=-0.01, std=0.002, share=0.96, p_value=0.1)
    withheld = dict.fromkeys(("a", "b", "c"), (1,))
    diagnosis = replace(
        nothing(test),
        held_out_steps=withheld,
        levels={"mu": replace(of, follows=speed), "K": replace(of, key="K", follows=room)},
    )
    verdict, *rest = summary(diagnosis)
    assert verdict.endswith(
        "tolerances. The level of mu goes with rolling speed from test to test: a law over rolling speed would say "
        "so; declare it as a law to use it. The level of K goes with environment temperature from test to test, which "
        "three tests cannot prove."
    )
    assert any("it goes with rolling speed to the power of -0.1800 ± 0.0030 (p = 0.01)" in line for line in rest)
    assert any("by -1.00 ± 0.20 % a °C (p = 0.1: three tests cannot prove it)" in line for line in rest)
    outcome = result_of(diagnosis, [test], None)
    paragraphs = Reader(page(outcome)).text("p")
    assert "The level of mu goes with rolling speed from test to test" in paragraphs
    assert "Level of mu 0.348, range 26 %; it goes with rolling speed to the power of" in paragraphs
    assert outcome.json["levels"]["mu"]["follows"] == {**vars(speed), "others": [], "proven": True}


def test_page_gives_the_next_experiment_ready_to_run(test: Test, tmp_path: Path) -> None:
    reader = Reader(page(result(found, test)))
    (table,) = [data for tag, data in reader.seen if tag == "pre" and data.startswith("[history]")]
    steps = tomllib.loads(table)["history"]["steps"]
    assert [(s["creepage_percent"], s["iterations"]) for s in steps] == [(0.5, 3), (2.0, 2)]
    begin, end = VALID.index("[history]"), VALID.index("[model]")
    (tmp_path / "next.toml").write_text(f"{VALID[:begin]}{table}\n\n{VALID[end:]}", encoding="utf-8")
    assert load(tmp_path / "next.toml").experiment.history.creepage.tolist() == [0.005] * 3 + [0.02] * 2
    assert "Record the disc temperature as well" in reader.text("p")


def test_page_counts_what_was_held_out(test: Test) -> None:
    items = Reader(page(result(found, test))).text("li")
    assert "step 2 (1 %)" in items
    assert "12 of 60 of the traction, 36 of 180 of the worn profile and 12 of 60 of the disc temperature" in items


def test_steps_without_a_sample_are_not_held_out(test: Test) -> None:
    seen = [replace(curve, held_out=np.zeros_like(curve.held_out)) for curve in found(test).curves]
    assert held_out(test, replace(found(test), curves=seen)) == "no sample"


@pytest.mark.parametrize("blind", [True, False])
def test_page_says_what_predicts_the_samples_held_out(test: Test, blind: bool) -> None:
    """The average over the explanations, which may err where the answer alone does not."""
    told = Reader(page(result_of(replace(found(test), blind=blind), [test], None))).text("p")
    said = "that neither search nor choice saw, " if blind else ""
    assert f"“Held out” are samples {said}predicted without them by the average over the answer" in told


def test_page_names_effects_in_words_in_what_differs(test: Test) -> None:
    said = "fitted to all samples, the evidence is for mu over time in cold and two_slope_factors"
    odd = replace(found(test), difference=said)
    words_of = "a change of the coefficient of friction with time in cold and two slope factors"
    assert any(words_of in line for line in sentences.sentences(odd))


def test_a_test_that_was_only_predicted_is_told_apart(tmp_path: Path) -> None:
    first, other = made(tmp_path, "one"), made(tmp_path, "other")
    nowhere = replace(error("profile", 9.0, 1.5), before=math.nan, after=math.nan)
    diagnosis = replace(found(first), validation=PredictedErrors("other", {"profile": nowhere}, {}, {}, {}))
    outcome = result_of(diagnosis, [first], other)
    reader = Reader(page(outcome))
    assert "other was not fitted" in reader.text("p")
    assert "only predicted" in reader.text("li")
    assert "1.5 times the noise" in reader.text("td")
    assert outcome.json["validation"]["error"]["profile"]["held_out_before"] == pytest.approx(0.99)
    assert "predicted, not fitted, used in the choice: other: worn profile 0.990 -> 0.153 µm" in outcome.summary


# --- numbers for programs


def test_json_holds_the_keys_of_the_contract(test: Test) -> None:
    told_json = json.loads(json.dumps(plain(result(found, test).json)))
    assert told_json["verdict"] == "effects_found"
    (first, second) = told_json["effects"]
    assert first["effect"] == "falling_friction"
    assert first["alternatives"] == ["film_breakdown"]
    assert first["parameters"]["ratio"] == {"value": 0.412, "std": 0.011, "low": 0.394, "high": 0.43, "unit": "1"}
    assert (first["probability"], first["strength"], first["remains"]) == (0.71, "probable", 0.0)
    assert second["channel"] == "profile"
    explained = told_json["explanations"]["traction"]
    assert [e["label"] for e in explained][:3] == ["falling_friction", "film_breakdown", "sensor_drift"]
    assert [e["chosen"] for e in explained] == [True, False, False, False, False]
    assert (explained[3]["refused"], explained[3]["gain"], explained[3]["remains"]) == (
        "yaw_mrad at a bound",
        700.0,
        0.1,
    )
    assert told_json["error"]["profile"]["unit"] == "um"
    assert set(told_json["error"]["traction"]) == {
        "unit", "noise", "before", "before_step_mu", "after", "held_out_before", "held_out_after",
    }  # fmt: skip
    assert told_json["base"]["K"]["std"] == 4e-7
    assert told_json["next_experiment"]["steps"][0] == {"creepage_percent": 0.5, "iterations": 3}
    assert told_json["revised"] == "revised.toml"
    assert told_json["hold_out_steps"] == {"small": [2]}


def test_json_of_what_is_not_there(test: Test) -> None:
    first = replace(nothing(test), errors={"traction": found(test).errors["traction"]}, curves=curves(test)[:1])
    told_json = result_of(first, [test], None).json
    assert told_json["error"]["profile"] == told_json["error"]["temperature"] == {}
    assert told_json["next_experiment"]["steps"] == []
    assert told_json["effects"] == told_json["laws"] == told_json["unexplained"] == []
    left = result(unknown, test).json["unexplained"]
    assert left[0] == {"channel": "traction", "covariate": "time", "kind": "smooth", "share_of_variance": 0.31,
                       "p_value": 1e-9}  # fmt: skip


def test_exit_code_5_only_where_the_cause_is_in_no_catalogue(test: Test) -> None:
    assert [result(kind, test).exit_code for kind in (found, nothing, unknown, learnt)] == [0, 0, 5, 0]
    partly = replace(found(test), unexplained=unknown(test).unexplained)
    outcome = result_of(partly, [test], None)
    assert outcome.exit_code == 0
    assert any("stays unexplained" in sentence for sentence in sentences.sentences(partly))
    assert any(text.startswith("unexplained: ") for text in outcome.summary)


def test_json_of_a_law(test: Test) -> None:
    told_json = json.loads(json.dumps(plain(result(learnt, test).json)))
    formula, curve = told_json["laws"]
    assert (told_json["verdict"], told_json["effects"]) == ("law_learned", [])
    assert {key: formula[key] for key in ("law", "quantity", "covariate", "form", "formula", "transfer", "valid")} == {
        "law": "mu_over_time_in_step", "quantity": "mu", "covariate": "time_in_step", "form": "exponential",
        "formula": "1 - 0.123 exp(-τ / 68.1 s)", "transfer": "inside", "valid": [0.0, 168.0],
    }  # fmt: skip
    assert formula["parameters"]["scale_s"]["unit"] == "s"
    assert formula["resembles"] == [{"effect": "running_in_friction", "share": 0.93}]
    assert (formula["probability"], formula["strength"]) == (0.95, "established")
    assert formula["curve"]["low"] == learnt(test).laws[0].curve.low.tolist()
    assert (curve["form"], curve["parameters"], curve["transfer"]) == ("curve", {}, "same_history")
    assert "probability" not in curve, "absent where it was not computed"
    assert curve["alternatives"] == [
        {"quantity": "wear", "covariate": "time", "probability": 0.3},
        {"effect": "running_in_wear", "probability": 0.1},
    ]


def test_a_law_is_told_in_the_same_words_everywhere(test: Test) -> None:
    outcome, lines = result(learnt, test), summary(learnt(test))
    reader = Reader(page(outcome))
    assert lines[1] == f"{words.sentence(DIFFERS)}."
    (differs,) = sentences.difference(learnt(test))
    assert reader.text("p").index(differs) < reader.text("p").index("Learnt from the data")
    assert DIFFERS not in reader.text("li")
    first = (
        "the coefficient of friction times (1 - 0.123 exp(-τ / 68.1 s)), with τ the time since the creepage changed "
        "from 0 to 168 s"
    )
    second = "the wear coefficient times a curve from 0.700 to 1.10, with E the dissipated energy from 0 to 8.40 kJ"
    told_of_laws = (
        first,
        "established, 95 %",
        "inside its range it can be carried over to another history, if it is right",
        second,
        "takes away 60 % of the misfit",
        "on which dissipated energy may stand for what changed with it",
        "running-in of friction (93 % of it)",
    )
    for text in told_of_laws:
        assert any(text in row for row in lines)
        assert text.casefold() in reader.text("p").casefold()
    for text in (
        "68.1 s 60.0 to 77.0",
        "a change of the wear coefficient with time or running-in of wear",
        "What would separate them: low and high creepages in turn",
    ):
        assert text in reader.text()
    assert "mu(n) = mu_0" not in reader.text("pre")


# --- the revised definition


def test_revised_definition_runs_with_what_was_found(test: Test) -> None:
    path = test.path.with_name("revised.toml")
    path.write_text(revised(found(test), test), encoding="utf-8")
    again = load(path).experiment
    assert again.effects == {
        "falling_friction": {"ratio": 0.412, "decay_s_m": 3.2},
        "lateral_wander": {"std_mm": 0.2},
    }
    assert again.options.friction_coefficient == 0.6
    assert again.options.wear_coefficient == 7e-5
    assert again.measured.provenance == "reconstructed"
    assert again.history.creepage.tolist() == test.experiment.history.creepage.tolist()
    assert path.read_text().startswith("# small, with falling friction and lateral wander added")


def test_revised_definition_declares_the_laws(test: Test) -> None:
    path = test.path.with_name("revised_laws.toml")
    path.write_text(revised(learnt(test), test), encoding="utf-8")
    again = load(path).experiment
    assert again.laws == {found.name: found.law for found in learnt(test).laws}
    assert path.read_text().startswith("# small, with a change of the coefficient of friction with time since")


def test_revised_definition_keeps_what_was_given(tmp_path: Path) -> None:
    test = made(
        tmp_path,
        "given",
        "wear_coefficient = 1e-4\n\n[effects.torque_offset]\noffset = 0.01\n\n[loop]\nhold_out_steps = [2]\n",
    )
    document = tomllib.loads(revised(found(test), test))
    assert document["model"]["wear_coefficient"] == 1e-4
    assert document["loop"]["hold_out_steps"] == [2]
    assert set(document["effects"]) == {"torque_offset", "falling_friction", "lateral_wander"}


def test_a_term_of_one_test_is_named_with_it_and_revises_that_one(tmp_path: Path) -> None:
    first, second = made(tmp_path, "one"), made(tmp_path, "two")
    own, law = replace(found(first).effects[0], test="two"), replace(learnt(first).laws[0], test="two")
    diagnosis = replace(found(first), effects=[own, found(first).effects[1]], laws=[law])
    result = result_of(diagnosis, [first, second], None)
    documents = [tomllib.loads(str(result.extra_files[name])) for name in ("revised.toml", "revised-two.toml")]
    assert [set(document["effects"]) for document in documents] == [
        {"lateral_wander"},
        {"lateral_wander", "falling_friction"},
    ]
    assert ["laws" in document for document in documents] == [False, True]
    assert [effect.get("test") for effect in result.json["effects"]] == ["two", None]
    assert result.json["laws"][0]["test"] == "two"
    assert "falling friction in two" in sentences.sentences(diagnosis)[0]


def test_revised_definition_of_a_second_test_names_the_data_of_its_own_folder(tmp_path: Path) -> None:
    """It is written as it would stand beside the definition of the first."""
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    first, second = made(tmp_path / "a", "one"), made(tmp_path / "b", "two")
    result = result_of(found(first), [first, second], None)
    measured = tomllib.loads(str(result.extra_files["revised-two.toml"]))["measured"]
    assert (tmp_path / "a" / measured["traction"]).resolve() == (tmp_path / "b" / "two_traction.csv").resolve()


def test_revised_definition_takes_the_base_of_its_own_test(tmp_path: Path) -> None:
    first, second = made(tmp_path, "one"), made(tmp_path, "two")
    mu = {
        f"mu ({name})": BaseEstimate(value, 0.01, 0.0, 1.0, "1", "mu", name)
        for name, value in (("one", 0.3), ("two", 0.5))
    }
    diagnosis = replace(found(first), base={**mu, "K": BaseEstimate(7e-5, 1e-6, 6e-5, 8e-5, "1", "K")})
    assert tomllib.loads(revised(diagnosis, first))["model"]["friction_coefficient"] == 0.3
    assert tomllib.loads(revised(diagnosis, second))["model"]["friction_coefficient"] == 0.5
    names = {array.name for array in result_of(diagnosis, [first, second], None).dataset.arrays}
    assert {"base_mu_one", "base_mu_two", "base_K"} <= names


def test_a_parameter_at_its_bound_stays_valid(test: Test) -> None:
    bound = catalogue()["third_body_layer"].params[0].lower
    just_below = Estimate(bound * (1.0 - 1e-12), 0.01, 0.0, 1.0, "1")
    effect = FoundEffect("third_body_layer", "traction", {"slope_ratio": just_below}, (), 1.0, "established")
    path = test.path.with_name("at_bound.toml")
    path.write_text(revised(replace(found(test), effects=[effect]), test), encoding="utf-8")
    assert load(path).experiment.effects == {"third_body_layer": {"slope_ratio": bound}}


# --- files


@pytest.fixture
def faked(monkeypatch: pytest.MonkeyPatch, test: Test) -> None:
    monkeypatch.setattr(close_loop, "diagnose", lambda tests, **_: found(test))


def called(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        cli.main(["close-loop", *arguments])
    return int(left.value.code or 0)


def test_files_are_written_whole_and_the_same_each_time(
    faked: None, test: Test, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert called(str(test.path), "-o", str(out), "--json", "--dpi", "40") == 0
    folder = out / "small"
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    pages = {f"close-loop-{channel}.png" for channel in ("traction", "profile", "temperature")}
    assert set(files) == {"close-loop.h5", "close-loop.png", "close-loop.html", "revised.toml", *pages}
    told_json = json.loads(capsys.readouterr().out)
    assert told_json["revised"] == str(folder / "revised.toml")
    assert load(folder / "revised.toml").experiment.measured.profile is not None
    assert called(str(test.path), "-o", str(out), "--force", "--dpi", "40") == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == files


@pytest.mark.parametrize("kind", [found, nothing, learnt])
def test_all_numbers_are_in_the_hdf5_file(
    monkeypatch: pytest.MonkeyPatch, test: Test, tmp_path: Path, kind: Any
) -> None:
    monkeypatch.setattr(close_loop, "diagnose", lambda tests, **_: kind(test))
    output = Output(tmp_path / "out", formats=(), quiet=True)
    assert _runner.run_close_loop([test.path], {"validate": False, "fitted": 1}, output) == 0
    path = tmp_path / "out" / "small" / "close-loop.h5"
    diagnosis = kind(test)
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data["traction_error"].sel(error_kind="held_out_after") == diagnosis.errors["traction"].held_out_after
        assert data["profile_error"].attrs["units"] == "m"
        noise = data["profile_error"].sel(error_kind="noise")
        assert float(noise) == pytest.approx(NOISE["profile"])
        assert np.array_equal(data["profile_measured"], diagnosis.curves[1].measured)
        assert data["profile_measured"].attrs["units"] == "m"
        assert np.array_equal(data["traction_at_creepage"], diagnosis.curves[0].covariates["creepage"])
        assert np.array_equal(data["temperature_held_out"], diagnosis.curves[2].held_out)
        assert data["base_K"].sel(estimate_kind="value") == 7e-5
        assert data.sizes["candidate"] == len(diagnosis.tried)
        if diagnosis.effects:
            assert data["falling_friction_decay_s_m"].attrs["units"] == "s m-1"
            assert data["candidate_label"].values[0] == "film_breakdown"
            assert data["candidate_gain"].values[1] == 950.0
        for law in diagnosis.laws:
            assert np.array_equal(data[f"{law.name}_low"], law.curve.low)
            si = {"kJ": ("J", 1e3), "s": ("s", 1.0)}[law.law.over.unit]
            assert data[f"{law.name}_place"].attrs["units"] == si[0]
            assert data[f"{law.name}_place"].values == pytest.approx(np.asarray(law.curve.at) * si[1])
    with h5py.File(str(path)) as file:
        named = [item for item in file.values() if isinstance(item, h5py.Dataset)]
        assert all(item.attrs["units"] and item.attrs["long_name"] for item in named)


def test_a_hump_across_the_track_can_be_written(test: Test) -> None:
    """Its parameter `at` has no unit in its key and is not the axis of its curve."""
    values = {"size_um": 0.4, "at": 0.3, "width": 0.1}
    law = Law("profile", "y_over_edge", "bump", values, valid=(-1.5, 1.5))
    estimates = {key: Estimate(value, 0.01, value - 0.02, value + 0.02, "1") for key, value in values.items()}
    hump = FoundLaw(law.name, "profile", estimates, (), 0.9, "probable",
                    law=law, formula=formula_text(law), curve=banded(law), resembles=())  # fmt: skip
    names = [array.name for array in dataset_of(replace(learnt(test), laws=[hump])).arrays]
    assert {f"{law.name}_at", f"{law.name}_value"} <= set(names)


def test_a_test_without_data_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bare.toml").write_text(VALID, encoding="utf-8")
    bare, fitted = load(tmp_path / "bare.toml"), load(write(tmp_path, traction=TRACTION))
    for tests, predicted in (([bare], {}), ([fitted], {"validate": bare}), ([fitted], {"predict": [bare]})):
        with pytest.raises(DefinitionError, match=r"bare\.toml: measured: names no data"):
            run(tests, predicted.pop("validate", None), lambda what, fraction: None, **predicted)
