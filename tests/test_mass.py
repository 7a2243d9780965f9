"""Weighed mass: K from it, beside and without a profile, made here from closed forms in full sliding."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from definitions import changed, write
from test_rig_log import SLIDING

from twindisc_cli.commands import check, fit_k, simulate_wear
from twindisc_cli.definition import Test, load
from twindisc_cli.errors import DefinitionError, MeasurementError, ValidityError
from twindisc_cli.model.forward import ForwardModel

MU, LOAD, SPEED, HARDNESS, DENSITY, K = 0.5, 72.0, 0.03 * 100 * np.pi, 700 * 9.80665e6, 7650.0, 8e-5
TEXT = SLIDING.replace("friction_coefficient = 0.6", "friction_coefficient = 0.5").replace(
    "hardness_HV = 700", "hardness_HV = 700\ndensity_kg_m3 = 7650"
)
CREEPAGE = np.array([0.02, 0.02, 0.04, 0.04, 0.06])


def loss(iteration: int, k: float = K) -> float:
    """m = rho K E / H with E = mu N V v t [mg]."""
    energy = MU * LOAD * SPEED * 84.0 * float(CREEPAGE[:iteration].sum())
    return DENSITY * k * energy / HARDNESS * 1e6


def weighings(*rows: tuple[float, ...], more: str = "") -> str:
    return f"iteration,mass loss [mg]{more}\n" + "".join(",".join(f"{v:.9g}" for v in row) + "\n" for row in rows)


def facet(k: float = K) -> str:
    """The profile of a chord whose section is what K wears off: w^3 = 12 S R."""
    section = loss(5, k) * 1e-6 / DENSITY / (2 * np.pi * 0.03)
    half = 0.5 * np.cbrt(12 * section * 0.03)
    y = np.linspace(-2e-3, 2e-3, 801)
    height = np.minimum(y**2 - half**2, 0.0) / 0.06
    return "y [mm],height [um]\n" + "".join(f"{a * 1e3:.4f},{b * 1e6:.6f}\n" for a, b in zip(y, height, strict=True))


def test(folder: Path, text: str = TEXT, **data: str) -> Test:
    return load(write(folder, text, **data))


test.__test__ = False  # type: ignore[attr-defined]


def test_a_trial_that_wears_far_more_than_was_weighed_ends_in_no_error(tmp_path: Path) -> None:
    """Contacts are followed to four times what the balance shows by the end of the history, as with a profile."""
    model = ForwardModel(test(tmp_path, mass=weighings((2, loss(2)), (4, loss(4)))).experiment)
    section = loss(5) * 1e-6 / DENSITY / (2 * np.pi * 0.03)
    assert model.reach == pytest.approx(4.0 * section, rel=1e-6)
    assert np.isfinite(model.predict({"mu": np.array([MU]), "K": np.array([1e5 * K])}).section).all()


def test_k_is_found_from_mass_alone(tmp_path: Path) -> None:
    mass = weighings((2, loss(2)), (4, loss(4)), (5, loss(5)))
    found = fit_k.run(test(tmp_path, mass=mass))
    assert found.json["K"] == pytest.approx(K, rel=2e-3)
    assert [row["volume_mm3"] for row in found.json["weighings"]] == pytest.approx(
        [loss(n) / DENSITY * 1e3 for n in (2, 4, 5)]
    )
    assert found.undefined == []
    assert "measured data" in [text.get_text() for text in found.figure().texts]
    worn = simulate_wear.run(test(tmp_path, mass=mass)).json
    assert worn["wear_coefficient_source"] == "from the weighed mass"
    assert worn["worn_volume_mm3"] == pytest.approx(loss(5) / DENSITY * 1e3, rel=2e-3)


def test_a_weighing_has_the_number_of_iterations_that_was_written_down(tmp_path: Path) -> None:
    """A pause is no iteration."""
    paused = TEXT.replace("steps = [", "steps = [\n  { pause_s = 60 },")
    found = fit_k.run(test(tmp_path, paused, mass=weighings((2, loss(2)), (5, loss(5)))))
    assert [row["iteration"] for row in found.json["weighings"]] == [2, 5]
    assert found.dataset.axes[0].values.tolist() == [2, 5]
    history = test(tmp_path, paused).experiment.history
    for course in (history, replace(history, per_iteration=2100.0), replace(history, per_iteration=4200.0)):
        iteration = np.array([2, 4]) if course.per_iteration != 2100.0 else np.array([4, 8])
        assert course.completed(course.entry(iteration)).tolist() == iteration.tolist()


def test_losses_from_step_to_step_are_said(tmp_path: Path) -> None:
    mass = weighings((2, loss(2)), (4, loss(2)), (5, loss(1)))
    (said,) = [line for line in fit_k.run(test(tmp_path, mass=mass)).summary if line.startswith("contradiction")]
    assert "a mass loss counts from the beginning of the test" in said


def test_the_error_of_k_is_that_of_the_scale(tmp_path: Path) -> None:
    # one weighing of 2 % gives a K of 2 %; without its uncertainty nothing is known of the error
    one = fit_k.run(test(tmp_path, mass=weighings((5, loss(5), 0.02 * loss(5)), more=",uncertainty [mg]"))).json
    assert one["K_std"] == pytest.approx(0.02 * K, rel=1e-2)
    assert fit_k.run(test(tmp_path, mass=weighings((5, loss(5))))).json["K_std"] is None
    misses = []
    for seed in range(20):
        noise = 0.02 * loss(5) * np.random.default_rng(seed).standard_normal(3)
        rows = ((n, loss(n) + e, 0.02 * loss(5)) for n, e in zip((2, 4, 5), noise, strict=True))
        found = fit_k.run(test(tmp_path, mass=weighings(*rows, more=",uncertainty [mg]"))).json
        misses.append((found["K"] - K) / found["K_std"])
    assert 0.5 < np.sqrt(np.mean(np.square(misses))) < 1.4


def test_weighings_that_one_k_does_not_describe_are_reported(tmp_path: Path) -> None:
    def lines(*times: float) -> str:
        rows = ((n, t * loss(n), 0.02 * loss(5)) for n, t in zip((2, 4, 5), times, strict=True))
        return "\n".join(fit_k.run(test(tmp_path, mass=weighings(*rows, more=",uncertainty [mg]"))).summary)

    steady, jumps = lines(1.0, 1.0, 1.0), lines(0.3, 1.0, 1.8)
    assert "one K misses the 3 weighings by" in steady and "warning" not in steady
    assert "warning: one K does not describe these weighings" in jumps and "p < 0.001 by chi-squared" in jumps


def test_both_discs_are_weighed(tmp_path: Path) -> None:
    # all that wore off is shared 30 to 70; no effect has to say so
    rows = [(n, share * loss(n), disc) for disc, share in ((1, 0.3), (2, 0.7)) for n in (2, 5)]
    assert fit_k.run(test(tmp_path, mass=weighings(*rows, more=",disc"))).json["K"] == pytest.approx(K, rel=2e-3)
    second = TEXT + "\n[effects.wear_partition]\ndisc1_share = 0.3\n"
    only = weighings(*rows[2:], more=",disc")
    assert fit_k.run(test(tmp_path, second, mass=only)).json["K"] == pytest.approx(K, rel=2e-3)
    first = weighings(*rows[:2], more=",disc")
    assert fit_k.run(test(tmp_path, second, mass=first)).json["K"] == pytest.approx(K, rel=2e-3)
    of_first = "\n".join(f"{row},{own}" for row, own in zip(facet().splitlines(), ["disc", *801 * "1"], strict=True))
    for data in ({"mass": first}, {"profile": of_first}):
        with pytest.raises(ValidityError, match="declare wear_partition"):
            fit_k.run(test(tmp_path, **data))


@pytest.mark.parametrize(("factor", "agree"), [(1.0, True), (2.0, False)])
def test_mass_and_profile_agree_or_contradict(tmp_path: Path, factor: float, agree: bool) -> None:
    mass = weighings((5, factor * loss(5), 0.01 * loss(5)), more=",uncertainty [mg]")
    both = test(tmp_path, mass=mass, profile=facet())
    found = fit_k.run(both)
    assert found.json["mass"]["K"] == pytest.approx(factor * K, rel=2e-3)
    assert found.json["K_from_volume_and_energy"] == pytest.approx(K, rel=0.01)
    assert any("by weight" in line for line in found.summary)
    assert any("contradiction: K by weight is 2" in finding for finding in found.json["findings"]) is not agree
    outcome = {f.subject: f for f in check.findings(both.experiment)}["the mass loss of disc 2"]
    assert outcome.ok is agree
    assert outcome.value == pytest.approx(factor * loss(5))
    assert outcome.high == pytest.approx(1.2 * loss(5) + 2 * 0.01 * loss(5), rel=1e-3)


@pytest.mark.parametrize(
    ("mass", "says"),
    [
        (weighings((6, 1.0)), "mass.csv:2: iteration: the history has iterations 1 to 5, not 6"),
        (weighings((5, 1.0), (2, 0.5)), "mass.csv:3: iteration: iteration 2 is not after the row before"),
        (weighings((2, 1.0, 3), more=",disc"), "mass.csv:2: disc: there is no disc 3; it is 1 or 2"),
        (weighings((5, -1.0)), "mass.csv:2: mass loss [mg]: the discs grow heavier: a mass loss is positive"),
        (weighings((5, 900.0)).replace("[mg]", "[g]"), "mass.csv:2: mass loss [g]: 900 g is not wear; check the unit"),
        (weighings((5, 9.0)).replace("[mg]", "[volt]"), "unknown unit [volt] for mass; known: mg, ug, g, kg"),
        (weighings((2, 1.0), (5, 0.0)), "nothing was worn off by weight"),
    ],
)
def test_a_bad_mass_is_told(tmp_path: Path, mass: str, says: str) -> None:
    with pytest.raises(MeasurementError) as error:
        fit_k.run(test(tmp_path, mass=mass))
    assert says in str(error.value)


def test_a_mass_needs_a_density(tmp_path: Path) -> None:
    with pytest.raises(DefinitionError, match=r"material.density_kg_m3: is missing"):
        test(tmp_path, changed(), mass=weighings((5, 1.0)))
