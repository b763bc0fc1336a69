"""Forms with files, as browsers send them."""

from hypothesis import example, given, strategies as st

from service.http.forms import SentFile, parts

KIND = "multipart/form-data; boundary=----WebKitFormBoundary7MA4"
EDGE = b"------WebKitFormBoundary7MA4"
NAMES = st.text(st.characters(exclude_categories=["C", "Z"], exclude_characters='"\\/;%*'), min_size=1, max_size=20)


@given(st.binary(min_size=1, max_size=300), NAMES)
@example(b"\r\n", "a.csv")
@example(b"\r\r\n\n\x00\xff\x85", "記録.csv")
def test_files_keep_every_byte_and_their_names(data: bytes, name: str) -> None:
    body = b"\r\n".join(
        [
            EDGE,
            b'Content-Disposition: form-data; name="size"',
            b"",
            b" 80 mm ",
            EDGE,
            f'Content-Disposition: form-data; name="motion"; filename="{name}"'.encode(),
            b"Content-Type: application/octet-stream",
            b"",
            data,
            EDGE + b"--",
            b"",
        ]
    )
    assert parts(KIND, body) == ({"size": "80 mm"}, (SentFile(name, data),))


def test_what_is_no_form_has_neither_fields_nor_files() -> None:
    nested = EDGE + b"\r\nContent-Type: multipart/mixed; boundary=b\r\n\r\n--b\r\n\r\n1\r\n--b--\r\n" + EDGE + b"--"
    for kind, body in ((KIND, b""), (KIND, b"no form"), ("multipart/form-data", b"--\r\n\r\n1"), (KIND, nested)):
        assert parts(kind, body) == ({}, ())


def test_a_folder_in_the_name_of_a_file_is_left_out() -> None:
    head = b'Content-Disposition: form-data; name="motion"; filename="C:\\\\a\\\\b.csv"\r\n\r\n1\r\n'
    (file,) = parts(KIND, EDGE + b"\r\n" + head + EDGE + b"--\r\n")[1]
    assert file.name == "b.csv"
