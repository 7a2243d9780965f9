"""One synthetic test: a rig is drawn, something is hidden in it, and the files are written.

The folder holds what a user would have (test.toml and the measured tables); the truth goes elsewhere.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from .effects import CATALOGUE, NEEDS_STOPS, Draw
from .hidden import Hidden
from .histories import KINDS, draw_rig
from .rig import March, Rig
from .sensors import CHANNELS, Channels, Plan, draw_plan, noise, read
from .sizing import Bench, Ruler
from .unknowns import NEEDS_STOPS as UNKNOWN_NEEDS_STOPS
from .unknowns import UNKNOWN
from .writing import definition, write_tables

BANDS = 40
"""Equal parts of a profile's range for which the true noise is told."""
_RETRIES = 4
_SIGMA = {"traction": (0.0015, 0.02), "profile": (0.03e-6, 0.3e-6), "temperature": (0.03, 0.6)}  # 1, m, K


@dataclass(frozen=True)
class Case:
    """What a test shall hold: hidden effects by name and the size of each in thresholds (0: nothing hidden)."""

    seed: int
    effects: tuple[str, ...] = ()
    size: float = 12.0
    group: str = ""


@dataclass(frozen=True)
class Made:
    """A test as it was made: noiseless and measured.

    Sizes in thresholds, firm sizes beyond the input tolerances, amounts in the effects' own units.
    """

    case: Case
    rig: Rig
    plan: Plan
    kind: str
    sizes: tuple[float, ...]
    firm_sizes: tuple[float, ...]
    amounts: tuple[float, ...]
    hidden: tuple[Hidden, ...]
    clean: Channels = field(default_factory=dict)
    measured: Channels = field(default_factory=dict)
    energy: float = 0.0


def _setting(rng: Generator, effects: tuple[str, ...]) -> tuple[Rig, Plan, str]:
    """Draw the rig and its measurement so that `effects` can show.

    Where nothing of the catalogue is hidden the declared traction law may be FASTSIM and the true one exact; beside a
    hidden effect that would be a second one.
    """
    kind = str(rng.choice(KINDS, p=(0.45, 0.3, 0.25)))
    contact = "hertz" if "half_space_contact" in effects or rng.random() < 0.2 else "half_space"
    law = "exact" if "exact_elasticity" not in effects and rng.random() < 0.25 else "fastsim"
    declared = law if rng.random() < 0.6 or {*effects} & {*CATALOGUE} else "fastsim"
    rig = draw_rig(rng, kind=kind, contact=contact, law=law, declared_law=declared)
    stops = bool({*NEEDS_STOPS, *UNKNOWN_NEEDS_STOPS} & {*effects}) or rng.random() < 0.3
    both = rng.random() < (0.5 if "wear_partition" in effects else 0.1)
    return rig, draw_plan(rng, rig, correlated=rng.random() < 0.35, stops=stops, discs=(1, 2) if both else (2,)), kind


def _law(name: str) -> tuple[str, Draw]:
    """Channel of a hidden effect, and how its shape is drawn."""
    return CATALOGUE[name] if name in CATALOGUE else (UNKNOWN[name][0], UNKNOWN[name][2])


def make(case: Case) -> Made:
    """Draw until the effects reach their size: noise of the channel scaled within limits, else another rig."""
    best: Made | None = None
    for attempt in range(_RETRIES):
        made = _attempt(np.random.default_rng([case.seed, attempt]), case)
        if best is None or _shortfall(made, case) < _shortfall(best, case):
            best = made
        if _shortfall(best, case) < 0.1:
            break
    assert best is not None
    return _measure(np.random.default_rng([case.seed, _RETRIES]), best)


def _shortfall(made: Made, case: Case) -> float:
    return max((1.0 - size / case.size for size in made.sizes), default=0.0)


