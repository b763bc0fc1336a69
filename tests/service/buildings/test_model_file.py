import re
import tomllib
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from core.effects import EFFECTS
from core.model.isolator import Isolator
from core.paper import ISOLATOR
from service.models.model_file import ModelFile, ModelFileError, ModelTable, read, written

DOCUMENTATION = Path(__file__).resolve().parents[3] / "docs" / "models" / "models.md"
TEXT = written(ModelFile("PAPER", "x", ISOLATOR))


def problems(text: str) -> tuple[str, ...]:
    with pytest.raises(ModelFileError) as caught:
        read(text)
    return caught.value.problems


def line(text: str, beginning: str) -> int:
    """The number of the first line that begins so."""
    return next(n for n, found in enumerate(text.splitlines(), start=1) if found.startswith(beginning))


values = st.fixed_dictionaries(
    {
        name: st.fixed_dictionaries({p.name: st.floats(*p.bounds) for p in effect.parameters})
        for name, effect in EFFECTS.items()
        if name in ISOLATOR.effects
    }
)
texts = st.text(min_size=1, max_size=20)
moments = st.datetimes(datetime(1990, 1, 1), datetime(2100, 1, 1), timezones=st.just(UTC))  # noqa: DTZ001  given after


@st.composite
def models(draw: st.DrawFn) -> ModelFile:
    effects = draw(values)
    effects = {name: effects[name] for name in draw(st.lists(st.sampled_from(sorted(effects)), unique=True))}
    deviations = st.floats(0, allow_infinity=True, allow_nan=False)
    return ModelFile(
        building=draw(texts),
        direction=draw(st.sampled_from(["x", "y", "xy"])),
        isolator=Isolator(effects),
        reference=draw(st.none() | moments),
        parent=draw(st.none() | texts),
        assumed=tuple(draw(st.lists(texts, max_size=3))),
        fitted_to=tuple(draw(st.lists(texts, max_size=3))),
        integral=draw(st.sampled_from([None, "recorded", "restored"])),
        standard_deviations={name: {key: draw(deviations) for key in effects[name]} for name in effects},
    )


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # a busy machine draws examples slowly
@given(model=models())
def test_what_is_written_is_read_as_the_same(model: ModelFile) -> None:
    assert read(written(model)) == model


def test_a_file_explains_its_numbers() -> None:
    assert "k_b = 475e6  # N/m, stiffness of the rubber after yield" in TEXT
    assert "[effects.elastic]  # Elastic stiffness" in TEXT
    assert tomllib.loads(TEXT)["effects"]["bouc_wen"]["F_y"] == 655.4e3


def test_a_model_of_both_directions_holds_in_each() -> None:
    assert read(TEXT.replace('"x"', '"xy"')).directions == ("x", "y")
    assert read(TEXT).directions == ("x",)


# what is written; what is written instead; the line to be named; what the message says
WRONG = {
    "unknown effect": ("effects.elastic", "effects.elastik", "[effects.elastik", "no such effect; did you mean 'el"),
    "unknown parameter": ("k_b =", "kb =", "kb", "effects.elastic.kb: no such parameter; did you mean 'k_b'?"),
    "text for a number": ("475e6", '"475e6"', "k_b", "effects.elastic.k_b: expected a number within 0 ... 1e+12 N/m"),
    "truth for a number": ("475e6", "true", "k_b", "effects.elastic.k_b: expected a number within"),
    "out of bounds": ("475e6", "-1.0", "k_b", "effects.elastic.k_b: expected a number within 0 ... 1e+12 N/m, got -1"),
    "no number": ("475e6", "nan", "k_b", "effects.elastic.k_b: expected a number within"),
    "direction": ('"x"', '"z"', "direction", "direction: input should be 'x', 'y' or 'xy', got 'z'"),
    "unknown key": ("building =", "bilding =", "bilding", "bilding: no such key; did you mean 'building'?"),
    "moment without offset": (
        'direction = "x"',
        'direction = "x"\nreference = 2024-03-05T06:07:08',
        "reference",
        "reference: it has no offset from UTC; write it as 2024-03-05T06:07:08Z",
    ),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_key_is_named_with_its_line_and_what_is_wanted(kind: str) -> None:
    right, wrong, named, message = WRONG[kind]
    text = TEXT.replace(right, wrong, 1)
    assert text != TEXT
    (problem,) = [found for found in problems(text) if message in found]
    assert problem.startswith(f"line {line(text, named)}: ")


def test_a_missing_value_is_named_with_its_unit() -> None:
    text = re.sub(r"D_y = .*\n", "", TEXT)
    assert problems(text) == (
        f"line {line(text, '[effects.bouc_wen]')}: effects.bouc_wen: D_y is missing (m, yield displacement)",
    )


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[standard_deviations.elastic]\nkb = 1.0", "standard_deviations.elastic.kb: no such parameter; did you mean"),
        (
            "[standard_deviations.elastic]\nk_b = -1.0",
            "standard_deviations.elastic.k_b: expected a number within 0 ... inf",
        ),
        (
            "[standard_deviations.elastik]\nk_b = 1.0",
            "standard_deviations.elastik: expected a table of an effect of this model",
        ),
    ],
)
def test_a_wrong_standard_deviation_is_named(table: str, message: str) -> None:
    assert any(message in problem for problem in problems(f"{TEXT}\n{table}\n"))


@given(
    value=st.sampled_from(["1", '"x"', "[]", "[[], []]", "{}", "{x = 1}", "{elastic = 1}", "{elastic = {k_b = {}}}"]),
    key=st.sampled_from(["effects", "standard_deviations", "building", "reference", "fitted_to"]),
)
def test_any_value_in_place_of_a_table_is_a_problem_not_a_crash(key: str, value: str) -> None:
    assert problems(f"{key} = {value}")


def test_bad_syntax_is_reported() -> None:
    assert "this is not TOML" in problems(TEXT.replace("475e6", ""))[0]


def test_every_key_is_documented() -> None:
    text = DOCUMENTATION.read_text("utf-8")
    for key, field in ModelTable.model_fields.items():
        assert field.description, key
        assert any(row.startswith(f"| `{key}` |") and field.description in row for row in text.splitlines()), key


def test_the_documented_example_is_right() -> None:
    (example,) = re.findall(r"```toml\n(.*?)```", DOCUMENTATION.read_text("utf-8"), re.DOTALL)
    assert written(read(example)) == example
