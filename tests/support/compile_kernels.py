"""Compile the kernels of `core` and of the hidden laws, which later processes get from Numba's cache.

.ci/run does so once. Otherwise processes that start together compile the same kernels at the same time.
"""

from multiprocessing import Process

from hidden.trial import trial

from service.models.warming import warm


def warm_hidden_laws() -> None:
    """Compile what simulates the hidden laws."""
    trial("hardening", 1)


def main() -> None:
    """Drive each kernel once, those of both at the same time."""
    processes = [Process(target=target) for target in (warm, warm_hidden_laws)]
    for one in processes:
        one.start()
    for one in processes:
        one.join()
    if any(one.exitcode for one in processes):
        raise SystemExit("not all kernels were compiled")


if __name__ == "__main__":
    main()
