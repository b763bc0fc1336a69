"""Sentences of the workbench about what remains once effects are added."""

from core.diagnosis.unexplained import Unexplained
from core.workbench.texts import remaining


def test_an_error_that_follows_the_motion_shows_that_the_model_is_incomplete() -> None:
    said = remaining(Unexplained(share=0.372, noise_ratio=88.7, allowed=1.25), 1)
    assert said == (
        "With this effect, the error is still 88.7 times the noise, and 37.2 % of its power follows the motion: "
        "the model is incomplete."
    )


def test_an_error_that_does_not_follow_the_motion_is_not_called_structure() -> None:
    said = remaining(Unexplained(share=-0.01, noise_ratio=1.4, allowed=1.25), 2)
    assert said == (
        "With these effects, the error is still 1.4 times the noise. Less than 5.0 % of its power follows the motion, "
        "so these records do not show what else is missing."
    )
