"""Weighted least squares with bounds, and the evidence of a fitted model.

    evidence = -chi2 / 2 - u'u / 2 - log|1 + J_u'J_u| / 2 - (k / 2) log n - sum of log min(1 + l, n) / 2

    J     Jacobian of the white residual over the inner parameters, (sample, parameter)
    u     parameters of curves, normal of unit variance; J_u their columns without what the others can absorb (Laplace)
    k     parameters of laws, and sizes of effects, n the samples: what a prior as wide as one sample's worth costs
          (Schwarz)
    l     eigenvalues of J_s'J_s in units of their prior, J_s the columns of what only shapes an effect that shows,
          without what the others can absorb: what the data do not fix costs nothing (Laplace), and nothing costs more
          than a size

Sources: D. J. C. MacKay, Neural Computation 4 (1992) 415-447; G. Schwarz, Annals of Statistics 6 (1978) 461-464.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from twindisc_cli.effects._state import State
from twindisc_cli.identify.span import span_of
from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.noise import Mask
from twindisc_cli.loop.problem import Case, Parameter, Problem
from twindisc_cli.loop.tolerances import with_nuisances
from twindisc_cli.model.experiment import Floats

STEP = 1e-4  # of the derivatives; inner parameters are of order one
MOST_STEPS = 200  # of the trust region, at the most: 40 were too few for some settlings and transitions
TYPICAL = 3.0  # typical sizes: the width of the prior of a size
FREE = 4.0  # fall of chi2 of two standard deviations, which a bound must cost to be held there
EDGE = 1e-3
"""Nearer to a bound than this share of the range a parameter is at it."""
SWEEPS, AGREED = 4, 0.2
"""Times that channels are fitted one after the other, and standard errors by which each may want to move after that."""
SAME_TRACK = 0.01
"""Fall of chi2 that is still to be had by what parameters do to the track, below which a fit has ended."""
MOST_TRACKS = 8  # that a fit follows one after the other
FTOL, TRACK_FTOL = 1e-5, 1e-4
"""Relative changes of chi2 at which a fit ends, on tracks that are integrated each time the second: a hundredth of a
nat, and a tenth, where a thousand samples are fitted. A step that changes less may as well be one to the worse: slopes
of tracks are no better than that."""
SETTLED = 1e-3
"""Fall of chi2 that another step promises to first order, below which a fit whose tracks are integrated has ended: some
hundredths of a standard error."""


@dataclass(frozen=True)
class Fit:
    """A fitted problem: inner parameters theta, white residual (sample,) and Jacobian there, covariance of theta."""

    problem: Problem
    theta: Floats
    residual: Floats
    jacobian: Floats
    covariance: Floats

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the fitted effects and laws."""
        return self.problem.terms

    @property
    def chi2(self) -> float:
        """Squared length of the white residual."""
        return float(self.residual @ self.residual)

    @property
    def misfit(self) -> float:
        """What a fit makes least: chi2, and the squares of parameters that are normal."""
        return self.chi2 + float(np.sum(self.theta[self.problem.normal] ** 2))

    def power(self, channel: str) -> float:
        """Squared length of the white residual of a channel."""
        return float(sum(np.sum(self.residual[part] ** 2) for part in self.problem.slices[channel]))

    @property
    def excess(self) -> float:
        """Mean square of the white residual, one at least: by how much what a fit leaves widens its covariances."""
        return max(self.chi2 / max(len(self.residual) - len(self.theta), 1), 1.0)

    def excess_of_assumed(self, channel: str) -> float:
        """The same of a channel where its noise had to be assumed: by how much it may be larger; 1 where it had not.

        Parameters are shared out among all samples.
        """
        left, count = self.residual[self.problem.assumed(channel)], len(self.residual)
        free = max(count - len(self.theta), 1) / count
        return max(float(np.mean(left**2)) / free, 1.0) if len(left) else 1.0

    @cached_property
    def followed(self) -> Problem:
        """The problem on the tracks of this fit, for which no integration is needed."""
        return self.problem.followed(self.theta)

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the evidence, up to a constant of the data."""
        normal, shape = self.problem.normal, self._shapes
        own = np.array([p.term is not None for p in self.problem.parameters], dtype=bool) & ~normal & ~shape
        curve, shaping = self._alone(normal, ~normal), self._alone(shape, ~normal & ~shape)
        volume = float(np.linalg.slogdet(np.eye(curve.shape[1]) + curve.T @ curve)[1])
        seen = np.linalg.svd(shaping / np.sqrt(precision(self.problem)[shape]), compute_uv=False) ** 2
        count = len(self.residual)
        fixed = float(own.sum()) * np.log(count) + float(np.sum(np.log(np.minimum(1.0 + seen, count))))
        return float(-0.5 * (self.misfit + volume + fixed))

    @property
    def _shapes(self) -> Mask:
        """Which parameters only shape an effect of the catalogue that shows, none of it at a bound (parameter,).

        Of one that does not show, or that a bound holds (a jump between two samples), a fit takes the best shape and no
        average.
        """
        terms = [name for name in self.terms if name not in self.problem.trial and self._shows(name)]
        return np.array([p.term in terms and p.off is None for p in self.problem.parameters], dtype=bool)

    def _shows(self, term: str) -> bool:
        """Whether an effect takes more from chi2 than all its parameters cost, and none of these is at a bound."""
        own = self.own(term)
        if np.any(own & np.any(self._at_edges, axis=0)):
            return False
        return self.taken_by(term) > float(own.sum() * np.log(len(self.residual)))

    def taken_by(self, term: str) -> float:
        """By how much chi2 would rise without an effect, to first order."""
        parameters, own = self.problem.parameters, self.own(term)
        size = own & np.array([p.off is not None for p in parameters], dtype=bool)
        off = np.array([p.inner(p.off) for p in parameters if p.term == term and p.off is not None])
        shown = self._alone(size, ~own & ~self.problem.normal) @ (self.theta[size] - off)
        return float(shown @ shown)

    @cached_property
    def taken_exactly(self) -> Mapping[str, float]:
        """By how much chi2 of each channel would rise without the effects whose formulas cannot err."""
        taken = dict.fromkeys(self.problem.channels, 0.0)
        for term in self.terms:
            if self.problem.effect(term).exact:
                taken[self.problem.shown_in(self.problem.effect(term))] += self.taken_by(term)
        return taken

    def explained(self, channel: str, before: float) -> float:
        """By how much the formulas that can err bring the squared length of a channel below what it was before."""
        return max(before - self.power(channel) - self.taken_exactly[channel], 0.0)

    def _alone(self, some: Mask, others: Mask) -> Floats:
        """Columns of the Jacobian (sample, some) without what other parameters can absorb."""
        if not some.any():
            return self.jacobian[:, some]
        columns, rest = self.jacobian[:, some], span_of(self.jacobian[:, others])
        return np.asarray(columns - rest @ (rest.T @ columns))

    def own(self, term: str) -> Mask:
        """Which parameters are those of a term (parameter,)."""
        return np.array([p.term == term for p in self.problem.parameters], dtype=bool)

    def value(self, parameter: Parameter) -> tuple[float, float]:
        """Value and standard deviation of a parameter in the unit of the test definition."""
        i = self.problem.parameters.index(parameter)
        std = float(np.sqrt(self.covariance[i, i]))
        value = float(parameter.outer(self.theta[i]))
        return value, std * (value if parameter.log else parameter.scale)

    def base(self, number: int) -> dict[str, float]:
        """The fitted base parameters of a test, by key."""
        return {key: float(v[0]) for key, v in self.problem.own_base(number, self.theta[None]).items()}

    def values(self, term: str) -> dict[str, float]:
        """The fitted parameters of a term, by key."""
        return {p.key: self.value(p)[0] for p in self.problem.parameters if p.term == term}

    @property
    def pressed(self) -> Mask:
        """Which parameters are at a bound beyond which they would fit better (parameter,)."""
        at_lower, at_upper = self._at_edges
        return np.asarray(np.where(self.jacobian.T @ self.residual < 0.0, at_upper, at_lower))

    @property
    def _at_edges(self) -> Mask:
        """Which parameters are at their lower, at their upper bound (2, parameter)."""
        lower, upper = self.problem.bounds
        return np.array([self.theta - lower, upper - self.theta]) < EDGE * (upper - lower)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Names of effect parameters that the data press against a bound.

        A bound that is the parameter's "off", or where an effect is complete (a share of one), is none of these; nor is
        one that may be left by a tenth of the range without a cost.
        """
        lower, upper = self.problem.bounds
        slope, at_edge = self.jacobian.T @ self.residual, np.any(self._at_edges, axis=0)
        results = []
        for i, p in enumerate(self.problem.parameters):
            width = upper[i] - lower[i]
            low = self.theta[i] - lower[i] < upper[i] - self.theta[i]
            bound, inward = (p.lower, 0.1 * width) if low else (p.upper, -0.1 * width)
            complete = p.unit == "1" and p.off == 0.0 and bound == 1.0
            cost = 2.0 * slope[i] * inward + inward**2 / self.covariance[i, i]
            if p.term is not None and at_edge[i] and bound != p.off and not complete and cost > FREE:
                results.append(p.name)
        return tuple(results)


