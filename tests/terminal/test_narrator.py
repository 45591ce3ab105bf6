from __future__ import annotations

import io
from dataclasses import replace

from rich.console import Console

from visup.agent import Event, Severity, Verdict
from visup.terminal.narrator import Narrator, verdict_line
from visup.wording import worded_once


def event(text: str, severity: Severity = Severity.INFO, kind: str = "entry") -> Event:
    return Event(kind, 12.34, 308, text, severity=severity)


def printed(*events: Event, terminal: bool = True) -> str:
    out = io.StringIO()
    for it in events:
        console = Console(file=out, width=80, force_terminal=terminal, color_system=None)
        Narrator(console).print_event(it)
    return out.getvalue()


def test_in_a_pipe_each_event_is_one_unwrapped_line() -> None:
    words = ("word " * 40).strip()
    assert printed(event(words), event("It is."), terminal=False) == (
        f"  12.3 s   {words}\n  12.3 s   It is.\n"
    )


def test_repeated_sentences_of_a_step_are_merged_with_the_highest_severity() -> None:
    told = worded_once(
        [event("It fails."), event("It rains."), event("It fails.", Severity.WARNING)]
    )
    assert [(e.text, e.severity) for e in told] == [
        ("It fails.", Severity.WARNING),
        ("It rains.", Severity.INFO),
    ]


def test_the_same_sentence_in_another_step_is_printed_again() -> None:
    again = replace(event("It is hidden."), frame_index=400)
    assert len(worded_once([event("It is hidden."), again])) == 2


def test_severe_events_with_the_same_reason_are_merged() -> None:
    told = worded_once(
        [
            event("Stage `a` has failed: it moved.", Severity.WARNING, "stage_failed"),
            event("Task `t` has failed: it moved.", Severity.CRITICAL, "alert"),
            event("Stage `b` is failing: it stood.", Severity.WARNING, "stage_failing"),
            event("Task `u` is complete: it moved."),
        ]
    )
    assert [e.text[:6] for e in told] == ["Task `", "Stage ", "Task `"]
    assert told[0].severity is Severity.CRITICAL


def test_long_sentences_wrap_in_their_column_within_80_columns() -> None:
    lines = printed(event("word " * 40)).splitlines()
    assert len(lines) > 2
    assert all(len(line.rstrip()) <= 80 for line in lines)
    assert lines[0].startswith("  12.3 s   word")
    assert lines[1].startswith(" " * 11 + "word")


def test_text_that_looks_like_markup_is_printed_unchanged() -> None:
    assert "[bold]x[/bold] [nonsense]" in printed(event("[bold]x[/bold] [nonsense]"))


def test_every_verdict_has_a_text() -> None:
    words = {verdict_line(v) for v in (*Verdict, None)}
    assert len(words) == len(Verdict) + 1
