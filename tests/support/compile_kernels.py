"""Compile the kernels of `core` and of the hidden laws, which later processes get from Numba's cache.

.ci/run does so once. Otherwise processes that start together compile the same kernels at the same time.
"""

from hidden.trial import trial

from service.models.warming import warm


def main() -> None:
    """Drive each kernel once."""
    warm()
    trial("hardening", 1)


if __name__ == "__main__":
    main()
