"""An interactive session: commands in, the agent's steps and what it believes out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from visup.agent import Frame, Observation
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import VisupError
from visup.agent.model.step import Step
from visup.stepping import Bookmark, ObservationSource, Stepper, StepResult, parse_condition
from visup.stepping.breakpoints import FrameStop, StopCondition, TimeStop
from visup.terminal.display import shown
from visup.terminal.narrator import event_row
from visup.terminal.session_commands import COMMANDS, HELP
from visup.terminal.tables import (
    alerts_list,
    behaviours_table,
    candidates_table,
    objects_table,
    questions_list,
    regions_table,
    relations_table,
    tasks_tree,
)
from visup.terminal.what_if_commands import parse_assumption, replaced_reasoners
from visup.wording import worded_once

__all__ = ["HELP", "Session"]

Answer = RenderableType | None


class Session:
    """Holds a stepper, with the branches that were begun, and answers commands.

    Args:
        agent: The agent.
        frames: Where its frames come from, or a feed of what was perceived.
        console: Where to write; standard output by default.

    Attributes:
        courses: The run, and the branches that were begun from one another; the last one is stepped.
    """

    def __init__(
        self,
        agent: Agent,
        frames: Iterable[Frame] | ObservationSource,
        console: Console | None = None,
    ) -> None:
        self.courses = [Stepper(agent, frames)]
        self.console = console or Console(highlight=False)
        self._marks: dict[str, Bookmark] = {}
        self._commands: dict[str, Callable[[Sequence[str]], Answer]] = {
            "step": self._step,
            "run": self._run,
            "back": self._back,
            "go": self._go,
            "mark": self._mark,
            "break": self._break,
            "delete": lambda words: self._breakpoint(words, "delete"),
            "disable": lambda words: self._breakpoint(words, "disable"),
            "enable": lambda words: self._breakpoint(words, "enable"),
            "watch": self._watch,
            "unwatch": self._unwatch,
            "why": self._why,
            "diff": self._diff,
            "assert": lambda words: self._suppose(words, retract=False),
            "forget": lambda words: self._suppose(words, retract=True),
            "use": self._use,
            "branch": lambda _: self._begin(self.stepper.branch()),
            "compare": self._compare,
            "leave": self._leave,
            "mind": lambda _: shown(self.stepper.mind),
            "percepts": lambda _: shown(seen) if (seen := self._seen()) else Text(_NO_STEP),
            "regions": lambda _: regions_table(self._seen()),
            "objects": lambda _: objects_table(self.stepper.mind.objects.values()),
            "candidates": self._candidates,
            "questions": lambda _: questions_list(self.stepper.mind.questions),
            "answer": self._answer,
            "relations": lambda words: relations_table(self.stepper.mind.relations, _number(words)),
            "tasks": lambda _: tasks_tree(self.stepper.mind),
            "alerts": lambda _: alerts_list(self.stepper.mind.alerts),
            "events": self._events,
            "directives": self._directives,
            "behaviours": self._behaviours,
            "help": _help,
        }

    @property
    def stepper(self) -> Stepper:
        """The course that is stepped."""
        return self.courses[-1]

    @property
    def agent(self) -> Agent:
        """The agent of that course."""
        return self.stepper.agent

    @property
    def marks(self) -> tuple[str, ...]:
        """Names of the places that are remembered."""
        return tuple(self._marks)

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
            command = entered.split(" #")[0].strip() or last
            if command.startswith("#"):
                continue
            if command in ("quit", "exit", "q"):
                break
            last = command
            answer = self.execute(command)
            if answer is not None:
                self.console.print(answer)
        return 0

    def execute(self, command: str) -> Answer:
        """Carry out one command; a unique beginning of its name will do."""
        word, *rest = command.split()
        if word.endswith("!"):
            word, rest = word[:-1], ["!", *rest]
        names = [n for n in self._commands if n.startswith(word)]
        name = word if word in self._commands else names[0] if len(names) == 1 else None
        if name is None:
            meant = f" ({', '.join(names)}?)" if names else ""
            return _amiss(f"'{word}' is not a command{meant}; 'help' lists them")
        try:
            return self._commands[name](rest)
        except VisupError as fault:
            return _amiss(str(fault))

    # Forth and back

    def _step(self, words: Sequence[str]) -> Answer:
        count = _number(words)
        what = " ".join(words if count is None else words[1:]).removeprefix("until").strip()
        return self._advance(count, what)

    def _run(self, words: Sequence[str]) -> Answer:
        what = " ".join(words).removeprefix("until").strip()
        return self._advance(None, what or _never)

    def _advance(self, count: int | None, what: str | Callable[[Step], bool]) -> Answer:
        stop: StopCondition | None = parse_condition(what, self.stepper.mind) if what else None
        if stop is not None and self._is_past(stop):
            return _amiss(f"{stop.text} is past: 'go' and 'back' lead there")
        stopped = self.stepper.step(count, stop, self._tell)
        return self._place(stopped)

    def _is_past(self, stop: StopCondition) -> bool:
        mind = self.stepper.mind
        if mind.frame_index < 0:
            return False
        if isinstance(stop, TimeStop):
            return stop.time <= mind.time
        return isinstance(stop, FrameStop) and stop.frame <= mind.frame_index

    def _tell(self, step: Step) -> None:
        for event in worded_once(step.events):
            self.console.print(event_row(event))

    def _place(self, stopped: StepResult | None = None) -> RenderableType:
        """Where the session is: why it stopped, what is watched, frame and time."""
        mind, lines = self.stepper.mind, []
        if stopped is not None:
            lines += [Text(f"stopped: {why}", style="bold") for why in stopped.reasons]
            if stopped.ended:
                lines.append(Text("the source has ended", style="yellow"))
        for watch in self.stepper.watches.values():
            values = [f"{_ids(r.objects)} {r}".strip() for r in watch.readings[:6]]
            told = ", ".join(values) or "nobody is meant by it"
            lines.append(Text(f"watch {watch.id}  {watch.text}: {told}", style="cyan"))
        seen = sum(b.last_seen == mind.time for b in mind.objects.values())
        where = f"frame {mind.frame_index}, {mind.time:.2f} s, {seen} regions"
        lines.append(Text(f"{where}{self._aside()}", style="dim"))
        return Group(*lines)

    def _aside(self) -> str:
        """What is to be known of the place besides frame and time."""
        stepper = self.stepper
        told = [f"; step {stepper.at} of {stepper.made}"] if stepper.at < stepper.made else []
        if stepper.paused:
            told.append(f"; inside the step, after {stepper.paused.phase.value}")
        if len(self.courses) > 1:
            told.append(f"; branch from step {stepper.begin}")
        return "".join(told)

    def _back(self, words: Sequence[str]) -> Answer:
        count = _number(words)
        self.stepper.back(1 if count is None else count)
        return self._place()

    def _go(self, words: Sequence[str]) -> Answer:
        place = words[0] if words else ""
        if place in self._marks:
            self.stepper.restore(self._marks[place])
        elif place in ("start", "end"):
            self.stepper.go(self.stepper.begin if place == "start" else self.stepper.made)
        elif place.removesuffix("s").replace(".", "", 1).isdecimal() and not place.isdecimal():
            self.stepper.go_to_time(float(place.removesuffix("s")))
        elif place.isdecimal():
            self.stepper.go(int(place))
        else:
            return _amiss(f"{_usage('go')}; marks: {', '.join(self._marks) or 'none'}")
        return self._place()

    def _mark(self, words: Sequence[str]) -> Answer:
        if not words:
            rows = [f"{name}  step {mark.number}" for name, mark in self._marks.items()]
            return Text("\n".join(rows) or "no place is marked")
        self._marks[words[0]] = self.stepper.snapshot()
        return Text(f"step {self.stepper.at} is '{words[0]}'", style="dim")

    # Where to stop

    def _break(self, words: Sequence[str]) -> Answer:
        if not words:
            every = self.stepper.breakpoints.values()
            return Text("\n".join(map(str, every)) or "no breakpoint is set")
        return Text(str(self.stepper.break_at(" ".join(words))))

    def _breakpoint(self, words: Sequence[str], what: str) -> Answer:
        number = _number(words)
        if number is None:
            return _amiss(_usage(what))
        if what == "delete":
            self.stepper.delete(number)
        else:
            self.stepper.enable(number, what == "enable")
        return self._break(())

    def _watch(self, words: Sequence[str]) -> Answer:
        breaks = bool(words) and words[0] == "!"
        text = " ".join(words[breaks:])
        if text:
            self.stepper.watch(text, breaks=breaks)
        return self._place() if self.stepper.watches else Text("nothing is watched")

    def _unwatch(self, words: Sequence[str]) -> Answer:
        number = _number(words)
        if number is None:
            return _amiss(_usage("unwatch"))
        self.stepper.unwatch(number)
        return self._watch(())

    # Why

    def _why(self, words: Sequence[str]) -> Answer:
        if not words:
            return Text(COMMANDS["why"].text)
        if words[0] == "not":
            return shown(self.stepper.why_not(" ".join(words[1:])))
        return shown(self.stepper.why(" ".join(words)))

    def _diff(self, words: Sequence[str]) -> Answer:
        numbers = [int(w) for w in words if w.isdecimal()]
        if self.stepper.at == self.stepper.begin and not numbers:
            return Text(_NO_STEP)
        first = numbers[0] if numbers else self.stepper.at - 1
        return shown(self.stepper.diff(first, *numbers[1:2]))

    # What if

    def _suppose(self, words: Sequence[str], *, retract: bool) -> Answer:
        belief = parse_assumption(self.stepper.mind, words, self.agent.models, retract=retract)
        return self._begin(self.stepper.branch(belief))

    def _use(self, words: Sequence[str]) -> Answer:
        if len(words) != 2 or words[0] not in ("rules", "task"):
            return _amiss(_usage("use"))
        reasoners = replaced_reasoners(self.agent.reasoners, words[0], words[1])
        return self._begin(self.stepper.branch(reasoners=reasoners))

    def _begin(self, branch: Stepper) -> Answer:
        for watch in self.stepper.watches.values():
            branch.watch(watch.text, breaks=watch.breaks)
        for point in self.stepper.breakpoints.values():
            branch.enable(branch.break_at(point.stop).id, point.enabled)
        self.courses.append(branch)
        return self._place()

    def _compare(self, words: Sequence[str]) -> Answer:
        changed = self.stepper.compare()
        told = [
            *(Text(f"- {float(e['time']):7.1f} s  {e['text']}", style="red") for e in changed.gone),
            *(
                Text(f"+ {float(e['time']):7.1f} s  {e['text']}", style="green")
                for e in changed.new
            ),
        ]
        before, after = changed.verdicts
        verdict = Text(f"verdict: {before or 'none'} -> {after or 'none'}")
        return Group(*(told or [Text("nothing is told differently")]), verdict)

    def _leave(self, words: Sequence[str]) -> Answer:
        if len(self.courses) == 1:
            return _amiss("this is no branch")
        self.courses.pop()
        return self._place()

    def _answer(self, words: Sequence[str]) -> Answer:
        number = _number(words)
        if number is None or len(words) < 2:
            return _amiss("answer ID NAME, such as: answer 2 arm")
        name = " ".join(words[1:])
        if not self.stepper.may_answer:
            branch = self.stepper.branch()
            branch.answer(number, name)
            return self._begin(branch)
        self.stepper.answer(number, name)
        return Text("taken as a fact from the next step on", style="dim")

    # What is believed

    def _seen(self) -> Observation | None:
        """What was perceived in this step."""
        paused, last = self.stepper.paused, self.stepper.last
        if paused is not None:
            return paused.seen
        return None if last is None else last.observation

    def _candidates(self, words: Sequence[str]) -> Answer:
        number = _number(words)
        belief = self.stepper.mind.objects.get(number) if number is not None else None
        if belief is None:
            return _amiss("which object? 'objects' lists their ids")
        return candidates_table(belief)

    def _events(self, words: Sequence[str]) -> Answer:
        most = _number(words) or 10
        told = list(self.stepper.told(last=self.stepper.at))[-most:]
        rows = Table.grid(padding=(0, 1))
        for number, event in told:
            rows.add_row(Text(f"step {number}", style="dim"), event_row(event))
        return rows if told else Text("none yet")

    def _directives(self, words: Sequence[str]) -> Answer:
        asked = self.agent.directives
        return Group(*map(shown, asked)) if asked else Text("nothing is asked for")

    def _behaviours(self, words: Sequence[str]) -> Answer:
        seen = self._seen()
        return behaviours_table(seen.reports) if seen else Text(_NO_STEP)


_NO_STEP = "no step was taken yet"


def _never(step: Step) -> bool:
    return False


def _help(words: Sequence[str]) -> Answer:
    if not words:
        return Text(HELP)
    found = [c for c in COMMANDS.values() if c.name.startswith(words[0])]
    if not found:
        return _amiss(f"'{words[0]}' is not a command; 'help' lists them")
    return Text("\n\n".join(c.text for c in found))


def _usage(name: str) -> str:
    return f"{COMMANDS[name].usage}: {COMMANDS[name].does}"


def _ids(objects: tuple[int, ...]) -> str:
    return f"({', '.join(map(str, objects))})" if objects else ""


def _amiss(text: str) -> Text:
    return Text(text, style="yellow")


def _number(words: Sequence[str]) -> int | None:
    return int(words[0]) if words and words[0].isdecimal() else None
