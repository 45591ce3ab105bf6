"""Searching for conditions: hits agree with what an agent reports in a replay, and none is missing."""

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
    folder = tmp_path_factory.mktemp("find")
    lake = Lake.create(folder / "lake")
    for number, (count, shift) in enumerate([(45, 0.0), (45, 45.0), (25, -90.0), (14, 0.0)]):
        record(folder / f"run-{number}", meeting(count, 20, shift), DOCK)
        add_run(lake, folder / f"run-{number}")
    return lake


@pytest.fixture(scope="module")
def database(lake: Lake) -> Iterator[LakeDatabase]:
    with open_database(lake) as opened:
        yield opened


CONDITIONS = random_conditions(24, 23)


def test_hits_agree_with_the_verdicts_of_the_agent(
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
        evaluators = [PatternEvaluator(s.pattern) for s in searches]

        def compare(step: Step, evaluators: list[PatternEvaluator] = evaluators) -> None:
            nonlocal compared
            for n, evaluator in enumerate(evaluators):
                evaluator(step)
                order = evaluator.pattern.rule.variables
                expected = verdicts(step.mind, f"f{n}")
                assert evaluator.before is not None
                for reading in evaluator.before.readings:
                    binding = dict(zip(order, reading.objects, strict=True))
                    assert reading.truth == expected[binding["a"], binding["b"]], CONDITIONS[n]
                    compared += 1

        replay(recording, replace(settings, rules=(rules,)), on_step=compare)
        for n, evaluator in enumerate(evaluators):
            hits = tuple(h for h in evaluator.hits() if h.truth == Truth.TRUE)
            assert not hits or run in possible[n], CONDITIONS[n]
            if searches[n].quick:
                assert searches[n].hits(recording, settings) == hits, CONDITIONS[n]
                quick += bool(hits)
            pruned += run not in possible[n]
    assert compared > 5_000
    assert quick > 10
    assert pruned > 0.1 * len(CONDITIONS) * len(lake.runs())


@pytest.mark.parametrize("rule", ["near", "meets", "none_such"])
def test_rules_are_found_where_a_replay_raises_alerts(
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
    hits_by_run = {f.run: f.hits for f in find(lake, search, search.possible_runs(database))}
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        events = replay(recording, replace(settings, rules=(file,))).events
        opened = [
            (e["time"], tuple(e["objects"]))
            for e in events
            if e["data"].get("alert_kind") == rule and e["kind"] == "alert"
        ]
        assert [(round(h.begin, 6), h.objects) for h in hits_by_run.get(run, ())] == opened


def test_names_in_conditions_are_actors_or_models(lake: Lake, database: LakeDatabase) -> None:
    by_actor = ConditionSearch(read_pattern("converging(arm, satellite) for 0.3 s"))
    by_model = ConditionSearch(read_pattern("converging(arm, spartan) for 0.3 s"))
    runs = by_actor.possible_runs(database)
    assert runs == by_model.possible_runs(database)
    hits_by_run = [f.hits for f in find(lake, by_actor, runs)]
    assert [h.names for hits in hits_by_run for h in hits]
    assert {h.names for hits in hits_by_run for h in hits} == {("arm", "spartan")}
    assert all(0 < (h.confidence or 0) <= 1 for hits in hits_by_run for h in hits)
    with pytest.raises(QueryError, match="nobody in this lake was ever taken for 'satelite'"):
        ConditionSearch(read_pattern("touching(arm, satelite)")).possible_runs(database)


@pytest.mark.parametrize("change", ["gone", "cut", "other"])
def test_a_run_without_stored_beliefs_is_replayed(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    search = read_search("converging(arm, satellite) and then diverging(arm, b) within 1 s")
    run = lake.runs()[0]
    copy = Path(shutil.copytree(lake.folder_of(run), tmp_path / run))
    beliefs, settings = copy / BELIEFS, lake.recorded(run)[1]
    assert read_minds(copy) is not None
    hits = search.hits(Recording.open(copy), settings)
    if change == "gone":
        beliefs.unlink()
    if change == "cut":
        beliefs.write_bytes(beliefs.read_bytes()[:-200])
    if change == "other":
        monkeypatch.setattr("visup.archive.finding.beliefs.__version__", "0.0")
    assert read_minds(copy) is None
    assert search.hits(Recording.open(copy), settings) == hits


@pytest.mark.parametrize(
    ("text", "quick"),
    [
        ("touching(a, b) and not (exists c: (converging(a, c) and diverging(b, c)))", True),
        ("touching(arm, 2) since[1 s] north_of(arm, 2)", True),
        ("coupled(a, b)", False),  # also evaluated for hidden objects
        ("gap(a, b) < 60 px", False),
        ("touching(a, b) and moving(a)", False),
        ("stale(region)", False),
    ],
)
def test_conditions_on_relations_alone_need_no_replay(text: str, quick: bool) -> None:
    assert read_search(text).quick is quick


def test_unknown_hits_are_separate_and_searched_in_every_run(
    lake: Lake, database: LakeDatabase
) -> None:
    pattern = read_pattern("touching(a, b)")
    certain, with_unknown = ConditionSearch(pattern), ConditionSearch(pattern, unknown=True)
    assert with_unknown.possible_runs(database) == lake.runs()
    hits_by_run = {f.run: f.hits for f in find(lake, with_unknown, lake.runs())}
    assert {h.truth for hits in hits_by_run.values() for h in hits} == {"true", "unknown"}
    for found in find(lake, certain, certain.possible_runs(database)):
        assert found.hits == tuple(h for h in hits_by_run[found.run] if h.truth == "true")


@pytest.mark.parametrize(
    ("text", "translated"),
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
def test_and_then_is_translated_to_the_rule_language(text: str, translated: str) -> None:
    assert desugared(text) == translated


@pytest.mark.parametrize(
    ("text", "message"),
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
def test_invalid_conditions_are_refused(text: str, message: str) -> None:
    with pytest.raises((RuleError, ErrorGroup)) as caught:
        read_search(text)
    assert message in str(caught.value)
    assert "watched" not in str(caught.value)  # the name of the rule made from it


def test_a_sequence_is_true_when_it_is_complete(tmp_path: Path) -> None:
    """The truths of both parts at each step determine when a sequence is true."""
    record(tmp_path, meeting(45, 20), DOCK)
    lake = Lake.create(tmp_path / "lake")
    key, _ = add_run(lake, tmp_path)
    first, then = "converging(arm, spartan)", "diverging(arm, spartan)"
    truths: list[tuple[float, bool, bool, bool]] = []
    evaluators = [
        PatternEvaluator(read_pattern(t))
        for t in (first, then, f"{first} and then {then} within 1 s")
    ]

    def record_truths(step: Step) -> None:
        for evaluator in evaluators:
            evaluator(step)
        truth = [any(r.truth == "true" for r in j.before.readings) for j in evaluators if j.before]
        truths.append((step.time, truth[0], truth[1], truth[2]))

    recording, settings = lake.recorded(key)
    replay(recording, settings, on_step=record_truths)
    assert any(t[3] for t in truths)
    for n, (time, _, second, both) in enumerate(truths):
        # A sample speaks until the next one.
        ends = [t for t, *_ in truths[1 : n + 1]]
        preceded = any(t[1] and end > time - 1.0 for t, end in zip(truths, ends, strict=False))
        assert both == (second and preceded), time


def test_a_task_is_found_where_a_replay_succeeds(
    lake: Lake, database: LakeDatabase, tmp_path: Path
) -> None:
    file = tmp_path / "near.task"
    file.write_text("<near> ::= converging(arm, satellite)\n")
    search = read_search(str(file))
    hits_by_run = {f.run: f.hits for f in find(lake, search, search.possible_runs(database))}
    ends = []
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        transcript = replay(recording, changed_settings(settings, tasks=(str(file),)))
        ends.append(transcript.verdict)
        assert bool(hits_by_run[run]) == (transcript.verdict == "succeeded")
        for hit in hits_by_run[run]:
            assert (hit.rule, hit.names) == ("near", ("arm", "spartan"))
            assert 0 <= hit.begin <= hit.end
    assert "succeeded" in ends
    assert set(ends) != {"succeeded"}
    with pytest.raises((RuleError, ErrorGroup, SettingsError, TaskError)):
        read_search(str(tmp_path / "none.task"))


def test_a_search_can_be_sent_to_other_processes() -> None:
    search = read_search("converging(arm, satellite) and then touching(arm, 2) within 1 s")
    assert ForkingPickler.loads(ForkingPickler.dumps(search)) == search
    assert list(each_run(abs, [-3, 1, -2], workers=2)) == [3, 1, 2]


times = st.floats(0, 60, allow_nan=False)


@given(st.lists(st.tuples(times, times), max_size=8))
def test_clip_spans_cover_each_hit_once(intervals: list[tuple[float, float]]) -> None:
    hits = tuple(Hit((), (), "true", min(p), max(p), False) for p in intervals)
    clip_spans = spans(hits)
    assert all(any(b <= h.begin and h.end <= e for b, e in clip_spans) for h in hits)
    assert all(span[1] < next_span[0] for span, next_span in pairwise(clip_spans))


def test_hits_are_cut_out_of_the_video(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(50), fps=5.0)
    hits = (Hit((), (), "true", 3.0, 3.5, False), Hit((), (), "true", 8.0, 8.2, False))
    videos = cut_hits(str(clip), "ab" * 16, hits, tmp_path / "cut")
    with open_source(str(videos[0])) as source:
        assert 12 <= sum(1 for _ in source) <= 14
    assert [v.name for v in videos] == ["disc-abababab-2.0s.webm", "disc-abababab-7.0s.webm"]
    with pytest.raises(SourceError, match="not there any more"):
        cut_hits(str(tmp_path / "gone.mp4"), "ab" * 16, hits, tmp_path / "cut")


def test_the_command_prints_hits_and_counts(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    result = visup("find", lake.path, "converging(arm, satellite) for 0.3 s")
    assert result.code == 0, result.err
    assert "arm (1), spartan (2), confidence" in result.out
    assert "inspect it: visup step " in result.out
    lines = visup(
        "find", lake.path, "converging(arm, satellite) for 0.3 s", "--json"
    ).out.splitlines()
    hits = [json.loads(line) for line in lines]
    assert f"Hits: {len(hits)}, in " in result.out
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
