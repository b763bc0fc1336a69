"""Effects, comparisons and diagnoses in Japanese: nothing but names, units and symbols stays English."""

import re

import pytest
from api_client import client

from core.effect import explained
from core.effects import EFFECTS
from service.language.translation import said

NAMES = {*EFFECTS, *(one.name for effect in EFFECTS.values() for one in effect.parameters)}
WORD = re.compile(r"(?<![\w/.-])[a-z]{3,}(?![\w/-])")


def english(text: str) -> list[str]:
    return [word for word in WORD.findall(text) if word not in {*NAMES, "exp", "sgn"}]


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_is_told_in_japanese(name: str) -> None:
    effect = EFFECTS[name]
    usual = {one.name: one.prior.median for one in effect.parameters}
    texts = [effect.title, effect.family, effect.suspect_when, explained(effect, usual)]
    texts += [one.meaning for one in effect.parameters]
    assert [text for text in texts if said(text, "ja") == text or english(said(text, "ja"))] == []


@pytest.mark.parametrize(
    "sentence",
    [
        "Beside hardening, Friction (friction) is missing. The loop is not symmetric about the origin.",
        "An effect of the family dry friction is missing: Friction (friction) or Break-away friction (Stribeck) "
        "(breakaway); the records cannot distinguish them.",
        "With hardening the error of the force falls from 575 kN to 31 kN (ΔBIC −1,450,000: the records "
        "support it, the "
        "limit is −10).",
        "The error of the force changes from 3.9 % to 0.2 % where it was fitted and from 9.1 % to 0.1 % on held-out "
        "earthquakes.",
        "With this effect, the error is still 1.41 times the noise. A regression on powers and delays of the motion, "
        "hysteresis, travel, vertical load, temperature and the other direction predicts less than 5.0 % of its power; "
        "an abrupt contact, for example, would not show in it.",
        "Step of the yield force (strength_step) is missing. Yield and sliding forces changed by a share of -0.100 at "
        "2021-05-03 03:12 UTC, between the earthquakes of 2021-04-13 03:12:07 and 2021-05-23 03:12:07, and stayed so.",
        "Friction (friction) comes nearest and does not explain it. Hardening of the rubber (hardening) comes near "
        "too.",
        "Not proposed because it is impossible: Inerter (inerter); it has no strength left: the records support its "
        "opposite.",
        "The sensor A.B1: reads 12.0 ± 0.3 % too much against the other sensors; check it, or divide "
        "its gain by 1.120; "
        "an opposite error of A.B2 would have the same effect.",
        "The superstructure: direction x: the storey below '3F' has 20 ± 3 % less stiffness than designed, against the "
        "other storeys (or that below '4F': a sensor between would show it). Look for damage there, or correct its "
        "stiffness in the building file; the estimated force already allows for it.",
        "Fitted: the misfit has a minimum here. Strongly correlated, barely distinguishable: F_y of "
        "bouc_wen and beta of "
        "bouc_wen (+0.966).",
        "Stiffness and damping that vary would explain 74 % (72 to 80) with the other direction, 60 % (50 to 70) with "
        "the phase of the loop.",
        "97 % (74 to 100) of the excess error lies in cycles above 170 mm, which has 58 % of the force's energy.",
        "The model misses the latest 2 events: in the event of 2026-10-10 10:39:43 UTC, direction x, "
        "12.3 % of the force "
        "is explained neither by the model nor by noise; the limit, from the events it was fitted to, is 2.0 %. A "
        "diagnosis shows what is missing.",
        "fitted to 3 events, 2 held out",
        "with hardening",
    ],
)
def test_a_sentence_of_a_comparison_or_a_diagnosis_is_told_in_japanese(sentence: str) -> None:
    translated = said(sentence, "ja")
    assert translated != sentence
    assert english(translated) == [], translated


def test_the_page_of_an_effect_keeps_the_names_of_its_parameters(database_url: str) -> None:
    with client(database_url) as asking:
        page = asking.get("/effects/power_viscous", headers={"Accept-Language": "ja"})
    assert "速度 speed で force の抵抗力" in page.text
