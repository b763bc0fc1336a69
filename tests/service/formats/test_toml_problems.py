import tomllib

import pytest
from hypothesis import given, strategies as st

from service.formats.toml_problems import line_of

TEXT = """\
a = 1
list = [
  1,
  2,
]  # ends here
[table]
inner.key = "x"
[[rows]]
v = 1
[[rows]]
w = '''
two lines'''
v = 2
"""


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("a",), 1),
        (("list",), 2),
        (("table",), 6),
        (("table", "inner", "key"), 7),
        (("rows", 0, "v"), 9),
        (("rows", 1), 10),
        (("rows", 1, "w"), 11),
        (("rows", 1, "v"), 13),
        (("rows", 1, "missing"), 10),  # the table that should hold it
        (("missing",), 1),
    ],
)
def test_the_line_where_a_key_begins(path: tuple[str | int, ...], line: int) -> None:
    assert line_of(TEXT, path) == line


@given(blank=st.integers(0, 20), rows=st.integers(1, 6), data=st.data())
def test_any_row_is_detected_at_any_position(blank: int, rows: int, data: st.DataObject) -> None:
    text = "\n" * blank + "".join(f"[[row]]\nv = {n}\n" for n in range(rows))
    row = data.draw(st.integers(0, rows - 1))
    assert tomllib.loads(text)["row"][row] == {"v": row}
    assert line_of(text, ("row", row, "v")) == blank + 2 * row + 2
