"""From a diagnosis to the arrays of close-loop.h5: curves, explanations tried, estimates and errors."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.diagnosis import CandidateResult, ChannelError, Curve, Diagnosis, Estimate, FoundLaw
from twindisc_cli.quantities import unit_named
from twindisc_cli.results import Array, Axis, Dataset

ERRORS = ("noise", "before", "after", "held_out_before", "held_out_after", "before_step_mu")
ESTIMATES = ("value", "std", "low", "high")


def dataset_of(diagnosis: Diagnosis) -> Dataset:
    """All numbers of a diagnosis."""
    several = len({curve.test for curve in diagnosis.curves}) > 1
    axes = [
        Axis("error_kind", np.array(ERRORS, dtype=object), "1", "kind of error"),
        Axis("estimate_kind", np.array(ESTIMATES, dtype=object), "1", "value, standard deviation, 90 % interval"),
        Axis("candidate", np.arange(1, len(diagnosis.tried) + 1), "1", "explanation tried"),
    ]
    arrays = [_error(channel, "", error) for channel, error in diagnosis.errors.items()]
    if diagnosis.validation is not None:
        arrays += [_error(channel, "validation_", e) for channel, e in diagnosis.validation.errors.items()]
    arrays += [_estimate(f"base_{name}", e, f"base parameter {name}") for name, e in diagnosis.base.items()]
    for term in diagnosis.terms:
        for key, estimate in term.parameters.items():
            arrays.append(_estimate(f"{term.name}_{key}", estimate, f"parameter {key} of {term.name}"))
    for result in diagnosis.laws:
        over = result.law.over.quantity
        axes.append(Axis(f"{result.name}_place", over.shown.to_si(result.curve.at), over.si, over.label))
        arrays += _law(result)
    arrays += _candidates(diagnosis.tried)
    numbers: dict[str, int] = {}
    for curve in diagnosis.curves:
        number = numbers.setdefault(curve.test, len(numbers) + 1)
        prefix = f"{curve.channel}_{number}" if several else curve.channel
        axes.append(Axis(f"{prefix}_sample", np.arange(len(curve.measured)), "1", f"{curve.channel} of {curve.test}"))
        arrays += _curve(curve, prefix)
    tests = {f"test_{number}": name for name, number in numbers.items()} if several else {}
    return Dataset(tuple(axes), tuple(arrays), {"verdict": diagnosis.verdict, **tests})


def _error(channel: str, prefix: str, error: ChannelError) -> Array:
    values = np.array([getattr(error, kind) for kind in ERRORS]) / channels()[channel].factor
    what, unit = "root mean square of measured minus model", channels()[channel].quantity.si
    return Array(f"{prefix}{channel}_error", ("error_kind",), values, unit, what, True)


def _estimate(name: str, estimate: Estimate, what: str) -> Array:
    values = np.array([getattr(estimate, kind) for kind in ESTIMATES])
    return Array(re.sub(r"\W+", "_", name).strip("_"), ("estimate_kind",), values, estimate.unit, what, True)


def _law(law: FoundLaw) -> list[Array]:
    """A law over its covariate with its 90 % band."""
    act = "factor on" if law.law.of.kind == "factor" else "shift of"
    unit = unit_named(law.law.of.unit)
    return [
        Array(f"{law.name}_{key}", (f"{law.name}_place",), unit.to_si(getattr(law.curve, key)), unit.si,
              f"{act} {law.law.of.label}, {what}")
        for key, what in (("value", "learnt"), ("low", "5 % quantile"), ("high", "95 % quantile"))
    ]  # fmt: skip


def _candidates(tried: Sequence[CandidateResult]) -> list[Array]:
    """One entry for each term tried in the place of another."""
    texts = {
        "channel": ("channel it shows in first", [t.channel for t in tried]),
        "label": ("effect, or quantity over covariate", [str(t.term) for t in tried]),
        "replaces": ("the term in whose place it was tried", [t.replaces for t in tried]),
        "at_bound": ("parameters that ran into a bound", [" ".join(t.at_bound) for t in tried]),
        "refused": ("why it is not the answer", [t.why_not for t in tried]),
    }
    numbers = {
        "gain": "fall of chi squared over no term in this place",
        "evidence": "log evidence relative to the answer",
        "probability": "share of resamples in which it is chosen, weighed by evidence",
        "chosen": "whether it is in the answer",
    }
    return [
        *(
            Array(f"candidate_{key}", ("candidate",), np.array(values, dtype=object), "1", what)
            for key, (what, values) in texts.items()
        ),
        *(
            Array(
                f"candidate_{key}", ("candidate",), np.array([float(getattr(t, key)) for t in tried]), "1", what, True
            )
            for key, what in numbers.items()
        ),
    ]


def _curve(curve: Curve, prefix: str) -> list[Array]:
    """Measured, before and after, what was held out or kept, and the covariates of one channel of one test."""
    dims, channel = (f"{prefix}_sample",), channels()[curve.channel]
    unit = channel.quantity.si
    what = {
        "measured": "measured",
        "before": "model before",
        "after": "model after",
        "unseen_before": "model before, fitted without the samples held out",
        "unseen_after": "model after, found without the samples held out",
    }
    marks = {"held_out": "held out to judge the answer that is found without them", "kept": "not an outlier"}
    return [
        *(
            Array(f"{prefix}_{key}", dims, getattr(curve, key), unit, text, key.startswith("unseen"))
            for key, text in what.items()
        ),
        *(Array(f"{prefix}_{key}", dims, getattr(curve, key), "1", text) for key, text in marks.items()),
        *(
            Array(f"{prefix}_at_{over.key}", dims, np.asarray(values), over.si, over.long_name, True)
            for name, values in curve.covariates.items()
            for over in (channel.covariate(name),)
        ),
    ]
