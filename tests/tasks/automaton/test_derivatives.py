from __future__ import annotations

from itertools import product

from hypothesis import given, settings
from hypothesis import strategies as st

from visup.tasks.automaton.derivatives import begin, derivatives, enter
from visup.tasks.automaton.states import Leaf, State, leaves, structural_key, with_leaves
from visup.tasks.grammar.analysis import Grammar
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Choice,
    Course,
    Name,
    Reference,
    Repeated,
    Sequence,
    Stage,
    Task,
    Together,
)
from visup.tasks.grammar.parser import read

LAW = settings(max_examples=150, deadline=None)
LONGEST = 4
Word = tuple[frozenset[str], ...]
ACTIONS = [Action(n, (Name("x"),)) for n in "abc"]

small = st.recursive(
    st.sampled_from(ACTIONS),
    lambda inner: st.one_of(
        st.builds(Sequence, st.lists(inner, min_size=2, max_size=3).map(tuple)),
        st.builds(Choice, st.lists(inner, min_size=2, max_size=3).map(tuple)),
        st.builds(Repeated, inner, st.sampled_from(["?", "*", "+"])),
        st.builds(Together, st.lists(st.sampled_from(ACTIONS), min_size=2, max_size=3).map(tuple)),
    ),
    max_leaves=5,
)


def words(course: Course) -> set[Word]:
    """All that a course can be seen as, up to a length, straight from its meaning."""
    match course:
        case Action(name=name):
            return {(frozenset({name}),)}
        case Choice(options=options):
            return set().union(*(words(o) for o in options))
        case Sequence(items=items):
            found: set[Word] = {()}
            for item in items:
                found = {a + b for a in found for b in words(item) if len(a + b) <= LONGEST}
            return found
        case Together(parts=parts):
            return {
                (frozenset().union(*(w[0] for w in way)),)
                for way in product(*(words(p) for p in parts))
            }
        case Repeated(item=item, mark=mark):
            one = words(item)
            more: set[Word] = {()}
            for _ in range(LONGEST):
                more |= {a + b for a in more for b in one if len(a + b) <= LONGEST}
            return one | {()} if mark == "?" else more if mark == "*" else words_once(one, more)
    raise AssertionError(course)


def words_once(one: set[Word], more: set[Word]) -> set[Word]:
    return {a + b for a in one for b in more if len(a + b) <= LONGEST}


def walked(task: Task) -> set[Word]:
    """The same, found by entering the course and moving on."""
    found: set[Word] = set()
    todo: list[tuple[State[None] | None, Word]] = [
        (s, ()) for s in enter(task, begin(task), None, 0.0)
    ]
    seen = set()
    while todo:
        state, word = todo.pop()
        if state is None:
            found.add(word)
            continue
        if len(word) >= LONGEST or (structural_key(state), word) in seen:
            continue
        seen.add((structural_key(state), word))
        for move in derivatives(task, state, None, 0.0):
            left = frozenset(x.step.action for x in move.left)
            todo.append((move.state, (*word, left)))
    return found


@LAW
@given(small)
def test_derivatives_accept_exactly_the_sequences_of_a_course(course: Course) -> None:
    task = Task((Stage("t", course),))
    if any(
        isinstance(c, Repeated) and c.mark != "?" and Grammar(task).nullable(c.item)
        for c in _all(course)
    ):
        return  # the check refuses these
    assert walked(task) == words(course)


def _all(course: Course) -> list[Course]:
    from visup.tasks.grammar.nodes import walk

    return list(walk(course))


@LAW
@given(small)
def test_a_course_is_nullable_if_it_accepts_the_empty_sequence(course: Course) -> None:
    grammar = Grammar(Task((Stage("t", course),)))
    assert grammar.nullable(course) == (() in words(course))


names = st.sampled_from(["t", "u", "v"])
bodies = st.recursive(
    st.one_of(st.just(ACTIONS[0]), st.builds(Reference, names)),
    lambda inner: st.one_of(
        st.builds(Sequence, st.lists(inner, min_size=2, max_size=2).map(tuple)),
        st.builds(Choice, st.lists(inner, min_size=2, max_size=2).map(tuple)),
        st.builds(Repeated, inner, st.just("?")),
    ),
    max_leaves=4,
)
grammars = st.tuples(bodies, bodies, bodies).map(
    lambda b: Task(tuple(Stage(n, c) for n, c in zip("tuv", b, strict=True)))
)


def shortest(task: Task) -> dict[str, int | None]:
    """Least number of actions in each stage, by trying deeper and deeper expansions."""
    best: dict[str, int | None] = dict.fromkeys("tuv")

    def least(course: Course | Actors) -> int | None:
        match course:
            case Action():
                return 1
            case Reference(stage=name):
                return best[name]
            case Sequence(items=items):
                parts = [least(i) for i in items]
                return None if None in parts else sum(p or 0 for p in parts)
            case Choice(options=options):
                return min((x for x in map(least, options) if x is not None), default=None)
            case Repeated():
                return 0
        raise AssertionError(course)

    for _ in range(5):
        best = {s.name: least(s.body) for s in task.stages}
    return best


@LAW
@given(grammars)
def test_a_stage_never_ends_when_no_expansion_of_it_does(task: Task) -> None:
    grammar = Grammar(task)
    endless = {n for n, length in shortest(task).items() if length is None}
    told = {s.name for s in grammar.non_terminating()}
    assert told <= endless
    assert bool(told) == bool(endless)


@LAW
@given(grammars)
def test_without_left_recursion_entering_ends(task: Task) -> None:
    if Grammar(task).left_recursive():
        return
    states = list(enter(task, begin(task), None, 0.0))
    assert all(s is None or leaves(s) for s in states)


def test_left_recursion_is_found_through_what_may_be_left_out() -> None:
    task = read("<t> ::= <u> a(x)\n<u> ::= b(x)? <t>\n<v> ::= c(x) <v>")
    assert [s.name for s in Grammar(task).left_recursive()] == ["t"]


def test_stages_and_times_of_steps_are_those_around_them() -> None:
    task = read("<t> ::= <u> within 60 s\n<u> ::= <a>\n<a> ::= x y")
    (state,) = [s for s in enter(task, begin(task), None, 10.0) if s is not None]
    (leaf,) = leaves(state)
    assert (leaf.step.action, leaf.step.actors, leaf.step.stage) == ("a", ("x", "y"), "u")
    assert [(d.seconds, d.stage, d.at) for d in leaf.step.deadlines] == [(60.0, "t", 70.0)]


def test_a_deadline_runs_on_through_a_sequence_and_anew_in_each_round() -> None:
    task = read("<t> ::= ((a(x) b(x)) within 60 s)+")
    (state,) = [s for s in enter(task, begin(task), None, 0.0) if s is not None]
    (on,) = derivatives(task, state, None, 5.0)
    assert on.state is not None
    assert leaves(on.state)[0].step.deadlines[0].at == 60.0
    again = [m for m in derivatives(task, on.state, None, 20.0) if m.state is not None]
    assert [leaves(m.state)[0].step.deadlines[0].at for m in again if m.state] == [80.0]


def test_leaves_are_replaced_in_order() -> None:
    task = read("<t> ::= (a(x) & b(x)) c(x)")
    (state,) = [s for s in enter(task, begin(task), 0, 0.0) if s is not None]
    numbered = with_leaves(state, iter(Leaf(x.step, i) for i, x in enumerate(leaves(state), 1)))
    assert [x.payload for x in leaves(numbered)] == [1, 2]
    assert structural_key(numbered) == structural_key(state)
