"""The wear path: how profile and contact change together as material goes (Eqs. 12-15).

    du/dS (y) = g(y) / N        S = K E / (2 pi R H)

    u    worn depth of both discs together [m], (node, strip);   y across the track [m], (strip,)
    S    worn section: worn volume over the circumference [m2], (node,)
    g    load of the strip per width [N/m]; in full sliding the energy a strip dissipates is proportional to it
    E    dissipated energy [J], K wear coefficient [1], H hardness of disc 2 [Pa]
    R    rolling radius [m] of disc 2, or of disc 1 where disc 2 is straight

Where K is uniform over y the profile depends on K and the history only through S, so one path serves every K and
every history. Contact "hertz" refits the best circle inside the patch and keeps the ellipse; contact "half_space"
lets the patch follow the worn profile. Partial slip moves the wear from strip to strip; this is left out of the
profile, since what is dissipated there is a small part of any test that wears. The wear index of a strip has it, by
`partial_slip`.

A path comes from the table (`tabulated`) where that reaches, else from an integration (`integrated`), and of straight
discs from a closed form (`line`); where the load changes, from integrations through histories (`carried`) between which
those of one K are linear (`nearby`), and where K differs from strip to strip, from an integration of its own (`local`).
`provider` chooses among the first three.
"""

from twindisc_cli.model.wear_path.carried import CarriedPath, LoadHistory, carried_paths
from twindisc_cli.model.wear_path.grid import first_section
from twindisc_cli.model.wear_path.local import Course, Factors, local_paths, weights_on
from twindisc_cli.model.wear_path.nearby import paths_near
from twindisc_cli.model.wear_path.path import CREEPAGES, SHARES, Scaled, Scaling, WearPath
from twindisc_cli.model.wear_path.provider import is_tabulated, wear_path

__all__ = [
    "CREEPAGES", "SHARES", "CarriedPath", "Course", "Factors", "LoadHistory", "Scaled", "Scaling", "WearPath",
    "carried_paths", "first_section", "is_tabulated", "local_paths", "paths_near", "wear_path", "weights_on",
]  # fmt: skip
