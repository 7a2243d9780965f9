"""Steps as they are driven: slip of both signs and of none, loads, speeds and yaw of their own, pauses.

What must come out follows from symmetry, from Hertz's similarity, and from closed forms.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from definitions import VALID, write

from twindisc_cli.cli import main
from twindisc_cli.commands._base import friction_of_steps
from twindisc_cli.definition import Test, dump, load, load_text
from twindisc_cli.definition.parse import parse
from twindisc_cli.errors import DefinitionError, MeasurementError
from twindisc_cli.identify.steps import identify_friction
from twindisc_cli.model.base import BaseParameters
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

HEAD = VALID[: VALID.index("steps = [")].replace("J_K = 100.0", "J_K = 100.0\nconvection_W_K = 1.6")
TAIL = "\n[model]\nfriction_coefficient = 0.6\nwear_coefficient = 7e-5\n"
MU = 0.6


def with_steps(*steps: str, head: str = HEAD, tail: str = TAIL) -> Test:
    listed = "".join(f"  {{ {step} }},\n" for step in steps)
    return load_text(f"{head}steps = [\n{listed}]\n{tail}", Path("steps.toml"))


def predicted(test: Test, **base: float) -> Prediction:
    values = {"mu": MU, "K": 7e-5, "convection": 1.6} | base
    return ForwardModel(test.experiment).predict(BaseParameters(**{k: np.array([v]) for k, v in values.items()}))


def command(folder: Path, name: str, *options: str, capsys: pytest.CaptureFixture[str]) -> dict:  # type: ignore[type-arg]
    with pytest.raises(SystemExit) as exit_:
        main([name, *options, "--json", "-o", str(folder / "out")])
    assert exit_.value.code == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)  # type: ignore[no-any-return]


def test_slip_the_other_way_is_the_mirror_image() -> None:
    steps = [(0.25, 2), (1.0, 2), (4.0, 1)]
    there, back = (
        predicted(with_steps(*(f"creepage_percent = {sign * c}, iterations = {n}" for c, n in steps))).state
        for sign in (1.0, -1.0)
    )
    np.testing.assert_allclose(back.traction_ratio, -there.traction_ratio, rtol=1e-12)
    np.testing.assert_allclose(back.energy, there.energy, rtol=1e-12)
    np.testing.assert_allclose(back.temperature, there.temperature, rtol=1e-12)


@pytest.mark.parametrize(
    ("own", "rig"),
    [
        ("normal_load_N = 500.0", HEAD.replace("normal_load_N = 72.0", "normal_load_N = 500.0")),
        ("rolling_speed_m_s = 2.0", HEAD.replace("mean_speed_rpm = 3000.0", "rolling_speed_m_s = 2.0")),
        ("mean_speed_rpm = 400", HEAD.replace("mean_speed_rpm = 3000.0", "mean_speed_rpm = 400")),
        (
            "normal_load_N = 20.0, rolling_speed_m_s = 2.0",
            HEAD.replace("normal_load_N = 72.0", "normal_load_N = 20.0").replace(
                "mean_speed_rpm = 3000.0", "rolling_speed_m_s = 2.0"
            ),
        ),
    ],
)
def test_a_step_of_its_own_load_and_speed_is_a_rig_of_that_load_and_speed(own: str, rig: str) -> None:
    steps = ("creepage_percent = 0.2, iterations = 2", "creepage_percent = 2.0, iterations = 2")
    mine = predicted(with_steps(*(f"{step}, {own}" for step in steps)))
    other = predicted(with_steps(*steps, head=rig))
    np.testing.assert_allclose(mine.state.time, other.state.time, rtol=1e-12)
    for name in ("traction_ratio", "power", "energy", "temperature"):
        np.testing.assert_allclose(getattr(mine.state, name), getattr(other.state, name), rtol=2e-3, err_msg=name)
    np.testing.assert_allclose(mine.section, other.section, rtol=2e-3)


def test_the_initial_slope_falls_with_the_cube_root_of_the_load() -> None:
    # T/N = (G a b C11 / N) v, and a b goes with N^(2/3)
    test = with_steps("creepage_percent = 0.001", "creepage_percent = 0.001, normal_load_N = 576.0", tail="")
    model = ForwardModel(test.experiment)
    first, second = model.predict({"mu": np.array([MU])}).state.traction_ratio[0, model.points.of_iteration]
    assert second / first == pytest.approx(0.5, rel=0.02)


def test_a_pause_cools_and_does_not_wear() -> None:
    pause = 90.0
    driven = ("creepage_percent = 2.0, iterations = 2", "creepage_percent = 4.0, iterations = 2")
    paused = predicted(with_steps(driven[0], f"pause_s = {pause}", driven[1]))
    whole = predicted(with_steps(*driven))
    times = paused.state.time
    begin, end = 168.0, 168.0 + pause
    at = {t: int(np.argmin(np.abs(times - t))) for t in (begin, end)}
    warm, cool = (paused.state.temperature[0, at[t]] - 293.15 for t in (begin, end))
    assert cool == pytest.approx(warm * np.exp(-1.6 / 100.0 * pause), rel=1e-9)
    assert paused.state.energy[0, at[end]] == paused.state.energy[0, at[begin]]
    assert paused.section[0, -1] == pytest.approx(whole.section[0, -1], rel=1e-12)
    assert paused.state.cycles[-1] == pytest.approx(whole.state.cycles[-1], rel=1e-12)
    assert times[-1] == pytest.approx(336.0 + pause)


def test_a_yaw_of_a_step_is_a_misalignment_in_it() -> None:
    yawed = predicted(with_steps("creepage_percent = 0.5, iterations = 2, yaw_mrad = 2.0")).state
    effect = "\n[effects.misalignment]\nyaw_mrad = 2.0\ntilt_mrad = 0.0\n"
    misaligned = predicted(with_steps("creepage_percent = 0.5, iterations = 2", tail=TAIL + effect)).state
    straight = predicted(with_steps("creepage_percent = 0.5, iterations = 2")).state
    np.testing.assert_allclose(yawed.traction_ratio, misaligned.traction_ratio, rtol=1e-12)
    assert np.all(yawed.traction_ratio < 0.99 * straight.traction_ratio)


@pytest.mark.parametrize(
    ("own", "effect", "slips"),
    [
        ("", "", False),
        (", yaw_mrad = 3.0", "", True),
        ("", "[effects.misalignment]\nyaw_mrad = 3.0\ntilt_mrad = 0.0\n", True),
        ("", "[effects.misalignment]\nyaw_mrad = 0.0\ntilt_mrad = 5.0\n", True),
        ("", "[effects.creepage_offset]\noffset_percent = 0.5\n", True),
    ],
)
def test_a_step_needs_no_friction_where_nothing_slips(own: str, effect: str, slips: bool) -> None:
    steps = "creepage_percent = 2.0, mu = 0.6", "creepage_percent = 0.0" + own, "pause_s = 60"
    model = ForwardModel(with_steps(*steps, tail=f"\n{effect}").experiment)
    assert list(model.slips) == [True, slips, False]
    if slips:
        with pytest.raises(DefinitionError, match="no friction is known for step 2:"):
            friction_of_steps(model)
    else:
        assert list(friction_of_steps(model).mu) == [0.6, 1.0, 1.0]


@pytest.mark.parametrize(("own", "state"), [("", "no_creepage"), (", yaw_mrad = 3.0", "no_longitudinal_creepage")])
def test_traction_along_rolling_says_nothing_of_slip_across(tmp_path: Path, own: str, state: str) -> None:
    steps = f"steps = [{{ creepage_percent = 2.0 }}, {{ creepage_percent = 0.0{own} }}]\n"
    rows = ["creepage [%],traction ratio,step", *["2.0,0.6,1"] * 3, *["0.0,0.001,2"] * 3]
    friction = identify_friction(ForwardModel(load(write(tmp_path, HEAD + steps, traction="\n".join(rows))).experiment))
    assert friction.state == ["saturated", state]
    assert np.isnan(friction.mu[1])


def test_mu_of_both_directions_and_of_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    creepage = [4.0, 2.0, 0.0, -2.0, -4.0, 200.0]
    steps = "".join(f"  {{ creepage_percent = {c} }},\n" for c in creepage)
    rng = np.random.default_rng(3)
    rows = [
        f"{c + 0.1 * rng.standard_normal() * (c == 0.0):.5f},{MU * np.sign(c) + 0.002 * rng.standard_normal():.5f},{n}"
        for n, c in enumerate(creepage, start=1)
        for _ in range(20)
    ]
    traction = "\n".join(["creepage [%],traction ratio,step", *rows])
    path = write(tmp_path, f"{HEAD}steps = [\n{steps}]\n", traction=traction)
    found = command(tmp_path, "identify-mu", str(path), capsys=capsys)["steps"]
    assert [step["state"] for step in found] == [
        "saturated", "saturated", "no_creepage", "saturated", "saturated", "saturated",
    ]  # fmt: skip
    assert found[2]["mu"] is None
    for step in (found[0], found[1], *found[3:]):
        assert step["mu"] == pytest.approx(MU, abs=0.002)
        assert step["mu_low"] < MU + 0.001
        assert step["mu_high"] > MU - 0.001
    for name in ("friction-chart", "check", "thermal"):
        command(tmp_path, name, str(path), capsys=capsys)
    assert command(tmp_path, "check", str(path), capsys=capsys)["problems"] == []


def test_mu_under_a_load_and_a_speed_of_their_own(tmp_path: Path) -> None:
    steps = ["creepage_percent = 0.1, normal_load_N = 500.0", "creepage_percent = -0.3, rolling_speed_m_s = 2.0",
             "creepage_percent = 0.3, yaw_mrad = 1.0"]  # fmt: skip
    test = with_steps(*steps, tail="")
    state = ForwardModel(test.experiment).predict({"mu": np.array([0.35])}).state
    model = ForwardModel(test.experiment)
    ratio = state.traction_ratio[0, model.points.of_iteration]
    listed = "".join(f"  {{ {step} }},\n" for step in steps)
    rows = "".join(f"{c},{r:.9f}\n" for c, r in zip((0.1, -0.3, 0.3), ratio, strict=True))
    path = write(tmp_path, f"{HEAD}steps = [\n{listed}]\n", traction=f"creepage [%],traction ratio\n{rows}")
    from twindisc_cli.identify.steps import identify_friction

    found = identify_friction(ForwardModel(load(path).experiment))
    np.testing.assert_allclose(found.mu, 0.35, rtol=1e-4)


def test_iterations_of_profiles_are_counted_without_pauses(tmp_path: Path) -> None:
    steps = "steps = [{ creepage_percent = 2.0, iterations = 2 }, { pause_s = 60 }, { creepage_percent = 4.0 }]\n"
    mass = "iteration,mass loss [mg]\n2,1\n3,2\n"
    head = HEAD.replace("hardness_HV = 700", "hardness_HV = 700\ndensity_kg_m3 = 7650")
    samples = load(write(tmp_path, head + steps, mass=mass)).experiment.measured.mass
    assert samples is not None
    np.testing.assert_array_equal(samples.iteration, [2, 4])
    with pytest.raises(MeasurementError, match="the history has iterations 1 to 3, not 4"):
        load(write(tmp_path, head + steps, mass=mass + "4,3\n"))
    with pytest.raises(MeasurementError, match="step 2 of the history is a pause"):
        load(write(tmp_path, head + steps, traction="creepage [%],traction ratio,step\n2,0.6,1\n2,0.6,2\n4,0.6,3\n"))


def test_every_command_takes_steps_as_driven(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    steps = """steps = [
  { creepage_percent = 0.5, iterations = 2 },
  { pause_s = 60 },
  { creepage_percent = -1.0, iterations = 2, normal_load_N = 100.0, rolling_speed_m_s = 2.0, yaw_mrad = 1.0 },
  { creepage_percent = 200.0 },
]
"""
    path = write(tmp_path, f"{HEAD}{steps}{TAIL}")
    for name in ("identify-mu", "friction-chart", "simulate-wear", "thermal", "contact", "check"):
        if name != "identify-mu":
            found = command(tmp_path, name, str(path), capsys=capsys)
            assert "NaN" not in json.dumps(found)
    test = load(path)
    again = load_text(dump(test.resolved), path).experiment.history
    np.testing.assert_array_equal(again.load_factor, test.experiment.history.load_factor)
    np.testing.assert_array_equal(again.duration, test.experiment.history.duration)


@pytest.mark.parametrize(
    ("step", "says"),
    [
        ("pause_s = 60, creepage_percent = 1.0", "a pause is a step of its own: { pause_s = 60 }"),
        ("pause_s = 60, iterations = 3", "a pause is a step of its own"),
        ("iterations = 3", "history.steps[1].creepage_percent: is missing; a step has a creepage_percent, or is a"),
        ("creepage_percent = 1.0, mean_speed_rpm = 400, rolling_speed_m_s = 2.0", "mean_speed_rpm is given too"),
        ("creepage_percent = 1.0, normal_load_N = -3", "must be greater than 0, not -3"),
        ("pause_s = 60", "all steps are pauses"),
    ],
)
def test_a_bad_step_is_told(step: str, says: str) -> None:
    other = "pause_s = 5" if says.startswith("all") else "creepage_percent = 1.0"
    with pytest.raises(DefinitionError) as error:
        parse(f"{HEAD}steps = [{{ {step} }}, {{ {other} }}]\n", "t.toml")
    (problem,) = error.value.problems
    assert says in str(problem)
