"""The tables of the restoring force's accuracy say what the scores say, and show what misses its goal."""

from accuracy import Agreement, Score

from benchmarks import force_tables
from benchmarks.restoring_force import QUICK, on_truth
from benchmarks.table import Table


def score(estimator: str, kind: str, seed: int, fit: float, coverage: float = 0.95) -> Score:
    measured = Agreement(fit, coverage, coverage)
    return Score(estimator, kind, "Kobe", 0.01, seed, measured, None if seed else measured, 0.1)


SCORES = [
    score("cms", "in class", 0, 93.0),
    score("cms", "in class", 1, 92.0),
    score("cms", "bent", 0, 97.9, 0.5),
    score("smoother", "in class", 0, 99.75),
    score("smoother", "in class", 1, 99.65),
    score("smoother", "bent", 0, 97.8, 0.5),
]
LIKE, UNLIKE, COVERED, STATIC, FILTERED, TIMES = force_tables.tables(SCORES, {"in class": [99.5, 99.4], "bent": []})


def row(table: Table, name: str) -> tuple[str, ...]:
    return next(row[1:] for row in table.rows if row[0] == name)


def test_the_worst_seed_counts_and_is_bold_where_it_misses_the_goal() -> None:
    assert LIKE.columns == ("motion", "cms, 1 %", "smoother, 1 %")
    assert row(LIKE, "Kobe") == ("92.00 (92.50)", "**99.65** (99.70)")
    assert row(LIKE, "goal, in class") == ("", "99.7")
    assert row(UNLIKE, "bent") == ("97.90 (97.90)", "**97.80** (97.80)")
    assert row(UNLIKE, "goal, outside") == ("", "98")


def test_coverage_is_bold_outside_its_goal_for_estimators_that_have_one() -> None:
    assert row(COVERED, "bent") == ("50.0 / 50.0 / 50.0", "**50.0** / **50.0** / **50.0**")
    assert row(COVERED, "in class")[1] == "95.0 / 95.0 / 95.0"


def test_where_static_interpolation_does_better_is_shown() -> None:
    assert STATIC.rows == (
        ("smoother", "in class", "6.75 (0 of 2)", "6.75 (0 of 1)"),
        ("smoother", "bent", "**-0.10** (1 of 1)", "**-0.10** (1 of 1)"),
    )


def test_the_residual_of_the_filters_is_shown_beside_the_error() -> None:
    assert row(FILTERED, "in class") == ("93.00 (93.00)", "99.75 (99.75)", "99.40")
    assert row(FILTERED, "bent") == ("97.90 (97.90)", "**97.80** (97.80)", "-")
    assert row(TIMES, "cms") == ("100", "100")


def test_a_record_too_short_for_the_products_filters_is_measured_all_the_same() -> None:
    found = on_truth("cut to its strongest 15 s", "Kobe", QUICK)
    assert found.band_alone is None
    assert all(s.filtered is None and s.measured.fit > 80 for s in found.scores)
