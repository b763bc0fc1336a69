"""The machine of a measurement."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = (
    "numpy",
    "scipy",
    "numba",
    "ctrlsys",
    "pyOMA-2",
    "mdof",
    "sippy-unipi",
    "nfoursid",
    "diffrax",
    "jax",
    "openseespy",
)


def description() -> str:
    """One paragraph: processor, cores, threads, Python and the installed packages."""
    return (
        f"{processor()}, {os.cpu_count()} cores, {os.environ.get('OMP_NUM_THREADS', 'any number of')} BLAS thread, "
        f"Python {platform.python_version()}; {', '.join(filter(None, map(installed, PACKAGES)))}."
    )


def processor() -> str:
    """The model's name as Linux says, or the architecture."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]} ({platform.machine()})" if names else platform.machine()


def installed(package: str) -> str:
    """Its name and version; empty if it is not there."""
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return ""
