"""Speed and accuracy beside named peers: `python -m benchmarks` measures them into docs/reference/benchmarks.md."""

import os

# Read when NumPy's BLAS is loaded: every way is measured with one thread, so that processor times compare.
os.environ["OMP_NUM_THREADS"] = "1"
