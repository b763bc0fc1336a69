"""Folders of the real records, beside the checkout and never in it."""

from pathlib import Path

import pytest

SHARED = (Path(__file__).resolve().parents[3] / "shared").resolve()
BNCS = SHARED / "data" / "bncs"
CSMIP = SHARED / "data" / "csmip"

needs_shared = pytest.mark.skipif(not BNCS.is_dir(), reason="needs the real records in ../shared/data ")
