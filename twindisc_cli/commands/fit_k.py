"""fit-k: the wear coefficient from the measured profile, and what worn volume and energy allow (Figs. 11, 14).

    W = K E / H     K, per dissipated energy E, as everywhere in the program (Eqs. 12, 13)
    W = k N s / H   Archard's k, per load and distance slid: K times the mean T/N

K errs as E does, which errs as T/N: its samples scatter, and the zero of the torque has an error of its own.
Where the discs were weighed, K also, or only, from the mass they lost. A second figure shows how far K moves with
what the test does not say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from twindisc_cli.commands._base import friction_of_steps
from twindisc_cli.consistency import contradictions
from twindisc_cli.definition import Test
from twindisc_cli.errors import ValidityError
from twindisc_cli.identify.known_k import KnownK, known_from_mass, known_from_profile
from twindisc_cli.identify.least_squares import NINETY
from twindisc_cli.identify.mass import MassFit, identify_from_mass
from twindisc_cli.identify.regimes import Regime, regimes_of_logarithms
from twindisc_cli.identify.sensitivity import Variation, sensitivity
from twindisc_cli.identify.steps import energy_of_steps
from twindisc_cli.identify.wear import WearFit, identify_wear
from twindisc_cli.model.experiment import Experiment
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.report.words import listed, p_value, regimes_text, with_error
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null

if TYPE_CHECKING:
    from matplotlib.figure import Figure

APART = 1.5
"""The volumes of profile and mass contradict each other beyond this factor and three standard errors."""
MOST_REPORTED = 4
IMPOSSIBLE = 3.0
"""A stated K this many times off what W H / E allows is called impossible."""


def run(test: Test) -> Result:
    """Find K of a test."""
    experiment = test.experiment
    model = ForwardModel(experiment)
    friction = friction_of_steps(model)
    error = friction.error_of(energy_of_steps(model, friction.mu))
    mass = None
    if experiment.measured.mass is not None:
        mass = identify_from_mass(model, friction.mu).with_energy_error(error)
    stated = _stated(experiment)
    if mass is not None and experiment.measured.profile is None:
        return _by_weight(experiment, mass, known_from_mass(mass, stated))
    fit = identify_wear(model, friction.mu).with_energy_error(error)
    if not fit.bisection.converged:
        none = (
            f"no K from {fit.bisection.bracket[0]:.2g} to {fit.bisection.bracket[1]:.2g} makes the simulated depth "
            f"{fit.measured.depth * 1e6:.3g} µm to within 1 %"
        )
        raise ValidityError([none, *contradictions(experiment)])
    known, varied = known_from_profile(fit, mass, stated), sensitivity(model, fit)
    return Result(
        command="fit-k",
        summary=(
            *_lines_of(known),
            *_archard_line(known[0], fit),
            *_summary(fit),
            *_varied_line(varied),
            *_mass_lines(mass),
            *_findings(fit, stated, mass),
            *contradictions(experiment),
        ),
        json={
            **_json(fit, stated, mass),
            **_known_json(known),
            **_of_discs(experiment, fit, known[0]),
            "sensitivity": [{"changed": v.what, "K": v.wear_coefficient, "change": v.change} for v in varied],
        },
        dataset=_dataset(fit, varied),
        figure=lambda: _figure(experiment, fit, known, mass),
        figures={"fit-k-sensitivity": lambda: _varied_figure(experiment, fit, varied)} if varied else {},
    )


def _of_discs(test: Experiment, fit: WearFit, use: KnownK) -> dict[str, Any]:
    """Archard's own coefficient, and K of each disc where the declared effects share the wear out; 90 % intervals."""
    ends = (("", use.value), ("_low", use.low), ("_high", use.high))
    archard = {f"archard_k{end}": or_null(k * fit.archard) for end, k in ends}
    if fit.part == 1.0:
        return archard
    rig, second = test.rig, fit.part if fit.disc == 2 else 1.0 - fit.part
    resists = float(rig.disc1.hardness * rig.track_radius(1) / (rig.disc2.hardness * rig.track_radius(2)))
    parts = {"1": (1.0 - second) * resists, "2": second}
    discs = {f"K_of_discs{end}": or_null({disc: k * part for disc, part in parts.items()}) for end, k in ends}
    return discs | archard


