"""The page of effects matches the effects and shows each one."""

import importlib.util
from pathlib import Path

from core.effects import EFFECTS

SCRIPT = importlib.util.spec_from_file_location(
    "write_effects", Path(__file__).resolve().parents[2] / "docs" / "tools" / "write_effects.py"
)
assert SCRIPT is not None
assert SCRIPT.loader is not None
writer = importlib.util.module_from_spec(SCRIPT)
SCRIPT.loader.exec_module(writer)


def test_the_page_is_what_the_effects_say() -> None:
    assert writer.PAGE.read_text("utf-8") == writer.document(), "python docs/tools/write_effects.py would mend it"


def test_the_picture_has_a_loop_for_every_effect() -> None:
    drawn = writer.PICTURE.read_text("utf-8")
    assert [name for name in EFFECTS if f">{name}</text>" not in drawn] == []
