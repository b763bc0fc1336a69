"""The files that run first are there."""

from pathlib import Path

HERE = Path(__file__).parent


def test_every_file_of_the_list_exists() -> None:
    listed = (HERE / "longest_first.txt").read_text("utf-8").split()
    assert [name for name in listed if not (HERE / name).is_file()] == []
