"""close-loop's error of the model before with the mu of each step, beside the one with a constant mu."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from definitions import shipped
from rigs import experiment, history
from test_close_loop_report import found, made

from twindisc_cli.commands._step_friction import with_step_friction
from twindisc_cli.commands.close_loop import result_of, summary
from twindisc_cli.definition import Test
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.identify.wear import identify_wear
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import Curve, Diagnosis
from twindisc_cli.model.experiment import Measured, TractionSamples
from twindisc_cli.model.forward import ForwardModel

NITROGEN = "cryogenic"


def record(test: Test, channel: str) -> Curve:
    """The record of a channel with every third sample held out, and models of zero, which have no part in it."""
    values = channels()[channel].values(channels()[channel].samples(test.experiment))
    zero, every = np.zeros(len(values)), np.ones(len(values), dtype=bool)
    return Curve(NITROGEN, channel, values, *(zero,) * 4, np.arange(len(values)) % 3 == 1, every, {}, "reconstructed")


@pytest.fixture(scope="module", name="small")
def small_test(tmp_path_factory: pytest.TempPathFactory) -> Test:
    return made(tmp_path_factory.mktemp("small"), "small")


@pytest.fixture(scope="module", name="diagnosis")
def recorded(small: Test) -> Diagnosis:
    """A made-up diagnosis with the records of the test in nitrogen."""
    any_other = found(small)
    errors = {channel: any_other.errors[channel] for channel in ("traction", "profile")}
    return replace(any_other, errors=errors, curves=[record(shipped(NITROGEN), channel) for channel in errors])


def test_the_mu_of_each_step_leaves_of_one_sample_a_step_nothing(diagnosis: Diagnosis) -> None:
    errors = with_step_friction(diagnosis, [shipped(NITROGEN).experiment])
    assert errors["traction"].before_step_mu == pytest.approx(0.0, abs=1e-9)
    assert errors["traction"].before == diagnosis.errors["traction"].before


def test_the_profile_misses_what_the_fit_of_k_by_least_squares_misses(diagnosis: Diagnosis) -> None:
    test = shipped(NITROGEN).experiment
    model = ForwardModel(test)
    fit = identify_wear(model, friction_in_use(model).mu)
    used = ~diagnosis.curves[1].held_out
    missed = 1e6 * np.sqrt(np.mean((fit.height - fit.squares_height)[used] ** 2))
    error = with_step_friction(diagnosis, [test])["profile"]
    assert error.before_step_mu == pytest.approx(missed, rel=1e-3)
    # the parabola of the paper's depth and width is 1.51 mm wide, a chord of its depth 1.03 mm
    assert error.before_step_mu > 0.3


def test_an_outlier_counts_neither_in_the_mu_of_its_step_nor_in_the_error(diagnosis: Diagnosis) -> None:
    """In full sliding T/N is mu: without the outlier the mu of each step leaves nothing of these samples."""
    course = history((0.02, 0.05), 1)
    time, step = np.linspace(10.0, 160.0, 16), np.repeat((0, 1), 8)
    ratio = np.where(step == 0, 0.5, 0.4)
    ratio[5] = 0.9
    samples = TractionSamples(time, step, np.array([0.02, 0.05])[step], ratio, np.full(16, np.nan))
    test = experiment(course, measured=Measured(traction=samples))
    zero, none = np.zeros(16), np.zeros(16, dtype=bool)
    curve = Curve("small", "traction", ratio, *(zero,) * 4, none, ratio < 0.8, {}, "measured")
    alone = replace(diagnosis, curves=[curve], errors={"traction": diagnosis.errors["traction"]})
    errors = with_step_friction(alone, [test])
    assert errors["traction"].before_step_mu == pytest.approx(0.0, abs=1e-9)


def test_without_a_recorded_traction_no_mu_of_a_step_is_claimed(diagnosis: Diagnosis) -> None:
    test = shipped(NITROGEN).experiment
    history = replace(test.history, given_mu=np.full_like(test.history.given_mu, 0.5))
    unknown = replace(test, history=history, measured=replace(test.measured, traction=None))
    assert np.isnan(with_step_friction(diagnosis, [unknown])["profile"].before_step_mu)


def test_summary_page_and_json_say_it(small: Test) -> None:
    without = found(small)
    errors = {**without.errors, "profile": replace(without.errors["profile"], before_step_mu=0.4567)}
    diagnosis = replace(without, errors=errors)
    assert "(before, with mu of each step: 0.457)" in "\n".join(summary(diagnosis))
    assert "mu of each step" not in "\n".join(summary(without))
    outcome = result_of(diagnosis, [small], None)
    assert outcome.json["error"]["profile"]["before_step_mu"] == 0.4567
    assert outcome.json["error"]["traction"]["before_step_mu"] is None
    page = str(outcome.extra_files["close-loop.html"])
    assert "before, mu of each step" in page
    assert '<td class="number">0.457</td>' in page
