"""Errors on samples that were removed from the data before anything was done with them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.explain import Outcome, explain
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.holdout import without
from twindisc_cli.loop.judge import predicted
from twindisc_cli.loop.validate import predict_test
from twindisc_cli.model.experiment import Experiment, TractionSamples
from twindisc_cli.model.forward import ForwardModel
from twindisc_cli.model.prediction import Prediction

from .answers import silent
from .student import Predict, gaussian_process, student

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Errors:
    """Root mean square errors of one split of a record, and what was chosen.

    loop, base: of the traction, with what the loop found and with the base model alone; student: the best of eight
    laws; average: all of them with their Akaike weights; process: the Gaussian process. warm: of the temperature by
    the loop and by the base model, where it was measured [K]. level: of loop and student where the level of each test
    is known, NaN of a single one. seconds: processor time of the loop.
    """

    record: str
    split: str
    base: float
    loop: float
    student: float
    average: float
    process: float
    named: tuple[str, ...]
    chosen: str
    seconds: float
    warm: tuple[float, float] = (np.nan, np.nan)
    level: tuple[float, float] = (np.nan, np.nan)


def of_split(record: str, test: Experiment, split: str, masks: Mapping[str, Mask]) -> Errors:
    """Learn without the samples of the masks, and predict these."""
    found, seconds = _learnt([without(test, masks)])
    whole = replace(found.problem.cases[0], model=ForwardModel(test))
    misses = {}
    for channel, mask in masks.items():
        for kind, fits in _kinds(found):
            rows = np.array([_missed(test, whole.model, predicted(f, [whole])[0], channel) for f in fits])
            weights = _weights(found, kind, channel, predicted(found.judged.before, [whole])[0], whole.model)
            misses[kind, channel] = np.sum(weights * rows, axis=0)[mask]
    creepage, when, ratio = _columns(_traction(test), masks["traction"])
    beside = _beside(_columns(_traction(test), ~masks["traction"]))
    error = {kind: rms(ratio - predict(creepage, when)) for kind, predict in beside.predict.items()}
    error |= {kind: rms(misses[kind, "traction"]) for kind in ("base", "loop")}
    warm = {kind: rms(misses.get((kind, "temperature"), np.empty(0))) for kind in ("loop", "base")}
    return Errors(record, split, **error, named=named(found), chosen=beside.chosen, seconds=seconds,
                  warm=(warm["loop"], warm["base"]))  # fmt: skip


def of_group(record: str, tests: Sequence[Experiment], learnt: Sequence[int]) -> Errors:
    """Learn on some tests of a group, predict the others; the student pools the samples of the tests he learns on."""
    found, seconds = _learnt([tests[i] for i in learnt])
    pooled = [_columns(_traction(tests[i])) for i in learnt]
    beside = _beside(tuple(np.concatenate(column) for column in zip(*pooled, strict=True)))
    rows: dict[str, list[Floats]] = {kind: [] for kind in ("base", "loop", "warm base", "warm loop", *beside.predict)}
    others = [test for i, test in enumerate(tests) if i not in learnt]
    for test in others:
        creepage, when, ratio = _columns(_traction(test))
        for kind, predict in beside.predict.items():
            rows[kind].append(ratio - predict(creepage, when))
        for kind, fits in _kinds(found):
            made = [predict_test(test, fitted) for fitted in fits]
            for channel, row in (("traction", kind), ("temperature", f"warm {kind}")):
                if channel == "traction" or test.measured.temperature is not None:
                    every = [_missed(test, one.case.model, one.prediction, channel) for one in made]
                    weights = _weights(found, kind, channel, made[0].prediction, made[0].case.model)
                    rows[row].append(np.sum(weights * np.array(every), axis=0))
    error = {kind: rms(np.concatenate(row or [np.empty(0)])) for kind, row in rows.items()}
    warm = error.pop("warm loop"), error.pop("warm base")
    ratios = [_traction(test).ratio for test in others]
    level = _with_level(rows["loop"], ratios), _with_level(rows["student"], ratios)
    split = f"learnt on {', '.join(tests[i].name.split()[-1] for i in learnt[:5])}{' ...' if len(learnt) > 5 else ''}"
    return Errors(record, split, **error, named=named(found), chosen=beside.chosen, seconds=seconds,
                  warm=warm, level=level)  # fmt: skip


def _kinds(found: Outcome) -> list[tuple[str, list[Fit]]]:
    """The base model, and the explanations that the loop predicts with."""
    return [("base", [found.judged.before]), ("loop", [member.after for member in found.mixture.members])]


def _weights(found: Outcome, kind: str, channel: str, prediction: Prediction, model: ForwardModel) -> Floats:
    """Weights of the fits of one kind at the samples of a channel (fit, sample)."""
    weights = found.mixture.on_all.weights_at(channel, model, prediction)
    return weights if kind == "loop" else np.ones((1, weights.shape[1]))


def _learnt(tests: Sequence[Experiment]) -> tuple[Outcome, float]:
    """What the loop finds in tests, and its processor time [s]."""
    begin = time.process_time()
    return explain(tests, validate=None, quick=False, progress=silent), time.process_time() - begin


@dataclass(frozen=True)
class _Beside:
    """What stands beside the loop: predictions by name, and the law that the student chose."""

    predict: Mapping[str, Predict]
    chosen: str


def _beside(known: tuple[Floats, ...]) -> _Beside:
    """Student and Gaussian process of creepage, time and T/N (sample,)."""
    best, average = student(*known)
    told = {"student": best.predict, "average": average, "process": gaussian_process(*known)}
    return _Beside(told, best.name)


def rms(misses: Floats) -> float:
    """Root mean square; NaN without samples."""
    return float(np.sqrt(np.mean(misses**2))) if len(misses) else np.nan


def named(found: Outcome) -> tuple[str, ...]:
    """The names in an answer."""
    return tuple(sorted(str(term) for term in found.answer.labels))


def _with_level(misses: Sequence[Floats], measured: Sequence[Floats]) -> float:
    """Error left where each test's level, a factor on the prediction, is known from its own samples."""
    left = []
    for miss, ratio in zip(misses, measured, strict=True):
        told = ratio - miss
        left.append(ratio - told * float(told @ ratio) / float(told @ told))
    return rms(np.concatenate(left))


def _missed(test: Experiment, model: ForwardModel, prediction: Prediction, channel: str) -> Floats:
    """Measured minus predicted of every sample of a channel, in the order of the file (sample,)."""
    own = channels()[channel]
    return np.asarray(own.values(own.samples(test)) - own.predicted(model, prediction)[0])


def _columns(samples: TractionSamples, mask: Mask | None = None) -> tuple[Floats, Floats, Floats]:
    """Creepage, time and T/N of samples (sample,)."""
    kept = slice(None) if mask is None else mask
    return samples.creepage[kept], samples.time[kept], samples.ratio[kept]


def _traction(test: Experiment) -> TractionSamples:
    assert test.measured.traction is not None
    return test.measured.traction
