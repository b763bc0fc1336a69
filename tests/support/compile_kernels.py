"""Compile the kernels of `core`, of the hidden laws and of the independent simulation, which later processes get from
Numba's cache.

.ci/run does so once. Otherwise processes that start together compile the same kernels at the same time.
"""

from multiprocessing import Process

import numpy as np
from ground_motions import RATE
from hidden.trial import trial
from independent_simulation import LinearSuperstructure, independent_response

from service.models.warming import warm


def warm_simulations() -> None:
    """Compile what simulates the hidden laws, and what simulates any superstructure in another way than the product."""
    trial("hardening", 1)
    storey = LinearSuperstructure(1e6, np.array([1e6]), np.array([[1e9]]), np.array([[1e6]]))
    independent_response(storey, np.zeros(3), RATE)


def main() -> None:
    """Drive each kernel once, those of the product and those of the tests at the same time."""
    processes = [Process(target=target) for target in (warm, warm_simulations)]
    for one in processes:
        one.start()
    for one in processes:
        one.join()
    if any(one.exitcode for one in processes):
        raise SystemExit("not all kernels were compiled")


if __name__ == "__main__":
    main()
