"""Progress of long work: it never goes back, and says what is being done."""

from core.workbench.progress import FINE, in_shares, within


def test_a_part_of_the_work_reports_its_share_of_the_whole() -> None:
    reports: list[tuple[str, int, int]] = []
    second_half = within(lambda *one: reports.append(one), 0.5, 1.0)
    second_half("reading", 0, 4)
    second_half("reading", 3, 4)
    in_shares(within(second_half, 0.5, 1.0))("searching", 0.5)
    second_half("nothing to do", 0, 0)
    assert reports == [
        ("reading", 50, FINE),
        ("reading", 88, FINE),
        ("searching", 88, FINE),
        ("nothing to do", 50, FINE),
    ]