def _archard_line(use: KnownK, fit: WearFit) -> tuple[str, ...]:
    """Archard's own coefficient beside K."""
    k = with_error(use.value * fit.archard, use.std * fit.archard)
    return (f"K is per dissipated energy, W = K E / H; Archard's k of W = k N s / H: {k} (mean T/N {fit.archard:.3g})",)


def _varied_line(varied: list[Variation]) -> tuple[str, ...]:
    """What moves K most."""
    if not varied:
        return ()
    most = sorted(varied, key=lambda variation: -abs(variation.change))[:MOST_REPORTED]
    return (f"what moves K most: {listed([f'{v.what} {100.0 * v.change:+.0f} %' for v in most])}",)


def _varied_figure(test: Experiment, fit: WearFit, varied: list[Variation]) -> Figure:
    from twindisc_cli.figures.wear import varied as drawn

    return drawn(varied, k=fit.bisection.wear_coefficient, name=test.name, provenance=test.measured.provenance)


def _stated(test: Experiment) -> dict[str, float]:
    """K given in the definition, by where it is from."""
    given = {"declared": test.options.wear_coefficient, "reported": test.reported.get("wear_coefficient", np.nan)}
    return {what: value for what, value in given.items() if np.isfinite(value)}


def _by_weight(test: Experiment, mass: MassFit, known: list[KnownK]) -> Result:
    """K of a test whose discs were weighed and not measured."""
    rows = (
        ("weighed_volume", mass.volume, "m3", "volume worn off the discs weighed", False),
        ("volume", mass.predicted, "m3", "the same at K", False),
        ("weighed_volume_error", mass.error, "m3", "standard error of the weighed volume", True),
        ("energy", mass.energy, "J", "energy dissipated so far", False),
    )
    return Result(
        command="fit-k",
        summary=(*_lines_of(known), *_mass_lines(mass), *contradictions(test)),
        json={**_mass_json(mass), "method": "mass", **_known_json(known)},
        dataset=Dataset(
            axes=(Axis("weighing", mass.iteration, "1", "iterations completed when the discs were weighed"),),
            arrays=tuple(Array(name, ("weighing",), v, unit, what, optional) for name, v, unit, what, optional in rows),
            attrs={"K": mass.wear_coefficient, "method": "mass"},
        ),
        figure=lambda: _weighed_figure(test, mass),
    )


def _weighed_figure(test: Experiment, mass: MassFit) -> Figure:
    from twindisc_cli.figures.mass import weighed

    return weighed(mass, _regimes(mass), name=test.name, provenance=test.measured.provenance)


def _regimes(mass: MassFit) -> list[Regime]:
    """The regimes of the wear rate [ug/m/mm2] over T gamma / A [N/mm2], as logarithms; of disc 2 if weighed."""
    rates = mass.rates
    shown = rates.disc == rates.disc.max(initial=0)
    return regimes_of_logarithms(rates.index[shown] * 1e-6, rates.rate[shown] * 1e3)


