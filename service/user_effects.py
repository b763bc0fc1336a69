"""Effects of this installation besides those of Menshin.

Files of a folder, each named by its file and holding EFFECT; and what installed packages offer as entry points of the
group `menshin.effects`, each named by its entry point.
"""

import sys
from collections.abc import Iterator
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from core.effect import Effect
from core.effects import add_effect
from core.errors import ModelError

GROUP = "menshin.effects"


def add_user_effects(folder: Path | None) -> None:
    """Add the effects to this process, before or after it has run a model.

    Args:
        folder: the setting effects_folder; None for entry points only.

    Raises:
        ModelError: an effect cannot be read or added; the message names its file or entry point.
    """
    for name, effect in (*_installed(), *([] if folder is None else _from_folder(folder))):
        if not isinstance(effect, Effect):
            raise ModelError(f"the effect {name} must be a core.effect.Effect, got {effect!r}")
        add_effect(name, effect)


def _installed() -> Iterator[tuple[str, object]]:
    for point in _entry_points(tuple(sys.path)):
        yield point.name, point.load()


@cache
def _entry_points(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Entry points of the packages on a path, which are read once: every package is looked at, in 15 ms."""
    return tuple(entry_points(group=GROUP))


def _from_folder(folder: Path) -> Iterator[tuple[str, object]]:
    if not folder.is_dir():
        raise ModelError(f"effects_folder = {folder} is not a folder; create it, or remove the setting")
    for path in sorted(folder.glob("[!_]*.py")):
        effect = getattr(_module(path), "EFFECT", None)
        if effect is None:
            raise ModelError(f"{path} has no EFFECT; each file of effects_folder defines one")
        yield path.stem, effect


def _module(path: Path) -> ModuleType:
    """The module of a file, executed once per process."""
    name = f"menshin_own_effects.{path.stem}"
    if name not in sys.modules:
        spec = spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            raise ModelError(f"{path} is not a Python file")
        module = module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except Exception as error:  # user code may raise anything
            raise ModelError(f"{path} cannot be run: {type(error).__name__}: {error}") from error
        sys.modules[name] = module
    return sys.modules[name]
