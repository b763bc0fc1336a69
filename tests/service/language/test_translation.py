"""Sentences are recognised by the message they were composed from; what no message fits stays as it is."""

import random

import pytest

from core.effects import only
from service.language.translation import Catalogue, catalogue, said

JAPANESE = Catalogue(
    {
        "normal": "正常",
        "the gain of level {0} jumped; check it. It is left out": "{0} の感度が変化。確認してください。除外しました",
        "inspect": "点検",
        "Change of stiffness": "剛性の変化",
        "{title}, direction {subject}": "{title}（{subject} 方向）",
        "direction {subject}": "{subject} 方向",
        "{0} of {1} checks passed.": "{1} 項目中 {0} 項目が適合。",
        "Break-away friction (Stribeck)": "起動摩擦（ストライベック効果）",
        "Friction": "摩擦",
        "with {0}": "{0} を追加",
        "{0} with the {1}": "{1}により {0}",
        "amplitude": "振幅",
        "velocity": "速度",
        "{0} alert{1} open": "未解決の警報 {0} 件",
        "{0} of {1}": "{1} の {0}",
        "noise of sensors": "センサーのノイズ",
        "noise": "ノイズ",
        "the isolators moved {length}": "免震層の変位は {length}",
        "They carry the building. Have them inspected.": "免震装置は建物を支えます。点検を受けてください。",
        "{what} that is {size} % off agrees with all": "{what}の誤差 {size} %（整合）",
        "It ended: {what}. {why}": "終了：{what}。{why}",
        "It is over.": "終わりました。",
        "a mass": "質量",
        "a gain": "感度",
        "the isolators moved {length}, and {more}": "免震層の変位は {length}、さらに{more}",
    },
    "ja",
)


@pytest.mark.parametrize(
    ("english", "japanese"),
    [
        ("normal", "正常"),
        ("Normal", "正常"),
        ("Change of stiffness, direction x", "剛性の変化（x 方向）"),
        ("Change of stiffness, direction x: inspect", "剛性の変化（x 方向）：点検"),
        ("8 of 9 checks passed. The isolators moved 12 mm.", "9 項目中 8 項目が適合。免震層の変位は 12 mm。"),
        ("normal of x", "x の 正常"),
        ("Noise of sensors", "センサーのノイズ"),
        ("Change of stiffness 12.0 ± 0.3 %", "剛性の変化 12.0 ± 0.3 %"),
        ("12 % normal", "12 % 正常"),
        ("Friction (friction)", "摩擦（friction）"),
        ("with hardening", "hardening を追加"),
        ("k5 of hardening, k3 of hardening", "hardening の k5、hardening の k3"),
        (
            "Friction (friction) or Break-away friction (Stribeck) (breakaway)",
            "摩擦（friction）または起動摩擦（ストライベック効果）（breakaway）",
        ),
        (
            "74 % (72) with the amplitude, 60 % (50) with the velocity",
            "振幅により 74 % (72)、速度により 60 % (50)",
        ),
        ("1 alert open; 2 alerts open", "未解決の警報 1 件；未解決の警報 2 件"),
        ("inspect: the isolators moved 12 mm", "点検：免震層の変位は 12 mm"),
        (
            "The isolators moved 12 mm. They carry the building. Have them inspected. 2 alerts open.",
            "免震層の変位は 12 mm。免震装置は建物を支えます。点検を受けてください。未解決の警報 2 件。",
        ),
        (
            "a mass that is +8 % off agrees with all and a gain that is −5 % off agrees with all",
            "質量の誤差 +8 %（整合）と感度の誤差 −5 %（整合）",
        ),
        ("the isolators moved 8 % (95 %: 6 to 9 %), and inspect", "免震層の変位は 8 % (95 %: 6 to 9 %)、さらに点検"),
        ("It ended: change of stiffness. It is over.", "終了：剛性の変化。終わりました。"),
        (
            "KIS01: the gain of level 3 jumped; check it. It is left out; direction x: the gain of level 4 jumped; "
            "check it. It is left out; normal",
            "KIS01：3 の感度が変化。確認してください。除外しました；x 方向：4 の感度が変化。確認してください。"
            "除外しました；正常",
        ),
        ("the isolators moved 12 mm, and change of stiffness", "免震層の変位は 12 mm、さらに剛性の変化"),
    ],
)
def test_a_sentence_is_translated_with_what_stands_in_its_places(english: str, japanese: str) -> None:
    assert JAPANESE.said(english) == japanese


def test_names_of_effects_stay_though_a_computation_with_few_of_them_asks_first() -> None:
    fresh = Catalogue({"Friction": "摩擦", "with {0}": "{0} を追加"}, "ja")
    with only(["elastic"]):
        assert fresh.said("with hardening") == "hardening を追加"
    assert fresh.said("Friction (friction)") == "摩擦（friction）"


@pytest.mark.parametrize(
    ("english", "japanese"),
    [
        (
            "Storey drift over height (below 6F, direction x, estimated): 1.14 %, beyond the action limit (active)",
            "層間変形角（6F の下、x 方向、推定値）：1.14 %、要対応のしきい値を超過（発報中）",
        ),
        (
            "Floor acceleration (roof, direction x): 320 gal, perhaps beyond the action limit (active)",
            "床応答加速度（roof、x 方向）：320 gal、要対応のしきい値を超えている可能性があります（発報中）",
        ),
    ],
)
def test_an_alert_about_a_limit_is_translated_with_its_state(english: str, japanese: str) -> None:
    assert said(english, "ja") == japanese


@pytest.mark.parametrize(
    "text", ["", "12 mm", "KIS01", "Tower 29", "x" * 5000, "No message is like it.", "Lack of one"]
)
def test_what_no_message_fits_is_not_translated(text: str) -> None:
    assert JAPANESE.said(text) is None


def test_a_hostile_text_takes_no_long_search() -> None:
    assert JAPANESE.said("the isolators moved " * 200) is None
    assert JAPANESE.said("the isolators moved " + "12 mm, and " * 300) is not None
    assert JAPANESE.said("Have them inspected. " * 190) is None
    assert JAPANESE.said(("normal, " * 490)[:-2]) == "、".join(["正常"] * 490)


def test_dates_are_written_as_in_japan() -> None:
    assert said("Tower 29, 5 January 2024, 14:03 (JST)", "ja") == "Tower 29, 2024年1月5日 14:03 (JST)"
    assert said("Tower 29, 5 January 2024, 14:03 (JST)", "en") == "Tower 29, 5 January 2024, 14:03 (JST)"


def test_a_text_that_would_take_long_stays_as_it_is() -> None:
    rng = random.Random(1)
    words = [word for message in catalogue("ja").exact for word in message.split()]
    hostile = [" ".join(rng.choices(words, k=500)) for _ in range(20)]
    assert [text for text in hostile if said(text, "ja") == text]  # without the limit, each is translated in part
