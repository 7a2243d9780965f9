"""Third-body layer: debris, oxide or sand between the discs shears, and the creep curve rises less steeply at first.

    T/(mu N) = [f(xi) + Lambda P(xi)] / (1 + Lambda),     P(xi) = (2 / pi) [e / (1 + e^2) + arctan(e)],   e = pi xi / 4
    xi = k G a b C11 v / (mu N),    1/k = 1 + Lambda + 0.07 Lambda / (Lambda + 0.12)
    Lambda = 3 G C11 L / (8 a) of an ellipse,   G C11 L / (4 a) of a line

    L        shear of the layer over the traction, its thickness over its shear modulus [m/Pa]
    Lambda   slope of the elastic discs alone over that of the layer alone [1]
    f, k     law of rolling without the layer, over the normalised creepage xi;  slope with the layer over that without
    v        longitudinal creepage [1];     a, b  semi-axes along and across [m]

A layer alone is a bed of springs: traction grows by v / L from the leading edge of each strip and meets the bound of a
semi-elliptic pressure at the same share of its length in all strips, which makes P (Polach's curve) whatever the patch.
The slope with the layer is that of both in series but for 1 to 4 %: they distribute the traction differently.

Source: J. J. Kalker's simplified theory with a semi-elliptic bound, integrated; the 0.07 and 0.12, and that the curves
mix by Lambda, by half_space.rolling with a layer (tests/test_third_body.py).
Valid for: elastic layers far thinner than the patch.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.physics._arrays import Floats

_NOT_IN_SERIES, _HALF_OF_THAT = 0.07, 0.12
"""What the sum of both compliances lacks over that of the discs, and the Lambda at which half of it is lacking: by the
exact solver, a/b 0.1 to 5, nu 0 to 0.5, within 1 % of the slope."""


def compliance_ratio(layer_compliance: float, *, stiffness: Floats, a: Floats, b: Floats, line: bool = False) -> Floats:
    """Lambda [1] for L [m/Pa], of a patch whose force per creepage without the layer is `stiffness` = G a b C11 [N]."""
    of_layer = (4.0 if line else 8.0 / 3.0) * a**2 * b
    return np.asarray(layer_compliance * stiffness / of_layer)


def slope_factor(ratio: Floats) -> Floats:
    """k [1] for Lambda [1]."""
    return np.asarray(1.0 / (1.0 + ratio + _NOT_IN_SERIES * ratio / (ratio + _HALF_OF_THAT)))


def saturation(xi: Floats, ratio: Floats, without: Floats) -> Floats:
    """T/(mu N) [1] at the normalised creepage xi and Lambda; `without` is the law without the layer at xi."""
    e = 0.25 * np.pi * xi
    springs = 2.0 / np.pi * (e / (1.0 + e**2) + np.arctan(e))
    return np.asarray((without + ratio * springs) / (1.0 + ratio))