def _mass_json(mass: MassFit) -> dict[str, Any]:
    rows = zip(mass.iteration, mass.volume, mass.predicted, mass.energy, strict=True)
    return {
        "K": mass.wear_coefficient,
        "K_std": or_null(mass.std),
        "weighings_missed": {
            "rms_over_uncertainty": or_null(mass.in_errors),
            "p_value": or_null(mass.p_value),
            "rms_over_largest": or_null(mass.in_total),
            "one_K_describes_them": mass.is_one_k,
        },
        "K_of_discs": {str(disc): k for disc, (k, _) in mass.of_disc.items()},
        "K_of_discs_low": {str(disc): or_null(max(k - NINETY * s, 0.0)) for disc, (k, s) in mass.of_disc.items()},
        "K_of_discs_high": {str(disc): or_null(k + NINETY * s) for disc, (k, s) in mass.of_disc.items()},
        "wear_rates": [
            {"disc": int(disc), "Tgamma_over_A_N_mm2": index * 1e-6, "wear_rate_ug_m_mm2": rate * 1e3}
            for disc, index, rate in zip(mass.rates.disc, mass.rates.index, mass.rates.rate, strict=True)
        ],
        "regimes_from_N_mm2": [float(np.exp(regime.low)) for regime in _regimes(mass)[1:]],
        "weighings": [
            {"iteration": i, "volume_mm3": v * 1e9, "predicted_volume_mm3": p * 1e9, "dissipated_energy_kJ": e * 1e-3}
            for i, v, p, e in rows
        ],
    }


def _mass_lines(mass: MassFit | None) -> tuple[str, ...]:
    if mass is None:
        return ()
    lines = [f"by weight {mass.volume[-1] * 1e9:.3g} mm³ were worn off", *_missed(mass)]
    result = _regimes(mass)
    if len(result) > 1:
        lines.append(f"the wear rate has {regimes_text(result)}")
    return tuple(lines)


def _missed(mass: MassFit) -> tuple[str, ...]:
    """How far the weighings are off one K, and a warning where it does not describe them."""
    if len(mass.volume) < 2:
        return ()
    of_total = f"{100.0 * mass.in_total:.2g} % of the largest"
    line = f"one K misses the {len(mass.volume)} weighings by {of_total} (root mean square)"
    if np.isfinite(mass.in_errors):
        chance = f"1 is expected, {p_value(mass.p_value)} by chi-squared"
        line += f", {mass.in_errors:.2g} times their uncertainty ({chance})"
    if mass.is_one_k:
        return (line,)
    times = mass.times_predicted
    return (
        line,
        f"warning: one K does not describe these weighings: {len(times)} of {len(mass.volume)} are off it by more than "
        f"their error, and weigh {times.min():.2g} to {times.max():.2g} times what it predicts; K is not the same "
        "throughout the test (close-loop looks for the cause)",
    )


def _json(fit: WearFit, stated: dict[str, float], mass: MassFit | None) -> dict[str, Any]:
    return {
        "K": fit.wear_coefficient,
        "K_std": fit.std,
        "method": fit.method,
        "K_bisection": fit.bisection.wear_coefficient,
        "K_least_squares": fit.least_squares.value,
        "K_least_squares_std": fit.least_squares.std,
        "K_from_volume_and_energy": fit.allowed,
        "bisection": [{"K": k, "Er_percent": error} for k, error in fit.bisection.trail],
        "bracket": list(fit.bisection.bracket),
        "depth_um": fit.simulated.depth * 1e6,
        "measured_depth_um": fit.measured.depth * 1e6,
        "width_mm": fit.simulated.width * 1e3,
        "measured_width_mm": fit.measured.width * 1e3,
        "profile_rms_um": fit.rms * 1e6,
        "dissipated_energy_kJ": fit.energy * 1e-3,
        "part_of_wear": fit.part,
        "stated": {what: {"K": k, "times_allowed": k / fit.allowed} for what, k in stated.items()},
        "findings": list(_findings(fit, stated, mass)),
        **({"mass": _mass_json(mass)} if mass else {}),
    }


def _findings(fit: WearFit, stated: dict[str, float], mass: MassFit | None) -> tuple[str, ...]:
    """Every stated K that worn volume and dissipated energy contradict, and a mass that contradicts the profile."""
    weighed = mass.of_disc.get(fit.disc, (mass.wear_coefficient * fit.part,))[0] if mass else fit.allowed * fit.part
    apart = weighed / (fit.allowed * fit.part)
    error = float(np.nan_to_num(mass.std)) / fit.allowed if mass else 0.0
    contradicts = not 1.0 / APART < apart < APART and abs(apart - 1.0) > 3.0 * error
    message = (
        (f"contradiction: K by weight is {apart:.2g} times what the volume of the profile allows",)
        if contradicts
        else ()
    )
    return message + tuple(
        f"impossible: the {what} K = {k:.3g} is {k / fit.allowed:.2g} times the {fit.allowed:.2g} that worn volume and "
        "dissipated energy allow"
        for what, k in stated.items()
        if not 1.0 / IMPOSSIBLE < k / fit.allowed < IMPOSSIBLE
    )


