"""The page about rules says what the code does."""

from __future__ import annotations

import re

import pytest

from tests.paths import ROOT
from visup.rules.formula.units import TICKS, UNITS
from visup.rules.language.parser import parse_rules, shipped_rules
from visup.rules.monitoring.cost import MAX_STATE, MAX_VARIABLES
from visup.rules.monitoring.samples import MIN_SPACING, SAMPLE_HOLD
from visup.rules.predicates.certainty import KEEP_OUT
from visup.rules.predicates.snapshot import SIGMAS
from visup.rules.predicates.vocabulary import IMPLIED_BY, PREDICATES, QUANTITIES
from visup.rules.presence.fragments import FragmentSettings
from visup.rules.presence.settings import PresenceSettings
from visup.rules.reasoners import ReasonerSettings
from visup.rules.relations.kinematics import RelationSettings

PAGE = (ROOT / "docs/rules.md").read_text("utf-8")
BLOCKS = [t for kind, t in re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.S | re.M) if not kind]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in re.findall(r"^\|.*\|$", PAGE, re.M)
]


@pytest.mark.parametrize("block", BLOCKS)
def test_every_example_of_the_page_is_in_the_language(block: str) -> None:
    assert len(parse_rules(block)) >= 2


def test_the_page_lists_every_word_and_quantity_with_its_arguments() -> None:
    told = {n: len(words.split(", ")) if words else 0 for r in ROWS for n, words in _calls(r[0])}
    known = {n: len(w.argument_kinds) for n, w in PREDICATES.items()}
    known |= {n: len(q.argument_kinds) for n, q in QUANTITIES.items()}
    assert told == known


def _calls(cell: str) -> list[tuple[str, str]]:
    """Name and arguments of the calls of which a cell consists, and nothing but commas."""
    call = r"`(\w+)\(([^)]*)\)`"
    return re.findall(call, cell) if re.fullmatch(f"{call}(, {call})*", cell) else []


def test_units_of_quantities_are_those_of_their_dimension() -> None:
    units = {str(unit): dimension for unit, (dimension, _) in UNITS.items()}
    assert KEEP_OUT in PAGE
    rows = {n: r[1].strip("`") for r in ROWS if len(r) == 3 for n, _ in _calls(r[0])}
    assert {name: units[unit] for name, unit in rows.items()} == {
        name: q.dimension for name, q in QUANTITIES.items()
    }


def test_the_page_shows_every_shipped_rule_and_what_expectations_cover() -> None:
    assert {r.name for r in shipped_rules()} == {r.name for r in parse_rules(BLOCKS[0])}
    told = {
        r[0].strip("`"): set(re.findall(r"\w+", r[1])) | {r[0].strip("`")}
        for r in ROWS
        if r[0].strip("`") in IMPLIED_BY and len(r) == 2
    }
    assert told == {name: set(covers) for name, covers in IMPLIED_BY.items()}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("valid until the next sample, but for no more than {:g} s", SAMPLE_HOLD / TICKS),
        ("closer than {:g} ms", 1000 * MIN_SPACING / TICKS),
        ("the limits are {:,} values", MAX_STATE),
        ("and {} objects in one rule", MAX_VARIABLES),
        ("value +- {:g} standard deviation", SIGMAS),
        ("trend above {} D/s", RelationSettings().rate_enter),
        ("below {} D/s or one", RelationSettings().rate_exit),
        ("gap at most {} D", RelationSettings().touch_enter),
        ("gap above {} D", RelationSettings().touch_exit),
        ("slower than {} D/s", RelationSettings().still_speed),
        ("fitted to the last\n  {} s", RelationSettings().window_s),
        ("(by {:g}\n  standard deviations", RelationSettings().change_sigmas),
        ("less than {} D apart", RelationSettings().parting_gap),
        ("by more than {} D/s and 4", 2 * RelationSettings().rate_enter),
        ("for {} s\n(by", FragmentSettings().apart_s),
        ("(by {} D", FragmentSettings().apart),
        ("seen steadily: for {} s", PresenceSettings().entry_s),
        ("out of sight for {:g} s and nothing", PresenceSettings().lost_s),
        ("measured over the last {} s", ReasonerSettings().coupling.window_s),
        ("their logarithms are added up until they reach {:g}", ReasonerSettings().coupling.odds),
        ("came together in the {:g} s before", ReasonerSettings().coupling.approach_s),
        ("apart for {} s", ReasonerSettings().coupling.apart_s),
        ("tau is {:g} s", ReasonerSettings().votes.tau_s),
        ("or {:g} s for an object that is hidden", ReasonerSettings().votes.tau_hidden_s),
        ("fewer than {} votes", ReasonerSettings().votes.known_votes),
        ("Hypotheses less than {} s apart", ReasonerSettings().votes.independent_s),
        ("* {}^k * (s - 0.4)", ReasonerSettings().votes.rank),
        ("similarity {}.", ReasonerSettings().votes.unknown_similarity),
        ("counts as {} more\nsimilar and has", ReasonerSettings().votes.shape.awaited),
        ("and has {} votes from the start", ReasonerSettings().votes.awaited_votes),
        ("their appearance it counts as {} more", ReasonerSettings().votes.found.awaited),
        ("exp({} v)", ReasonerSettings().votes.evidence),
        ("been the most likely for {} s", ReasonerSettings().votes.report_s),
        ("with a probability of {} |", ReasonerSettings().votes.report_likelihood),
        ("within {} of each other", ReasonerSettings().questions.close),
        ("been almost equally likely for {:g} s", ReasonerSettings().questions.patience_s),
    ],
)  # fmt: skip
def test_thresholds_on_the_page_are_the_defaults(text: str, value: float) -> None:
    assert " ".join(text.format(value).split()) in " ".join(PAGE.split())
