"""An interactive session: commands in, the agent's steps and what it believes out."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from visup.agent import Frame, Mind, ObjectBelief, Relation, RelationTable
from visup.agent.agent import Agent, Step
from visup.agent.errors import VisupError
from visup.narrative import line
from visup.tasks.sentences import prospects_text
from visup.wording import worded_once

Predicate = Callable[[Step], bool]
HELP = """\
step [N]          one step, or N
run [until WHAT]  until an event of kind WHAT, a stage, a time (12.5), the end
regions           what moved in the last frame
objects           who is there, with their most likely identities
candidates ID     all identities that object ID may have
questions         what the operator is asked
answer ID NAME    say what object ID is
relations [ID]    what holds between objects
tasks             stages, actors and verdicts
alerts            what is open
events            the latest events
behaviours        what each behaviour did in the last step
help, quit
An empty line repeats the last command."""


class Session:
    """Holds an agent and its source, and answers commands.

    Args:
        agent: The agent.
        frames: Where its frames come from.
        console: Where to write; standard output by default.
    """

    def __init__(
        self, agent: Agent, frames: Iterable[Frame], console: Console | None = None
    ) -> None:
        self.agent = agent
        self.console = console or Console(highlight=False)
        self._frames = iter(frames)
        self._last: Step | None = None
        self._events: list[RenderableType] = []
        self._commands: dict[str, Callable[[Sequence[str]], RenderableType | None]] = {
            "step": self._step,
            "run": self._run,
            "regions": lambda _: regions_table(self._last),
            "objects": lambda _: objects_table(self.agent.mind),
            "candidates": self._candidates,
            "questions": lambda _: questions_list(self.agent.mind),
            "answer": self._answer,
            "relations": lambda words: relations_table(self.agent.mind, _number(words)),
            "tasks": lambda _: tasks_tree(self.agent.mind),
            "alerts": lambda _: alerts_list(self.agent.mind),
            "events": lambda _: Group(*self._events[-10:]) if self._events else Text("none yet"),
            "behaviours": lambda _: behaviours_table(self._last),
            "help": lambda _: Text(HELP),
        }

    def words(self) -> list[str]:
        """The commands, for completion."""
        return [*self._commands, "until", "quit"]

    def run(self, commands: Iterable[str]) -> int:
        """Obey commands until 'quit' or their end.

        Returns:
            Exit code, 0.
        """
        self.console.print("[dim]'step' goes on by one frame, 'help' shows the commands.[/dim]")
        last = "step"
        for entered in commands:
            command = entered.strip() or last
            if command in ("quit", "exit", "q"):
                break
            last = command
            shown = self.obey(command)
            if shown is not None:
                self.console.print(shown)
        return 0

    def obey(self, command: str) -> RenderableType | None:
        """Carry out one command; a unique beginning of its name will do."""
        word, *rest = command.split()
        names = [n for n in self._commands if n.startswith(word)]
        name = word if word in self._commands else names[0] if len(names) == 1 else None
        if name is None:
            meant = f" ({', '.join(names)}?)" if names else ""
            return Text(f"'{word}' is not a command{meant}; 'help' lists them", style="yellow")
        return self._commands[name](rest)

    def _step(self, words: Sequence[str]) -> RenderableType | None:
        count = _number(words)
        return self._advance(1 if count is None else count, None)

    def _run(self, words: Sequence[str]) -> RenderableType | None:
        what = words[-1] if words and words[-1] != "until" else None
        return self._advance(None, until(what) if what else None)

    def _advance(self, count: int | None, stop: Predicate | None) -> RenderableType | None:
        taken = 0
        for frame in islice(self._frames, count):
            self._last = self.agent.step(frame)
            taken += 1
            told = [line(e) for e in worded_once(self._last.events)]
            self._events = [*self._events, *told][-1000:]
            for text in told:
                self.console.print(text)
            if stop and stop(self._last):
                break
        if not taken:
            return Text("the source has ended", style="yellow")
        mind = self.agent.mind
        seen = sum(b.last_seen == mind.time for b in mind.objects.values())
        return Text(f"frame {mind.frame_index}, {mind.time:.2f} s, {seen} regions", style="dim")

    def _answer(self, words: Sequence[str]) -> RenderableType:
        number = _number(words)
        if number is None or len(words) < 2:
            return Text("answer ID NAME, such as: answer 2 arm", style="yellow")
        try:
            self.agent.answer(number, " ".join(words[1:]))
        except VisupError as fault:
            return Text(str(fault), style="yellow")
        return Text("taken as a fact from the next step on", style="dim")

    def _candidates(self, words: Sequence[str]) -> RenderableType:
        number = _number(words)
        belief = self.agent.mind.objects.get(number) if number is not None else None
        if belief is None:
            return Text("which object? 'objects' lists their ids", style="yellow")
        return candidates_table(belief)


def until(what: str) -> Predicate:
    """When to stop: at a time in seconds, an event kind, or a stage that becomes current."""
    try:
        at = float(what)
    except ValueError:
        return lambda step: (
            any(e.kind == what for e in step.events)
            or any(t.current == what for t in step.mind.tasks)
        )
    return lambda step: step.time >= at


def regions_table(step: Step | None) -> RenderableType:
    """What motion segmentation saw in the last frame."""
    if step is None:
        return Text("no step was taken yet")
    table = Table("region", "box", "area", "velocity px/s", "cut", "confidence")
    for r in step.observation.of("region"):
        box = ",".join(map(str, r.bbox))
        velocity = f"{r.velocity[0]:.1f}, {r.velocity[1]:.1f} ± {r.velocity_sigma:.1f}"
        cut = "yes" if r.cut else "no"
        table.add_row(str(r.id), box, f"{r.area:.0f}", velocity, cut, f"{r.confidence:.2f}")
    return table


def objects_table(mind: Mind) -> Table:
    """Who is believed to be there."""
    table = Table("id", "identity", "share", "presence", "box", "px/s", "depth")
    for b in sorted(mind.objects.values(), key=lambda b: b.id):
        speed = sum(v * v for v in b.region.velocity) ** 0.5
        depth = f"{b.depth:.1f}" if b.depth is not None else "unknown"
        box = ",".join(map(str, b.region.bbox))
        table.add_row(
            str(b.id), b.name, f"{b.strength:.2f}", b.presence.value, box, f"{speed:.1f}", depth
        )
    return table


def candidates_table(belief: ObjectBelief) -> Table:
    """The identities that an object may have."""
    table = Table("identity", "votes", "share", title=f"object {belief.id}")
    for c in belief.candidates:
        table.add_row(c.name, f"{c.votes:.2f}", f"{c.share:.2f}")
    return table


def relations_table(mind: Mind, object_id: int | None) -> Table:
    """What holds between objects; of one object and the others also what is seldom asked for."""
    table = Table("relation", "objects", "truth", "since", "value", "confidence")
    held = mind.relations
    told: Iterable[Relation] = held
    if object_id is not None and isinstance(held, RelationTable):
        told = held.all()
    for r in told:
        if object_id is None or object_id in r.objects:
            value = "" if r.value is None else f"{r.value:.1f}"
            objects = " ".join(map(str, r.objects))
            since = f"{r.since:.1f} s"
            table.add_row(r.name, objects, r.truth.value, since, value, f"{r.confidence:.2f}")
    return table


def tasks_tree(mind: Mind) -> RenderableType:
    """How each task stands."""
    if not mind.tasks:
        return Text("no task was given")
    return Group(*(_task_tree(mind, n) for n in range(len(mind.tasks))))


def _task_tree(mind: Mind, number: int) -> Tree:
    task = mind.tasks[number]
    tree = Tree(f"{task.task}: {task.verdict.value}  {task.evidence}".rstrip())
    for s in task.stages:
        here = "> " if s.stage == task.current else "  "
        tree.add(f"{here}{s.stage}: {s.status.value} since {s.since:.1f} s  {s.evidence}".rstrip())
    for b in task.bindings:
        who = f"object {b.object_id} ({b.strength:.2f})" if b.object_id is not None else "nobody"
        tree.add(f"  {b.actor} is played by {who}")
    tree.add(f"  {prospects_text(task)}")
    return tree


def alerts_list(mind: Mind) -> RenderableType:
    """What is open."""
    lines = [
        f"{a.id}  {a.severity.name.lower()}  since {a.opened:.1f} s  {a.cause}" for a in mind.alerts
    ]
    return Text("\n".join(lines) or "no alert is open")


def questions_list(mind: Mind) -> RenderableType:
    """What waits for an answer."""
    return Text("\n".join(q.text for q in mind.questions) or "nothing is asked")


def behaviours_table(step: Step | None) -> RenderableType:
    """What each behaviour did."""
    if step is None:
        return Text("no step was taken yet")
    table = Table("behaviour", "state", "percepts", "ms", "error")
    for r in step.reports:
        count, took = str(len(r.percepts)), f"{r.elapsed_ms:.1f}"
        table.add_row(r.behaviour, r.state.value, count, took, r.error)
    return table


def _number(words: Sequence[str]) -> int | None:
    return int(words[0]) if words and words[0].isdigit() else None


def read_commands(words: Sequence[str]) -> Iterator[str]:
    """Lines that the user enters: with history and completion on a terminal, plain from a pipe."""
    if not sys.stdin.isatty():
        yield from sys.stdin
        return
    from prompt_toolkit import PromptSession
    from prompt_toolkit.completion import WordCompleter

    prompt: PromptSession[str] = PromptSession(completer=WordCompleter(list(words)))
    while True:
        try:
            yield prompt.prompt("visup> ")
        except (EOFError, KeyboardInterrupt):
            return
