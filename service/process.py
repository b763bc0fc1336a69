"""What holds in every process of the service: threads of numerical libraries, and searches for garbage."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of a process whose linear algebra has one thread, since processes work side by side: with several, 16
simultaneous decompositions took ten times as long, and one analysis on a busy machine of two cores ten times the
processor time."""
GARBAGE = (50_000, 20, 20)
"""Thresholds of the searches for garbage: modules have very many objects, which all stay, and a page may read thousands
of rows."""
