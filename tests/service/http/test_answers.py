"""Response bodies are cached as long as there is room, the most recently used ones."""

from service.http.responses import Answers


def test_the_longest_not_requested_makes_room() -> None:
    answers = Answers(most=5)
    answers.keep("a", b"11")
    answers.keep("b", b"22")
    assert answers.find("a") == b"11"
    answers.keep("c", b"33")
    assert [answers.find(tag) for tag in "abc"] == [b"11", None, b"33"]


def test_one_that_comes_twice_takes_its_room_once() -> None:
    answers = Answers(most=4)
    for _ in range(3):
        answers.keep("a", b"11")
    answers.keep("b", b"22")
    assert [answers.find(tag) for tag in "ab"] == [b"11", b"22"]


def test_one_too_long_is_not_kept() -> None:
    answers = Answers(most=4)
    answers.keep("a", b"11111")
    assert answers.find("a") is None
    answers.keep("b", b"22")
    assert answers.find("b") == b"22"
