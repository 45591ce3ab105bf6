"""Looking for conditions: what is found is what an agent would have said, and nothing is left out."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from multiprocessing.reduction import ForkingPickler
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.archive.recordings import meeting, record
from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from visup.agent import Truth
from visup.agent.model.errors import ErrorGroup, RuleError, SettingsError, SourceError, TaskError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.archive.adding import add_run
from visup.archive.finding.beliefs import read_minds
from visup.archive.finding.clips import cut_hits, spans
from visup.archive.finding.pattern import desugared, read_pattern
from visup.archive.finding.pattern_evaluator import Hit, PatternEvaluator
from visup.archive.finding.search import (
    ConditionSearch,
    RulesSearch,
    find,
    read_search,
)
from visup.archive.lake import BELIEFS, Lake
from visup.archive.parallel import each_run
from visup.archive.querying.database import LakeDatabase, QueryError, open_database
from visup.evaluation.archive.conditions import random_conditions
from visup.percepts.video.open import open_source
from visup.rules.language.parser import load_rules
from visup.rules.safety.queries import verdicts
from visup.runs.replay import changed_settings, replay
from visup.runs.settings import WatchSettings

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """Runs in which the arm comes near, touches, or never does; one without an arm."""
    place = tmp_path_factory.mktemp("find")
    made = Lake.create(place / "lake")
    for number, (count, shift) in enumerate([(45, 0.0), (45, 45.0), (25, -90.0), (14, 0.0)]):
        record(place / f"run-{number}", meeting(count, 20, shift), DOCK)
        add_run(made, place / f"run-{number}")
    return made


@pytest.fixture(scope="module")
def database(lake: Lake) -> Iterator[LakeDatabase]:
    with open_database(lake) as found:
        yield found


CONDITIONS = random_conditions(24, 23)


def test_what_is_found_is_what_the_agent_says(
    lake: Lake, database: LakeDatabase, tmp_path: Path
) -> None:
    rules = tmp_path / "all.rules"
    rules.write_text(
        "\n".join(f'rule f{n}(a, b): info when {text} say "."' for n, text in enumerate(CONDITIONS))
    )
    compared, pruned, quick = 0, 0, 0
    searches = [ConditionSearch(read_pattern(text)) for text in CONDITIONS]
    possible = [set(search.possible_runs(database)) for search in searches]
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        judges = [PatternEvaluator(s.pattern) for s in searches]

        def look(step: Step, judges: list[PatternEvaluator] = judges) -> None:
            nonlocal compared
            for n, judge in enumerate(judges):
                judge(step)
                order = judge.pattern.rule.variables
                said = verdicts(step.mind, f"f{n}")
                assert judge.before is not None
                for reading in judge.before.readings:
                    meant = dict(zip(order, reading.objects, strict=True))
                    assert reading.truth == said[meant["a"], meant["b"]], CONDITIONS[n]
                    compared += 1

        replay(recording, replace(settings, rules=(rules,)), on_step=look)
        for n, judge in enumerate(judges):
            hits = tuple(h for h in judge.hits() if h.truth == Truth.TRUE)
            assert not hits or run in possible[n], CONDITIONS[n]
            if searches[n].quick:
                assert searches[n].hits(recording, settings) == hits, CONDITIONS[n]
                quick += bool(hits)
            pruned += run not in possible[n]
    assert compared > 5_000
    assert quick > 10
    assert pruned > 0.1 * len(CONDITIONS) * len(lake.runs())


@pytest.mark.parametrize("rule", ["near", "meets", "none_such"])
def test_rules_are_found_where_a_replay_raises_them(
    lake: Lake, database: LakeDatabase, tmp_path: Path, rule: str
) -> None:
    when = {
        "near": "converging(a, b) for 0.3 s",
        "meets": "touching(a, b) and converging(a, b) within 1 s",
        "none_such": "coupled(a, b) and south_of(a, b)",
    }[rule]
    file = tmp_path / "mine.rules"
    file.write_text(
        f'rule {rule}(a, b): warning when {when} hold 0.5 s say "{{a}} {{is}} near {{b}}."'
    )
    search = RulesSearch(file, load_rules(file))
    found = {f.run: f.hits for f in find(lake, search, search.possible_runs(database))}
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        told = replay(recording, replace(settings, rules=(file,))).events
        opened = [
            (e["time"], tuple(e["objects"]))
            for e in told
            if e["data"].get("alert_kind") == rule and e["kind"] == "alert"
        ]
        assert [(round(h.begin, 6), h.objects) for h in found.get(run, ())] == opened


def test_names_are_those_whom_the_agent_meant(lake: Lake, database: LakeDatabase) -> None:
    by_actor = ConditionSearch(read_pattern("converging(arm, satellite) for 0.3 s"))
    by_model = ConditionSearch(read_pattern("converging(arm, spartan) for 0.3 s"))
    runs = by_actor.possible_runs(database)
    assert runs == by_model.possible_runs(database)
    found = [f.hits for f in find(lake, by_actor, runs)]
    assert [h.names for hits in found for h in hits]
    assert {h.names for hits in found for h in hits} == {("arm", "spartan")}
    assert all(0 < (h.confidence or 0) <= 1 for hits in found for h in hits)
    with pytest.raises(QueryError, match="nobody in this lake was ever taken for 'satelite'"):
        ConditionSearch(read_pattern("touching(arm, satelite)")).possible_runs(database)


@pytest.mark.parametrize("change", ["gone", "cut", "other"])
def test_a_run_without_notes_is_reasoned_about_again(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    search = read_search("converging(arm, satellite) and then diverging(arm, b) within 1 s")
    run = lake.runs()[0]
    copy = Path(shutil.copytree(lake.folder_of(run), tmp_path / run))
    notes, settings = copy / BELIEFS, lake.recorded(run)[1]
    assert read_minds(copy) is not None
    hits = search.hits(Recording.open(copy), settings)
    if change == "gone":
        notes.unlink()
    if change == "cut":
        notes.write_bytes(notes.read_bytes()[:-200])
    if change == "other":
        monkeypatch.setattr("visup.archive.finding.beliefs.__version__", "0.0")
    assert read_minds(copy) is None
    assert search.hits(Recording.open(copy), settings) == hits


@pytest.mark.parametrize(
    ("text", "quick"),
    [
        ("touching(a, b) and not (exists c: (converging(a, c) and diverging(b, c)))", True),
        ("touching(arm, 2) since[1 s] north_of(arm, 2)", True),
        ("coupled(a, b)", False),  # judged of what is hidden, too
        ("gap(a, b) < 60 px", False),
        ("touching(a, b) and moving(a)", False),
        ("stale(region)", False),
    ],
)
def test_conditions_about_relations_alone_need_no_reasoning(text: str, quick: bool) -> None:
    assert read_search(text).quick is quick


def test_unknown_is_kept_apart_and_looked_for_everywhere(
    lake: Lake, database: LakeDatabase
) -> None:
    pattern = read_pattern("touching(a, b)")
    sure, all_of_it = ConditionSearch(pattern), ConditionSearch(pattern, unknown=True)
    assert all_of_it.possible_runs(database) == lake.runs()
    told = {f.run: f.hits for f in find(lake, all_of_it, lake.runs())}
    assert {h.truth for hits in told.values() for h in hits} == {"true", "unknown"}
    for found in find(lake, sure, sure.possible_runs(database)):
        assert found.hits == tuple(h for h in told[found.run] if h.truth == "true")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("f(a)", "f(a)"),
        ("f(a) and g(a)", "f(a) and g(a)"),
        ("(f(a) and then_(a))", "(f(a) and then_(a))"),
        ("f(a) and then g(a)", "(g(a)) and (previous once (f(a)))"),
        ("f(a) and  then g(a) within 2 s", "(g(a)) and ((f(a)) within 1 ms to 2 s ago)"),
        (
            "f(a) and then g(a) within 2 s and then h(a)",
            "(h(a)) and (previous once ((g(a)) and ((f(a)) within 1 ms to 2 s ago)))",
        ),
    ],
)
def test_and_then_is_written_in_the_rule_language(text: str, meant: str) -> None:
    assert desugared(text) == meant


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("and then touching(a, b)", "something is missing beside `and then`"),
        ("touching(a, b) and then", "something is missing beside `and then`"),
        ("gap(a, b)", "neither true nor false"),
        ("toching(a, b)", "touching"),
        ("touching(a, b", "condition:1:14: ')' is missing\n    touching(a, b\n"),
        (
            "touching(arm satellite)",
            "condition:1:13: ',' is missing\n    touching(arm satellite)\n",
        ),
        (
            "touching(a, b) and then diverges(a, b) within 5 s",
            "condition:1:1: there is no relation",
        ),
        ("touching(a, b) fro 2 s", "condition:1:16: 'fro' does not belong here"),
        ("touching(a, b) and", "'touching(a, b) and' ends too early"),
        ("", "there is no condition"),
    ],
)
def test_what_is_no_condition_is_refused(text: str, said: str) -> None:
    with pytest.raises((RuleError, ErrorGroup)) as told:
        read_search(text)
    assert said in str(told.value)
    assert "watched" not in str(told.value)  # the rule that is made of it


def test_a_sequence_is_true_once_it_is_complete(tmp_path: Path) -> None:
    """Of the truths of each step it follows when a sequence is true."""
    record(tmp_path, meeting(45, 20), DOCK)
    lake = Lake.create(tmp_path / "lake")
    key, _ = add_run(lake, tmp_path)
    first, then = "converging(arm, spartan)", "diverging(arm, spartan)"
    truths: list[tuple[float, bool, bool, bool]] = []
    judges = [
        PatternEvaluator(read_pattern(t))
        for t in (first, then, f"{first} and then {then} within 1 s")
    ]

    def look(step: Step) -> None:
        for judge in judges:
            judge(step)
        held = [any(r.truth == "true" for r in j.before.readings) for j in judges if j.before]
        truths.append((step.time, held[0], held[1], held[2]))

    recording, settings = lake.recorded(key)
    replay(recording, settings, on_step=look)
    assert any(t[3] for t in truths)
    for n, (time, _, second, both) in enumerate(truths):
        # A sample speaks until the next one.
        ends = [t for t, *_ in truths[1 : n + 1]]
        spoke = any(t[1] and end > time - 1.0 for t, end in zip(truths, ends, strict=False))
        assert both == (second and spoke), time


def test_a_task_is_found_where_a_replay_carries_it_out(
    lake: Lake, database: LakeDatabase, tmp_path: Path
) -> None:
    file = tmp_path / "near.task"
    file.write_text("<near> ::= converging(arm, satellite)\n")
    search = read_search(str(file))
    found = {f.run: f.hits for f in find(lake, search, search.possible_runs(database))}
    ends = []
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        told = replay(recording, changed_settings(settings, tasks=(str(file),)))
        ends.append(told.verdict)
        assert bool(found[run]) == (told.verdict == "succeeded")
        for hit in found[run]:
            assert (hit.rule, hit.names) == ("near", ("arm", "spartan"))
            assert 0 <= hit.begin <= hit.end
    assert "succeeded" in ends
    assert set(ends) != {"succeeded"}
    with pytest.raises((RuleError, ErrorGroup, SettingsError, TaskError)):
        read_search(str(tmp_path / "none.task"))


def test_what_is_looked_for_can_be_sent_to_other_processes() -> None:
    search = read_search("converging(arm, satellite) and then touching(arm, 2) within 1 s")
    assert ForkingPickler.loads(ForkingPickler.dumps(search)) == search
    assert list(each_run(abs, [-3, 1, -2], workers=2)) == [3, 1, 2]


times = st.floats(0, 60, allow_nan=False)


@given(st.lists(st.tuples(times, times), max_size=8))
def test_what_is_cut_out_covers_all_hits_once(of: list[tuple[float, float]]) -> None:
    hits = tuple(Hit((), (), "true", min(p), max(p), False) for p in of)
    found = spans(hits)
    assert all(any(b <= h.begin and h.end <= e for b, e in found) for h in hits)
    assert all(one[1] < other[0] for one, other in pairwise(found))


def test_hits_are_cut_out_of_the_footage(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(50), fps=5.0)
    hits = (Hit((), (), "true", 3.0, 3.5, False), Hit((), (), "true", 8.0, 8.2, False))
    videos = cut_hits(str(clip), "ab" * 16, hits, tmp_path / "cut")
    with open_source(str(videos[0])) as source:
        assert 12 <= sum(1 for _ in source) <= 14
    assert [v.name for v in videos] == ["disc-abababab-2.0s.webm", "disc-abababab-7.0s.webm"]
    with pytest.raises(SourceError, match="not there any more"):
        cut_hits(str(tmp_path / "gone.mp4"), "ab" * 16, hits, tmp_path / "cut")


def test_the_command(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    told = visup("find", lake.path, "converging(arm, satellite) for 0.3 s")
    assert told.code == 0, told.err
    assert "arm (1), spartan (2), confidence" in told.out
    assert "inspect it: visup step " in told.out
    lines = visup(
        "find", lake.path, "converging(arm, satellite) for 0.3 s", "--json"
    ).out.splitlines()
    hits = [json.loads(line) for line in lines]
    assert f"Hits: {len(hits)}, in " in told.out
    assert {tuple(h["names"]) for h in hits} == {("arm", "spartan")}
    assert all(Path(h["folder"], "journal.sqlite").is_file() for h in hits)
    first = visup("find", lake.path, "converging(a, b)", "--first", 1, "--clips", lake.path / "cut")
    assert "Hits: " in first.out
    assert "; searched: 1 (25 %); not searched: 3." in first.out
    assert "the footage is not there any more" in first.err
    none = visup("find", lake.path, "coupled(arm, spartan) and south_of(arm, spartan)")
    assert (none.code, none.out.splitlines()[-1]) == (
        1,
        "Hits: 0, in 0 of 4 runs; searched: 0 (0 %).",
    )
    assert visup("find", lake.path, "gap(a, b)").code == 2
    with pytest.raises(SettingsError, match="alerts are raised or not"):
        read_search("mine.rules", unknown=True)