def _attempt(rng: Generator, case: Case) -> Made:
    rig, plan, kind = _setting(rng, case.effects)
    bench = Bench(rig, plan, March(rig).run())
    drawn = [_law(name)[1](rng, rig, bench.trace) for name in case.effects]
    amounts: tuple[float, ...] = ()
    sizes: tuple[float, ...] = ()
    firm: tuple[float, ...] = ()
    if drawn:
        ruler = Ruler(bench)
        amounts = tuple(ruler.amount(effect, case.size) for effect in drawn)
        shown = [bench.readings([effect.at(amount)]) for effect, amount in zip(drawn, amounts, strict=True)]
        for name, readings in zip(case.effects, shown, strict=True):
            plan = _rescaled(plan, _law(name)[0], ruler.size(readings, plan) / case.size)
        sizes = tuple(ruler.size(readings, plan) for readings in shown)
        firm = tuple(min(ruler.beyond_tolerances(s, plan), size) for s, size in zip(shown, sizes, strict=True))
    hidden = tuple(effect.at(amount) for effect, amount in zip(drawn, amounts, strict=True))
    return Made(case, rig, plan, kind, sizes, firm, amounts, hidden)


def _measure(rng: Generator, made: Made) -> Made:
    """Let the sensors read what happened while the effects acted, marched finely."""
    rig = made.rig.fine()
    trace = March(rig, made.hidden).run()
    clean = read(rig, trace, made.hidden, made.plan)
    measured = {}
    for name in CHANNELS:
        value = clean[name] + noise(rng, made.plan, name, clean[name].size)
        measured[name] = np.round(value / made.plan.quantum[name]) * made.plan.quantum[name]
    return replace(made, clean=clean, measured=measured, energy=trace.energy)


def _rescaled(plan: Plan, channel: str, factor: float) -> Plan:
    """The plan with the noise of `channel` times `factor`, within what sensors have; left alone if it is near 1."""
    if abs(factor - 1.0) < 0.05:
        return plan
    sigma = float(np.clip(plan.sigma[channel] * factor, *_SIGMA[channel]))
    return replace(plan, sigma={**plan.sigma, channel: sigma})


def truth(made: Made) -> dict[str, object]:
    """What was hidden, for the score and for people; never for the loop."""
    unknown = [name for name in made.case.effects if name in UNKNOWN]
    what: object = list(made.case.effects)
    if unknown:
        channel, covariates, _ = UNKNOWN[unknown[0]]
        what = f"unexplained:{channel}:{covariates[0]}"
    return {
        "truth": what,
        "group": made.case.group,
        "alternatives": [],
        "kind": unknown[0] if unknown else None,
        "covariates": list(UNKNOWN[unknown[0]][1]) if unknown else [],
        "sizes": list(made.sizes),
        "sizes_beyond_tolerances": list(made.firm_sizes),
        "amounts": list(made.amounts),
        "target_size": made.case.size if made.case.effects else 0.0,
        "declared_contact": made.rig.contact,
        "declared_traction": made.rig.declared_law,
        "true_traction": made.rig.law,
        "tolerated": [] if made.rig.law == made.rig.declared_law else ["exact_elasticity"],
        "history": made.kind,
        "seed": made.case.seed,
        "mu0": made.rig.mu,
        "K": made.rig.wear,
        "hS": made.rig.convection,
        "sigma": made.plan.sigma,
        "rho": made.plan.rho,
        "outliers": made.plan.outliers,
        "noise": _true_noise(made),
        "iterations": list(made.rig.iterations),
        "depth_um": -1e6 * float(made.clean["profile"].min()),
        "energy_kJ": 1e-3 * made.energy,
    }


def _true_noise(made: Made) -> dict[str, object]:
    """The noise that was added, as samples and sum of squares: of each iteration in 1 and K, of each band in um2."""
    noise: dict[str, object] = {}
    for name in CHANNELS:
        squares = (made.measured[name] - made.clean[name]) ** 2
        if name == "profile":
            y, squares = made.plan.y, 1e12 * squares
            band = np.floor(BANDS * (y - y.min()) / np.ptp(y)).astype(int)
            part = np.tile(band, squares.size // y.size)
        else:
            part = (made.plan.time(name) / made.rig.duration).astype(int)
        count, total = np.bincount(part), np.bincount(part, squares)
        noise[name] = [[int(n), float(s)] for n, s in zip(count, total, strict=True)]
    return noise


def make_test(case: Case, folder: Path, truth_file: Path) -> Made:
    """Make a test: test.toml and the measured tables in `folder`, the truth in `truth_file`, elsewhere."""
    made = make(case)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "test.toml").write_text(definition(made.rig, folder.name))
    write_tables(folder, rig=made.rig, plan=made.plan, measured=made.measured)
    truth_file.parent.mkdir(parents=True, exist_ok=True)
    truth_file.write_text(json.dumps(truth(made), indent=1) + "\n")
    return made
