"""A crown that is not the declared one: against a rig with that crown, and found in what another simulator made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rigs
from score.hidden import NOTHING
from score.rig import March, Rig
from score.sensors import CHANNELS, draw_plan, noise, read
from score.writing import definition, write_tables

from twindisc_cli.definition import load
from twindisc_cli.laws.trial import curve
from twindisc_cli.loop.candidates import searched
from twindisc_cli.loop.explain import explain
from twindisc_cli.loop.explanation import Explanation
from twindisc_cli.loop.fit import at
from twindisc_cli.loop.notes import across_the_track, of_laws_across
from twindisc_cli.loop.problem import problem_of
from twindisc_cli.model.experiment import Contact, Experiment, Options
from twindisc_cli.model.forward import ForwardModel

BASE = {"mu": np.array([0.6]), "K": np.array([1e-4]), "convection_W_K": np.array([1.6])}
COURSE = rigs.history((0.002, 0.01, 0.02), 10)


def worn(contact: Contact, radius: float) -> Experiment:
    options = Options(contact=contact, wear_coefficient=1e-4)
    return rigs.experiment(COURSE, rig=rigs.rig(crown=radius), options=options)


@pytest.mark.parametrize("contact", ["hertz", "half_space"])
@pytest.mark.parametrize("ratio", [0.5, 0.93, 1.07, 1.6])
def test_discs_of_another_crown_wear_and_roll_as_a_rig_that_declares_it(contact: Contact, ratio: float) -> None:
    """Between the crowns for which paths are known they are interpolated: to half a per cent of the greatest depth."""
    model, other = ForwardModel(worn(contact, 0.03)), ForwardModel(worn(contact, 0.03 * ratio))
    found, true = model.predict(BASE, {"crown_error": {"radius_ratio": np.array([ratio])}}), other.predict(BASE)
    section, one = true.section[:, -1:], np.ones((1, 1))
    y = np.linspace(-1e-3, 1e-3, 201)
    one_depth, other_depth = (
        np.ravel(made.paths.at(lambda path: path.depth_on(y), section, one)) for made in (found, true)
    )
    assert one_depth == pytest.approx(other_depth, abs=5e-3 * other_depth.max())
    assert found.traction == pytest.approx(true.traction, abs=5e-4)


def recorded(folder: Path, curvature: float) -> Experiment:
    """A record of the score's rig, which has contact, traction and wear of its own, with so many times the curvature
    that is declared."""
    rig = Rig(
        load=72.0, rpm=3000.0, radius=0.03, crown=(np.inf, 0.03), creepage=(0.003, 0.01, 0.05, 0.02),
        iterations=(4, 4, 4, 4), revolutions=4200, capacity=100.0, environment=20.0, contact="half_space",
        law="fastsim", declared_law="fastsim", mu=0.6, wear=1e-4, convection=1.6, creepage_error=(0.0,) * 4,
        crown_tolerance=curvature,
    )  # fmt: skip
    rng = np.random.default_rng(8)
    plan = draw_plan(rng, rig, correlated=False, stops=True, discs=(1, 2))
    clean = read(rig, March(rig).run(), [NOTHING], plan)
    measured = {name: clean[name] + noise(rng, plan, name, clean[name].size) for name in CHANNELS}
    write_tables(folder, "", rig=rig, plan=replace(plan, weighed=()), measured=measured)
    (folder / "test.toml").write_text(definition(rig, replace(plan, weighed=()), "crown", ""), encoding="utf-8")
    return load(folder / "test.toml").experiment


def test_another_crown_is_found(tmp_path: Path) -> None:
    found = explain([recorded(tmp_path, 0.7)], validate=None, quick=True, progress=lambda stage, part: None)
    assert found.answer.terms == ("crown_error",)
    ratio, std = found.sure.value(next(p for p in found.sure.problem.parameters if p.term == "crown_error"))
    assert ratio == pytest.approx(1.0 / 0.7, abs=3.0 * std)


def test_it_is_not_tried_where_every_crown_would_have_to_be_integrated() -> None:
    plant = rigs.Plant(rigs.history((0.005, 0.01, 0.02, 0.04), 3))
    test = rigs.Instruments(each=4).record(plant, np.random.default_rng(5))
    factor = np.where(test.history.step > 1, 2.0, 1.0)
    changing = replace(test, history=replace(test.history, load_factor=factor))
    assert "crown_error" in searched(problem_of([test]))
    assert "crown_error" not in searched(problem_of([changing]))


@pytest.mark.parametrize(("loads", "open_crown"), [((1.0, 1.0), False), ((1.0, 2.0), True)])
def test_a_law_across_the_track_is_doubtful_where_no_crown_was_tried(
    loads: tuple[float, float], *, open_crown: bool
) -> None:
    """It would change the wear across the track, too; a law over time has nothing to do with it."""
    test = rigs.Instruments(each=4).record(rigs.Plant(rigs.history((0.01, 0.02), 3)), np.random.default_rng(5))
    factor = np.where(test.history.step == test.history.step[-1], loads[1], loads[0])
    base = problem_of([replace(test, history=replace(test.history, load_factor=factor))])
    laws = {
        name: curve(*name.split("_over_", 1), at=np.array([0.0, 1.0]), mix=np.eye(2))
        for name in ("wear_across_over_y_over_edge", "wear_over_time")
    }
    problem = base.with_terms(*laws, trial=laws)
    answer = Explanation(at(problem, problem.start()), {}, 0.0)
    doubtful = across_the_track(base, answer)
    assert doubtful == ["wear_across_over_y_over_edge"] * open_crown
    assert len(of_laws_across(doubtful)) == open_crown
