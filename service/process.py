"""Settings of every process of the service: threads of numerical libraries and thresholds of garbage collection."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment in which numerical libraries use one thread, because the processes run in parallel. With several threads,
16 simultaneous decompositions took ten times as long, and one analysis on a busy machine with two cores took ten times
the processor time."""
GARBAGE = (50_000, 20, 20)
"""Thresholds for `gc.set_threshold`. They are high because modules create many objects that live as long as the
process, and because a page may read thousands of rows."""
