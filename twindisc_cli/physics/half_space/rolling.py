"""Exact steady rolling with friction of half-spaces (Eqs. 4-6): tractions, slip, stick and slip zones, forces.

    s = w - (u(x) - u(x + dx)) / dx,       w_x = vx - phi y + w'_x,       w_y = vy + phi x + w'_y
    stick:  s = 0, |t| <= mu p             slip:  t = mu p s / |s|

    t        traction [Pa], s slip velocity over rolling speed [1], u elastic displacement by the tractions [m]
    vx, vy   longitudinal and lateral creepage [1];     phi   spin [rad/m]
             with a third body between them  u + L t,  which shears by L t [m]
    mu p     traction bound [Pa];     w'   slip that the pressure itself makes in bodies of unequal stiffness [1]

Signs: tractions and forces are positive where creepage is, so on body 1 they act the other way; the leading edge is at
+x; the moment is the integral of x t_y - y t_x. Dissipation is the integral of t . s, with s averaged over both ends of
an element, for then it balances the work of the forces, vx Fx + vy Fy + phi Mz, to rounding (between unlike bodies
the rolling resistance works too). In the slip condition,
which takes a backward difference, the x of an element is a sixth of its length ahead of its centre.

Method: Newton's steps in the tractions of the sticking elements and in the directions of the slipping ones, the sets
updated after each; every step is solved by GMRES with the operator's inverse on an endless surface as preconditioner,
weighted down where slip is fast against the bound; grids of half the fineness give the first guess. The result is
first order in the size of the elements. A mu that falls with the local slip is put in again and again from the slip
that it makes, beginning with that of rest.

Source: J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990); E. A. H. Vollebregt, User guide for
CONTACT (the same discretisation). Valid for: patches small against the bodies, steady rolling, one mu at each point,
or one that falls with slip by no more than about G / p, beyond which slip is not unique.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twindisc_cli.physics.half_space import NoConvergenceError, ProfileError
from twindisc_cli.physics.half_space.influence_tangential import Straining, strain_by_pressure, straining

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Singles = NDArray[np.float32]
_Field = TypeVar("_Field", Floats, Singles)
SlipLaw = Callable[[Floats], Floats]
"""What the size of the local slip over the rolling speed (y, x) decides."""

_COARSEST = 10  # elements along the shorter side of the first grid
_MOST_STEPS = 60  # of Newton's active set, at the most
_KRYLOV = 40  # largest subspace of an inner solve
_INNER = 0.1  # its relative accuracy
_COARSE_TOLERANCE = 1e-3  # of a start, which the fine grid sets right
_MATCHED = 5e-3  # tolerance times the root of the number of elements: the grid's error of T/(mu N) is near 0.25 over it
_OF_A_LAW = 1e-5  # tolerance where mu falls with slip, for the bound is put in again from the slip found
_PRACTICALLY_SLIPPING = 0.98  # of the bound, on a guess from a coarser grid
_SLIP_WEIGHT = 0.4  # normalised |s| G / (mu p) from which slip outweighs elasticity in the preconditioner
SPIN_AHEAD = 1.0 / 6.0
"""How far ahead of its centre an element takes the slip by spin [element]. The order is first at any place; here and at
a quarter the error is least (`make bench`), and here the results are CONTACT's on the same grid."""


@dataclass(frozen=True)
class Discs:
    """The half-spaces: combined shear modulus [Pa] and Poisson's ratio [1] of Eq. 7, and what sets them apart.

    stiffness_difference   K = G/4 [(1 - 2 nu_1)/G_1 - (1 - 2 nu_2)/G_2] of unequal bodies [1]
    layer_compliance       shear L of a third body between them, over the traction [m/Pa]
    """

    shear_modulus: float
    poisson: float
    stiffness_difference: float = 0.0
    layer_compliance: float = 0.0


