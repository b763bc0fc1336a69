"""Ways to simulate the paper's building on its isolation layer: ours and the peers'.

Each takes the ground acceleration (n,) in m/s² at RATE, linear between samples, and gives the layer's force (n,) in N.
The peers' models are eq 1 and eq 22 written down again in the terms of each.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from core.arrays import Matrix, Vector
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR, RATE

Integrate = Callable[[Vector], Vector]

FLOORS = BUILDING.floor_mass.size
MASS = np.append(BUILDING.base_mass, BUILDING.floor_mass)
STIFFNESS = BUILDING.storey_stiffness
DASHPOT = BUILDING.damping_coefficient * STIFFNESS
K_B = ISOLATOR.effects["elastic"]["k_b"]
C_B = ISOLATOR.effects["viscous"]["c_b"]
HYSTERESIS = ISOLATOR.effects["bouc_wen"]


@dataclass(frozen=True, slots=True)
class Integrator:
    """One way."""

    module: str
    integrate: Integrate


def ours(substeps: int | None) -> Integrate:
    """core.model.simulation with so many steps a sample, None for as many as it takes by itself."""

    def integrate(ground: Vector) -> Vector:
        return simulate(BUILDING, ISOLATOR, ground, RATE, substeps=substeps).force

    return integrate


def lsoda(rtol: float) -> Integrate:
    """scipy's LSODA, adaptive in step and order."""

    def integrate(ground: Vector) -> Vector:
        from scipy.integrate import solve_ivp

        n, linear = FLOORS + 1, _linear_rates()

        def rates(at: float, y: Vector) -> Vector:
            i = min(int(at * RATE), ground.size - 2)
            changes: Vector = linear @ y
            changes[n:-1] -= ground[i] + (at * RATE - i) * (ground[i + 1] - ground[i])
            changes[-1] = _rate_of_z(y[n], y[-1])
            return changes

        t = np.arange(ground.size) / RATE
        y = solve_ivp(rates, (0, t[-1]), np.zeros(2 * n + 1), "LSODA", t, rtol=rtol, atol=1e-3 * rtol).y
        force: Vector = K_B * y[0] + C_B * y[n] + HYSTERESIS["F_y"] * y[-1]
        return force

    return integrate


def _linear_rates() -> Matrix:
    """Rates of x and v from the base slab up, and of z, which is zero alone: one product is fastest in Python."""
    n = FLOORS + 1
    chain = [np.vstack([np.insert(s, 0, b), np.append(s, 0.0)]) for s, b in ((STIFFNESS, K_B), (DASHPOT, C_B))]
    K, C = (np.diag(below + above) - np.diag(above[:-1], 1) - np.diag(above[:-1], -1) for below, above in chain)
    linear = np.zeros((2 * n + 1, 2 * n + 1))
    linear[:n, n:-1] = np.eye(n)
    linear[n:-1, :n], linear[n:-1, n:-1] = -K / MASS[:, None], -C / MASS[:, None]
    linear[n, -1] = -HYSTERESIS["F_y"] / MASS[0]
    return linear


def _rate_of_z(v: float, z: float) -> float:
    softening = HYSTERESIS["gamma"] * abs(v) * z + HYSTERESIS["beta"] * v * abs(z)
    return (HYSTERESIS["A"] * v - softening) / HYSTERESIS["D_y"]


def diffrax(solver: str, steps: int) -> Integrate:
    """One of diffrax's explicit solvers by name, in steps of one length, so many a sample; compiled by JAX before."""
    compiled: list[Callable[[Vector], Vector]] = []  # by the first call, which is not timed

    def integrate(ground: Vector) -> Vector:
        if not compiled:
            compiled.append(_diffrax(solver, steps, ground.size))
        return np.asarray(compiled[0](ground))

    return integrate


