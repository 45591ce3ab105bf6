"""An interactive session: reads commands, prints the agent's steps and beliefs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, Group, RenderableType
from rich.text import Text

from visup.agent import Frame
from visup.agent.cycle.agent import Agent
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import OutputError, VisupError
from visup.agent.model.step import Step
from visup.report.annotate import annotate
from visup.report.graphics import terminal_picture
from visup.report.pictures import png
from visup.report.spotlight import spotlight
from visup.stepping import Bookmark, ObservationSource, Stepper, StepResult, parse_condition
from visup.stepping.breakpoints import FrameStop, StopCondition, TimeStop
from visup.terminal.console import make_console
from visup.terminal.narrator import event_line, event_row
from visup.terminal.session_commands import COMMANDS
from visup.terminal.session_views import VIEWS, Refusal, number_in, refusal, usage
from visup.terminal.what_if_commands import parse_assumption, replaced_reasoners
from visup.wording import prose, worded_once

Answer = RenderableType | None
PICTURES = (".png", ".jpg", ".jpeg", ".webp")


class Session:
    """Executes commands on a stepper and its branches.

    Args:
        agent: The agent.
        frames: Its frames, or a source of observations.
        console: The console; standard output by default.
        picture: Returns the frame of a number, (H, W, 3) uint8 BGR, if frames can be read again.

    Attributes:
        timelines: The run and the nested branches; the last one is stepped.
    """

    def __init__(
        self,
        agent: Agent,
        frames: Iterable[Frame] | ObservationSource,
        console: Console | None = None,
        picture: Callable[[int], NDArray[np.uint8]] | None = None,
    ) -> None:
        self._picture = picture
        self.timelines = [Stepper(agent, frames)]
        self.console = console or make_console(unwrapped=True)
        self._marks: dict[str, Bookmark] = {}

    @property
    def stepper(self) -> Stepper:
        """The timeline that is stepped."""
        return self.timelines[-1]

    @property
    def agent(self) -> Agent:
        """The agent of that timeline."""
        return self.stepper.agent

    @property
    def marks(self) -> tuple[str, ...]:
        """Names of the marks."""
        return tuple(self._marks)

    def words(self) -> list[str]:
        """The commands, for completion."""
        return [*_NAMES, "until", "quit"]

    def run(self, commands: Iterable[str]) -> int:
        """Carry out commands until 'quit' or their end.

        Returns:
            Exit code: 0, or 2 if a command was refused.
        """
        self.console.print(
            "[dim]Type 'step' to advance by one frame, 'help' for all commands.[/dim]"
        )
        last, refused = "step", False
        for entered in commands:
            command = entered.split(" #")[0].strip() or last
            if command.startswith("#"):
                continue
            if command in ("quit", "exit", "q"):
                break
            last = command
            answer = self.execute(command)
            refused |= isinstance(answer, Refusal)
            if answer is not None:
                self.console.print(answer)
        return 2 if refused else 0

    def execute(self, command: str) -> Answer:
        """Carry out one command, given by its name or an unambiguous prefix."""
        word, *rest = (
            command.replace("?", "help ", 1).split() if command[0] == "?" else command.split()
        )
        if word.endswith("!"):
            word, rest = word[:-1], ["!", *rest]
        names = [_SHORT[word]] if word in _SHORT else [n for n in _NAMES if n.startswith(word)]
        name = word if word in _NAMES else names[0] if len(names) == 1 else None
        if name is None:
            suggestion = did_you_mean(word, _NAMES)
            alternatives = (
                f" ({', '.join(names)}?)" if names else f" ({suggestion})" if suggestion else ""
            )
            return refusal(f"'{word}' is not a command{alternatives}; 'help' lists them")
        try:
            if name in VIEWS:
                return VIEWS[name](self.stepper, rest)
            return _ACTIONS[name](self, rest)
        except VisupError as fault:
            return refusal(str(fault))

    # Stepping

    def _step(self, words: Sequence[str]) -> Answer:
        count = number_in(words)
        what = " ".join(words if count is None else words[1:]).removeprefix("until").strip()
        return self._advance(count, what)

    def _run(self, words: Sequence[str]) -> Answer:
        what = " ".join(words).removeprefix("until").strip()
        return self._advance(None, what or _run_to_end)

    def _advance(self, count: int | None, what: str | Callable[[Step], bool]) -> Answer:
        stop: StopCondition | None = (
            parse_condition(what, self.stepper.mind, self.stepper.names) if what else None
        )
        if stop is not None and self._already_passed(stop):
            return refusal(f"{stop.text} has already passed; use 'go' or 'back'")
        stopped = self.stepper.step(count, stop, self._print_events)
        return self._position(stopped)

    def _already_passed(self, stop: StopCondition) -> bool:
        mind = self.stepper.mind
        if mind.frame_index < 0:
            return False
        if isinstance(stop, TimeStop):
            return stop.time <= mind.time
        return isinstance(stop, FrameStop) and stop.frame <= mind.frame_index

    def _print_events(self, step: Step) -> None:
        for event in worded_once(step.events):
            if self.console.is_terminal:
                self.console.print(event_row(event))
            else:  # a pipe has no width
                self.console.print(Text(event_line(event)), soft_wrap=True)

    def _position(self, stopped: StepResult | None = None) -> RenderableType:
        """The position of the session: reasons for stopping, watched values, frame and time."""
        mind, lines = self.stepper.mind, []
        if stopped is not None:
            lines += [Text(f"stopped: {why}", style="bold") for why in stopped.reasons]
            if stopped.ended:
                lines.append(Text("the source has ended", style="yellow"))
        for watch in self.stepper.watches.values():
            values = [f"{_ids(r.objects)} {r}".strip() for r in watch.readings[:6]]
            value_text = ", ".join(values) or "no object matches"
            lines.append(Text(f"watch {watch.id}  {watch.text}: {value_text}", style="cyan"))
        visible = sum(b.last_seen == mind.time for b in mind.objects.values())
        regions = "1 region" if visible == 1 else f"{visible} regions"
        where = f"frame {mind.frame_index}, {mind.time:.2f} s, {regions}"
        lines.append(Text(f"{where}{self._position_details()}", style="dim"))
        return Group(*lines)

    def _position_details(self) -> str:
        """Details of the position besides frame and time."""
        stepper = self.stepper
        details = [f"; step {stepper.at} of {stepper.made}"] if stepper.at < stepper.made else []
        if stepper.paused:
            details.append(f"; inside the step, after {stepper.paused.phase.value}")
        if len(self.timelines) > 1:
            details.append(f"; branch from step {stepper.begin}")
        return "".join(details)

    def _back(self, words: Sequence[str]) -> Answer:
        count = number_in(words) if words else 1
        if count is None:
            return refusal(usage("back"))
        self.stepper.back(count)
        return self._position()

    def _go(self, words: Sequence[str]) -> Answer:
        target = words[0] if words else ""
        if target in self._marks:
            self.stepper.restore(self._marks[target])
        elif target in ("start", "end"):
            self.stepper.go(self.stepper.begin if target == "start" else self.stepper.made)
        elif target.removesuffix("s").replace(".", "", 1).isdecimal() and not target.isdecimal():
            self.stepper.go_to_time(float(target.removesuffix("s")))
        elif target.isdecimal():
            self.stepper.go(int(target))
        else:
            return refusal(f"{usage('go')}; marks: {', '.join(self._marks) or 'none'}")
        return self._position()

    def _mark(self, words: Sequence[str]) -> Answer:
        if not words:
            rows = [f"{name}  step {mark.number}" for name, mark in self._marks.items()]
            return Text("\n".join(rows) or "no marks are set")
        self._marks[words[0]] = self.stepper.snapshot()
        return Text(f"step {self.stepper.at} is '{words[0]}'", style="dim")

    def _show(self, words: Sequence[str]) -> Answer:
        if self.stepper.mind.frame_index < 0:
            return refusal("no step has been taken yet")
        if self._picture is None:
            return refusal("no frame can be shown: the frames of this source cannot be read again")
        if words and words[0] == "why":
            return self._show_why(self._picture, words[1:])
        mind = self.stepper.mind
        image = annotate(self._picture(mind.frame_index), mind)
        return self._shown(image, mind.frame_index, words[0] if words else None)

    def _show_why(
        self, picture: Callable[[int], NDArray[np.uint8]], words: Sequence[str]
    ) -> Answer:
        """The frame of an explanation with its regions highlighted."""
        file = words[-1] if words and words[-1].endswith(PICTURES) else None
        question = list(words[:-1] if file else words)
        if not question:
            return refusal("usage: show why WHAT, such as: show why alert 1")
        negated, subject = question[0] == "not", " ".join(question)
        why = (
            self.stepper.why_not(subject.removeprefix("not").strip())
            if negated
            else self.stepper.why(subject)
        )
        frame, regions = why.regions
        if frame is None:
            return refusal(
                "the answer is not based on any region of a frame, so there is nothing to show"
            )
        return self._shown(spotlight(picture(frame), regions), frame, file)

    def _shown(self, image: NDArray[np.uint8], frame: int, file: str | None) -> Answer:
        """Show a picture on the terminal, or write it to a file."""
        if self.console.is_terminal and file is None:
            return terminal_picture(image, self.console.width)
        path = Path(file or f"frame-{frame:05d}.png")
        try:
            path.write_bytes(png(image))
        except OSError as fault:
            raise OutputError(
                f"the picture cannot be written ({fault.strerror})", where=str(path)
            ) from fault
        return Text(f"{path}: {image.shape[1]} x {image.shape[0]} pixels")

    # Breakpoints and watches

    def _break(self, words: Sequence[str]) -> Answer:
        if not words:
            every = self.stepper.breakpoints.values()
            return Text("\n".join(map(str, every)) or "no breakpoints are set")
        return Text(str(self.stepper.break_at(" ".join(words))))

    def _breakpoint(self, words: Sequence[str], what: str) -> Answer:
        number = number_in(words)
        if number is None:
            return refusal(usage(what))
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
        return self._position() if self.stepper.watches else Text("no watches are set")

    def _unwatch(self, words: Sequence[str]) -> Answer:
        number = number_in(words)
        if number is None:
            return refusal(usage("unwatch"))
        self.stepper.unwatch(number)
        return self._watch(())

    # Branches

    def _assume(self, words: Sequence[str], *, retract: bool) -> Answer:
        belief = parse_assumption(self.stepper.mind, words, self.agent.models, retract=retract)
        return self._enter_branch(self.stepper.branch(belief))

    def _use(self, words: Sequence[str]) -> Answer:
        if len(words) != 2 or words[0] not in ("rules", "task"):
            return refusal(usage("use"))
        reasoners = replaced_reasoners(self.agent.reasoners, words[0], words[1])
        return self._enter_branch(self.stepper.branch(reasoners=reasoners))

    def _enter_branch(self, branch: Stepper) -> Answer:
        for watch in self.stepper.watches.values():
            branch.watch(watch.text, breaks=watch.breaks)
        for point in self.stepper.breakpoints.values():
            branch.enable(branch.break_at(point.stop).id, point.enabled)
        self.timelines.append(branch)
        return self._position()

    def _compare(self, words: Sequence[str]) -> Answer:
        changed = self.stepper.compare()
        marked = [("-", "red", e) for e in changed.gone] + [("+", "green", e) for e in changed.new]
        events = [
            Text(prose(f"{mark} {float(e['time']):7.1f} s  {e['text']}"), style=style)
            for mark, style, e in marked
        ]
        before, after = changed.verdicts
        verdict = Text(f"verdict: {before or 'none'} -> {after or 'none'}")
        return Group(*(events or [Text("no differences")]), verdict)

    def _leave(self, words: Sequence[str]) -> Answer:
        if len(self.timelines) == 1:
            return refusal("this is not a branch")
        self.timelines.pop()
        return self._position()

    def _answer(self, words: Sequence[str]) -> Answer:
        number = number_in(words)
        if number is None or len(words) < 2:
            return refusal("usage: answer ID NAME, such as: answer 2 arm")
        name = " ".join(words[1:])
        if not self.stepper.can_answer:
            branch = self.stepper.branch()
            branch.answer(number, name)
            return self._enter_branch(branch)
        self.stepper.answer(number, name)
        return Text("this counts as fact from the next step on", style="dim")


_ACTIONS: Mapping[str, Callable[[Session, Sequence[str]], Answer]] = MappingProxyType(
    {
        "step": Session._step,
        "run": Session._run,
        "back": Session._back,
        "go": Session._go,
        "mark": Session._mark,
        "show": Session._show,
        "break": Session._break,
        "delete": partial(Session._breakpoint, what="delete"),
        "disable": partial(Session._breakpoint, what="disable"),
        "enable": partial(Session._breakpoint, what="enable"),
        "watch": Session._watch,
        "unwatch": Session._unwatch,
        "assert": partial(Session._assume, retract=False),
        "forget": partial(Session._assume, retract=True),
        "use": Session._use,
        "branch": lambda session, _: session._enter_branch(session.stepper.branch()),
        "compare": Session._compare,
        "leave": Session._leave,
        "answer": Session._answer,
    }
)
"""Commands that move the session or change something, by name."""

_SHORT = {"s": "step"}
"""Prefixes that keep their old meaning although another command shares them."""

_NAMES = tuple(name for name in COMMANDS if name in _ACTIONS or name in VIEWS)


def _run_to_end(step: Step) -> bool:
    return False


def _ids(objects: tuple[int, ...]) -> str:
    return f"({', '.join(map(str, objects))})" if objects else ""
