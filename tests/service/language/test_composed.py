"""Findings, reasons and errors as pages show them, each composed of several messages, leave no English in Japanese."""

import re

import pytest

from service.language.translation import said

ENGLISH = re.compile(r"(?<![\w/.\[_:'\"-])[a-z]{3,}(?![\w/\]_(=.'-])")
NAMES = ("http", "location", "gal", "position", "rotation")


@pytest.mark.parametrize(
    "text",
    [
        "XX.TWR.01.HNX: every sample is 0 (SI); check the sensor and its cable. The channel is left out; "
        "direction x: the base slab's acceleration cannot be used; nothing can be estimated without it",
        "does not move with its neighbours below 2.0 Hz (squared coherence 0.12): check the sensor. The channel "
        "is left out",
        "moves less than a level below it: two levels may be swapped. Check the building file. The channel is left out",
        "its axes are turned by 12.3 ± 0.4 degrees from x towards y relative to the other sensors'; they were "
        "turned back; to make this permanent, set rotation = 12 for its x and y in the building file",
        "direction x: the displacement channel contains accelerations integrated twice, so no displacement was "
        "measured, and the accelerations are nowhere clearly above their noise; no motion of the layer",
        "direction x: the calibrated superstructure was not used: left-out floors are predicted with an error of "
        "0.31 by the model, of 0.2 by interpolation; the force is the paper's, with static interpolation between "
        "measured floors. A sensor on another floor would help",
        "direction y: noise alone does not explain what the superstructure leaves of the record (chi-square "
        "3.21); assumed: masses and sensors corrected, every mode with a damping of its own; measured floors stay"
        " as measured, and the force's standard deviation allows for it",
        "http://10.0.0.1/ cannot be reached: its name is not known, 3 times; check location in the building file,"
        " and the name server (DNS)",
        "http://10.0.0.1/ answered 401 Unauthorized; the user name or the password is missing or wrong; correct "
        "it in location in the building file",
        "the unit of XX.A.00.HNX is not known; send a StationXML file with these channels, or give their gain and"
        " unit in the building file; channels that the building file does not name were ignored: XX.A.00.HNZ",
        "Improvement ended: no further effect lowers the error in stronger earthquakes than those fitted. The error of "
        "the force in stronger earthquakes than those fitted changes from 27.3 % to 6.4 %, that in earthquakes left "
        "out in turn from 23.4 % to 5.2 %. Fitted: the misfit has a minimum here.",
        "/in/a.mseed cannot be read: Permission denied (and 3 more); give the service's account the right to read it",
    ],
)
def test_a_composed_text_leaves_no_english(text: str) -> None:
    left = [word for word in ENGLISH.findall(said(text, "ja").replace("Permission denied", "")) if word not in NAMES]
    assert left == []