def _diffrax(solver: str, steps: int, count: int) -> Callable[[Vector], Vector]:
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    n, t = FLOORS + 1, jnp.arange(count) / RATE

    def rates(at, y, ground):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202  traced by JAX
        i = jnp.clip((at * RATE).astype(int), 0, count - 2)
        shaking = ground[i] + (at * RATE - i) * (ground[i + 1] - ground[i])
        x, v, z = y[:n], y[n:-1], y[-1]
        layer = K_B * x[0] + C_B * v[0] + HYSTERESIS["F_y"] * z
        storeys = STIFFNESS * (x[1:] - x[:-1]) + DASHPOT * (v[1:] - v[:-1])
        acceleration = (jnp.append(storeys, 0.0) - jnp.insert(storeys, 0, layer)) / MASS - shaking
        return jnp.concatenate([v, acceleration, jnp.array([_rate_of_z(v[0], z)])])

    @jax.jit
    def force(ground):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
        y = diffrax.diffeqsolve(
            diffrax.ODETerm(rates),
            getattr(diffrax, solver)(),
            0.0,
            t[-1],
            1 / RATE / steps,
            jnp.zeros(2 * n + 1),
            args=ground,
            saveat=diffrax.SaveAt(ts=t),
            max_steps=None,
            adjoint=diffrax.ForwardMode(),  # no derivatives are asked for, and none are prepared
        ).ys
        return K_B * y[:, 0] + C_B * y[:, n] + HYSTERESIS["F_y"] * y[:, -1]

    return force  # type: ignore[no-any-return]


def opensees(steps: int) -> Integrate:
    """OpenSees with Newmark's average acceleration and Newton's iteration, so many steps a sample.

    Its BoucWen names γ and β the other way round from the paper and counts z in metres; its z is integrated by the
    implicit Euler method, which is what limits the accuracy.
    """

    def integrate(ground: Vector) -> Vector:
        import openseespy.opensees as ops

        _opensees_model(ops, ground)
        force = np.zeros(ground.size)
        for i in range(1, ground.size):
            if ops.analyze(steps, 1 / RATE / steps):
                raise RuntimeError(f"OpenSees did not converge in sample {i}")
            force[i] = ops.eleResponse(1, "material", 1, "stress")[0]
        return force

    return integrate


def _opensees_model(ops, ground: Vector) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001  a module without types
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for node in range(FLOORS + 2):
        ops.node(node, 0.0)
    ops.fix(0, 1)
    for node, mass in enumerate(MASS, start=1):
        ops.mass(node, float(mass))
    yield_displacement = HYSTERESIS["D_y"]
    gamma, beta = HYSTERESIS["beta"] / yield_displacement, HYSTERESIS["gamma"] / yield_displacement
    initial_stiffness = HYSTERESIS["F_y"] / yield_displacement
    ops.uniaxialMaterial("Elastic", 101, K_B, C_B)
    ops.uniaxialMaterial("BoucWen", 102, 0.0, initial_stiffness, 1.0, gamma, beta, HYSTERESIS["A"], 0.0, 0.0, 0.0)
    ops.uniaxialMaterial("Parallel", 100, 101, 102)
    ops.element("zeroLength", 1, 0, 1, "-mat", 100, "-dir", 1)
    for storey, (stiffness, dashpot) in enumerate(zip(STIFFNESS, DASHPOT, strict=True), start=1):
        ops.uniaxialMaterial("Elastic", 200 + storey, float(stiffness), float(dashpot))
        ops.element("zeroLength", 1 + storey, storey, 1 + storey, "-mat", 200 + storey, "-dir", 1)
    ops.timeSeries("Path", 1, "-dt", 1 / RATE, "-values", *ground)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-8, 20)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")


OURS = "core.model.simulation, 1 step"
"""Fast enough and right to 2e-4, the accuracy at which ways are compared."""
INTEGRATORS: Mapping[str, Integrator] = MappingProxyType(
    {
        OURS: Integrator("core.model.simulation", ours(1)),
        "core.model.simulation, as it is called": Integrator("core.model.simulation", ours(None)),
        "core.model.simulation, 16 steps": Integrator("core.model.simulation", ours(16)),
        "LSODA, rtol 1e-5": Integrator("scipy.integrate", lsoda(1e-5)),
        "LSODA, rtol 1e-8": Integrator("scipy.integrate", lsoda(1e-8)),
        "diffrax, Bosh3, 1 step": Integrator("diffrax", diffrax("Bosh3", 1)),
        "diffrax, Tsit5, 1 step": Integrator("diffrax", diffrax("Tsit5", 1)),
        "OpenSeesPy, 10 steps": Integrator("openseespy.opensees", opensees(10)),
        "OpenSeesPy, 32 steps": Integrator("openseespy.opensees", opensees(32)),
    }
)
"""The coarsest steps or tolerance with which each comes within 2e-4, and others beside it."""
