"""How quick and how accurate is it beside its peers? `python -m benchmarks` runs all and writes docs/benchmarks.md."""

import os

# Read when NumPy's BLAS is loaded: every way is measured with one thread, so that processor times compare.
os.environ["OMP_NUM_THREADS"] = "1"