@dataclass(frozen=True)
class Creepage:
    """Longitudinal (x) and lateral (y) creepage [1], spin about the origin of the grid [rad/m]."""

    x: float
    y: float = 0.0
    spin: float = 0.0


@dataclass(frozen=True)
class Rolling:
    """A solved case on its grid; fields have shape (y, x) or (2, y, x).

    x, y          centres of the elements [m]
    bound         mu p [Pa]
    traction      [Pa];     slip  relative slip velocity over the rolling speed [1], at the centres
    slipping      where the traction is at its bound
    residual      of the last step: root mean square of the violated slip condition over the largest rigid slip [1]
    """

    x: Floats
    y: Floats
    bound: Floats
    traction: Floats
    slip: Floats
    slipping: Mask
    residual: float

    @property
    def contact(self) -> Mask:
        """Where the bodies touch."""
        return self.bound > 0.0

    @property
    def element_area(self) -> float:
        """Area of one element [m2]."""
        return float((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))

    @cached_property
    def force_x(self) -> float:
        """Longitudinal force [N]."""
        return float(self.traction[0].sum()) * self.element_area

    @cached_property
    def force_y(self) -> float:
        """Lateral force [N]."""
        return float(self.traction[1].sum()) * self.element_area

    @cached_property
    def moment(self) -> float:
        """Spin moment about the origin [N m]."""
        return float((self.x * self.traction[1] - self.y[:, None] * self.traction[0]).sum()) * self.element_area

    @property
    def stick_fraction(self) -> float:
        """Share of the patch that sticks [1]."""
        return 1.0 - float(self.slipping.sum() / self.contact.sum())

    @property
    def dissipation(self) -> Floats:
        """Friction work per rolled length and per width [N/m], (y,); times the rolling speed it is P_l(y) [W/m]."""
        work: Floats = (self.traction * self.slip).sum(axis=(0, 2)) * (self.x[1] - self.x[0])
        return work

    @property
    def work(self) -> float:
        """Friction work of the patch per rolled length [N]; times the rolling speed it is the power."""
        return float(self.dissipation.sum()) * float(self.y[1] - self.y[0])


@dataclass(frozen=True)
class _Case:
    """One grid: bound over G (ny, nx), rigid slip (2, ny, nx), dx/dy, nu, layer L G / dx, and the operator on it."""

    bound: Floats
    rigid: Floats
    aspect: float
    poisson: float
    layer: float = 0.0

    @property
    def strain(self) -> Straining:
        return self.straining_of(self.contact.shape)

    def straining_of(self, shape: tuple[int, ...]) -> Straining:
        """The operator on another number of such elements."""
        return straining(shape=(shape[0], shape[1]), aspect=self.aspect, poisson=self.poisson, layer=self.layer)

    @cached_property
    def contact(self) -> Mask:
        return self.bound > 0.0

    def slip(self, tractions: Floats) -> Floats:
        """Relative slip in the contact, zero outside."""
        return (self.rigid - self.strain(tractions)) * self.contact


def solve(
    *,
    x: Floats,
    y: Floats,
    pressure: Floats,
    mu: ArrayLike | SlipLaw,
    discs: Discs,
    creepage: Creepage,
    start: Floats | None = None,
    tolerance: float | None = None,
) -> Rolling:
    """Solve steady rolling on a grid.

    x, y        centres of the elements [m], uniform, ascending; the leading edge is at the largest x
    pressure    normal pressure [Pa], (y, x); zero outside the contact
    mu          coefficient of friction [1], a number or (y, x); or what gives it for the size of the local slip
                over the rolling speed [1], (y, x) for (y, x)
    start       tractions [Pa] of a similar case on this grid, (2, y, x)
    tolerance   on the slip condition, root mean square over the largest rigid slip; left out, what it leaves of
                error is a hundredth of the grid's own (under one mu)
    """
    bound = _bound(mu(np.zeros_like(pressure)) if callable(mu) else mu, pressure)
    case, rigid = _prepared(x, y, pressure, bound, discs, creepage)
    if tolerance is None:
        tolerance = _OF_A_LAW if callable(mu) else _MATCHED / float(np.sqrt(case.contact.sum()))
    guess = _guess(case) if start is None else _onto_bound(case, start / discs.shear_modulus)
    solved = case, *_converged(case, guess, tolerance)
    if callable(mu):
        solved = _under_law(*solved, lambda slip: _bound(mu(slip), pressure) / discs.shear_modulus, tolerance)
    case, tractions, slipping, residual = solved
    return Rolling(
        x=x,
        y=y,
        bound=case.bound * discs.shear_modulus,
        traction=tractions * discs.shear_modulus,
        slip=_centred_slip(replace(case, rigid=rigid), tractions),
        slipping=slipping,
        residual=residual,
    )


