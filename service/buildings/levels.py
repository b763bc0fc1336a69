"""Which levels does an engineer mean who names them, or calls them base and roof?"""

from collections.abc import Iterable

from core.description import BuildingDescription


class LevelError(Exception):
    """No such level, or not levels that an analysis could use."""


def named(asked: Iterable[str], description: BuildingDescription) -> tuple[str, ...]:
    """Names of the levels to use, each once.

    Args:
        asked: names of levels, or the roles `ground`, `base` and `roof`; a level of such a name goes first.
        description: of the building.

    Raises:
        LevelError: a level is not known, or the base slab or every level above it is left out.
    """
    roles = {"ground": description.ground.name, "base": description.base.name, "roof": description.floors[-1].name}
    known = roles | {level.name: level.name for level in description.levels}
    wanted = list(asked)
    for name in wanted:
        if name not in known:
            raise LevelError(f"no level {name!r}; there are {', '.join(known)}")
    levels = tuple(dict.fromkeys(known[name] for name in wanted))
    if description.base.name not in levels:
        raise LevelError("the base slab must be among them, as in base,roof")
    if not {floor.name for floor in description.floors} & set(levels):
        raise LevelError("a level above the base slab must be among them, as in base,roof")
    return levels
