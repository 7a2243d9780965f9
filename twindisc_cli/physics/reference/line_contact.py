"""Line contact of two cylinders (Hertz): the limit of an ellipse that grows across rolling.

    a = sqrt(4 q / (pi E* kappa)),    p0 = E* kappa a / 2

    q  load per length [N/m];   kappa  relative curvature along rolling [1/m];   a  half-length of the patch [m]

Source: K. L. Johnson, Contact Mechanics (1985), section 4.2(c).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twindisc_cli.physics._arrays import Floats, arrays


@dataclass(frozen=True)
class Strip:
    """A line contact: half-length a along rolling [m] and peak pressure p0 [Pa]."""

    a: Floats
    p0: Floats


def line_contact(*, curvature: ArrayLike, load_per_length: ArrayLike, effective_modulus: ArrayLike) -> Strip:
    """The line contact under a load per length [N/m]; all broadcast."""
    sharp, load, modulus = arrays(curvature, load_per_length, effective_modulus)
    a = np.sqrt(4.0 * load / (np.pi * modulus * sharp))
    return Strip(a=a, p0=0.5 * modulus * sharp * a)
