"""Makes rig.csv and profile.csv of the tutorial: a test in full sliding whose friction falls with the sliding speed.

    T = mu(w) N,  mu = 0.55 (0.5 + 0.5 exp(-3 w)),  w = v V        w^3 = 12 S R,  S = K E / (2 pi R H)

Closed forms alone, nothing of twindisc: python docs/tutorial/make.py
"""

from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
RADIUS, LOAD, SPEED, HARDNESS, K = 0.03, 72.0, 9.4248, 700 * 9.80665e6, 2e-4
rng = np.random.default_rng(11)

creepage = np.repeat([0.02, 0.05, 0.015, 0.08, 0.03, 0.06], 84)  # 84 s are 4200 revolutions at 3000 rpm
idle = 30
slip = np.concatenate([np.full(idle, 0.02), creepage, np.full(idle, 0.06)])
load = np.concatenate([np.zeros(idle), np.full(len(creepage), LOAD), np.zeros(idle)])
mu = 0.55 * (0.5 + 0.5 * np.exp(-3.0 * slip * SPEED))
torque = mu * load * RADIUS + 0.02 + 0.006 * rng.standard_normal(len(slip))
columns = (np.arange(len(slip)), 3000 * (1 + slip / 2), 3000 * (1 - slip / 2), torque, load)
head = "time [s],speed 1 [rpm],speed 2 [rpm],torque [N m],normal load [N]"
np.savetxt(HERE / "rig.csv", np.transpose(columns), fmt=["%d", "%.1f", "%.1f", "%.4f", "%.1f"], delimiter=",",
           header=head, comments="")  # fmt: skip

energy = float(np.sum((mu * load * slip)[idle:-idle]) * SPEED)
section = K * energy / (2.0 * np.pi * RADIUS * HARDNESS)
half = 0.5 * np.cbrt(12.0 * section * RADIUS)
y = np.linspace(-1.5e-3, 1.5e-3, 151)
height = np.minimum((y**2 - half**2) / (2.0 * RADIUS), 0.0) + 1e-7 * rng.standard_normal(len(y))
np.savetxt(HERE / "profile.csv", np.transpose([y * 1e3, height * 1e6]), fmt="%.4f", delimiter=",",
           header="y [mm],height [um]", comments="")  # fmt: skip
