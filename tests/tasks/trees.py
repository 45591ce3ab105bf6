"""Trees of the task language, drawn at random."""

from __future__ import annotations

from hypothesis import strategies as st

from visup.tasks.chunk import WORDS
from visup.tasks.tree import (
    Action,
    Actor,
    Actors,
    Choice,
    Clause,
    Course,
    Deadline,
    Duration,
    Hold,
    Invariant,
    Name,
    Reference,
    Repeated,
    Sequence,
    Stage,
    Task,
    Timed,
    Together,
)

names = st.from_regex(r"[a-zA-Zä_][a-z0-9_é]{0,8}", fullmatch=True).filter(lambda n: n not in WORDS)
models = st.from_regex(r"[a-z0-9][a-z0-9_.\-]{0,8}", fullmatch=True).filter(
    lambda n: n not in WORDS
)
amounts = st.one_of(
    st.integers(0, 10**6).map(float), st.floats(0.0, 1e9, allow_nan=False, allow_infinity=False)
)
durations = st.builds(Duration, amounts, st.sampled_from(["s", "ms", "min", "h"]))
clauses: st.SearchStrategy[Clause] = st.one_of(
    st.builds(Hold, durations), st.builds(Deadline, durations)
)
actors = st.lists(names.map(Name), min_size=1, max_size=3).map(tuple)
actions = st.builds(Action, names, actors)
references = st.builds(Reference, names)


def _several(inner: st.SearchStrategy[Course]) -> st.SearchStrategy[tuple[Course, ...]]:
    return st.lists(inner, min_size=2, max_size=3).map(tuple)


def _larger(inner: st.SearchStrategy[Course]) -> st.SearchStrategy[Course]:
    return st.one_of(
        st.builds(Choice, _several(inner)),
        st.builds(Sequence, _several(inner)),
        st.builds(Together, _several(inner)),
        st.builds(Timed, inner, st.lists(clauses, min_size=1, max_size=2).map(tuple)),
        st.builds(Repeated, inner, st.sampled_from(["?", "*", "+"])),
    )


atoms: st.SearchStrategy[Course] = st.one_of(actions, references)
courses = st.recursive(atoms, _larger, max_leaves=8)
stages = st.builds(Stage, names, st.one_of(courses, st.builds(Actors, actors)))
tasks = st.builds(
    Task,
    st.lists(stages, min_size=1, max_size=4).map(tuple),
    st.lists(
        st.builds(Actor, names, st.lists(models, min_size=1, max_size=3).map(tuple)), max_size=2
    ).map(tuple),
    st.lists(
        st.builds(Invariant, st.sampled_from(["never", "always"]), actions, st.none() | references),
        max_size=2,
    ).map(tuple),
)