def _prepared(
    x: Floats, y: Floats, pressure: Floats, bound: Floats, discs: Discs, creepage: Creepage
) -> tuple[_Case, Floats]:
    """The case of a grid, which takes its spin ahead of the centres, and the rigid slip at them (2, y, x)."""
    dx, dy = _spacing(x, pressure.shape[1]), _spacing(y, pressure.shape[0])
    spin, modulus = creepage.spin, discs.shear_modulus
    rigid = np.stack(np.broadcast_arrays(creepage.x - spin * y[:, None], creepage.y + spin * x))
    if discs.stiffness_difference:
        rigid -= strain_by_pressure(pressure, aspect=dx / dy) * (discs.stiffness_difference / modulus)
    ahead = np.array([0.0, spin * SPIN_AHEAD * dx])[:, None, None]
    layer = discs.layer_compliance * modulus / dx
    return _Case(bound / modulus, rigid + ahead, dx / dy, discs.poisson, layer), rigid


def _bound(mu: ArrayLike, pressure: Floats) -> Floats:
    """The traction bound mu p [Pa], (y, x)."""
    bound = np.asarray(mu, dtype=float) * pressure
    if not (np.isfinite(bound).all() and (bound >= 0.0).all() and bound.any()):
        raise ProfileError("the traction bound mu p must be finite, nowhere negative, and somewhere positive")
    return bound


def _under_law(
    case: _Case, tractions: Floats, slipping: Mask, residual: float, law: SlipLaw, tolerance: float
) -> tuple[_Case, Floats, Mask, float]:
    """The case whose bound is that of the slip it makes, its tractions over G, where they slip, and the residual.

    First what is solved under the bound at rest; then again under the bound of its slip, until that changes no more.
    """
    for _ in range(_MOST_STEPS):
        bound = law(np.hypot(*case.slip(tractions)) * slipping)
        if np.abs(bound - case.bound).max() < tolerance * bound.max():
            return case, tractions, slipping, residual
        grown = np.where(slipping, bound / np.where(case.contact, case.bound, 1.0), 1.0)
        case = replace(case, bound=bound)
        tractions, slipping, residual = _converged(case, _onto_bound(case, tractions * grown), tolerance)
    raise NoConvergenceError("friction falls so steeply with slip that steady rolling does not settle")


def _converged(case: _Case, guess: Floats, tolerance: float) -> tuple[Floats, Mask, float]:
    """Tractions over G, where they slip, and the residual, which is within the tolerance."""
    tractions, slipping, residual = _newton(case, guess, tolerance)
    if not residual < tolerance:
        raise NoConvergenceError(f"steady rolling did not converge in {_MOST_STEPS} steps: residual {residual:.1e}")
    return tractions, slipping, residual


def limit(coarse: ArrayLike, fine: ArrayLike) -> tuple[Floats, Floats]:
    """A force or fraction carried to ever finer grids, and its error, from grids of n and 2 n elements a side.

    The leading error is first order in 1/n. The staircase of the patch's edge adds some that is not, for which the
    error says half of the last step.
    """
    coarse, fine = np.asarray(coarse, dtype=float), np.asarray(fine, dtype=float)
    return 2.0 * fine - coarse, 0.5 * np.abs(fine - coarse)


