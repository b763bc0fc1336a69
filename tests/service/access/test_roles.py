"""Roles on single buildings: no one has more on a building than was granted there."""

from hypothesis import given, settings, strategies as st

from service.access.roles import Grant, Role, granted

CODES = ("A", "B", "C")
GRANTS = st.lists(
    st.builds(Grant, st.sampled_from(Role), st.none() | st.frozensets(st.sampled_from(CODES), max_size=3)), max_size=5
)


def allowed(grants: list[Grant], code: str) -> int:
    """The highest role that was granted on a building; 0 for none."""
    return max((one.role for one in grants if one.buildings is None or code in one.buildings), default=0)


@settings(derandomize=True, max_examples=300, deadline=None)
@given(GRANTS, st.sampled_from(Role))
def test_a_caller_has_on_each_building_what_was_granted_there(grants: list[Grant], needed: Role) -> None:
    caller = granted("a", grants)
    acting = None if caller is None else caller.at_least(needed)
    for code in (*CODES, "not granted by name"):
        role = allowed(grants, code)
        of_caller = None if caller is None else caller.on(code)
        assert (of_caller.role if of_caller and of_caller.buildings else 0) == role
        exists = acting is not None and (acting.buildings is None or code in acting.buildings)
        assert exists == (role >= needed), "a request that needs a role sees the buildings where it was granted"
        assert not exists or needed <= acting.role <= acting.on(code).role <= role


@settings(derandomize=True, max_examples=100, deadline=None)
@given(GRANTS, st.sampled_from(Role), st.sampled_from(Role))
def test_a_request_that_needs_two_roles_needs_the_higher_one(grants: list[Grant], one: Role, other: Role) -> None:
    caller = granted("a", grants)
    if caller is None:
        return
    first = caller.at_least(one)
    both = None if first is None else first.at_least(other)
    highest = caller.at_least(max(one, other))
    assert (both and both.buildings) == (highest and highest.buildings)
