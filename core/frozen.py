"""A mapping for frozen values: immutable, and can be hashed, copied and pickled."""

from typing import Any, NoReturn, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class FrozenDict(dict[K, V]):
    """An immutable dict; hashable if its values are."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[type["FrozenDict[K, V]"], tuple[dict[K, V]]]:
        return FrozenDict, (dict(self),)

    def __copy__(self) -> "FrozenDict[K, V]":
        return self

    def __repr__(self) -> str:
        return f"FrozenDict({dict(self)!r})"

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:  # noqa: ANN401  whatever a dict takes
        raise TypeError("a frozen value cannot be changed; make a new one from it")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse
