"""Tables over several axes: carried from their nodes to an even grid, and read linearly between its cells."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from twindisc_cli.physics._arrays import Floats


def read(table: NDArray[np.float32], unit: tuple[Floats, ...]) -> Floats:
    """Linear between the cells of a table (..., quantity) at places 0 ... 1 along each of its axes, (quantity, ...)."""
    count, quantities = unit[0].size, table.shape[-1]
    index, corners, shares = np.zeros(count, np.intp), np.zeros(1, np.intp), []
    for points, place in zip(table.shape[:-1], unit, strict=True):
        position = place.ravel() * (points - 1)
        cell = np.clip(np.nan_to_num(position).astype(np.intp), 0, points - 2)
        shares.append(position - cell)
        index = index * points + cell
        corners = np.add.outer(corners * points, np.arange(2)).ravel()
    rows = table.reshape(-1, quantities).take(np.add.outer(corners, index), axis=0)
    values = rows.transpose(2, 0, 1).astype(float)
    for share in shares:
        below, above = values[:, : values.shape[1] // 2], values[:, values.shape[1] // 2 :]
        values = below + share * (above - below)
    return values.reshape(quantities, *unit[0].shape)


def polynomials(at: Floats, count: int) -> Floats:
    """The first of Chebyshev's polynomials, (point, polynomial)."""
    return np.asarray(chebyshev.chebvander(at, count - 1))


def through(at_nodes: Floats, at_points: Floats) -> Floats:
    """The matrix from values at nodes to values at points, by functions known at both (point, function)."""
    return np.asarray(at_points @ np.linalg.inv(at_nodes))


def linear_at(values: Floats, position: Floats) -> Floats:
    """Values (..., node) on lines between their nodes, at positions from 0 to the last node's number (..., place)."""
    left = np.minimum(position.astype(np.intp), values.shape[-1] - 2)
    part = position - left
    below, above = (np.take_along_axis(values, place, -1) for place in (left, left + 1))
    return np.asarray((1.0 - part) * below + part * above)


def cubic_weights(nodes: Floats, at: Floats) -> Floats:
    """Weights (..., node) of the four nodes (node,) around places (...); a node itself gets weight one."""
    first = np.clip(np.searchsorted(nodes, at) - 2, 0, len(nodes) - 4)
    near = first[..., None] + np.arange(4)
    known = nodes[near]
    weights = np.zeros((*np.shape(at), len(nodes)))
    own = np.stack(
        [
            np.prod([(at - known[..., j]) / (known[..., i] - known[..., j]) for j in range(4) if j != i], axis=0)
            for i in range(4)
        ],
        axis=-1,
    )
    np.put_along_axis(weights, near, own, axis=-1)
    weights[np.abs(weights) < 1e-14] = 0.0
    return weights
