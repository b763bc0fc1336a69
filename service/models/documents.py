"""Results of the workbench as documents of the schema in `service.models.results`."""

from collections.abc import Collection, Sequence

from core.comparison.failure import Failure
from core.comparison.misfit import pooled
from core.comparison.prediction import Prediction, predicted_accelerations, predicted_displacement
from core.comparison.profile import Bin, Profile
from core.comparison.region import Region
from core.diagnosis.missing_effects import Diagnosis, Outcome
from core.diagnosis.sensor_faults import BuildingFault
from core.effects import EFFECTS
from core.workbench.comparing import ComparisonResult
from core.workbench.diagnosis_result import DiagnosisResult, fault_sentences, first_cause
from core.workbench.directions import DirectionDiagnosis, only_in_one
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes, ModelErrors, Version
from core.workbench.fitting import FitResult
from core.workbench.improving import ExtensionResult, ImprovementResult
from service.models.operations import Work, work
from service.models.results import (
    AllErrors,
    AllPredictions,
    BeyondOut,
    BinOut,
    CandidateOut,
    ComparisonDocument,
    Covariance,
    DiagnosisDocument,
    DirectionOut,
    DroppedOut,
    EventErrors,
    ExtensionDocument,
    FailureOut,
    FitDocument,
    ImprovementDocument,
    LeftOut,
    MisfitOut,
    ModelValues,
    OutOfRangeOut,
    PredictionOut,
    ProfileOut,
    RegionOut,
    StepOut,
    StrongerOut,
    SuspectOut,
    UnexplainedOut,
    VersionOut,
)


def comparison(done: Work[ComparisonResult]) -> ComparisonDocument:
    """A comparison as a document."""
    result = done.result
    return ComparisonDocument(
        building=done.model.building,
        model=ModelValues.of(done.model),
        events=_events(result.errors),
        all=AllErrors(
            force=MisfitOut.of(result.failure.misfit), prediction=_all_predictions(result.errors.predictions)
        ),
        failure=_failure(result.failure, result.text),
        corrections=list(result.corrections),
        remarks=list(result.errors.remarks),
        unused=list(result.earthquakes.unused),
    )


def fit(done: Work[FitResult]) -> FitDocument:
    """A fit as a document: values, covariance, outcome, and the errors before and after."""
    result, ended = done.result, done.result.fit
    before, after = (_events(one.errors, result.earthquakes.held_out) for one in result.versions)
    return FitDocument(
        building=done.model.building,
        model=ModelValues.of(done.model),
        outcome=ended.outcome.name.lower(),
        undetermined=[list(key) for key in ended.undetermined],
        covariance=Covariance(
            parameters=[list(key) for key in ended.free], matrix=(ended.covariance * result.inflation).tolist()
        ),
        before=before,
        after=after,
        explanation=" ".join(result.text),
        unused=list(result.earthquakes.unused),
    )


def extension(done: Work[ExtensionResult]) -> ExtensionDocument:
    """An addition as a document."""
    result = done.result
    return ExtensionDocument(
        building=done.given.building,
        added=CandidateOut.of(result.candidate, result.before),
        versions=versions(result.versions, result.earthquakes),
        model=ModelValues.of(done.model),
        explanation=" ".join(result.text),
        unused=list(result.earthquakes.unused),
    )


def diagnosis(done: Work[DiagnosisResult]) -> DiagnosisDocument:
    """A diagnosis as a document."""
    result, steps = done.result, done.result.diagnosis.named
    return DiagnosisDocument(
        building=done.given.building,
        outcome=result.outcome,
        findings=_suspects(result.faults),
        candidates=[CandidateOut.of(one, result.before) for one in result.candidates],
        dropped=[DroppedOut.model_validate(one) for one in result.dropped],
        untried=list(result.diagnosis.untried),
        set=[one.effect for one in steps[0].alike] if steps else [],
        unknown_flag=result.diagnosis.outcome is Outcome.UNKNOWN or result.diagnosis.is_unknown,
        resembles=list(result.resembles),
        out_of_range=[OutOfRangeOut.model_validate(one) for one in result.out_of_range],
        directions=_directions(result.directions),
        unexplained=_unexplained(result.diagnosis),
        steps=[
            StepOut(
                effect=step.chosen.effect,
                family=EFFECTS[step.chosen.effect].family,
                delta_bic=step.chosen.delta_bic,
                share=None if step.worth is None else step.worth.fitted,
                share_held_out=None if step.worth is None else step.worth.held_out,
                set=[one.effect for one in step.alike],
            )
            for step in steps
        ],
        versions=versions(result.versions, result.earthquakes),
        model=ModelValues.of(done.model),
        explanation=" ".join(result.text),
        unused=list(result.earthquakes.unused),
    )


def _directions(each: Sequence[DirectionDiagnosis]) -> list[DirectionOut]:
    only = [(here.direction, step.chosen.effect) for here, step, _ in only_in_one(each)]
    return [
        DirectionOut(
            direction=one.direction,
            outcome=one.diagnosis.outcome.value,
            set=[candidate.effect for candidate in one.diagnosis.named[0].alike] if one.diagnosis.named else [],
            effects=[step.chosen.effect for step in one.diagnosis.named],
            only_here=[effect for direction, effect in only if direction == one.direction],
            resembles=list(one.diagnosis.resembles),
            noise_ratio=one.diagnosis.unexplained.noise_ratio,
        )
        for one in each
    ]


