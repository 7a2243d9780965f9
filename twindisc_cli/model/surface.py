"""The worn surfaces at the stops where profiles were recorded, and the samples taken from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twindisc_cli.effects._state import State, Surface
from twindisc_cli.model.experiment import Floats, Ints, ProfileSamples
from twindisc_cli.model.patch import Paths
from twindisc_cli.model.points import Points
from twindisc_cli.physics._even_grid import linear_at


@dataclass(frozen=True)
class Stops:
    """Recorded profiles: disc and operating point, each (stop,); stop and y [m] of every sample, each (sample,)."""

    disc: Ints
    point: Ints
    stop: Ints
    y: Floats

    @staticmethod
    def of(profile: ProfileSamples, points: Points) -> Stops:
        """Find the stops of a recorded profile."""
        stops, stop = np.unique(np.stack([profile.disc, profile.iteration]), axis=1, return_inverse=True)
        last = np.clip(stops[1] - 1, 0, len(points.of_iteration) - 1)
        return Stops(disc=stops[0], point=points.of_iteration[last], stop=stop.ravel(), y=profile.y)

    def sample(self, surface: Surface) -> Floats:
        """Heights (set, sample) [m] of a surface at the recorded samples; beyond its grid it is as at its ends."""
        grid = surface.y
        position = np.clip((self.y - grid[0]) / (grid[1] - grid[0]), 0.0, len(grid) - 1.0)
        left = np.minimum(position.astype(np.int64), len(grid) - 2)
        part = position - left
        height = surface.height
        return np.asarray((1.0 - part) * height[:, self.stop, left] + part * height[:, self.stop, left + 1])


def recorded_sections(profile: ProfileSamples, used: NDArray[np.bool_] | None = None) -> list[float]:
    """Section [m2] missing in each recorded profile, of the used samples only if given."""
    stops = np.stack([profile.disc, profile.iteration])
    chosen = np.ones(len(profile.y), dtype=bool) if used is None else used
    sections = []
    for stop in np.unique(stops[:, chosen], axis=1).T:
        here = chosen & np.all(stops == stop[:, None], axis=0)
        order = np.argsort(profile.y[here])
        sections.append(-float(np.trapezoid(profile.height[here][order], profile.y[here][order])))
    return sections


def worn_surface(paths: Paths, state: State, section: Floats, stops: Stops) -> Surface:
    """Surfaces (set, stop, strip) of the recorded discs; `section` (set, point) is what both discs lost [m2]."""
    ratio = np.broadcast_to(state.normal_load / state.nominal_load, section.shape)[:, stops.point]
    scaled, own = paths.profile_scale(ratio), section[:, stops.point]
    scale = scaled.across
    reach = 1.15 * max(max(float(path.y[-1]) for path in paths.paths), float(np.abs(stops.y).max()))
    width = float(paths.paths[0].y[1] - paths.paths[0].y[0])
    last = int(np.ceil(reach / width))
    grid = width * np.arange(-last, last + 1.0)  # the strips themselves, and some beyond
    depth = paths.at(lambda path: path.depth_on(grid), own, ratio) * scaled.height[..., None]
    if np.any(np.abs(scale - 1.0) > 1e-12):
        depth = _stretched(grid, depth, scale[..., None])
    edge = paths.at(lambda path: path.edge, own, ratio) * scale
    depth = depth * np.where(stops.disc == 1, state.disc1_share, 1.0 - state.disc1_share)[..., None]
    return Surface(y=grid, height=-depth, edge=edge[..., None], depth=depth.max(axis=-1, keepdims=True))


def _stretched(grid: Floats, depth: Floats, scale: Floats) -> Floats:
    """depth(y / scale) on the same uniform grid; scale (set, stop, 1)."""
    step = grid[1] - grid[0]
    position = np.clip((grid / scale - grid[0]) / step, 0.0, len(grid) - 1.0)
    return linear_at(depth, position)
