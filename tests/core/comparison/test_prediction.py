from dataclasses import replace

import numpy as np
import pytest
from building_models import paper
from layer_observations import BAND, layer_observation

from core.building import fixed_base_modes
from core.comparison.prediction import Prediction, Start, predict, predicted_accelerations, predicted_displacement
from core.errors import RecordError
from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.paper import BUILDING, ISOLATOR

MODES = fixed_base_modes(BUILDING)
SOFTER = Isolator({**ISOLATOR.effects, "elastic": {"k_b": 0.9 * 475e6}})


def predicted(isolator: Isolator, seed: int = 1, scale: float = 1.0) -> Prediction:
    return alone(layer_observation(seed, scale=scale), isolator)


def alone(observation: Observation, isolator: Isolator = ISOLATOR) -> Prediction:
    (result,) = predict([Start(MODES, observation)], isolator, paper(), BAND)
    return result


def test_the_true_model_predicts_the_motion_to_the_sensors_noise() -> None:
    """0.1 %: the motion is given without noise here. 20 %: a floor's noise is judged from a fifth of the record."""
    prediction = predicted(ISOLATOR)
    assert prediction.displacement.misfit.nrmse < 1e-3
    assert list(prediction.accelerations) == ["1F", "2F", "3F", "4F", "5F", "6F", "7F", "RF"]
    for level, acceleration in prediction.accelerations.items():
        assert acceleration.misfit.noise_ratio == pytest.approx(1.0, abs=0.2), level


def test_a_wrong_model_predicts_another_motion() -> None:
    prediction = predicted(SOFTER)
    assert prediction.displacement.misfit.nrmse > 0.05
    assert prediction.accelerations["RF"].misfit.noise_ratio > 3


def test_earthquakes_together_weigh_by_their_motion() -> None:
    predictions = [predicted(SOFTER), predicted(SOFTER, seed=2, scale=0.1)]
    whole, strong = predicted_displacement(predictions), predictions[0].displacement.misfit
    assert whole.nrmse == pytest.approx(strong.nrmse, rel=0.02)  # the weak one has a hundredth of the energy
    assert set(predicted_accelerations(predictions)) == set(predictions[0].accelerations)


def test_a_baseline_of_the_displacement_is_no_error() -> None:
    observation = layer_observation(1)
    shifted = replace(observation, layer=replace(observation.layer, displacement=observation.layer.displacement + 0.01))
    prediction = alone(shifted)
    assert prediction.displacement.misfit.nrmse == pytest.approx(
        predicted(ISOLATOR).displacement.misfit.nrmse, rel=1e-3
    )


def test_an_integrated_displacement_is_compared_within_the_band() -> None:
    observation = layer_observation(1)
    drift = np.linspace(0.0, 0.05, observation.layer.displacement.size)
    layer = replace(observation.layer, displacement=observation.layer.displacement + drift)
    prediction = alone(replace(observation, layer=layer, transducer=False))
    assert prediction.displacement.misfit.nrmse < 0.02  # what the filter leaves of the drift's two ends


def test_without_the_ground_nothing_is_predicted() -> None:
    with pytest.raises(RecordError, match="the ground's acceleration was not measured"):
        alone(replace(layer_observation(1), ground_acceleration=None))
