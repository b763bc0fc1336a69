"""Every benchmark runs, on records so short that their times say nothing, with whatever peers are installed."""

import re

import pytest

from benchmarks import chain, identification, identification_noise, simulation
from benchmarks.__main__ import BENCHMARKS, TARGET, renewed
from benchmarks.identifiers import IDENTIFIERS, OURS, Identifier
from benchmarks.integrators import INTEGRATORS
from benchmarks.table import Table, with_results
from benchmarks.trial import Limits
from core.estimators import ESTIMATORS
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR, RATE, ground_motion
from service.akt013 import recorded

LIMITS = Limits(seconds=20)
ABSENT = {"a peer": Identifier("no_such_package", IDENTIFIERS[OURS].identify)}


def row(table: Table, name: str) -> dict[str, str]:
    return next(dict(zip(table.columns, row, strict=True)) for row in table.rows if row[0] == name)


def test_identification_reports_errors_and_missing_peers() -> None:
    """1 % for the frequency and 50 % for the damping ratio: a minute with 20 block rows leaves 0.05 and 30."""
    size = identification.Size(BUILDING, (2, 6), samples=6_000, block_rows=20, order=14)
    table = identification.table(size, {OURS: IDENTIFIERS[OURS]} | ABSENT, LIMITS, rounds=1)
    assert row(table, "a peer")["ms"] == "not installed"
    ours = row(table, OURS)
    assert float(ours["ms"]) > 0
    assert abs(float(ours["f1, %"])) < 1
    assert abs(float(ours["ζ1, %"])) < 50


def test_identification_under_noise_takes_the_best_order() -> None:
    clean = identification_noise.motion()
    records = identification_noise.noisy(clean, (0.0, 0.0, 0.0), seeds=1)
    found = identification_noise.errors(IDENTIFIERS[OURS].identify, records)
    assert found.shape == (len(identification_noise.ORDERS), 1, 2)
    # without noise the highest order is right to three digits, though seven modes need only fourteen states
    assert abs(found[-1, 0, 0]) < 1e-3


def test_all_integrators_that_are_here_agree() -> None:
    """2e-4: the accuracy at which the ways are compared. With 1e-5 LSODA is near it, and rounding, which is another on
    another processor, decides on which side."""
    ground = ground_motion(*recorded())[1500:2100]
    names = ["core.model.simulation, 1 step", "LSODA, rtol 1e-8"]
    table = simulation.table(ground, {name: INTEGRATORS[name] for name in names}, LIMITS, rounds=1)
    assert [float(row(table, name)["error of the force"]) < 2e-4 for name in names] == [True, True]


def test_the_chain_runs_with_every_estimator() -> None:
    ground = ground_motion(*recorded())[: round(90 * RATE)]
    response = simulate(BUILDING, ISOLATOR, ground, RATE)
    table = chain.table({"short": chain.event(ground, response, (2, 6), ("x",))}, response.force, LIMITS, rounds=1)
    assert [name for name, *_ in table.rows] == [f"{estimator}: short" for estimator in ESTIMATORS]
    assert all(float(row(table, name)["fit of F, %"]) > 90 for name, *_ in table.rows)


def test_the_page_shows_every_benchmark() -> None:
    headings = re.findall(r"^## (.+)$", TARGET.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert headings == [title for title, _ in BENCHMARKS.values()]


def test_a_part_of_the_page_is_renewed_and_the_others_stay() -> None:
    first, second = (title for title, _ in list(BENCHMARKS.values())[:2])
    page = renewed("", {second: f"## {second}\n\nold\n", first: f"## {first}\n\nkept\n"})
    again = renewed(page, {second: f"## {second}\n\nnew\n"})
    assert again == page.replace("old", "new")
    assert re.findall(r"^## (.+)$", again, flags=re.MULTILINE) == [first, second]


def test_a_row_must_fit_its_table() -> None:
    with pytest.raises(ValueError, match="does not fit"):
        Table("times", "", ("way", "ms"), (("ours",),))
    written = Table("times", "of ours", ("way", "ms"), (("ours", "1.0"),)).markdown()
    assert written == "### times\n\nof ours\n\n| way | ms |\n| --- | --- |\n| ours | 1.0 |\n"


def test_only_the_text_between_a_programs_comments_is_replaced() -> None:
    begin, end = (f"<!-- {edge} of what `python -m benchmarks.api` writes -->" for edge in ("begin", "end"))
    page = f"before\n{begin}\n\n{{}}\n{end}\nafter\n"
    assert with_results(page.format("old"), "benchmarks.api", "new") == page.format("new")
    for other in ("a page without comments", page * 2):
        with pytest.raises(ValueError, match="to unpack"):
            with_results(other, "benchmarks.api", "new")
