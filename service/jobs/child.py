"""The start of a process that computes jobs.

Each loads this module with all that it imports: neither the settings nor the database.
"""

import os
from pathlib import Path
from threading import Thread
from time import sleep

from service.user_effects import add_user_effects


def begin(parent: int, effects_folder: Path | None) -> None:
    """Begin a process of this machine, which computes for its parent until that ends."""
    end_with_parent(parent)
    add_user_effects(effects_folder)


def end_with_parent(parent: int) -> None:
    """End this process when its parent is killed: no process would read its results."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True, name="end with the parent").start()
