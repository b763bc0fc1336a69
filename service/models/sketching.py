"""Sketches of missing forces on files: document, report and pictures."""

from pydantic import Field

from core.comparison.compared import ForceComparison
from core.workbench.sketching import SketchResult, dependence_table, missing_table
from core.workbench.tables import values_table, version_tables
from service.models import texts
from service.models.documents import versions
from service.models.figures.histories import loop, strongest_of
from service.models.figures.residual import over_motion, spectrum
from service.models.model_file import ModelFile
from service.models.results import Head, Result, Value, VersionOut
from service.reports.document import Document, Figure, Part, notes, paragraph


class MissingOut(Result):
    """The missing force in one earthquake: the residual of the refitted model."""

    earthquake: str
    direction: str
    rms: Value = Field(description="N, beyond the noise.")
    noise: Value = Field(description="N, root mean square of the noise in it.")
    time: list[float] = Field(description="s, since the start of the record.")
    force: list[float] = Field(description="N.")
    std: list[float] = Field(description="N, standard deviation of the noise in it.")

    @classmethod
    def of(cls, one: ForceComparison) -> "MissingOut":
        """The missing force of a comparison."""
        observation = one.observation
        return cls(
            earthquake=observation.name,
            direction=observation.direction,
            rms=one.misfit.excess,
            noise=one.noise.rms,
            time=[number / observation.rate for number in range(one.resolved.size)],
            force=one.resolved.tolist(),
            std=one.noise.std.tolist(),
        )


class DependenceOut(Result):
    """A variable that the missing force may depend on."""

    variable: str
    share: Value = Field(description="Share of its power that functions of the variable predict where not fitted.")


class ProposalOut(Result):
    """The simplest law for it."""

    effect: str = Field(description="Name of the effect.")
    formula: str
    terms: list[str]
    source: str = Field(description="File of the effect.")
    values: dict[str, dict[str, Value]] = Field(description="Values of the model with it, SI units.")
    standard_deviations: dict[str, dict[str, Value]]
    taken: dict[str, Value] = Field(description="Share of the error beyond the noise that it takes.")
    alike: list[str] = Field(description="Terms that the records cannot distinguish from it.")


class SketchDocument(Head):
    """What is known of the force that a model lacks."""

    missing: list[MissingOut]
    dependences: list[DependenceOut]
    proposal: ProposalOut | None = Field(description="null if nothing is proposed.")
    versions: list[VersionOut]
    explanation: str
    unused: list[str]


def document(given: ModelFile, result: SketchResult) -> SketchDocument:
    """A sketch as a document."""
    return SketchDocument(
        building=given.building,
        missing=[MissingOut.of(one) for one in result.missing],
        dependences=[DependenceOut(variable=one.variable, share=one.share) for one in result.dependences],
        proposal=_proposal(result),
        versions=versions(result.versions, result.earthquakes),
        explanation=" ".join(result.text),
        unused=list(result.earthquakes.unused),
    )


def _proposal(result: SketchResult) -> ProposalOut | None:
    one = result.proposal
    if one is None:
        return None
    return ProposalOut(
        effect=one.name,
        formula=one.formula,
        terms=[placed.term.name for placed in one.law.placed],
        source=one.source,
        values={name: dict(values) for name, values in one.model.effects.items()},
        standard_deviations={name: dict(values) for name, values in one.std.items()},
        taken=dict(result.taken),
        alike=list(one.law.alike),
    )


def sketch_report(given: ModelFile, result: SketchResult) -> Document:
    """A sketch for a terminal."""
    return Document(texts.SKETCH_TITLE.format(given.building), tuple(_parts(result)))


def sketch_file(given: ModelFile, result: SketchResult) -> Document:
    """A sketch with its figures."""
    return Document(texts.SKETCH_TITLE.format(given.building), (*_parts(result), *_figures(result)))


def _parts(result: SketchResult) -> list[Part]:
    values = [] if result.proposal is None else [values_table(result.proposal.model, result.proposal.std)]
    return [
        paragraph(result.text),
        missing_table(result),
        dependence_table(result),
        *values,
        *version_tables(result.versions, result.earthquakes),
        notes(tuple(result.earthquakes.unused)),
    ]


def _figures(result: SketchResult) -> list[Figure]:
    after = () if result.proposal is None else result.versions[-1].errors.forces
    drawn = (loop(strongest_of(result.missing)), over_motion(result.missing), spectrum(result.missing, after))
    return [figure for figure in drawn if figure is not None]