def fit(problem: Problem, start: Floats | None = None, most_steps: int = MOST_STEPS) -> Fit:
    """Fit all parameters of a problem from inner start values (parameter,)."""
    lower, upper = problem.bounds
    margin = 1e-9 * (upper - lower)
    theta = np.clip(problem.start() if start is None else start, lower + margin, upper - margin)
    if len(theta) == 0:
        return at(problem, theta)
    own = problem.is_integrated and problem.tracks is None
    return (_on_its_tracks if own else _fit)(problem, theta, most_steps)


class _SettledError(Exception):
    """Another step would gain nothing that counts."""


@dataclass
class _Steps:
    """What a fit has evaluated on its way from inner start values (parameter,), and the best of it.

    moved: derivatives of the residual (sample, parameter) that the problem does not see, by what moves its tracks.
    best, least: the parameters of the least misfit so far, and that misfit.
    """

    problem: Problem
    start: Floats
    ftol: float
    moved: Floats | None
    best: Floats = field(init=False)
    least: float = np.inf
    near: Sequence[State | None] = ()
    known: dict[bytes, tuple[Floats, Floats, Floats]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """The start is the best at first."""
        self.best = self.start

    @cached_property
    def target(self) -> Floats:
        """What was measured, as the residual counts it (sample,)."""
        return self.problem.discount(self.problem.measured)

    def at(self, theta: Floats) -> tuple[Floats, Floats, Floats]:
        """Residual (sample,), its slopes (sample, parameter), and the triangle of both with the prior's rows.

        A triangle has the lengths and the angles of residual and slopes, in as few rows as there are parameters. Above
        its diagonal the last column is what the slopes can take of the residual.
        """
        key = theta.tobytes()
        if key not in self.known:
            left, slopes = self._linearised(theta)
            normal = self.problem.normal
            prior = np.column_stack([np.eye(len(theta))[normal], theta[normal]])
            rows = np.concatenate([np.column_stack([slopes, left]), prior])
            triangle = np.asarray(np.linalg.qr(rows, mode="r"))
            self.known[key] = left, slopes, triangle
            self._compare(theta, triangle)
        return self.known[key]

    def _linearised(self, theta: Floats) -> tuple[Floats, Floats]:
        left, slopes, self.near = linearised(self.problem, theta, self.target, self.near)
        if self.moved is None:
            return left, slopes
        return left + self.moved @ (theta - self.start), slopes + self.moved

    def _compare(self, theta: Floats, triangle: Floats) -> None:
        """Keep the best; _SettledError where this step changed nothing that counts, or another promises nothing."""
        misfit = float(triangle[:, -1] @ triangle[:, -1])
        ended = abs(misfit - self.least) < self.ftol * self.least
        if misfit < self.least:
            self.best, self.least = theta.copy(), misfit
            promised = float(triangle[:-1, -1] @ triangle[:-1, -1])
            ended |= self.problem.is_integrated and promised < SETTLED
        if ended:
            raise _SettledError


def _fit(problem: Problem, theta: Floats, most_steps: int, *, ftol: float = FTOL, moved: Floats | None = None) -> Fit:
    """Fit all parameters from inner start values (parameter,) within the bounds.

    moved: derivatives of the residual (sample, parameter) that the problem does not see, by what moves its tracks. What
    changes nothing at its bound takes no part: it would end each step there.
    """
    lower, upper = problem.bounds
    steps = _Steps(problem, theta, ftol, moved)
    with suppress(_SettledError):
        inside = np.minimum(theta - lower, upper - theta) > EDGE * (upper - lower)
        free = steps.at(theta)[1].any(axis=0) | inside

        def triangle(part: Floats) -> Floats:
            inner = theta.copy()
            inner[free] = part
            return steps.at(inner)[2]

        def residual(part: Floats) -> Floats:
            return triangle(part)[:, -1]

        def slope(part: Floats) -> Floats:
            return triangle(part)[:, :-1][:, free]

        if free.any():
            least_squares(
                residual,
                theta[free],
                jac=slope,
                bounds=(lower[free], upper[free]),
                x_scale="jac",
                ftol=None,
                xtol=1e-7,
                gtol=1e-8,
                max_nfev=most_steps,
            )
    left, slopes, _ = steps.at(steps.best)
    return _summarised(problem.begun_at(steps.near), steps.best, left, slopes)


def _on_its_tracks(problem: Problem, start: Floats, most_steps: int) -> Fit:
    """A fit with the track of every set of parameters integrated, as far as parameters move the track.

    Where loads change they move it little, and evenly: what they do to it is found once. Where K differs from strip to
    strip, derivatives on one track lead astray.
    """
    every = replace(problem, tracks=["each"] * len(problem.cases))
    if problem.is_local:
        return replace(_fit(every, start, most_steps, ftol=TRACK_FTOL), problem=problem)
    best = at(every, start)
    moved = best.jacobian - at(best.followed, start).jacobian
    for _ in range(MOST_TRACKS):
        ahead = _fit(best.followed, best.theta, most_steps, moved=moved)
        if best.misfit - ahead.misfit < SAME_TRACK:
            break
        here = at(problem.followed(ahead.theta), ahead.theta)
        if here.misfit > best.misfit:
            break
        best = _summarised(every, here.theta, here.residual, here.jacobian + moved)
    return replace(best, problem=problem)


def at(problem: Problem, theta: Floats) -> Fit:
    """The summary of a problem at given inner parameters (parameter,), without fitting."""
    return _summarised(problem, theta, *linearised(problem, theta, problem.discount(problem.measured))[:2])


def refit(problem: Problem, start: Floats | None = None) -> Fit:
    """Fit, find the nuisances there, and fit again."""
    first = fit(replace(problem, nuisance=None) if problem.nuisance is None else problem, start)
    base = [i for i, p in enumerate(problem.parameters) if p.term is None]
    return fit(with_nuisances(problem, first.theta, first.jacobian[:, base]), first.theta)


def carried(problem: Problem, *fits: Fit) -> Floats:
    """Inner start values of a problem, taken from earlier fits where these had the parameter."""
    known = {
        (p.name, p.case): p.outer(value)
        for fitted in fits
        for p, value in zip(fitted.problem.parameters, fitted.theta, strict=True)
    }
    return np.array([p.inner(float(known.get((p.name, p.case), p.start))) for p in problem.parameters])


def remembered(cases: Sequence[Case], *fits: Fit) -> list[Case]:
    """The cases with base parameters as fitted earlier, for where these are not fitted."""
    return [
        replace(case, known=dict(case.known) | {key: value for f in fits for key, value in f.base(number).items()})
        for number, case in enumerate(cases)
    ]


def linearised(
    problem: Problem, inner: Floats, target: Floats, near: Sequence[State | None] = ()
) -> tuple[Floats, Floats, list[State | None]]:
    """White residual (sample,), its Jacobian (sample, parameter), and the state that each test settles in.

    near: such states for parameters nearby. Parameters on trial may heat a test without end: what is not finite then is
    very far off.
    """
    step = np.where(inner + STEP > problem.bounds[1], -STEP, STEP)
    sets = np.concatenate([inner[None], inner + np.diag(step)])
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        predictions = problem.predict(sets, near=near)
        rows = problem.discount(problem.white(predictions))
    rows = finite(rows)
    first = [prediction.state.of_sets(np.array([0])) for prediction in predictions]
    settled = [state if _is_sound(state, case) else None for state, case in zip(first, problem.cases, strict=True)]
    return target - rows[0], -((rows[1:] - rows[0]) / step[:, None]).T, settled


def finite(rows: Floats) -> Floats:
    """White rows, in which what is not finite is very far off."""
    return np.nan_to_num(rows, nan=1e6, posinf=1e6, neginf=-1e6)


def _is_sound(state: State, case: Case) -> bool:
    """Whether predictions may begin at a state: it is finite wherever that of the base model is."""
    known = np.isfinite(state.temperature) if case.near is None else np.isfinite(case.near.temperature)
    return bool(np.isfinite(state.energy).all() and np.array_equal(np.isfinite(state.temperature), known))


def _summarised(problem: Problem, theta: Floats, residual: Floats, jacobian: Floats) -> Fit:
    """Covariance at a minimum; a wide prior keeps it finite where the data do not see a parameter.

    Where a trial goes so far off that this is lost to rounding, it is inverted in parameters of like size, and no
    variance is less than rounding allows.
    """
    hessian = jacobian.T @ jacobian + np.diag(precision(problem))
    try:
        covariance = np.linalg.inv(hessian)
    except np.linalg.LinAlgError:
        covariance = np.zeros_like(hessian)
    if not np.all(np.diag(covariance) > 0.0):
        scale = 1.0 / np.sqrt(np.diag(hessian))
        values, vectors = np.linalg.eigh(hessian * scale * scale[:, None])
        root = scale[:, None] * vectors / np.sqrt(np.maximum(values, len(values) * np.finfo(float).eps))
        covariance = root @ root.T
    return Fit(problem, theta, residual, jacobian, np.asarray(covariance))


def precision(problem: Problem) -> Floats:
    """Precision of the normal that stands for the prior of each parameter (parameter,)."""
    lower, upper = problem.bounds
    width = (upper - lower) / np.sqrt(12.0)
    for i, p in enumerate(problem.parameters):
        if p.normal:
            width[i] = 1.0
        elif p.term is not None and p.off is not None:
            width[i] = TYPICAL * abs(p.inner(p.start) - p.inner(p.off))
    return np.asarray(width**-2.0)


def plain_fit(problem: Problem, *known: Fit) -> Fit:
    """Fit without nuisances, each base parameter to its own channels: what an effect-free identification would give.

    A channel that misses an effect then does not pull at the parameters of the others. `known` fits give start values,
    the last of them first. Where declared effects let mu follow the temperature, one channel after the other is fitted
    again until all agree.
    """
    theta, cases = carried(problem, *known), remembered(problem.cases, *known)
    names = [(p.name, p.case) for p in problem.parameters]
    for _ in range(SWEEPS):
        before = theta.copy()
        for together in problem.sharing:
            part = replace(problem, channels=together, nuisance=None, cases=cases)
            alone = fit(part, carried(part, *known))
            cases = remembered(cases, alone)
            for p, inner in zip(alone.problem.parameters, alone.theta, strict=True):
                theta[names.index((p.name, p.case))] = inner
        whole = at(replace(problem, nuisance=None, tracks=None), theta)
        if _channels_agree(whole, theta - before):
            break
        known = (whole,)
    return whole


def base_fit(problem: Problem, *known: Fit) -> Fit:
    """The same, with the noise that the base model leaves where the samples alone do not show it (Case)."""
    fitted = plain_fit(problem, *known)
    predictions = fitted.problem.predict(fitted.theta[None])
    cases = [case.with_noise_about(p) for case, p in zip(fitted.problem.cases, predictions, strict=True)]
    if all(case is before for case, before in zip(cases, fitted.problem.cases, strict=True)):
        return fitted
    return plain_fit(replace(fitted.problem, cases=cases), fitted)


def _channels_agree(fitted: Fit, moved: Floats) -> bool:
    """Whether what was fitted after each channel would move its parameters by a part of their standard errors at most.

    moved: by how much the parameters were moved, channel after channel (parameter,).
    """
    problem = fitted.problem
    groups = [{base.key for channel in of for base in channels()[channel].parameters} for of in problem.sharing]
    group = np.array([next(i for i, keys in enumerate(groups) if p.key in keys) for p in problem.parameters])
    for number, together in enumerate(problem.sharing):
        rows = [np.arange(at.start, at.stop) for (_, c), at in problem.places.items() if c in together]
        slopes = fitted.jacobian[np.concatenate(rows)]
        own = slopes[:, (group == number) & ~fitted.pressed]
        step, *_ = np.linalg.lstsq(own, slopes @ np.where(group > number, moved, 0.0))
        if np.any(np.abs(step) * np.linalg.norm(own, axis=0) > AGREED):
            return False
    return True