def _spacing(points: Floats, count: int) -> float:
    """Distance of the element centres [m]; they must be uniform, ascending and as many as the pressure has."""
    steps = np.diff(points)
    if points.shape != (count,) or count < 2 or not (steps > 0.0).all() or np.ptp(steps) > 1e-6 * steps[0]:
        raise ProfileError("the grid must ascend in equal steps, one for each row or column of the pressure")
    return float(points[-1] - points[0]) / (count - 1)


def _centred_slip(case: _Case, tractions: Floats) -> Floats:
    """Slip at the centres of the elements: the mean of the backward and the forward difference."""
    padded = np.pad(tractions, ((0, 0), (0, 0), (1, 0)))
    strain = case.straining_of(padded.shape[1:])(padded)
    return (case.rigid - 0.5 * (strain[:, :, 1:] + strain[:, :, :-1])) * case.contact


def _guess(case: _Case) -> Floats:
    """Tractions over G from the solution on a grid of half the fineness, refined down from the coarsest one."""
    if min(case.bound.shape) < 2 * _COARSEST:
        return np.zeros_like(case.rigid)
    coarse = _Case(_halved(case.bound), _halved(case.rigid), case.aspect, case.poisson, 0.5 * case.layer)
    tractions, _, _ = _newton(coarse, _guess(coarse), _COARSE_TOLERANCE)
    share = tractions / np.where(coarse.contact, coarse.bound, 1.0)
    ny, nx = case.bound.shape
    return _onto_bound(case, _doubled(_doubled(share, 1), 2)[:, :ny, :nx] * case.bound)


def _halved(field: Floats) -> Floats:
    """Means over two by two elements of the last two dimensions; an odd row or column is repeated."""
    ny, nx = field.shape[-2:]
    even = np.pad(field, [(0, 0)] * (field.ndim - 2) + [(0, ny % 2), (0, nx % 2)], mode="edge")
    return 0.25 * (even[..., ::2, ::2] + even[..., 1::2, ::2] + even[..., ::2, 1::2] + even[..., 1::2, 1::2])


def _doubled(field: Floats, axis: int) -> Floats:
    """Linear interpolation to elements of half the length along one axis."""
    values = np.moveaxis(field, axis, -1)
    padded = np.concatenate([values[..., :1], values, values[..., -1:]], axis=-1)
    fine = np.empty((*values.shape[:-1], 2 * values.shape[-1]))
    fine[..., 0::2] = 0.75 * values + 0.25 * padded[..., :-2]
    fine[..., 1::2] = 0.75 * values + 0.25 * padded[..., 2:]
    return np.moveaxis(fine, -1, axis)


def _onto_bound(case: _Case, tractions: Floats) -> Floats:
    """Tractions brought to the bound where they exceed or nearly reach it."""
    size = np.hypot(*tractions)
    at_bound = size > _PRACTICALLY_SLIPPING * case.bound
    return np.where(at_bound, tractions * (case.bound / np.where(size > 0.0, size, 1.0)), tractions) * case.contact


def _newton(case: _Case, tractions: Floats, tolerance: float) -> tuple[Floats, Mask, float]:
    """Tractions over G, where they slip, and the residual, from a first guess."""
    scale = np.abs(case.rigid[:, case.contact]).max() * np.sqrt(2.0 * case.contact.sum())
    if scale == 0.0:
        return np.zeros_like(tractions), np.zeros_like(case.contact), 0.0
    slipping = case.contact & (np.hypot(*tractions) >= case.bound * (1.0 - 1e-9))
    for count in range(_MOST_STEPS):
        step = _Step(case, tractions, slipping)
        residual = float(np.linalg.norm(step.residual)) / scale
        if residual < tolerance or count == _MOST_STEPS - 1:
            break
        tractions = tractions + step.solve()
        size = np.hypot(*tractions)
        slipping = step.slipping | (case.contact & (size > case.bound))
        tractions = np.where(slipping, tractions * (case.bound / np.where(size > 0.0, size, 1.0)), tractions)
    return tractions, step.slipping, residual


