"""The page: whole, escaped, self-contained."""

from __future__ import annotations

import builtins
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.report.scene import TOLD, run
from visup.agent import Event, Severity, Verdict
from visup.agent.model.errors import ExtraMissingError, OutputError
from visup.report.collector import Collector
from visup.report.page.distance_figures import distance_figures, fitted_lines
from visup.report.page.figures import vote_figures
from visup.report.page.html import report_page, write_report
from visup.report.page.sections import flat, narrative, nearest
from visup.report.page.shell import embedded, plotly_source
from visup.report.page.summary import summary
from visup.report.records import RunData, StateSpan

EVIL = "<script>alert('x')</script> & \"quotes\""
INSIDE = (
    "data:image/jpeg;base64,",
    "data:text/csv;base64,",
    "data:application/vnd.apache.parquet;",
)
VOID = frozenset({"meta", "img", "br", "link", "input", "hr"})
OPTIONAL_END = frozenset({"th", "td", "tr", "thead", "tbody", "li", "p", "dt", "dd"})


class Page(HTMLParser):
    """What a browser would find in the page."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.scripts: list[str] = []
        self.open: list[str] = []
        self.faults: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open[-1] != tag and self.open[-1] in OPTIONAL_END:
            self.open.pop()
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"unexpected </{tag}>")

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)
        elif not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join("".join(self.words).split())

    def values(self, *names: str) -> list[str]:
        return [v for _, a in self.tags for k, v in a.items() if k in names and v is not None]


@cache
def data(task: str = "dock") -> RunData:
    collector = Collector()
    for step, frame in run((160, 120), task):
        collector.add(step, frame)
    facts = {"source": "clips/capture.mp4", "settings": {"tasks": ["dock.task"], "every": 1}}
    return collector.finish(
        Verdict.FAILED, facts, problem="The file is cut off.", notes=["25 fps."]
    )


@cache
def page(task: str = "dock") -> Page:
    return Page(report_page(data(task)))


def test_the_page_is_well_formed() -> None:
    assert page().faults == []
    assert [t for t in page().open if t not in OPTIONAL_END] == []
    ids = page().values("id")
    assert len(ids) == len(set(ids))


def test_every_part_of_the_run_is_on_the_page() -> None:
    text = page().text
    told = [sentence for events in TOLD.values() for _, _, sentence, _ in events]
    alert = data().alerts[0]
    wanted = [
        *told,
        alert.cause,
        *alert.evidence,
        "Failed",
        "The file is cut off.",
        "25 fps.",
        "clips/capture.mp4",
        "dock.task",
        "Object 1, spartan",
        "approach",
        "captured",
        "motion",
    ]
    assert [w for w in wanted if w not in text] == []
    assert [s for s in summary(data()).split(". ") if s not in text] == []


def test_every_link_leads_somewhere() -> None:
    ids = set(page().values("id"))
    links = [a["href"] for t, a in page().tags if t == "a" and "download" not in a]
    assert len(links) > 10
    assert all(link and link.startswith("#") and link[1:] in ids for link in links)


def test_the_annotated_videos_beside_the_page_are_linked() -> None:
    names = ("annotated.webm", "annotated-2.webm")
    linked = Page(report_page(replace(data(), videos=names)))
    links = [a["href"] for t, a in linked.tags if t == "a" and str(a["href"]).endswith(".webm")]
    assert links == list(names)
    assert "Annotated video, part 2" in " ".join(linked.words)


def test_names_in_prose_are_quoted() -> None:
    told = Event("stage_done", 1.0, 1, "Stage `captured` is complete.")
    words = " ".join(Page(report_page(replace(data(), events=(told,)))).words)
    assert "Stage 'captured' is complete." in words
    assert "`" not in words


def test_the_page_loads_nothing_from_the_network() -> None:
    for value in page().values("src", "href", "action", "data", "poster", "srcset"):
        assert value.startswith((*INSIDE, "#"))
    assert not [t for t, _ in page().tags if t in ("link", "iframe", "object", "embed", "base")]
    policies = [a["content"] for _, a in page().tags if a.get("http-equiv")]
    assert policies[0] is not None
    assert policies[0].startswith("default-src 'none'")
    assert "http" not in policies[0]


def test_all_pictures_are_described() -> None:
    pictures = [a for t, a in page().tags if t == "img"]
    assert len(pictures) >= len(data().key_frames)
    assert all(a.get("alt") for a in pictures)
    plots = [a for _, a in page().tags if a.get("class") == "plot-area"]
    assert all(a.get("aria-label") for a in plots)


def test_figures_in_the_page_are_those_that_its_script_draws() -> None:
    drawn = json.loads(page().scripts[0])
    places = [a["id"] for _, a in page().tags if a.get("class") == "plot-area"]
    assert [f["id"] for f in drawn] == places
    identity = {f"{series}-{n}" for series in ("likelihoods", "votes") for n in (1, 2)}
    assert {"stages", "presence", "distance-1-2", *identity} == set(places)
    assert "Plotly" in page().scripts[1]


def test_text_of_users_cannot_run_as_script() -> None:
    evil = data(EVIL)
    evil = replace(
        evil,
        source=EVIL,
        problem=EVIL,
        notes=(EVIL,),
        facts={EVIL: {EVIL: [EVIL]}},
        events=tuple(replace(e, text=EVIL) for e in evil.events),
        objects=tuple(replace(s, name=EVIL) for s in evil.objects),
        alerts=tuple(replace(a, cause=EVIL, kind=EVIL, evidence=(EVIL,)) for a in evil.alerts),
        key_frames=tuple(
            replace(
                k,
                captions=(EVIL,),
                closeups=tuple(
                    replace(
                        look,
                        believed=EVIL,
                        matches=tuple(replace(m, name=EVIL) for m in look.matches),
                    )
                    for look in k.closeups
                ),
            )
            for k in evil.key_frames
        ),
        behaviour_costs=tuple(replace(e, behaviour=EVIL) for e in evil.behaviour_costs),
    )
    attacked = Page(report_page(evil))
    assert attacked.faults == []
    assert len(attacked.scripts) == len(page().scripts)
    assert not any("alert('x')" in s and i != 0 for i, s in enumerate(attacked.scripts))
    assert "<" not in attacked.scripts[0]
    assert attacked.text.count(" ".join(EVIL.split())) > 15
    handlers = {k for _, a in attacked.tags for k in a if k.startswith("on")}
    assert handlers == set()


@given(text=st.text(max_size=40))
@settings(max_examples=60, deadline=None)
def test_every_sentence_is_on_the_page_unchanged(text: str) -> None:
    event = Event("entry", 1.0, 0, text, severity=Severity.WARNING)
    shown = Page(narrative(RunData("x", events=(event,))))
    clean = text.replace("\0", "�").replace("\r\n", "\n").replace("\r", "\n")
    assert " ".join(clean.split()) in shown.text or "\0" in text or "\r" in text
    assert {t for t, _ in shown.tags} == {"ol", "li", "div", "time", "span"}


def test_the_same_run_gives_the_same_page() -> None:
    assert report_page(data()) == report_page(data())


def test_an_empty_run_has_a_page_too() -> None:
    text = report_page(Collector().finish())
    shown = Page(text)
    assert shown.faults == []
    assert "visup saw no frame" in shown.text
    assert len(text) < 100_000


def test_a_run_without_objects_or_task_has_a_page_too() -> None:
    collector = Collector()
    for step, frame in run((64, 48)):
        mind = replace(step.mind, objects={}, tasks=(), alerts=(), relations=())
        collector.add(replace(step, mind=mind, events=(), alerts=()), frame)
    shown = Page(report_page(collector.finish()))
    assert shown.faults == []
    assert "without a task" in shown.text
    assert "It followed no object." in shown.text


def test_the_report_is_written_atomically_and_is_small(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text("an older report")
    write_report(data(), path)
    assert path.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert path.stat().st_size < 8_000_000
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_an_unwritable_path_is_reported(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        write_report(RunData("x"), tmp_path / "missing" / "report.html")


def test_without_plotly_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> Any:
        if name.startswith("plotly"):
            raise ImportError(name)
        return real(name, globals, locals, fromlist or (), level)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ExtraMissingError, match="'report'"):
        plotly_source()


def test_json_in_the_page_never_ends_its_script() -> None:
    figure = replace(vote_figures(data())[0], title="x", layout={"t": "</script><!--"})
    text = embedded([figure])
    assert "<" not in text
    assert json.loads(text)[0]["layout"]["t"] == "</script><!--"


@given(
    slope=st.floats(-20, 50),
    start=st.floats(300, 600),
    count=st.integers(3, 60),
    noise=st.floats(0, 3),
)
@settings(max_examples=60, deadline=None)
def test_fitted_lines_find_the_speed(slope: float, start: float, count: int, noise: float) -> None:
    times = np.arange(count) / 5.0
    gaps = start + slope * times + noise * np.random.default_rng(count).standard_normal(count)
    span = StateSpan(("relation", "1", "2"), "converging", 0.0, float(times[-1]))
    (line,) = fitted_lines(times.tolist(), gaps.tolist(), [span])
    spread = np.sqrt(((times - times.mean()) ** 2).sum())
    assert abs(line.slope - slope) <= 6 * noise / spread + 1e-6
    assert line.end - line.start == pytest.approx(line.slope * (times[-1] - times[0]), abs=1e-6)


def test_samples_with_contact_do_not_affect_fitted_lines() -> None:
    times = [float(t) for t in range(20)]
    gaps = [max(0.0, 50.0 - 10.0 * t) for t in times]
    span = StateSpan(("relation", "1", "2"), "converging", 0.0, 19.0)
    (line,) = fitted_lines(times, gaps, [span])
    assert line.slope == pytest.approx(-10.0)
    assert line.times == (0.0, 4.0)
    assert fitted_lines(times, [0.0] * 20, [span]) == ()


def test_missing_votes_are_unknown() -> None:
    samples = [
        replace(s, votes={1: {"a": 1.0}} if i % 2 else {1: {"b": 1.0}})
        for i, s in enumerate(data().samples)
    ]
    figure = vote_figures(replace(data(), samples=tuple(samples)))[0]
    assert {y for t in figure.traces for y in t["y"]} == {None, 1.0}


def test_spans_with_too_few_points_have_no_line() -> None:
    span = StateSpan(("relation", "1", "2"), "diverging", 1.0, 1.3)
    assert fitted_lines([0.0, 1.0, 1.2, 2.0], [1.0, 2.0, 3.0, 4.0], [span]) == ()


def test_the_distance_figure_describes_both_trends() -> None:
    (figure,) = distance_figures(data())
    assert "converging from 0.0 to 6.2 s at -" in figure.caption
    assert "diverging from 6.2 to 12.0 s at +" in figure.caption
    names = [t["name"] for t in figure.traces]
    assert names == ["distance", "converging", "diverging"]
    hidden = [y for x, y in zip(*(figure.traces[0][k] for k in "xy"), strict=True) if 3.1 < x < 3.5]
    assert hidden == [None, None]


def test_events_lead_to_the_nearest_key_frame() -> None:
    keys = data().key_frames
    event = Event("entry", 5.9, 29, "x")
    assert nearest(keys, event) == next(k for k in keys if k.frame_index == 30)
    assert nearest((), event) is None


def test_a_coupling_is_a_band_without_a_line() -> None:
    coupled = StateSpan(("relation", "1", "2"), "coupled", 8.0, 9.5)
    (figure,) = distance_figures(replace(data(), spans=(*data().spans, coupled)))
    bands = [s for s in figure.layout["shapes"] if s["type"] == "rect"]
    assert [(b["x0"], b["x1"]) for b in bands] == [(8.0, 9.5)]
    assert "coupled from 8.0 to 9.5 s" in figure.caption
    assert len(figure.traces) == len(distance_figures(data())[0].traces)


def test_facts_are_flattened_in_order() -> None:
    facts = {"a_b": 1.0, "c": {"d": [1, 2], "e": {}, "f": None}, "g": True}
    assert flat(facts) == [("a b", "1"), ("c, d", "1, 2"), ("g", "True")]


@pytest.mark.parametrize("videos", [(), ("annotated.webm",)])
def test_only_a_page_with_a_video_may_load_one(videos: tuple[str, ...]) -> None:
    page = report_page(replace(data(), videos=videos, source="<video src=x>"))
    policy = page.partition("Content-Security-Policy")[2].partition(">")[0]
    assert ("media-src" in policy) == bool(videos)
