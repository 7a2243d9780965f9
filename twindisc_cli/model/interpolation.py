"""Cubic interpolation on the four nodes around a place."""

from __future__ import annotations

import numpy as np

from twindisc_cli.model.experiment import Floats


def cubic_weights(nodes: Floats, at: Floats) -> Floats:
    """Weights (..., node) of the nodes (node,) at places (...) among them; a node itself gets weight one."""
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
