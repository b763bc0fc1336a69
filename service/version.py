"""The version of the running code."""

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

VERSION = version("menshin")
"""Stored with every result."""


@cache
def code_digest() -> str:
    """SHA-256 of the installed sources of `core` and `service`: it tells two builds of one version apart."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for file in sorted(file for room in ("core", "service") for file in (root / room).rglob("*.py")):
        digest.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()
