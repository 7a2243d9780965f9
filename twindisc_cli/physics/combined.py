"""Direction of the traction where longitudinal and lateral creepage act together.

    e = (1 - w) e_linear + w e_slip,    w = xi^3 / (xi^3 + 12)

    e_linear  direction of the linear theory's force (G a b C11 vx, G a b C22 vy), right for small creepage
    e_slip    direction of the creepage (vx, vy), right in full sliding
    xi        the linear theory's force over mu N [1]

C11 and C22 differ, so the traction turns as the patch slides. The form and the 12 are fitted to twelve points of
CONTACT (open-source release 2025-07-23, revision 2707; a/b = 0.63, nu = 0.3), which they meet within 0.004 mu N.
"""

from __future__ import annotations

import numpy as np

from twindisc_cli.physics._arrays import Floats

_HALF_TURNED = 12.0  # cube of xi at which the direction is half that of the slip


def direction(along: Floats, across: Floats, creepage: Floats, sideways: Floats) -> tuple[Floats, Floats]:
    """Cosine and sine of the angle between the traction and the rolling direction.

    along, across: the linear theory's force over mu N [1]; creepage, sideways [1]; of one shape.
    """
    if not np.any(across) and not np.any(sideways):
        return np.sign(along), np.zeros_like(along)
    xi = np.maximum(np.hypot(along, across), 1e-30)
    slip = np.maximum(np.hypot(creepage, sideways), 1e-30)
    turned = xi**3 / (xi**3 + _HALF_TURNED)
    east = (1.0 - turned) * along / xi + turned * creepage / slip
    north = (1.0 - turned) * across / xi + turned * sideways / slip
    length = np.maximum(np.hypot(east, north), 1e-30)
    return east / length, north / length
