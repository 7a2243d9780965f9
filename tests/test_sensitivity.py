"""How far K moves with what a test does not say: against closed forms, and against the forward model's own
integration."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from definitions import shipped

from twindisc_cli.commands import fit_k
from twindisc_cli.definition import load
from twindisc_cli.figures.wear import varied
from twindisc_cli.identify.sensitivity import (
    RULES,
    Variation,
    _depth_by_circle,
    _longer,
    circle_applies,
    sensitivity,
)
from twindisc_cli.identify.steps import friction_in_use
from twindisc_cli.identify.wear import WearFit, identify_wear
from twindisc_cli.model.experiment import History, TractionSamples
from twindisc_cli.model.forward import ForwardModel


@cache
def air() -> tuple[ForwardModel, WearFit]:
    model = ForwardModel(shipped("ambient").experiment)
    return model, identify_wear(model, friction_in_use(model).mu)


@cache
def changes() -> dict[str, float]:
    return {variation.what: variation.change for variation in sensitivity(*air())}


def test_k_goes_with_the_hardness_and_against_the_energy() -> None:
    # W = K E / H at one depth: K is proportional to H, and to 1/E where the patch is the same
    assert changes()["hardness +5 %"] == pytest.approx(0.05, abs=2e-3)
    assert changes()["hardness -5 %"] == pytest.approx(-0.05, abs=2e-3)
    creepage = np.array([0.25, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9])
    ratio = np.array([0.334, 0.491, 0.55, 0.57, 0.58, 0.60, 0.60, 0.61, 0.62, 0.62, 0.61, 0.60])
    iterations = np.array([5] * 10 + [7] * 2)
    longer = iterations + 2 * (np.arange(12) >= 10)
    energy = [float(np.sum(ratio * creepage * n)) for n in (iterations, longer)]
    assert changes()["last two steps 2 iterations longer"] == pytest.approx(energy[0] / energy[1] - 1.0, abs=5e-3)


def test_samples_stay_in_their_steps_where_the_last_ones_are_made_longer() -> None:
    """What was recorded in a step of one iteration is not asked of the step before it, nor is a pause made longer."""
    test = air()[0].experiment
    steps, pause = test.history.step_creepage[-3:], np.array([False, False, True, False])
    ones = np.ones(4)
    course = History(np.arange(4), np.insert(steps, 2, 0.0), 84.0 * ones, np.where(pause, 0.0, 4200.0), np.nan * ones)
    middle = (course.end_time - 0.5 * course.duration)[~pause]
    ratio = np.array([0.60, 0.55, 0.50])
    samples = TractionSamples(middle, np.flatnonzero(~pause), steps, ratio, np.full(3, np.nan))
    falling = {"falling_friction": {"ratio": 0.5, "decay_s_m": 3.0}}
    test = replace(test, history=course, measured=replace(test.measured, traction=samples), effects=falling)
    longer = _longer(test)
    assert (longer.history.duration / course.duration).tolist() == [1.0, 3.0, 1.0, 3.0]
    mu, longer_mu = (friction_in_use(ForwardModel(each)).mu for each in (test, longer))
    assert longer_mu[~pause] == pytest.approx(mu[~pause], rel=1e-3)


def test_two_discs_that_wear_equally_need_more_than_twice_the_k() -> None:
    # each bears half of the wear; the facet is wider besides, as disc 1 hollows
    assert changes()["both discs wear equally"] > 1.0


def test_a_little_wear_takes_off_the_patchs_own_share() -> None:
    # u = S 3 / (4 b) (1 - (y/b)^2) of a section S, while the patch is as new
    model, _ = air()
    section, patch = 1e-15, model.experiment.rig.patch
    worn = np.zeros(64)
    worn[0] = section * model.circumference_hardness
    for rule, every in RULES.values():
        depth = _depth_by_circle(model, worn, rule, every, 1.0)
        assert depth == pytest.approx(0.75 * section / float(patch.b), rel=1e-3)


def test_the_circle_through_the_whole_track_is_near_the_models_own() -> None:
    assert abs(changes()["circle through the whole track"]) < 0.1


def test_the_circle_is_asked_where_one_load_wears_disc_2_alone() -> None:
    """Its patch has the rig's load, and its depth is that of one disc; how fast the discs roll is in the energy."""
    test = air()[0].experiment
    history, options = test.history, test.options
    faster = replace(history, speed_factor=np.full(len(history.step), 2.0))
    assert circle_applies(test)
    assert circle_applies(replace(test, history=faster))
    for course in (
        replace(history, load_factor=np.where(history.step == 0, 7.0, 1.0)),
        replace(history, load_factor=np.full(len(history.step), 2.0)),
        replace(history, separate=True),
    ):
        assert not circle_applies(replace(test, history=course))
    assert not circle_applies(replace(test, options=replace(options, disc1_wear_coefficient=7e-5)))


def test_a_declared_partition_counts_in_the_k_of_volume(tmp_path) -> None:  # type: ignore[no-untyped-def]
    source = shipped("cryogenic").path
    text = source.read_text(encoding="utf-8").replace("../data", str(source.parents[1] / "data"))
    text = text.replace(
        "[reported]", '[model]\ncontact = "half_space"\n[effects.wear_partition]\ndisc1_share = 0.54\n[reported]'
    )
    path = tmp_path / "shared.toml"
    path.write_text(text, encoding="utf-8")
    alone, both = (fit_k.run(test).json for test in (shipped("cryogenic"), load(path)))
    assert both["K_from_volume_and_energy"] == pytest.approx(alone["K_from_volume_and_energy"] / 0.46, rel=1e-9)
    assert both["K"] == pytest.approx(both["K_from_volume_and_energy"], rel=0.1)
    assert both["K_of_discs"]["1"] + both["K_of_discs"]["2"] == pytest.approx(both["K"], rel=1e-9)
    assert both["K_of_discs"]["1"] / both["K"] == pytest.approx(0.54, rel=1e-9)
    assert both["K_of_discs_low"]["2"] < both["K_of_discs"]["2"] < both["K_of_discs_high"]["2"]


def test_archards_k_is_k_times_the_mean_friction() -> None:
    found = fit_k.run(shipped("ambient")).json
    creepage = np.array([0.25, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9])
    ratio = np.array([0.334, 0.491, 0.55, 0.57, 0.58, 0.60, 0.60, 0.61, 0.62, 0.62, 0.61, 0.60])
    weight = creepage * ([5] * 10 + [7] * 2)
    assert found["archard_k"] / found["K"] == pytest.approx(np.average(ratio, weights=weight), rel=2e-3)


def test_the_figure_names_the_k_that_its_changes_are_of():
    """The bisection stops within 1 % of the depth, here 0.7 % above the K that makes it."""
    variations = [Variation("hardness +5 %", 5.97e-5, 0.05), Variation("load +2 %", 5.58e-5, -0.018)]
    drawn = varied(variations, k=5.72e-5, name="air", provenance="reconstructed")
    (axes,) = drawn.axes
    title = axes.get_title(loc="left")
    assert "= 5.69e-5 where nothing is changed" in title
    assert "5.72e-5" in title
    assert max(axes.get_xticks()) < 6.0
