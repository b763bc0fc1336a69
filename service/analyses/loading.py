"""Preparation of a process for analyses of events."""


def load() -> None:
    """Import what an analysis needs: 1 s of processor time, and 150 MB."""
    from scipy import interpolate, optimize, signal, stats  # noqa: F401  which core imports at their first use

    import core.analysis  # noqa: F401  loaded here so that no event waits for it
