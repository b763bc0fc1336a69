"""The page of effects matches the effects and shows each one."""

import write_effects

from core.effects import EFFECTS


def test_the_page_is_what_the_effects_say() -> None:
    assert write_effects.PAGE.read_text("utf-8") == write_effects.document(), (
        "python docs/tools/write_effects.py would mend it"
    )


def test_the_picture_has_a_loop_for_every_effect() -> None:
    drawn = write_effects.PICTURE.read_text("utf-8")
    assert [name for name in EFFECTS if f">{name}</text>" not in drawn] == []
