"""Contact, wear and heat on cases drawn anew: `python tests/bench.py --seed 7 drawn` draws others.

Each section takes a generator of random numbers and yields the worst of its cases beside a target, against closed
forms, solvers of ordinary differential equations or the exact half-space solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from rigs import solve_rolling

AtMost = Callable[..., object]


def shaft_with_pauses(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Disc and shaft through drives and pauses, against the exponential of their matrix and an ODE solver."""
    from scipy.integrate import solve_ivp
    from scipy.linalg import expm

    from twindisc_cli.physics import disc_heat

    closed, solved = [], []
    for case in range(200):
        capacity, shaft, joint = np.exp(rng.uniform(np.log([20.0, 20.0, 0.01]), np.log([500.0, 2e4, 20.0])))
        loss = float(rng.choice([0.0, np.exp(rng.uniform(np.log(0.01), np.log(10.0)))], p=[0.1, 0.9]))
        count = 8
        duration = np.exp(rng.uniform(np.log(1.0), np.log(3600.0), count))
        power, room = rng.uniform(0.0, 50.0, count) * (rng.random(count) < 0.6), rng.uniform(280.0, 300.0, count)
        found = disc_heat.temperatures(
            power=power, duration=duration, capacity=capacity, convection=loss, environment=room, initial=293.0,
            shaft_conductance=joint, shaft_capacity=shaft,
        )[0]  # fmt: skip
        rates = np.array([[-(loss + joint), joint], [joint, -joint]]) / [[capacity], [shaft]]
        one = other = np.array([293.0, 293.0])
        for i in range(count):
            drive = np.array([(power[i] + loss * room[i]) / capacity, 0.0])
            both = np.block([[rates, drive[:, None]], [np.zeros((1, 3))]])
            one = (expm(both * duration[i]) @ np.append(one, 1.0))[:2]
            closed.append(abs(found[i] - one[0]))
            if case < 10:
                other = solve_ivp(
                    lambda _, x, drive=drive, rates=rates: rates @ x + drive, (0.0, duration[i]), other,
                    method="LSODA", rtol=1e-11, atol=1e-9,
                ).y[:, -1]  # fmt: skip
                solved.append(abs(found[i] - other[0]))
    yield at_most("shaft with pauses, 200 drawn, against the matrix exponential", max(closed), 1e-6, "K")
    yield at_most("  10 of them against an ODE solver", max(solved), 1e-6, "K")


