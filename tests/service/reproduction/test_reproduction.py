"""`menshin reproduce`, through its front door: the printed tables and the page of one run."""

import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import obspy
import pytest
from click.testing import Result
from paper_records import building_file, miniseed, records
from shared_data import BNCS, needs_shared
from typer.testing import CliRunner

from core.analysis import AnalysisSettings
from core.estimators import ESTIMATORS
from core.tables import Table
from service.akt013 import PLACE
from service.buildings.description import read
from service.cli import app
from service.documents.html import page as page_of
from service.formats import FormatError
from service.records.event_files import events
from service.reproduction import published, report
from service.reproduction.real import papers_sensors, real
from service.reproduction.real_figures import real_figures
from service.reproduction.real_tables import amplitude_tables, real_tables
from service.reproduction.simulated import Simulated, default_ground, ground_of_file, simulated
from service.reproduction.simulated_figures import force_figures, response_figures

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]  # slow: one run of it all

DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "reference" / "reproduction.md"
SECTION_7, SECTION_8 = tuple(range(6, 17)), tuple(range(18, 25))
UNITS = ("(s)", "(gal)", "(kN)", "(mm)", "(gal √t)", "(kN/mm)", "(kN s/mm)")


def menshin(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["reproduce", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of one run, with the paper's building under its own sensors as the real one."""
    made = tmp_path_factory.mktemp("reproduced")
    (made / "building.toml").write_text(building_file(), "utf-8")
    (made / "event.mseed").write_bytes(miniseed(records(np.random.default_rng(7))))
    (made / "note.txt").write_text("a note", "utf-8")
    files_of = (made / "event.mseed", "--building", made / "building.toml")
    done = menshin(*files_of, "-o", made / "page.html", "--markdown", made / "printed.md")
    assert done.exit_code == 0, done.output
    (made / "terminal.txt").write_text(done.output, "utf-8")
    return made


@pytest.fixture(scope="module")
def printed(folder: Path) -> str:
    return (folder / "printed.md").read_text("utf-8")


def rows(document: str) -> Iterator[list[str]]:
    """The cells of every line of every table."""
    for line in document.splitlines():
        if line.startswith("| "):
            yield [cell.strip() for cell in line.strip("|").split("|")]


def column(document: str, estimator: str) -> dict[tuple[str, str], str]:
    """An estimator's cells in the table of fitting rates, by figure and column."""
    found: dict[tuple[str, str], str] = {}
    at = None
    for cells in rows(document):
        if cells[0] == "figure":
            at = cells.index(f"ours, {estimator}")
        elif at is not None and re.fullmatch(r"1\d[ab]?", cells[0]) and len(cells) > at:
            found[cells[0], cells[1]] = cells[at]
    return found


def test_the_papers_method_meets_the_reference(printed: str) -> None:
    """The reference prototype's fitting rates under AKT013: 0.3 points of them is what the project asks for.

    Ten percent of noise in the second mode's shape moves its fit by half a point from one draw to the next.
    """
    fits = column(printed, "cms")
    for (figure, words), reference, points in (
        (("10a", "acceleration of mode 1, 1 % noise"), 93.8, 0.3),
        (("10b", "acceleration of mode 1, 10 % noise"), 81.2, 0.3),
        (("11a", "acceleration of mode 2, 1 % noise"), 88.9, 0.3),
        (("11b", "acceleration of mode 2, 10 % noise"), 64.3, 1.0),
        (("12a", "restoring force, 1 % noise"), 97.1, 0.3),
        (("12b", "restoring force, 10 % noise"), 93.3, 0.3),
        (("12b", "the same, 10 % noise above the base slab only"), 94.5, 0.3),
        (("14", "restoring force, 1 % noise, 1 mode"), 91.0, 0.3),
        (("14", "restoring force, 1 % noise, 2 modes"), 97.1, 0.3),
        (("14", "restoring force, 1 % noise, 3 modes"), 97.1, 0.3),
        (("15", "restoring force, 1 % noise, all masses × 0.9"), 89.1, 0.3),
        (("15", "the same, divided by 0.9"), 97.1, 0.3),
    ):
        assert float(fits[figure, words]) == pytest.approx(reference, abs=points), words
    assert 92.9 < float(fits["16", "restoring force, 1 % noise, the masses of Figure 16"]) < 97.3  # over the motions


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_has_a_force_in_every_case(printed: str, estimator: str) -> None:
    """Whatever the estimator, a tenth less mass costs at least 9 points, and noise never helps."""
    fits = {
        key: float(cell) for key, cell in column(printed, estimator).items() if key[0] in ("12a", "12b", "15", "16")
    }
    assert len(fits) == 7
    assert fits["15", "restoring force, 1 % noise, all masses × 0.9"] < 91.0
    assert fits["12a", "restoring force, 1 % noise"] > fits["12b", "restoring force, 10 % noise"] > 90.0


def test_table_one_is_the_papers(printed: str) -> None:
    found = [cells for cells in rows(printed) if len(cells) == 5 and cells[0] in set("12345")]
    assert len(found) == 5
    assert all(cells[1] == cells[2] and cells[3] == cells[4] for cells in found)


def test_table_three_is_near_the_analytic_shapes(printed: str) -> None:
    """2 % at 1 % noise, as the paper's method is held to elsewhere."""
    found = {cells[0]: cells for cells in rows(printed) if cells[0].startswith("mode ")}
    for mode in (1, 2):
        analytic, ours = (float(cell) for cell in found[f"mode {mode}, 1 % noise"][2:4])
        assert ours == pytest.approx(analytic, rel=0.02)


@pytest.mark.parametrize("source", ["run", "docs"])
def test_every_published_number_is_shown(folder: Path, source: str) -> None:
    document = (folder / "printed.md" if source == "run" else DOCUMENT).read_text("utf-8")
    cells = {cell for row in rows(document) for cell in row}
    numbers = [f"{f:.2f}" for f in (*published.FREQUENCIES, *published.DAMPING_RATIOS, *published.REAL_DAMPING_RATIOS)]
    numbers += [f"{shape:.4f}" for shapes in (*published.SHAPES.values(), published.REAL_SHAPES) for shape in shapes]
    numbers += [f"{f:.4f}" for f in published.REAL_FREQUENCIES]
    for fits in (published.FIRST_MODAL_FIT, published.SECOND_MODAL_FIT, published.FORCE_FIT):
        numbers += [f"{fit:.1f}" for fit in fits.values()]
    numbers += [f"{published.SCATTERED_FIT:.2f}", "475 000", "6000", "0.0029", "655.4", "70.13"]
    assert [number for number in numbers if number not in cells] == []


def test_the_document_shows_every_estimator() -> None:
    shown = {cell for row in rows(DOCUMENT.read_text("utf-8")) for cell in row}
    assert {f"ours, {name}" for name in ESTIMATORS} <= shown, "python docs/tools/write_reproduction.py would mend it"


def test_the_pages_in_the_documentation_hold_nothing_of_a_real_building() -> None:
    page = Page(DOCUMENT.with_suffix(".html").read_text("utf-8"))
    assert list(page.figures) == [f"figure-{number}" for number in SECTION_7]


def test_the_terminal_prints_the_same_as_the_document(folder: Path, printed: str) -> None:
    terminal = (folder / "terminal.txt").read_text("utf-8")
    numbers = {cell for row in rows(printed) for cell in row if re.fullmatch(r"-?\d+\.\d+", cell)}
    assert [number for number in numbers if number not in terminal] == []


def test_the_document_names_its_command(folder: Path, printed: str) -> None:
    assert f"    menshin reproduce {folder}/event.mseed --building {folder}/building.toml\n" in printed


class Page(HTMLParser):
    """Files that the page loads, and the texts of every figure."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.figures: dict[str, list[str]] = {}
        self._figure = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href", "srcset")]
        self.ids += [value or "" for name, value in attrs if name == "id"]
        if tag == "figure":
            self._figure = dict(attrs)["id"] or ""
            self.figures[self._figure] = []

    def handle_endtag(self, tag: str) -> None:
        self._figure = "" if tag == "figure" else self._figure

    def handle_data(self, data: str) -> None:
        if self._figure and data.strip():
            self.figures[self._figure].append(data.strip())


@pytest.fixture(scope="module")
def page(folder: Path) -> Page:
    return Page((folder / "page.html").read_text("utf-8"))


def test_the_page_needs_nothing_else(folder: Path, page: Page) -> None:
    assert page.addresses == []
    assert page.tags.isdisjoint({"script", "link", "iframe", "object", "embed"})
    text = (folder / "page.html").read_text("utf-8")
    assert "://" not in text
    assert len(text) < 2**21


def test_the_page_has_every_figure_once_with_units_and_caption(page: Page) -> None:
    assert list(page.figures) == [f"figure-{number}" for number in (*SECTION_7, *SECTION_8)]
    assert len(set(page.ids)) == len(page.ids)
    for name, texts in page.figures.items():
        assert texts[0].startswith(f"Figure {name.removeprefix('figure-')}. ")
        assert len(texts[1]) > 40, "a caption says what is shown"
        if name not in ("figure-9", "figure-20"):  # mode shapes: levels, and a shape that is 1 at the roof
            assert any(text.endswith(UNITS) for text in texts[2:]), name


@pytest.fixture(scope="module")
def seven() -> Simulated:
    return simulated(default_ground(), 1, lambda _: None)


def test_every_axis_has_a_label_with_a_unit(seven: Simulated) -> None:
    for figure in (*response_figures(seven), *force_figures(seven)):
        for panel in figure.pictures:
            titles = {
                axis.get("title") or axis["axis"]["title"]
                for layer in panel.to_dict()["layer"]
                for name, axis in layer["encoding"].items()
                if name in "xy"
            }
            assert len(titles) == 2
            without_unit = {title for title in titles if not re.search(r" \([a-zN √]+\)$", title)}
            assert without_unit <= {"level", "mode shape, the roof being 1"}


def test_modes_that_were_not_identified_leave_gaps_that_are_stated(seven: Simulated) -> None:
    cases = {
        noise: replace(case, shapes=case.shapes[:, :0], modal=case.modal[:0]) for noise, case in seven.cases.items()
    }
    without = replace(seven, cases=cases, by_modes={})
    shown = [figure.key for figure in (*response_figures(without), *force_figures(without))]
    assert shown == [f"figure-{number}" for number in (6, 7, 8, 12, 13, 15, 16)]
    section = report.sections(without, None)[0]
    assert any("not both of the first two were identified" in remark for remark in section.remarks)
    fits = {row[0]: row[3] for row in section.tables[-1].rows}
    assert fits["10a"] == fits["11b"] == "–"


def test_without_records_section_8_is_omitted_with_a_note(seven: Simulated) -> None:
    text = page_of(report.page(report.sections(seven, None)))
    assert "Section 8 is left out" in text
    assert list(Page(text).figures) == [f"figure-{number}" for number in SECTION_7]


@pytest.mark.parametrize(
    ("arguments", "code", "printed"),
    [
        (("event.mseed",), 2, "needs both"),
        (("--building", "building.toml"), 2, "needs both"),
        (("--channel", "XX.A.00.HNX"), 2, "--ground"),
        (("--ground", "building.toml"), 1, "is a building or model file (TOML), not a record"),
        (("--ground", "note.txt"), 1, "an unknown format"),
        (("--ground", "event.mseed"), 1, "--channel"),
    ],
)
def test_what_cannot_be_used_is_stated(
    folder: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], code: int, printed: str
) -> None:
    monkeypatch.chdir(folder)
    done = menshin(*arguments)
    assert done.exit_code == code
    assert printed in done.output


def test_a_ground_motion_of_ones_own(tmp_path: Path) -> None:
    """AKT013's own file, and its counts as miniSEED, whose unit nothing tells, are the default motion."""
    with as_file(files("obspy") / PLACE) as path:
        assert ground_of_file(path, None).acceleration == pytest.approx(default_ground().acceleration, abs=1e-12)
        trace = obspy.read(str(path), format="KNET")[0]
    trace.data = trace.data.astype(np.int32)
    trace.stats.station = "AKT13"  # miniSEED has five letters for it
    trace.write(str(tmp_path / "ground.mseed"), format="MSEED")
    own = ground_of_file(tmp_path / "ground.mseed", trace.id)
    assert own.acceleration == pytest.approx(default_ground().acceleration, abs=1e-12)  # rounding, of 0.7 m/s²
    with pytest.raises(FormatError, match="name it with --channel"):
        ground_of_file(tmp_path / "ground.mseed", "XX.OTHER.00.HNX")


@needs_shared
def test_the_real_building() -> None:
    """estimator.md's fits by the paper's method, at another rate and band: 0.2 points; k_eq as the records' README."""
    described = read((BNCS / "building.toml").read_text("utf-8"), BNCS)
    tests = [BNCS / f"{name}.mseed" for name in ("CNP100", "LAC100", "SP100")]
    assert papers_sensors(described.description, "x") == ("base slab", "4", "roof")
    found = real(events(tests, described), described.description, None, AnalysisSettings(), lambda _: None)
    assert [figure.key for figure in real_figures(found)] == [f"figure-{number}" for number in SECTION_8]
    modes, forces = real_tables(found)
    amplitudes, conclusions = amplitude_tables(found)
    assert _cells(forces, "fitting rate (%)", at=1) == pytest.approx([99.0, 98.7, 97.9], abs=0.2)
    assert len(modes.rows) >= 2 + 3 * 2
    k_eq = {row[0]: float(row[3].split()[0]) for row in amplitudes.rows if row[1] == "cms"}
    assert k_eq["50 to 100"] == pytest.approx(4.4, rel=0.15)
    assert k_eq["5 to 10"] == pytest.approx(9.0, rel=0.15)
    fall, k_rank, c_rank, k_spread, c_spread = (float(row[2]) for row in conclusions.rows)
    assert fall > 50.0
    assert k_rank < c_rank < 0
    assert k_spread < c_spread


def _cells(table: Table, word: str, at: int) -> list[float]:
    """The first estimator's numbers in the rows with that word."""
    return [float(row[1 + len(table.texts)]) for row in table.rows if row[at] == word]
