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


def test_a_pipe_is_given_one_line_for_each_event_neither_wrapped_nor_padded() -> None:
    words = ("word " * 40).strip()
    assert printed(event(words), event("It is."), terminal=False) == (
        f"  12.3 s   {words}\n  12.3 s   It is.\n"
    )


def test_what_is_said_twice_in_a_step_is_told_once_and_gravely() -> None:
    told = worded_once(
        [event("It fails."), event("It rains."), event("It fails.", Severity.WARNING)]
    )
    assert [(e.text, e.severity) for e in told] == [
        ("It fails.", Severity.WARNING),
        ("It rains.", Severity.INFO),
    ]


def test_the_same_words_in_another_step_are_told_again() -> None:
    again = replace(event("It is hidden."), frame_index=400)
    assert len(worded_once([event("It is hidden."), again])) == 2


def test_grave_events_of_one_reason_are_told_by_the_gravest() -> None:
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


def test_long_sentences_go_on_below_themselves_within_80_columns() -> None:
    lines = printed(event("word " * 40)).splitlines()
    assert len(lines) > 2
    assert all(len(line.rstrip()) <= 80 for line in lines)
    assert lines[0].startswith("  12.3 s   word")
    assert lines[1].startswith(" " * 11 + "word")


def test_words_that_look_like_markup_are_printed_as_they_are() -> None:
    assert "[bold]x[/bold] [nonsense]" in printed(event("[bold]x[/bold] [nonsense]"))


def test_every_verdict_has_words() -> None:
    words = {verdict_line(v) for v in (*Verdict, None)}
    assert len(words) == len(Verdict) + 1
