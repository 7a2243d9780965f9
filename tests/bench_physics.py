"""Contact, wear and heat on cases drawn anew: `python tests/bench.py --seed 7 drawn` draws others.

Each section takes a generator of random numbers and yields the worst of its cases beside a target, against closed
forms, solvers of ordinary differential equations or the exact half-space solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from rigs import solve_rolling

from twindisc_cli.model.experiment import Rig
from twindisc_cli.physics.half_space.normal import NormalContact

AtMost = Callable[..., object]
Floats = NDArray[np.float64]


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
            shaft=disc_heat.Shaft(joint, shaft),
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


def worn_tracks(rng: Generator, at_most: AtMost) -> Iterator[object]:
    """Tracks worn by half-space contact, on new discs that are smooth, grooved or off-centre: T/N against the solver.

    A track and its equivalent ellipse go through the solver on grids of as many elements, which takes most of their
    error from the difference.
    """
    import rigs
    from test_worn import CREEPAGE, MU

    from twindisc_cli.model.experiment import Measured, Options, Start
    from twindisc_cli.model.forward import ForwardModel

    off: dict[str, list[float]] = {"smooth": [], "grooved": [], "off-centre": []}
    y = np.linspace(-6e-3, 6e-3, 4801)
    for case in range(60):
        kind = list(off)[case % 3]
        rig = rigs.rig(crown=float(np.exp(rng.uniform(np.log(0.01), np.log(0.1)))))
        b, wear = float(rig.patch.b), float(np.exp(rng.uniform(np.log(2e-5), np.log(1e-3))))
        rise = np.zeros_like(y)
        if kind == "grooved":
            for _ in range(int(rng.integers(1, 5))):
                depth, width = np.exp(rng.uniform(np.log([2e-7, 0.1]), np.log([2e-6, 0.3])))
                rise -= depth * np.exp(-(((y - rng.uniform(-1.0, 1.0) * b) / (width * b)) ** 2))
        elif kind == "off-centre":
            rise += rng.uniform(-0.5, 0.5) * b * rig.curvature_y * y
        history = rigs.history([0.02, *CREEPAGE], [10] + [1] * len(CREEPAGE))
        history = replace(history, duration=np.where(history.step > 0, 1e-3, history.duration))
        options = Options(contact="half_space", traction="exact", wear_coefficient=wear)
        start = Start(y, np.stack([np.zeros_like(y), rise])) if kind != "smooth" else None
        test = rigs.experiment(history, rig=rig, options=options, measured=Measured(start=start))
        model = ForwardModel(test)
        found = model.predict({"mu": np.array([MU]), "K": np.array([wear])})
        path = found.paths.paths[0]
        depth = found.paths.at(lambda p, at=path.y: np.array([np.interp(at, p.y, d) for d in p.depth]),
                               found.section[:, -1:])[0, 0]  # fmt: skip
        gap = 0.5 * rig.curvature_y * path.y**2 - np.interp(path.y, y, rise) + depth
        law = found.state.traction_ratio[0, model.points.of_iteration[-len(CREEPAGE) :]]
        off[kind].append(float(np.abs(law - solved_track(rig, path.y, gap, MU, np.array(CREEPAGE))).max()))
    for kind, errors in off.items():
        yield at_most(f"worn tracks, 20 {kind}, T/N at mu = 0.6 against the solver, the largest", max(errors), 0.005)
    every = np.concatenate([np.array(errors) for errors in off.values()])
    yield at_most("  all 60, 95 % within", float(np.quantile(every, 0.95)), 0.003)


def solved_track(rig: Rig, y: Floats, gap: Floats, mu: float, creepage: Floats) -> Floats:
    """T/N of a profile by the solver, its difference from the equivalent ellipse added to the ellipse's law."""
    from scipy.interpolate import CubicSpline

    from table_makers.strips import solve_strips
    from table_makers.worn import Profile, rig_of
    from twindisc_cli.physics import exact, kalker
    from twindisc_cli.physics.half_space import rolling
    from twindisc_cli.physics.half_space.strips import equivalent_ellipse

    given = {"curvature_x": rig.curvature_x, "normal_load": rig.normal_load, "effective_modulus": rig.effective_modulus}
    strips = solve_strips(y=y, gap=gap, relative_accuracy=1e-4, **given)
    a, b = (float(axis) for axis in equivalent_ellipse(strips))
    loaded = y[strips.line_load > 0.0]
    middle, half = 0.5 * (loaded[0] + loaded[-1]), 0.5 * (loaded[-1] - loaded[0]) + 0.5 * (y[1] - y[0])
    shape, round_rig = CubicSpline(y - middle, gap), rig_of(a / b)
    tracks = Profile(rig, shape, 1.03 * float(strips.half_length.max()), 1.03 * half), Profile(
        round_rig, lambda place: 0.5 * round_rig.curvature_y * place**2, 1.02 * float(round_rig.patch.a),
        1.02 * float(round_rig.patch.b),
    )  # fmt: skip

    def force(profile: Profile, pressed: NormalContact, bound: Floats, v: float) -> float:
        discs = rolling.Discs(profile.rig.shear_modulus, profile.rig.poisson_ratio)
        driven = rolling.Creepage(v)
        return rolling.solve(x=pressed.x, y=pressed.y, pressure=bound, mu=1.0, discs=discs, creepage=driven,
                             tolerance=1e-4).force_x / profile.rig.normal_load  # fmt: skip

    nominal = rig.shear_modulus * a * b * float(kalker.coefficients(a / b, rig.poisson_ratio).c11) / rig.normal_load
    results = []
    for n in (32, 64):
        pressed = [profile.pressed(n) for profile in tracks]
        linear = [force(p, at, np.where(at.patch, 1e20, 0.0), 1.0) for p, at in zip(tracks, pressed, strict=True)]
        scale = float(round_rig.patch.a * round_rig.patch.b) / round_rig.normal_load * rig.normal_load / (a * b)
        stiffness = nominal * linear[0] / linear[1] * scale
        xi = stiffness * creepage / mu
        curves = np.array([
            [force(p, at, at.pressure, float(x) / k) for x in xi]
            for p, at, k in zip(tracks, pressed, linear, strict=True)
        ])  # fmt: skip
        results.append(mu * (exact.saturation(xi, a / b, rig.poisson_ratio) + curves[0] - curves[1]))
    return np.asarray(2.0 * results[1] - results[0])


SECTIONS = {
    "drawn: unlike discs": unlike_discs,
    "drawn: worn tracks": worn_tracks,
    "drawn: flash temperatures": flash_temperatures,
    "drawn: tilted cylinders": tilted_cylinders,
    "drawn: loads up and down": loads_up_and_down,
    "drawn: shaft with pauses": shaft_with_pauses,
}
