"""Records with some fields changed: as the library does it."""

from dataclasses import FrozenInstanceError, dataclass, fields, replace
from functools import cached_property

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.model import fast_replace as changing


@dataclass(frozen=True, slots=True)
class Record:
    one: int
    two: str = "b"
    three: tuple[int, ...] = ()


@dataclass(frozen=True)
class Open:
    one: int
    two: str = "b"
    three: tuple[int, ...] = ()

    @cached_property
    def double(self) -> int:
        return 2 * self.one


@dataclass(frozen=True)
class Single:
    one: int


@dataclass(frozen=True)
class Checked:
    one: int

    def __post_init__(self) -> None:
        if self.one < 0:
            raise ValueError


VALUES = {"one": st.integers(), "two": st.text(), "three": st.tuples(st.integers())}


KINDS = pytest.mark.parametrize("kind", [Record, Open])


@KINDS
@given(changes=st.fixed_dictionaries({}, optional=VALUES), one=st.integers())
def test_replace_equals_dataclasses_replace(
    kind: type[Record], changes: dict[str, object], one: int
) -> None:
    record = kind(one)
    changed = changing.replace(record, **changes)
    assert changed == replace(record, **changes)  # type: ignore[arg-type]
    assert all(getattr(record, f.name) == getattr(kind(one), f.name) for f in fields(record))


def test_cached_properties_are_not_copied() -> None:
    record = Open(1)
    assert record.double == 2
    assert changing.replace(record, one=5).double == 10
    assert changing.replace(record, two="c").double == 2


def test_post_init_checks_run_again() -> None:
    with pytest.raises(ValueError):
        changing.replace(Checked(1), one=-1)


@KINDS
def test_a_changed_record_stays_frozen(kind: type[Record]) -> None:
    with pytest.raises(FrozenInstanceError):
        changing.replace(kind(1), one=2).one = 3  # type: ignore[misc]


def test_a_record_with_a_single_field_is_changed() -> None:
    assert changing.replace(Single(1), one=2) == Single(2)


@KINDS
def test_an_unknown_field_is_refused(kind: type[Record]) -> None:
    with pytest.raises(KeyError):
        changing.replace(kind(1), four=4)


@KINDS
def test_a_record_without_changes_is_returned_itself(kind: type[Record]) -> None:
    record = kind(1, "b", (3,))
    assert changing.replace(record, one=1, three=record.three) is record
    assert changing.replace(record, one=2) is not record
