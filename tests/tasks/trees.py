"""Trees of the task language, drawn at random."""

from __future__ import annotations

from hypothesis import strategies as st

from visup.rules.formula.nodes import And, Not, Or
from visup.rules.formula.terms import Measure
from visup.rules.traits.colours import SHADES, TERMS
from visup.tasks.diagnostics.actor_error_patterns import RANKS
from visup.tasks.grammar.conditions import EVERY, Condition, Period, Range, lasted
from visup.tasks.grammar.criteria import (
    Another,
    Colours,
    Conduct,
    Criterion,
    Extent,
    PartOf,
    Place,
    Ranked,
    in_order,
)
from visup.tasks.grammar.nodes import (
    Action,
    Actor,
    Actors,
    AnyOrder,
    Choice,
    Clause,
    Comparison,
    Conditioned,
    Counted,
    Course,
    Deadline,
    Delay,
    Ground,
    Hold,
    Include,
    Invariant,
    Name,
    Number,
    Parameter,
    ParameterRef,
    Reference,
    Repeated,
    Sequence,
    Stage,
    StageCondition,
    Task,
    Timed,
    Together,
    ZoneDeclaration,
)
from visup.tasks.grammar.statement import RESERVED_WORDS
from visup.tasks.grammar.units import UNITS

names = st.from_regex(r"[a-zA-Zä_][a-z0-9_é]{0,8}", fullmatch=True).filter(
    lambda n: n not in RESERVED_WORDS
)
models = st.from_regex(r"[a-z0-9][a-z0-9_.\-]{0,8}", fullmatch=True).filter(
    lambda n: n not in (*RESERVED_WORDS, *TERMS)
)
amounts = st.one_of(
    st.integers(0, 10**6).map(float), st.floats(0.0, 1e9, allow_nan=False, allow_infinity=False)
)
amounts_said = st.one_of(
    st.builds(Number, amounts, st.sampled_from([*UNITS, "parsec"])),
    st.builds(ParameterRef, names),
)
holds = st.builds(Hold, amounts_said)
clauses: st.SearchStrategy[Clause] = st.one_of(
    holds,
    st.builds(Deadline, amounts_said),
    st.builds(Delay, amounts_said, st.none() | amounts_said),
)
actors = st.lists(names.map(Name), min_size=1, max_size=3).map(tuple)
actions = st.builds(Action, names, actors)
measures = st.builds(Measure, names, actors)
comparisons = st.one_of(
    st.builds(Comparison, measures, st.sampled_from(["<", "<=", ">", ">="]), amounts_said),
    st.builds(
        Comparison, measures, st.just("between"), st.builds(Range, amounts_said, amounts_said)
    ),
)
periods = st.builds(Period, st.none() | amounts_said, amounts_said)
periodic = st.builds(Comparison, measures, st.just(EVERY), periods)
references = st.builds(Reference, names)
facts: st.SearchStrategy[Condition] = st.one_of(actions, comparisons, periodic)


def _joined(inner: st.SearchStrategy[Condition]) -> st.SearchStrategy[Condition]:
    several = st.lists(inner, min_size=2, max_size=3).map(tuple)
    return st.one_of(
        st.builds(And, several),
        st.builds(Or, several),
        st.builds(Not, inner),
        st.builds(lasted, inner, amounts_said),
    )


conditions = st.recursive(facts, _joined, max_leaves=4)
kinds = st.sampled_from(["begins", "ends", "progresses", "fails", "pauses"])
signs = st.builds(StageCondition, kinds, conditions, st.none() | holds)


def _several(inner: st.SearchStrategy[Course]) -> st.SearchStrategy[tuple[Course, ...]]:
    return st.lists(inner, min_size=2, max_size=3).map(tuple)