def _unexplained(diagnosis: Diagnosis) -> UnexplainedOut:
    left, taken = diagnosis.unexplained, diagnosis.explained
    return UnexplainedOut(
        share=left.share,
        noise_ratio=left.noise_ratio,
        of_excess=1 - taken.fitted,
        of_excess_held_out=None if taken.held_out is None else 1 - taken.held_out,
    )


def diagnosis_without_records(
    building: str, faults: Sequence[BuildingFault], unused: Sequence[str]
) -> DiagnosisDocument:
    """A diagnosis that ends with faults of the sensors because no record can be used."""
    cause = first_cause(faults)
    return DiagnosisDocument(
        building=building,
        outcome=None if cause is None else cause.value,
        findings=_suspects(faults),
        candidates=[],
        set=[],
        unknown_flag=False,
        unexplained=UnexplainedOut(share=None, noise_ratio=None),
        steps=[],
        versions=[],
        model=None,
        explanation=" ".join(fault_sentences(faults)),
        unused=list(unused),
    )


def improvement(done: Work[ImprovementResult]) -> ImprovementDocument:
    """An improvement as a document."""
    result = done.result
    return ImprovementDocument(
        building=done.model.building,
        taken=list(result.added),
        versions=versions(result.versions, result.earthquakes),
        model=ModelValues.of(done.model),
        diagnoses=[diagnosis(work(one, done.given, done.model.parent or "")) for one in result.rounds],
        left_out=left_out(result),
        beyond=[
            BeyondOut(times=one.times, displacement=one.displacement, spread=one.spread, error=one.error)
            for one in result.beyond
        ],
        explanation=" ".join(result.text),
    )


def left_out(result: ImprovementResult) -> list[LeftOut]:
    """The model before and after each change, with its errors where it was not fitted."""
    return [
        LeftOut(
            effect=one.change or None,
            added=one.is_added,
            errors=dict(one.errors),
            error=one.error,
            stronger=[
                StrongerOut(fitted_to=list(trial.fitted_to), reach=trial.reach, errors=dict(trial.errors))
                for trial in one.trials
            ],
            error_in_stronger=one.error_in_stronger,
        )
        for one in result.left_out
    ]


def _events(errors: ModelErrors, held_out: Collection[str] = ()) -> list[EventErrors]:
    predicted = {(one.observation.name, one.observation.direction): one for one in errors.predictions}
    return [
        EventErrors(
            name=one.observation.name,
            start=one.observation.start.isoformat(),
            direction=one.observation.direction,
            held_out=one.observation.name in held_out,
            force=MisfitOut.of(one.misfit),
            prediction=_prediction(predicted.get((one.observation.name, one.observation.direction))),
        )
        for one in errors.forces
    ]


def _prediction(one: Prediction | None) -> PredictionOut | None:
    if one is None:
        return None
    return PredictionOut(
        displacement=MisfitOut.of(one.displacement.misfit),
        accelerations={level: MisfitOut.of(floor.misfit) for level, floor in one.accelerations.items()},
    )


def _all_predictions(predictions: tuple[Prediction, ...]) -> AllPredictions | None:
    if not predictions:
        return None
    levels = predicted_accelerations(predictions)
    return AllPredictions(
        displacement=MisfitOut.of(predicted_displacement(predictions)),
        accelerations={level: MisfitOut.of(one) for level, one in levels.items()},
        all_accelerations=MisfitOut.of(pooled(list(levels.values()))) if levels else None,
    )


def _failure(failure: Failure, text: Sequence[str]) -> FailureOut:
    return FailureOut(
        explanation=" ".join(text),
        is_noise=failure.is_noise,
        noise_ratio=failure.noise_ratio,
        constant_stiffness_and_damping=failure.constant,
        any_function_of_motion=failure.over_motion,
        regions=[_region(one) for one in failure.regions],
        narrowed=None if failure.narrowed is None else _region(failure.narrowed),
        profiles=[_profile(one) for one in failure.profiles],
        windows=list(failure.windows),
    )


def _region(one: Region) -> RegionOut:
    return RegionOut(
        covariate=one.name,
        threshold=None if one.classed else one.threshold,
        is_above=one.is_above,
        class_=one.classed or None,
        share=one.share,
        share_of_energy=one.energy,
        odds=one.odds,
    )


def _profile(one: Profile) -> ProfileOut:
    bins = [_bin(part, one.classes[int(part.low)] if one.classes else None) for part in one.bins]
    return ProfileOut(covariate=one.name, explained_share=one.explained_share, bins=bins)


def _bin(one: Bin, name: str | None) -> BinOut:
    values = {field: getattr(one, field) for field in ("low", "high", "share", "energy", "time")}
    return BinOut(class_=name, noise_ratio=one.noise_ratio, **values)


def versions(made: Sequence[Version], earthquakes: Earthquakes) -> list[VersionOut]:
    """Errors of versions, as documents hold them."""
    groups = earthquakes.groups
    return [
        VersionOut(
            name=version.name,
            error=MisfitOut.of(version.error(groups[FITTED])),
            error_held_out=MisfitOut.of(version.error(groups[HELD_OUT])) if HELD_OUT in groups else None,
            events=_events(version.errors, earthquakes.held_out),
        )
        for version in made
    ]


def _suspects(faults: Sequence[BuildingFault]) -> list[SuspectOut]:
    return [
        SuspectOut(
            cause=one.cause.value,
            kind=one.kind,
            channel=one.channel,
            value=one.value,
            std=one.std,
            message=one.message,
            corrected=one.is_corrected,
        )
        for one in faults
    ]
