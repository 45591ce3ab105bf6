"""Questions of a run to its operator that are open at a given time."""

from __future__ import annotations

from collections.abc import Iterable

from visup.agent import Event, Question


def open_questions(events: Iterable[Event], now: float) -> tuple[Question, ...]:
    """The questions open at a time, by object.

    A journal does not record when a question settled by itself; here such a question stays open to the end.

    Args:
        events: Events of the run, by time.
        now: Seconds.
    """
    questions: dict[int, Question] = {}
    for e in events:
        if e.time > now or not e.objects:
            continue
        if e.kind == "question":
            names = tuple(map(str, e.data.get("names", ())))
            questions[e.objects[0]] = Question(e.objects[0], names, e.time, e.text)
        elif e.kind in ("answer", "exit"):
            questions.pop(e.objects[0], None)
    return tuple(questions[number] for number in sorted(questions))
