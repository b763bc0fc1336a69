"""The tables of the diagnosis' benchmark count what is right, and name every trial that is not."""

from dataclasses import replace

from benchmarks.diagnosis_tables import tables
from benchmarks.diagnosis_trial import Row
from benchmarks.table import Table

RIGHT = Row(
    case="hardening",
    seed=1,
    noise=0.01,
    misfit=0.05,
    hidden=("hardening",),
    outcome="effect",
    unknown=False,
    named=("hardening",),
    sets=(("hardening",),),
    suspects=(),
    before=5.0,
    after=1.0,
    predicted=0.005,
    predicted_before=0.1,
    seconds=5.0,
)
WRONG = replace(
    RIGHT, seed=3, noise=0.1, named=("friction",), sets=(("friction",),), outcome="one_of_set", unknown=True
)
BLAMED = replace(RIGHT, case="mass", hidden=(), misfit=0.0, sets=())
WEAK = replace(WRONG, seed=5, misfit=0.015)
NAMED, BLAMES = "same law, misfit > 2 %: named first", "mass 10 % off: outcome mass"


def cells(table: Table, first: str) -> tuple[str, ...]:
    [found] = [row for row in table.rows if row[0] == first]
    return found[1:]


def test_shares_are_of_the_trials_that_are_requested() -> None:
    """A weak law need not be seen: its trial is in no share of those above 2 %."""
    whole, by_noise, _ = tables([RIGHT, WRONG, BLAMED, WEAK])
    assert cells(whole, NAMED) == ("≥ 98 %", "50.0 % (1 of 2)")
    assert cells(whole, "same law, misfit ≤ 2 %: another named") == ("", "100.0 % (1 of 1)")
    assert cells(whole, "mass 10 % off: an effect blamed") == ("0", "100.0 % (1 of 1)")
    assert by_noise.columns == ("right", "1 % noise", "10 % noise")
    assert cells(by_noise, NAMED) == ("100.0 % (1 of 1)", "0.0 % (0 of 1)")
    assert cells(by_noise, BLAMES) == ("0.0 % (0 of 1)", "none run")


def test_a_pair_counts_as_held_only_if_each_effect_is_in_a_set_of_its_own() -> None:
    pair = replace(RIGHT, case="friction+relief", hidden=("friction", "relief"), named=("relief", "breakaway"))
    held = replace(pair, sets=(("relief", "friction"), ("breakaway", "friction")))
    missed = replace(pair, sets=(("relief", "friction"), ("breakaway",)))
    one = replace(pair, sets=(("relief", "friction"),))
    whole, *_ = tables([held, missed, one])
    assert cells(whole, "two effects: the sets contain both") == ("", "33.3 % (1 of 3)")


def test_beyond_the_fitted_range_either_that_is_said_or_the_family_named() -> None:
    beyond = replace(RIGHT, case="moat+weak", hidden=("moat",), named=("hardening",))
    said = replace(beyond, outcome="out_of_range", named=(), sets=())
    whole, _, wrong = tables([beyond, said, replace(beyond, seed=3, named=("friction",))])
    assert cells(whole, "beyond the fitted range: this stated, or the family named") == ("", "66.7 % (2 of 3)")
    assert cells(whole, "beyond the fitted range: another family named") == ("0", "33.3 % (1 of 3)")
    assert wrong.rows == (("beyond the fitted range", "moat+weak, 3", "1 %", "5.0 %", "effect, friction"),)


def test_every_trial_that_went_wrong_is_listed_with_what_was_stated() -> None:
    *_, wrong = tables([RIGHT, WRONG, BLAMED, WEAK])
    assert wrong.rows == (
        ("same law, misfit > 2 %", "hardening, 3", "10 %", "5.0 %", "one_of_set, friction, unknown"),
        ("mass 10 % off", "mass, 1", "1 %", "0.0 %", "effect, hardening"),
    )


def test_tables_can_be_made_before_any_trial_is_done() -> None:
    assert [len(table.rows) for table in tables([])][2] == 0
