"""What is an earthquake called in tables and pictures?"""

from collections.abc import Collection


def label(earthquake: str, direction: str, directions: Collection[str]) -> str:
    """Its name; with the direction where there are several.

    Args:
        earthquake: its name.
        direction: that is told of.
        directions: that are told of beside it.
    """
    return f"{earthquake} {direction}" if len(directions) > 1 else earthquake
