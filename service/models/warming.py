"""Preparation of a process for jobs on models."""


def warm() -> None:
    """Load what such a job needs, and compile the kernels that no earlier process has compiled.

    It takes 3 s of processor time and 320 MB, and after an installation or a new effect some 30 s more.
    """
    import numpy as np

    from core.building import fixed_base_modes
    from core.model.force_response import force_response
    from core.model.isolator import Conditions
    from core.model.simulation import Axis, respond
    from core.paper import BUILDING, ISOLATOR
    from service.analyses.loading import load
    from service.models import figures, jobs  # noqa: F401  loaded here so that no job waits for them

    load()

    rate = 100.0
    motion = 0.1 * np.sin(np.arange(100) / 20)
    axis = Axis(fixed_base_modes(BUILDING), motion, Conditions.usual(motion.size, rate))
    for axes in ([axis], [axis, axis]):
        respond(axes, BUILDING.base_mass, ISOLATOR, rate)
    every = [(effect, parameter) for effect, values in ISOLATOR.effects.items() for parameter in values]
    for wanted in ([], every):
        force_response(ISOLATOR, motion, np.gradient(motion) * rate, rate, wanted=wanted)
