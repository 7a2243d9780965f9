"""Contact of elastic half-spaces with any profile: normal contact, its fast strip form, and rolling with friction.

A normal contact that has no honest answer raises one of the errors below.
"""


class ContactError(ValueError):
    """A contact that cannot be computed from what was given."""


class ProfileError(ContactError):
    """The profiles or the grid are not usable numbers: NaN, wrong shape, not uniform, not ascending."""


class NoContactError(ContactError):
    """The two bodies never touch: no common range, or no load that presses them together."""


class DataEdgeError(ContactError):
    """The loaded patch reaches the end of the measured range, so that load beyond the data is unknown."""


class CoarseGridError(ContactError):
    """The grid has too few points across the patch for a number worth printing."""


class OutOfRangeError(ContactError):
    """A contact beyond what the tables and limits of the theory cover."""


class NoConvergenceError(ContactError):
    """The iteration did not reach the accuracy asked for."""
