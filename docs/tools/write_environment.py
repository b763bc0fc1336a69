"""Write docker/menshin.env.example, every setting as a variable: `python docs/tools/write_environment.py`."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from service.settings import KEY_VARIABLE, settings_by_name
from service.settings.names import variable

TARGET = Path(__file__).parents[2] / "docker" / "menshin.env.example"
OPENING = f"""\
# Every setting of Menshin. Copy it to docker/menshin.env for Compose, to /etc/menshin/menshin.env for systemd.
# `python docs/tools/write_environment.py` writes this file. A line without # is in use; the values are the defaults.
# Lists are JSON: ["a", "b"]. Keep the file to yourself (chmod 600): it may hold passwords.

# key that encrypts secrets in the database; `menshin secret new-key` prints one
#{KEY_VARIABLE}=
"""


def document() -> str:
    """The whole file."""
    return OPENING + "".join(_lines())


def _lines() -> Iterator[str]:
    group = ""
    for name, field in settings_by_name().items():
        first, _, member = name.partition(".")
        if member and first != group:
            group = first
            yield f"\n# --- {group} ---\n"
        yield f"\n# {field.description}\n#{variable(name)}={_default(field)}\n"


def _default(field: FieldInfo) -> str:
    """The default as a variable has it; empty where there is none, or it depends on the machine."""
    value: Any = field.default
    if value is None or value is PydanticUndefined:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return json.dumps(value) if isinstance(value, list | tuple) else str(value)


if __name__ == "__main__":
    TARGET.write_text(document(), "utf-8")
