"""Sketches of missing forces as documents: one schema for the command's files, the API and the pages. SI units."""

from collections.abc import Mapping

import numpy as np
from pydantic import Field

from core.comparison.compared import ForceComparison
from core.sketching.course import Course, Trace
from core.sketching.law import Law
from core.workbench.sketching import Proposal, SketchResult
from service.documents.thinning import extremes
from service.models.documents import versions
from service.models.model_file import ModelFile
from service.models.results import FittedValue, Head, HeldOut, Result, Value, VersionOut

POINTS = 3000
"""Samples of all traces in a document."""


class MissingOut(Result):
    """The missing force in one earthquake: the residual of the refitted model, thinned where it is stored."""

    earthquake: str
    direction: str
    rms: Value = Field(description="N, beyond the noise.")
    noise: Value = Field(description="N, root mean square of the noise in it.")
    time: list[float] = Field(description="s, since the start of the record.")
    force: list[float] = Field(description="N.")
    std: list[float] = Field(description="N, standard deviation of the noise in it.")

    @classmethod
    def of(cls, one: ForceComparison, most: int | None) -> "MissingOut":
        """The missing force of a comparison, at most so many samples of it."""
        observation = one.observation
        kept = np.arange(one.resolved.size) if most is None else extremes(one.resolved, most)
        return cls(
            earthquake=observation.name,
            direction=observation.direction,
            rms=one.misfit.excess,
            noise=one.noise.rms,
            time=(kept / observation.rate).tolist(),
            force=one.resolved[kept].tolist(),
            std=one.noise.std[kept].tolist(),
        )


class DependenceOut(Result):
    """A variable that the missing force may depend on."""

    variable: str
    share: Value = Field(description="Share of its power that functions of the variable predict where not fitted.")


class TraceOut(Result):
    """Samples of the missing force in one earthquake, over the variable that it depends on."""

    earthquake: str
    direction: str
    held_out: HeldOut = Field(description="True if the earthquake was held out.")
    variable: list[Value] = Field(description="SI.")
    force: list[Value] = Field(description="N: what is measured beyond the model without the law.")
    law: list[Value] | None = Field(description="N, the law's; null if nothing is proposed.")

    @classmethod
    def of(cls, one: Trace, held_out: bool, most: int) -> "TraceOut":
        """Samples of a trace at equal intervals, at most so many."""
        kept = slice(None, None, -(-one.force.size // most))
        return cls(
            earthquake=one.earthquake,
            direction=one.direction,
            held_out=held_out,
            variable=one.variable[kept].tolist(),
            force=one.force[kept].tolist(),
            law=None if one.law is None else one.law[kept].tolist(),
        )


class BinOut(Result):
    """Mean of the missing force over a part of the variable's range."""

    branch: int = Field(description="1, -1: motion in the positive and the negative direction; 0: both.")
    low: Value = Field(description="Beginning of the part, SI.")
    high: Value = Field(description="Its end.")
    mean: Value = Field(description="N.")
    std: Value = Field(description="N, standard deviation of the mean.")
    law: Value = Field(description="N, mean of the law; null if nothing is proposed.")


class CourseOut(Result):
    """The missing force over the variable that it depends on."""

    variable: str
    unit: str = Field(description="SI.")
    bins: list[BinOut]
    traces: list[TraceOut]

    @classmethod
    def of(cls, one: Course, held_out: frozenset[str]) -> "CourseOut":
        """The samples, thinned, and the means."""
        most = max(POINTS // len(one.traces), 20)
        return cls(
            variable=one.variable,
            unit=one.unit,
            bins=[BinOut.model_validate(part) for part in one.bins],
            traces=[TraceOut.of(trace, trace.earthquake in held_out, most) for trace in one.traces],
        )


class SketchedValue(FittedValue):
    """A parameter of the sketched effect."""

    meaning: str


class TermOut(Result):
    """One term of a sketched law."""

    term: str = Field(description="Its name.")
    own: float = Field(description="Its length, speed, time or travel, SI; 0 for none.")
    amplitude: float = Field(description="N.")


class LawOut(Result):
    """A sketched law as values, from which the code of its effect is written."""

    terms: list[TermOut]
    displacement: float = Field(description="m, the largest in the records.")
    velocity: float = Field(description="m/s, the largest in the records.")

    @classmethod
    def of(cls, law: Law) -> "LawOut":
        """A law of core."""
        terms = zip(law.placed, law.amplitudes, strict=True)
        return cls(
            terms=[TermOut(term=one.term.name, own=one.s, amplitude=amplitude) for one, amplitude in terms],
            displacement=law.scales.displacement,
            velocity=law.scales.velocity,
        )


class ProposalOut(Result):
    """The simplest law for it."""

    effect: str = Field(description="Name of the effect.")
    formula: str
    terms: list[str]
    law: LawOut | None = Field(None, description="The law as values; null in sketches of earlier versions.")
    source: str = Field(description="File of the effect.")
    parameters: dict[str, SketchedValue] = Field(description="The effect's parameters.")
    values: dict[str, dict[str, Value]] = Field(description="Values of the model with it, SI units.")
    standard_deviations: dict[str, dict[str, Value]]
    taken: dict[str, Value] = Field(description="Share of the error beyond the noise that it takes.")
    alike: list[str] = Field(description="Terms that the records cannot distinguish from it.")


class SketchDocument(Head):
    """Estimate of the force that a model lacks, with its sketches."""

    missing: list[MissingOut]
    dependences: list[DependenceOut]
    course: CourseOut
    proposal: ProposalOut | None = Field(description="null if nothing is proposed.")
    versions: list[VersionOut]
    explanation: str
    sentences: list[str] = Field(description="The same, sentence by sentence.")
    unused: list[str]


def document(given: ModelFile, result: SketchResult, most: int | None = None) -> SketchDocument:
    """A sketch as a document.

    Args:
        given: the model.
        result: the sketch.
        most: samples of the missing force in one earthquake; None for all.
    """
    return SketchDocument(
        building=given.building,
        missing=[MissingOut.of(one, most) for one in result.missing],
        dependences=[DependenceOut(variable=one.variable, share=one.share) for one in result.dependences],
        course=CourseOut.of(result.course, result.earthquakes.held_out),
        proposal=None if result.proposal is None else _proposal(result.proposal, result.taken),
        versions=versions(result.versions, result.earthquakes),
        explanation=" ".join(result.text),
        sentences=list(result.text),
        unused=list(result.earthquakes.unused),
    )


def _proposal(one: Proposal, taken: Mapping[str, float]) -> ProposalOut:
    values, std = one.model.effects[one.name], one.std.get(one.name, {})
    return ProposalOut(
        effect=one.name,
        formula=one.formula,
        terms=[placed.term.name for placed in one.law.placed],
        law=LawOut.of(one.written),
        source=one.source,
        parameters={
            known.name: SketchedValue(
                value=values[known.name], std=std.get(known.name), unit=known.unit, meaning=known.meaning
            )
            for known in one.effect.parameters
        },
        values={name: dict(own) for name, own in one.model.effects.items()},
        standard_deviations={name: dict(own) for name, own in one.std.items()},
        taken=dict(taken),
        alike=list(one.law.alike),
    )
