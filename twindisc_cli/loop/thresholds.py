"""The calibrated numbers of the closed loop, each with its meaning, where it is from, and what moving it costs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """What counts as noise, as tolerance, as found. Seeds are those of the public score's development sets.

    tolerated_effects   effect, parameter and one standard deviation of what inputs may be off by without being a
                        finding: traction stiffness and load to 0.7 % (calibration of twin-disc rigs). Larger ones hide
                        small effects of the operation, smaller ones name the rig's own tolerances as effects.
    step_creepage       error that the creepage of each step may have on its own, relative and absolute (encoders).
    transverse_radius   relative tolerance of the crown where the definition gives none (grinding).
    youngs_modulus      the same of Young's modulus (handbooks of bearing and rail steels).
    formulas            families of curves that a learnt law is chosen from: what the choice costs.
    """

    tolerated_effects: tuple[tuple[str, str, float], ...] = (
        ("third_body_layer", "slope_ratio", -0.007),
        ("load_error", "error_percent", 0.7),
    )
    step_creepage: tuple[float, float] = (0.003, 6e-6)
    transverse_radius: float = 0.005
    youngs_modulus: float = 0.005
    formulas: int = 9
    forms: int = 2
    enough: float = 5.0
    law_enough: float = 6.0
    law_seen: float = 1.5
    within: float = 3.0
    cooling: float = 0.02
    most_terms: int = 4
    tried: int = 7
    drop: float = 3.0
    hopeful: float = 0.3
    curve_steps: int = 12
    scan: int = 17
    rivals: int = 10
    draws: int = 100
    rise: float = 0.01
    rise_at_most: float = 0.2
    rise_errors: float = 2.5
    fewest_judged: int = 6
    judged_blocks: int = 12
    alarm: float = 0.002
    refusal: float = 0.002
    short: float = 0.2
    covariates: int = 2
    spare_stops: int = 3
    alike: float = 0.97
    resembles: float = 0.5
    rival_share: float = 0.05
    established: float = 0.9
    probable: float = 0.6
    separated: int = 4
    most_refused: int = 4
    blocks: int = 30
    block_samples: int = 8


THRESHOLDS = Thresholds()
