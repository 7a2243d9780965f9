"""One sample that lies far from what all others make it, as a weighing with debris on the disc.

    d_i = r_i^2 / (1 - h_i)

    d_i   chi2 that falls where sample i is left out and all parameters are fitted anew, to first order
    r_i   residual in standard deviations of the noise, h_i its leverage, of J (J' J)^-1 J'

Source: R. D. Cook, S. Weisberg, Residuals and Influence in Regression (1982), section 2.2.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np
from scipy.special import chdtrc

from twindisc_cli.loop.channels import channels
from twindisc_cli.loop.fit import Fit
from twindisc_cli.loop.thresholds import SEARCH

FAR = 5.0
"""Standard deviations from which on a sample is named: of a thousand one lies so far in one record of two thousand."""


def notes(fitted: Fit, among: Collection[str]) -> Iterator[str]:
    """The sample of each of these channels without which nothing of it is unexplained, where there is one."""
    if not among:
        return
    leverage = np.sum(np.linalg.qr(fitted.jacobian)[0] ** 2, axis=1)
    fall = fitted.residual**2 / np.maximum(1.0 - leverage, 1e-6)
    for (number, channel), at in fitted.problem.places.items():
        case = fitted.problem.cases[number]
        noise = case.noise[channel]
        if channel not in among or noise.correlation > 0.0 or noise.slow is not None:
            continue
        here, first = fall[at], int(np.argmax(fall[at]))
        left = fitted.power(channel) - here[first]
        chance = float(chdtrc(max(fitted.problem.count(channel) - 1, 1), max(left, 0.0)))
        if here[first] > FAR**2 and chance > SEARCH.nothing_left:
            prediction = fitted.problem.predict(fitted.theta[None])[number]
            time = np.asarray(channels()[channel].covariates(case.model, prediction)["time"])[noise.order[first]]
            yield (
                f"{case.test.name}: one sample of the {channels()[channel].label}, at {time:.6g} s, lies "
                f"{np.sqrt(here[first]):.1f} standard deviations of the noise from what all others make it; without it "
                "nothing of them is unexplained"
            )
