"""Results of the workbench as reports, for a terminal and as an HTML file."""

from dataclasses import replace

from core.tables import Table
from core.workbench.comparing import ComparisonResult, force_table, levels_of, outer_levels, prediction_table
from core.workbench.diagnosing import BRIEF, DiagnosisResult, candidate_table
from core.workbench.fitting import FitResult
from core.workbench.improving import ExtensionResult, ImprovementResult, left_out_tables
from core.workbench.tables import values_of, version_tables
from service.models import texts
from service.models.model_file import ModelFile
from service.models.operations import Work
from service.reports.document import Document, Part, heading, notes, paragraph


def comparison(done: Work[ComparisonResult]) -> Document:
    """A comparison for a terminal: errors by earthquake and over all, then where the model fails."""
    result, model = done.result, done.model
    tables = (force_table(result), prediction_table(result, outer_levels(result)))
    return Document(
        f"{_subject(model)}: {', '.join(model.isolator.effects)}",
        (
            *(table for table in tables if table is not None),
            paragraph(result.text),
            notes((*result.errors.remarks, *_unused(result.earthquakes.unused))),
        ),
    )


def comparison_file(done: Work[ComparisonResult]) -> Document:
    """A comparison with its figures."""
    from service.models.figures import comparison_figures  # slow to import

    result = done.result
    tables = (force_table(result), prediction_table(result, levels_of(result)))
    return Document(
        texts.COMPARISON_TITLE.format(_subject(done.model)),
        (
            paragraph(result.text),
            *(table for table in tables if table is not None),
            _values(done.model),
            notes((*result.errors.remarks, *_unused(result.earthquakes.unused))),
            *comparison_figures(result),
        ),
    )


def fit(done: Work[FitResult]) -> Document:
    """A fit for a terminal: values, errors before and after, and remarks."""
    result = done.result
    return Document(
        _subject(done.model),
        (
            _brief_values(done.model),
            *version_tables(result.versions, result.earthquakes),
            paragraph(result.text),
            notes(_unused(result.earthquakes.unused)),
        ),
    )


def diagnosis(done: Work[DiagnosisResult]) -> Document:
    """A diagnosis for a terminal: missing effects, effects tried, and the errors of the main versions."""
    result, given = done.result, done.given
    versions = (*result.versions[:2], *result.versions[2:][-1:])
    parts: tuple[Part, ...] = (
        paragraph(result.text),
        _without_last(candidate_table(result, result.candidates[:BRIEF])),  # the text has the remarks that matter
        *version_tables(versions, result.earthquakes),
        *([_brief_values(done.model)] if result.diagnosis.steps else []),
        notes(_unused(result.earthquakes.unused)),
    )
    return Document(f"{_subject(given)}: {', '.join(given.isolator.effects)}", parts)


def diagnosis_file(done: Work[DiagnosisResult]) -> Document:
    """A diagnosis with its figures."""
    from service.models.figures import diagnosis_figures  # slow to import

    result = done.result
    return Document(
        texts.DIAGNOSIS_TITLE.format(_subject(done.given)),
        (
            paragraph(result.text),
            *version_tables(result.versions, result.earthquakes),
            candidate_table(result, result.candidates),
            _values(done.model),
            notes((*result.refitted.errors.remarks, *_unused(result.earthquakes.unused))),
            paragraph([texts.DIAGNOSIS_FIGURES]),
            *diagnosis_figures(result),
        ),
    )


def change(done: Work[ExtensionResult] | Work[ImprovementResult]) -> Document:
    """An addition or improvement for a terminal: the added effects, the errors of every version, the values."""
    result = done.result
    return Document(
        "",
        (
            paragraph(result.text),
            *version_tables(result.versions, result.earthquakes),
            *(left_out_tables(result) if isinstance(result, ImprovementResult) else ()),
            _brief_values(done.model),
            notes(_unused(result.earthquakes.unused)),
        ),
    )


def improvement_file(done: Work[ImprovementResult], first: Work[DiagnosisResult]) -> Document:
    """An improvement with its figure, and the first of its diagnoses."""
    from service.models.documents import left_out  # slow to import, as the figure is
    from service.models.figures.improvements import left_out_figure

    steps = left_out(done.result)
    diagnosis = diagnosis_file(first)
    own = (*change(done).parts, *([left_out_figure(steps)] if len(steps) > 1 else []))
    parts = (*own, heading(texts.FIRST_DIAGNOSIS), *diagnosis.parts)
    return Document(texts.IMPROVEMENT_TITLE.format(_subject(done.given)), parts)


def _subject(model: ModelFile) -> str:
    return f"{model.building}, direction {model.direction}"


def _unused(reasons: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"not used: {reason}" for reason in reasons)


def _values(model: ModelFile) -> Table:
    """Values of every parameter; no standard deviation where it was not fitted."""
    rows = [
        (one.effect, one.parameter, one.value, one.std, one.unit, one.meaning)
        for one in values_of(model.isolator, model.standard_deviations)
    ]
    headings = ("effect", "parameter", "value", "standard deviation", "unit", "meaning")
    return Table("The model", headings, tuple(rows), texts=("parameter", "standard deviation", "unit", "meaning"))


def _brief_values(model: ModelFile) -> Table:
    """The same for a terminal, which is too narrow for the meanings."""
    table = _without_last(_values(model))
    rows = tuple((*row[:3], row[3] or texts.NOT_FITTED, row[4]) for row in table.rows)
    return replace(table, caption="", rows=rows)


def _without_last(table: Table) -> Table:
    return replace(table, headings=table.headings[:-1], rows=tuple(row[:-1] for row in table.rows))
