"""Results of the workbench as reports, for a terminal and as an HTML file."""

from collections.abc import Sequence
from dataclasses import replace

from core.forecasting.response import Forecast
from core.tables import Table
from core.workbench.comparing import ComparisonResult, force_table, levels_of, outer_levels, prediction_table
from core.workbench.diagnosis_result import BRIEF, DiagnosisResult, candidate_table
from core.workbench.fitting import FitResult
from core.workbench.forecasting import forecast_sentences, forecast_table
from core.workbench.improving import ExtensionResult, ImprovementResult, left_out_tables
from core.workbench.sketching import SketchResult, dependence_table, missing_table
from core.workbench.tables import values_of, values_table, version_tables
from service.documents.document import Document, Part, heading, notes, paragraph
from service.models import texts
from service.models.forecasting import Forecasts
from service.models.model_file import ModelFile
from service.models.operations import Work
from service.verdict import texts as verdict_texts
from service.verdict.checks import Check


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


def forecast(done: Forecasts) -> Document:
    """Forecasts for a terminal: peaks with their intervals, warnings, and the building's limits."""
    parts = [part for each in zip(done.result.forecasts, done.checks, strict=True) for part in _forecast(*each)]
    return Document(texts.FORECAST_TITLE.format(_subject(done.given)), (*parts, _notes_on_forecasts(done)))


def forecast_file(done: Forecasts) -> Document:
    """Forecasts with their figures."""
    from service.models.figures.forecasts import forecast_figures  # slow to import
    from service.models.forecast_results import document

    parts: list[Part] = []
    for one, checks, shown in zip(done.result.forecasts, done.checks, document(done).forecasts, strict=True):
        parts += [*_forecast(one, checks), *forecast_figures(shown)]
    return Document(texts.FORECAST_TITLE.format(_subject(done.given)), (*parts, _notes_on_forecasts(done)))


def _forecast(one: Forecast, checks: Sequence[Check]) -> tuple[Part, ...]:
    return forecast_table(one), paragraph(forecast_sentences(one)), _limits(checks)


def _limits(checks: Sequence[Check]) -> Table:
    """Checks of a forecast, each with the share of the limit that decides it."""
    rows = tuple(
        (verdict_texts.title(one), verdict_texts.value(one), verdict_texts.limit(one), _share(one), one.outcome.value)
        for one in checks
    )
    headings = ("check", "forecast", "limit", "share", "outcome")
    return Table(texts.LIMITS_CAPTION, headings, rows, texts.LIMITS_NOTE, texts=("outcome",))


def _share(check: Check) -> str:
    if check.value is None or check.limit is None:
        return ""
    share = f"{100 * abs(check.value) / check.limit:.0f} %"
    if check.uncertainty is None:
        return share
    return f"{share} (to {100 * (abs(check.value) + check.uncertainty) / check.limit:.0f} %)"


def _notes_on_forecasts(done: Forecasts) -> Part:
    return notes((*done.result.sources, *_unused(done.result.earthquakes.unused)))


def sketch(given: ModelFile, result: SketchResult) -> Document:
    """A sketch for a terminal."""
    values = [] if result.proposal is None else [values_table(result.proposal.model, result.proposal.std)]
    parts: tuple[Part, ...] = (
        paragraph(result.text),
        missing_table(result),
        dependence_table(result),
        *values,
        *version_tables(result.versions, result.earthquakes),
        notes(tuple(result.earthquakes.unused)),
    )
    return Document(texts.SKETCH_TITLE.format(given.building), parts)


def sketch_file(given: ModelFile, result: SketchResult) -> Document:
    """A sketch with its figures."""
    from service.models.figures.histories import loop, strongest_of  # slow to import
    from service.models.figures.residual import over_motion, spectrum
    from service.models.figures.sketches import sketch_figures
    from service.models.sketch_results import CourseOut

    after = () if result.proposal is None else result.versions[-1].errors.forces
    own = sketch_figures(CourseOut.of(result.course, result.earthquakes.held_out))
    shared = (loop(strongest_of(result.missing)), over_motion(result.missing), spectrum(result.missing, after))
    written = sketch(given, result)
    return replace(written, parts=(*written.parts, *own, *shared))


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