def _larger(inner: st.SearchStrategy[Course]) -> st.SearchStrategy[Course]:
    return st.one_of(
        st.builds(Choice, _several(inner)),
        st.builds(Sequence, _several(inner)),
        st.builds(Together, _several(inner)),
        st.builds(AnyOrder, _several(inner)),
        st.builds(Conditioned, inner, st.lists(signs, min_size=1, max_size=2).map(tuple)),
        st.builds(Counted, inner, st.integers(0, 9), st.none() | st.integers(0, 9)),
        st.builds(Timed, inner, st.lists(clauses, min_size=1, max_size=2).map(tuple)),
        st.builds(Repeated, inner, st.sampled_from(["?", "*", "+"])),
    )


atoms: st.SearchStrategy[Course] = st.one_of(actions, references, comparisons, periodic)
courses = st.recursive(atoms, _larger, max_leaves=8)
texts = st.text(st.characters(exclude_characters='"\n', exclude_categories=["Cs"]), max_size=12)
stages = st.builds(
    Stage, names, st.one_of(courses, st.builds(Actors, actors)), texts, st.booleans()
)
sizes = st.none() | amounts_said
colours = st.sampled_from([*TERMS, *(f"{s} {t}" for s in SHADES for t in TERMS)])
places = st.builds(Place, st.tuples(amounts, amounts))
criteria: st.SearchStrategy[Criterion] = st.one_of(
    st.builds(Colours, st.lists(colours, min_size=1, max_size=3).map(tuple)),
    st.builds(Ranked, st.sampled_from(RANKS)),
    st.builds(Another),
    st.builds(Extent, st.sampled_from(["larger", "smaller"]), amounts_said),
    places,
    st.builds(Conduct, st.just("enters"), st.sampled_from(["", "left", "right", "top", "bottom"])),
    st.builds(Conduct, st.sampled_from(["moves", "rests"])),
    st.builds(PartOf, names.map(Name)),
)
told = st.lists(criteria, min_size=1, max_size=4).map(in_order)
some_models = st.lists(models, min_size=1, max_size=3).map(tuple)
declared = st.one_of(
    st.builds(Actor, names, some_models, sizes, st.booleans()),
    st.builds(Actor, names, st.just(()) | some_models, sizes, st.booleans(), criteria=told),
    st.builds(Actor, names, st.just(()), amounts_said, st.booleans()),
    st.builds(Actor, names, st.just(()), sizes, st.just(True)),
)
corners = st.lists(st.tuples(amounts, amounts), min_size=3, max_size=4).map(tuple)
floors = st.tuples(
    st.builds(Number, amounts, st.sampled_from(["m", "cm"])),
    st.builds(Number, amounts, st.sampled_from(["m", "mm"])),
)
floor_zones = st.builds(
    ZoneDeclaration, names, st.just(()), floor=st.lists(floors, min_size=3, max_size=4).map(tuple)
)
points = st.lists(st.tuples(st.tuples(amounts, amounts), floors), min_size=4, max_size=5)
grounds = points.map(lambda ps: Ground(tuple(i for i, _ in ps), tuple(f for _, f in ps)))
let_be = st.just(True)
bystanders = st.one_of(
    st.builds(Actor, names, some_models, criteria=st.just(()) | told, bystander=let_be),
    st.builds(Actor, names, criteria=st.just(()) | told, bystander=let_be),
    st.just(Actor("", bystander=True)),
)
tasks = st.builds(
    Task,
    st.lists(stages, min_size=1, max_size=4).map(tuple),
    st.lists(declared, max_size=2).map(tuple),
    st.lists(
        st.builds(
            Invariant,
            st.sampled_from(["never", "always"]),
            conditions,
            st.none() | holds,
            st.lists(references, max_size=2).map(tuple),
        ),
        max_size=2,
    ).map(tuple),
    st.lists(
        st.builds(ZoneDeclaration, names, st.just(()) | corners) | floor_zones, max_size=2
    ).map(tuple),
    st.lists(st.builds(Parameter, names, amounts_said), max_size=2).map(tuple),
    st.lists(st.builds(Include, texts), max_size=1).map(tuple),
    grounds=st.lists(grounds, max_size=1).map(tuple),
    bystanders=st.lists(bystanders, max_size=2).map(tuple),
)