def _lines_of(known: list[KnownK]) -> tuple[str, ...]:
    """The K to use, whether it is fixed at all, and every other with the reason why it differs."""
    use = known[0]
    level = "one standard deviation" if np.isfinite(use.std) else "no ±: one weighing without an uncertainty"
    others = [f"  {k.name:<18} {with_error(k.value, k.std):<20} {k.why}" for k in known[1:]]
    return (
        f"use K = {with_error(use.value, use.std)} ({level}), by {use.name.removeprefix('by ')}: {use.why}",
        *(("warning: the 90 % interval of K is as wide as K itself: these data hardly fix it",) if use.is_wide else ()),
        *(("the others, and why they differ:", *others) if others else ()),
    )


def _known_json(known: list[KnownK]) -> dict[str, Any]:
    use = known[0]
    return {
        "K_low": or_null(use.low),
        "K_high": or_null(use.high),
        "interval_percent": 90.0,
        "K_known": [
            {
                "name": k.name,
                "K": k.value,
                "K_std": or_null(k.std),
                "use": k.use,
                "from_data": k.from_data,
                "why": k.why,
            }
            for k in known
        ],
    }


def _summary(fit: WearFit) -> tuple[str, ...]:
    return (
        f"depth {fit.simulated.depth * 1e6:.3g} µm (measured {fit.measured.depth * 1e6:.3g}), "
        f"width {fit.simulated.width * 1e3:.3g} mm (measured {fit.measured.width * 1e3:.3g}), "
        f"{len(fit.bisection.trail)} simulations of the bisection, dissipated energy {fit.energy * 1e-3:.3g} kJ",
    )


def _figure(test: Experiment, fit: WearFit, known: list[KnownK], mass: MassFit | None) -> Figure:
    from twindisc_cli.figures.wear import fitted

    weighed = (mass, _regimes(mass)) if mass else None
    return fitted(fit, known=known, weighed=weighed, name=test.name, provenance=test.measured.provenance)


def _dataset(fit: WearFit, varied: list[Variation]) -> Dataset:
    k, error = np.array(fit.bisection.trail).T
    return Dataset(
        axes=(
            Axis("y", fit.y, "m", "position across the track"),
            Axis("trial", np.arange(1, len(k) + 1), "1", "number of the bisection"),
            *([Axis("changed", np.array([v.what for v in varied], dtype=object), "1", "changed")] if varied else []),
        ),
        arrays=(
            Array("measured_height", ("y",), fit.height, "m", "measured height change"),
            Array("height", ("y",), fit.simulated_height, "m", "simulated height change"),
            Array("least_squares_height", ("y",), fit.squares_height, "m", "height change at the least-squares K"),
            Array("bisection_K", ("trial",), k, "1", "wear coefficient tried"),
            Array("bisection_Er", ("trial",), error / 100.0, "1", "depth error of Eq. 17"),
            *(
                [
                    Array("changed_K", ("changed",), np.array([v.wear_coefficient for v in varied]), "1", "K of depth"),
                    Array("change_of_K", ("changed",), np.array([v.change for v in varied]), "1", "share of K"),
                ]
                if varied
                else []
            ),
        ),
        attrs={
            "K": fit.wear_coefficient,
            "K_std": fit.std,
            "method": fit.method,
            "K_allowed": fit.allowed,
            "archard_k": fit.wear_coefficient * fit.archard,
            "dissipated_energy_J": fit.energy,
            "load_times_distance_slid_N_m": fit.sliding,
        },
    )
