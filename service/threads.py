"""Threads of numerical libraries: one in each process, since processes work side by side."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of a process whose linear algebra has one thread: with several, 16 simultaneous decompositions took ten
times as long, and one analysis on a busy machine of two cores took ten times the processor time."""
