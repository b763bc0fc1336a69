"""Comparisons and fits as JSON: SI units, null for a value that is not known or has no bound."""

from collections.abc import Collection
from dataclasses import asdict
from math import isfinite
from typing import Any

from core.comparison.excess import Share
from core.comparison.misfit import Misfit, pooled
from core.comparison.prediction import Prediction, predicted_accelerations, predicted_displacement
from core.comparison.profile import Bin, Profile
from core.comparison.region import Region
from core.workbench.comparing import ComparisonResult
from core.workbench.earthquakes import ModelErrors
from core.workbench.fitting import FitResult
from service.models.model_file import ModelFile
from service.models.workbench.work import Work
from service.version import VERSION


def comparison_as_json(found: Work[ComparisonResult]) -> dict[str, Any]:
    """Every comparison and where the model fails."""
    result = found.result
    failure = result.failure
    document = {
        "version": VERSION,
        "building": found.model.building,
        "model": model_as_json(found.model),
        "events": events_as_json(result.errors),
        "all": {
            "force": misfit_as_json(failure.misfit),
            "prediction": _prediction_of_all(result.errors.predictions),
        },
        "failure": {
            "explanation": " ".join(result.text),
            "is_noise": failure.is_noise,
            "floors": asdict(failure.noise_ratio),
            "constant_stiffness_and_damping": asdict(failure.constant),
            "any_function_of_motion": asdict(failure.over_motion),
            "regions": [_region(one) for one in failure.regions],
            "narrowed": None if failure.narrowed is None else _region(failure.narrowed),
            "profiles": [_profile(one) for one in failure.profiles],
            "windows": [asdict(one) for one in failure.windows],
        },
        "corrections": [asdict(one) for one in result.corrections],
        "remarks": list(result.errors.remarks),
        "unused": list(result.earthquakes.unused),
    }
    return finite(document)


def model_as_json(model: ModelFile) -> dict[str, Any]:
    """The model's direction, effects and values."""
    return {
        "direction": model.direction,
        "parent": model.parent,
        "fitted_to": list(model.fitted_to),
        "effects": {name: dict(values) for name, values in model.isolator.effects.items()},
        "standard_deviations": {name: dict(values) for name, values in model.standard_deviations.items()},
    }


def misfit_as_json(misfit: Misfit) -> dict[str, float]:
    """Its measures."""
    return {
        "rms": misfit.rms,
        "nrmse": misfit.nrmse,
        "fitting_rate": misfit.fitting_rate,
        "noise_floor": misfit.floor,
        "in_noise_floors": misfit.noise_ratio,
    }


def events_as_json(errors: ModelErrors, left_out: Collection[str] = ()) -> list[dict[str, Any]]:
    """The errors in every earthquake and direction."""
    predicted = {(one.observation.name, one.observation.direction): one for one in errors.predictions}
    return [
        {
            "name": one.observation.name,
            "start": one.observation.start.isoformat(),
            "direction": one.observation.direction,
            "left_out": one.observation.name in left_out,
            "force": misfit_as_json(one.misfit),
            "prediction": _prediction(predicted.get((one.observation.name, one.observation.direction))),
        }
        for one in errors.forces
    ]


def _prediction(one: Prediction | None) -> dict[str, Any] | None:
    if one is None:
        return None
    return {
        "displacement": misfit_as_json(one.displacement.misfit),
        "accelerations": {level: misfit_as_json(of.misfit) for level, of in one.accelerations.items()},
    }


def _prediction_of_all(predictions: tuple[Prediction, ...]) -> dict[str, Any] | None:
    if not predictions:
        return None
    levels = predicted_accelerations(predictions)
    return {
        "displacement": misfit_as_json(predicted_displacement(predictions)),
        "accelerations": {level: misfit_as_json(one) for level, one in levels.items()},
        "all_accelerations": misfit_as_json(pooled(list(levels.values()))) if levels else None,
    }


def _region(one: Region) -> dict[str, Any]:
    return {
        "circumstance": one.name,
        "threshold": None if one.classed else one.threshold,
        "is_above": one.is_above,
        "class": one.classed or None,
        "share": asdict(one.share),
        "share_of_energy": one.energy,
        "odds": asdict(one.odds),
    }


def _profile(one: Profile) -> dict[str, Any]:
    away: Share | None = one.explained_share
    return {
        "circumstance": one.name,
        "taken_away": None if away is None else asdict(away),
        "bins": [({"class": one.classes[int(bin_.low)]} if one.classes else {}) | _bin(bin_) for bin_ in one.bins],
    }


def _bin(one: Bin) -> dict[str, Any]:
    """The noise ratio has its stored name, `floors`."""
    return {"floors" if name == "noise_ratio" else name: value for name, value in asdict(one).items()}


def finite(document: dict[str, Any]) -> dict[str, Any]:
    """The same with null for every number that JSON cannot hold."""
    kept: dict[str, Any] = _finite(document)
    return kept


def _finite(value: Any) -> Any:  # noqa: ANN401  whatever JSON may hold
    match value:
        case float():
            return float(value) if isfinite(value) else None
        case dict():
            return {key: _finite(member) for key, member in value.items()}
        case list() | tuple():
            return [_finite(member) for member in value]
    return value


def fit_as_json(found: Work[FitResult]) -> dict[str, Any]:
    """Values, covariance, outcome, and the errors before and after."""
    result, fit = found.result, found.result.fit
    before, after = result.versions
    return finite(
        {
            "version": VERSION,
            "building": found.model.building,
            "model": model_as_json(found.model),
            "outcome": fit.outcome.name.lower(),
            "undetermined": [list(key) for key in fit.undetermined],
            "covariance": {
                "parameters": [list(key) for key in fit.free],
                "matrix": (fit.covariance * result.inflation).tolist(),
            },
            "before": events_as_json(before.errors, result.earthquakes.held_out),
            "after": events_as_json(after.errors, result.earthquakes.held_out),
            "explanation": " ".join(result.text),
            "unused": list(result.earthquakes.unused),
        }
    )
