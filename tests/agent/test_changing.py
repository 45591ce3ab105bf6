"""Records with some fields changed: as the library does it."""

from dataclasses import dataclass, fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import changing


@dataclass(frozen=True, slots=True)
class Record:
    one: int
    two: str = "b"
    three: tuple[int, ...] = ()


@dataclass(frozen=True)
class Single:
    one: int


VALUES = {"one": st.integers(), "two": st.text(), "three": st.tuples(st.integers())}


@given(st.fixed_dictionaries({}, optional=VALUES), st.integers())
def test_a_changed_record_is_that_of_the_library(changes: dict[str, object], one: int) -> None:
    record = Record(one)
    changed = changing.replace(record, **changes)
    assert changed == replace(record, **changes)  # type: ignore[arg-type]
    assert all(getattr(record, f.name) == getattr(Record(one), f.name) for f in fields(record))


def test_a_record_of_a_single_field_is_changed_too() -> None:
    assert changing.replace(Single(1), one=2) == Single(2)


def test_a_field_that_is_not_there_is_refused() -> None:
    with pytest.raises(KeyError):
        changing.replace(Record(1), four=4)


def test_a_record_of_which_nothing_changes_stays_the_same_one() -> None:
    record = Record(1, "b", (3,))
    assert changing.replace(record, one=1, three=record.three) is record
    assert changing.replace(record, one=2) is not record