def loads_up_and_down(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Histories of loads between a quarter and four times the rig's, against an integration of the profile of its
    own."""
    import load_integration
    import rigs

    from twindisc_cli.model.experiment import Options
    from twindisc_cli.model.forward import ForwardModel

    mu, wear = 0.5, 6e-5
    for contact, steps in (("hertz", 40), ("half_space", 30)):
        deepest, traction, fallen = [], [], []
        for _ in range(10):
            count = int(rng.integers(3, 7))
            ratio, creepage = np.exp(rng.uniform(np.log([[0.25], [0.002]]), np.log([[4.0], [0.02]]), (2, count)))
            history = replace(rigs.history(creepage, 2), load_factor=np.repeat(ratio, 2))
            options = Options(contact=contact, wear_coefficient=wear, traction="exact")
            model = ForwardModel(rigs.experiment(history, options=options))
            base = {"mu": np.array([mu]), "K": np.array([wear]), "convection_W_K": np.array([1.6])}
            found, rig = model.predict(base), rigs.rig()
            load = np.broadcast_to(found.state.normal_load / rig.normal_load, found.section.shape)
            depth, at = found.paths.at(lambda path: path.depth, found.section, load)[0], model.points.of_iteration[1::2]
            facet = 0.5 * np.cbrt(12.0 * found.section[0, -1] / rig.curvature_y)
            half = max(1.1 * facet + 1.3 * float(rig.patch.b) * np.cbrt(ratio.max()), 1.25 * facet)
            per_piece = wear / model.circumference_hardness * rigs.SPEED * 168.0
            own = load_integration.integrated(
                rig, contact, half * np.linspace(-1.0, 1.0, 141), loads=rigs.LOAD * ratio, creepage=creepage, mu=mu,
                wear=per_piece, steps=steps,
            )  # fmt: skip
            deepest.append(100.0 * np.abs(depth[at].max(axis=1) / own[0] - 1.0).max())
            traction.append(np.abs(found.state.traction_ratio[0, at] - own[1]).max())
            fallen.append(-np.diff(depth, axis=0).min() / depth.max())
        yield at_most(f"10 drawn histories of loads, {contact}: depth against an integration", max(deepest), 0.5, "%")
        yield at_most("  T/N", max(traction), 0.004)
        yield at_most("  depth that came back, over the greatest", max(fallen), 1e-9)


def tilted_cylinders(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Straight discs whose axes tilt, against strips of Carter at their own creepage, and against the solver."""
    import rigs

    from twindisc_cli.model.experiment import Disc, Options, Rig
    from twindisc_cli.model.forward import ForwardModel

    steel = {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "hardness": rigs.HARDNESS}
    y = 0.5 * ((2.0 * np.arange(4001) + 1.0) / 4001 - 1.0)
    modulus, off, solved = 206e9 / 2.6, [], []
    for case in range(50):
        radius, width = rng.uniform(0.015, 0.05), rng.uniform(0.003, 0.02)
        load = width * np.exp(rng.uniform(np.log(2e4), np.log(1e6)))
        mu, creepage, tilt = (
            rng.uniform(0.05, 0.6),
            np.exp(rng.uniform(np.log(2e-4), np.log(0.02))),
            0.02 * rng.random(),
        )
        discs = [Disc(radius, np.inf, width=width, **steel) for _ in range(2)]
        history = rigs.history([creepage], 1)
        test = rigs.experiment(history, rig=Rig(*discs, normal_load=load, rolling_speed=1.0),
                               options=Options(traction="exact"))  # fmt: skip
        base = {"mu": np.array([mu]), "K": np.array([np.nan]), "convection_W_K": np.array([1.0])}
        found = ForwardModel(test).predict(
            base, {"misalignment": {"yaw_mrad": np.zeros(1), "tilt_mrad": np.array([1e3 * tilt])}}
        )
        spin, a = tilt / radius, float(test.rig.patch.a)
        bound = a / radius * mu * 2.0
        local = creepage - spin * width * y
        k = np.minimum(np.abs(local) / bound, 1.0)
        carter = float(np.mean(np.sign(local) * (1.0 - (1.0 - k) ** 2)))
        off.append(abs(float(found.state.traction_ratio[0, 0]) / mu - carter))
        if case < 3:
            n, across = 64, 65
            half = 24.0 * a  # a width of 24 lengths, with the same creepages at its ends
            x, place = (
                a * ((2.0 * np.arange(n) + 1.0) / n - 1.0),
                half * ((2.0 * np.arange(across) + 1.0) / across - 1.0),
            )
            pressure = np.sqrt(1.0 - (x / a) ** 2) * np.ones((across, 1)) * float(test.rig.patch.p0)
            force = solve_rolling(
                x=x, y=place, pressure=pressure, mu=mu, shear_modulus=modulus, poisson=0.3, creepage_x=creepage,
                spin=spin * 0.5 * width / half,
            ).traction[0].sum()  # fmt: skip
            solved.append(abs(force / (mu * pressure.sum()) - carter))
    yield at_most("tilted cylinders, 50 drawn, T/(mu N) against strips of Carter", max(off), 0.005)
    yield at_most("  3 of them, by the solver on a line 24 times as wide as long", max(solved), 0.005)


def flash_temperatures(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Largest rise and mean between the limits of speed, against the sum of moving point sources."""
    from test_flash import ONE_FLUX, UNIT, rises

    from twindisc_cli.physics.flash import flash_temperature

    off = np.empty((40, 2))
    for case in range(len(off)):
        ratio, peclet = np.exp(rng.uniform(np.log([0.1, 0.1]), np.log([5.0, 200.0])))
        found = flash_temperature(power=ONE_FLUX / ratio, a=1.0, b=1.0 / ratio, speed=2.0 * peclet, **UNIT)
        known = np.array(rises(float(ratio), float(peclet)))
        off[case] = 100.0 * np.abs(2.0 * np.array([float(found.maximum), float(found.mean)]) / known - 1.0)
    yield at_most("flash temperature, 40 drawn, largest rise against moving sources", off[:, 0].max(), 3.0, "%")
    yield at_most("  mean rise", off[:, 1].max(), 3.0, "%")


def unlike_discs(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Discs of unlike elasticity, creepages of both signs, through the forward model, against the solver."""
    import rigs

    from twindisc_cli.model.contact_fields import exact_field, hertz_patch
    from twindisc_cli.model.experiment import Disc, Options, Rig
    from twindisc_cli.model.forward import ForwardModel
    from twindisc_cli.physics.half_space.rolling import Creepage

    off, work, yawed = [], [], []
    while len(off) < 100 or len(yawed) < 20:
        turned = len(off) == 100
        young, radius = np.exp(rng.uniform(np.log([[5e9], [0.01]]), np.log([[400e9], [0.1]]), (2, 2)))
        nu, crown = rng.uniform(0.1, 0.48, 2), np.exp(rng.uniform(np.log(0.005), np.log(0.5)))
        discs = [
            Disc(r, t, youngs_modulus=e, poisson_ratio=v, hardness=rigs.HARDNESS)
            for r, t, e, v in zip(radius, (np.inf, crown), young, nu, strict=True)
        ]
        rig = Rig(*discs, normal_load=float(np.exp(rng.uniform(0.0, np.log(500.0)))), rolling_speed=1.0)
        mu, ratio = rng.uniform(0.05, 0.8), float(rig.patch.a / rig.patch.b)
        if not 0.02 < abs(rig.dundurs) / mu < 3.0 or not 0.07 < ratio < 10.0:
            continue
        unit = mu * rig.normal_load / (rig.shear_modulus * float(rig.patch.a * rig.patch.b) * 4.5)
        creepage = float(np.exp(rng.uniform(np.log(0.1), np.log(8.0))) * rng.choice([-1.0, 1.0]) * unit)
        yaw = turned * unit * rng.uniform(0.3, 3.0)
        history = replace(rigs.history([creepage], 1), yaw=np.array([yaw]))
        test = rigs.experiment(history, rig=rig, options=Options(traction="exact"))
        base = {"mu": np.array([mu]), "K": np.array([np.nan]), "convection_W_K": np.array([1.0])}
        found = ForwardModel(test).predict(base).state
        exact = exact_field(hertz_patch(rig, rig.normal_load), rig, mu=mu, creepage=Creepage(creepage, yaw))
        capacity = mu * rig.normal_load
        (yawed if turned else off).append(abs(float(found.traction_ratio[0, 0]) / mu - exact.force_x / capacity))
        if not turned:
            slid = max(abs(creepage), unit)
            work.append(abs(float(found.power[0, 0]) - exact.power) / (capacity * slid))
    yield at_most("unlike discs, 100 drawn, both signs, T/(mu N) against the solver", max(off), 0.01)
    yield at_most("  power over that of full slip", max(work), 0.02)
    yield at_most("  20 with lateral creepage too, which is approximate, T/(mu N)", max(yawed), 0.25)


SECTIONS = {
    "drawn: unlike discs": unlike_discs,
    "drawn: flash temperatures": flash_temperatures,
    "drawn: tilted cylinders": tilted_cylinders,
    "drawn: loads up and down": loads_up_and_down,
    "drawn: shaft with pauses": shaft_with_pauses,
}
