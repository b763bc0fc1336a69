"""The benchmarks are not installed: they are found in the checkout, after all that is."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))