class _Step:
    """One linearised step. A slipping element whose slip would drive its traction is released to stick first.

    Unknowns are both components of the traction where it sticks, and the one along the bound where it slips:
    there t . s = 0 for the tangent t, which linearises to  (|s| / bound) tau - t . strain(tau) = -t . s.
    The residual is in double precision; the step, of which a tenth is left to the next, in single.
    """

    def __init__(self, case: _Case, tractions: Floats, slipping: Mask) -> None:
        slip = case.slip(tractions)
        normal = tractions / np.where(slipping, case.bound, 1.0)
        along = (normal * slip).sum(axis=0)
        self.slipping = slipping & (along >= 0.0)
        stick = (case.contact & ~self.slipping).astype(float)
        tangent = np.stack([-normal[1], normal[0]]) * self.slipping
        self.residual = _free(slip, stick, tangent)
        shift = np.where(self.slipping, along / np.where(self.slipping, case.bound, 1.0), 0.0)
        weight = np.sqrt(_SLIP_WEIGHT / (_SLIP_WEIGHT + shift)) * case.contact
        rest = self.slipping / (_SLIP_WEIGHT + shift)
        self._stick, self._tangent, self._shift, self._weight, self._rest = (
            values.astype(np.float32) for values in (stick, tangent, shift, weight, rest)
        )
        self._operator = case.strain

    def solve(self) -> Floats:
        """The change of the tractions over G, along the bound where they slip."""
        change = _gmres(lambda v: self._apply(self._precondition(v)), self.residual.astype(np.float32))
        return self._precondition(change).astype(float)

    def _apply(self, change: Singles) -> Singles:
        return _free(self._operator.single(change) + self._shift * change, self._stick, self._tangent)

    def _precondition(self, residual: Singles) -> Singles:
        smooth = self._operator.approximate_inverse(self._weight * residual)
        return _free(self._weight * smooth + self._rest * residual, self._stick, self._tangent)


def _free(field: _Field, stick: _Field, tangent: _Field) -> _Field:
    """The part of a field along the unknowns."""
    free: _Field = stick * field + tangent * (tangent * field).sum(axis=0)
    return free


def _gmres(apply: Callable[[Singles], Singles], right_hand_side: Singles) -> Singles:
    """Solve apply(v) = right_hand_side to the inner accuracy, or as far as the subspace allows."""
    shape, size = right_hand_side.shape, float(np.linalg.norm(right_hand_side))
    basis = np.empty((_KRYLOV + 1, right_hand_side.size), dtype=np.float32)
    basis[0] = right_hand_side.ravel() / size
    hessenberg = np.zeros((_KRYLOV + 1, _KRYLOV))
    goal = np.zeros(_KRYLOV + 1)
    goal[0] = size
    for k in range(_KRYLOV):
        vector: NDArray[Any] = apply(basis[k].reshape(shape)).ravel()
        along = basis[: k + 1] @ vector
        vector = vector - along @ basis[: k + 1]
        hessenberg[: k + 1, k] = along
        hessenberg[k + 1, k] = np.linalg.norm(vector)
        if hessenberg[k + 1, k] > 0.0:
            basis[k + 1] = vector / hessenberg[k + 1, k]
        solution, misfit, _, _ = np.linalg.lstsq(hessenberg[: k + 2, : k + 1], goal[: k + 2], rcond=None)
        if hessenberg[k + 1, k] == 0.0 or (misfit.size and misfit[0] < (_INNER * size) ** 2):
            break
    return (solution.astype(np.float32) @ basis[: solution.size]).reshape(shape)
