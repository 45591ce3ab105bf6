"""The commands of `visup step`: syntax, description, completion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Command:
    """One command of a session.

    Attributes:
        usage: Its syntax.
        effect: Its effect, in one clause.
        more: Further help.
        completes: Kind of its arguments: 'stop', 'why', 'object', 'relation', 'break', 'mark', 'file',
            'command', 'expression'.
    """

    usage: str
    effect: str
    more: str = ""
    completes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Its first word."""
        return self.usage.split()[0]

    @property
    def text(self) -> str:
        """The full help of the command."""
        return f"{self.usage}\n  {self.effect}" + (f"\n\n{self.more}" if self.more else "")


_WHERE = """\
WHAT is one of
  a phase            update, cogitate, match, attend, act: stops inside the step
                     after it, with the half-made mind to look at
  an event           alert, entry, coupled, stage_failing, ...
  a rule             collision_course: when it becomes true of anybody;
                     'rule NAME changes': whenever its verdict changes
  a stage            when it becomes current or its status changes
  object 2           when its presence or identity changes
  12.5, frame 300    at that time in seconds, at that frame
  an expression      when gap(1, 2) < 20 px, change touching(arm, satellite)
Where a word could be two things, say which: 'event coupled', 'stage coupled'."""
_EXPRESSION = """\
An expression of the rule language (docs/rules.md). A number is an object's id,
a name is an actor or a model, one letter is any object:
  gap(1, 2)    touching(arm, satellite) for 0.5 s    speed(a) > 40 px/s"""
_WHY = """\
  why alert 2              the rule, its conditions and quantities, the percepts
  why verdict, why captured       a task, a stage
  why touching 1 2         a relation; why coupled 1 2
  why identity 1           votes, and what it looked like; why object 1
  why not collision_course [1 2]  which condition is not met, and by how much
  why not captured         what a stage waits for
  why not coupled 1 2, entry 3, exit 1, occlusion 1, identified 1, touching 1 2"""
_BRANCH = """\
An assertion, a retraction or a swap begins a branch at this place; the run
itself stays as it is. 'compare' shows what the branch changes, 'leave' returns."""

_COMMANDS = (
    Command(
        "step [N] [until WHAT]",
        "advance one step, or N, or until a condition holds",
        _WHERE,
        ("stop",),
    ),
    Command(
        "run [until WHAT]", "advance until a condition holds, or to the end", _WHERE, ("stop",)
    ),
    Command("back [N]", "go back one step, or N; forward gives the same steps"),
    Command(
        "go PLACE",
        "go to a step, a time (12.5s), a mark, 'start' or 'end'",
        "Steps are numbered from 1. Breakpoints on the way are ignored.",
        ("mark",),
    ),
    Command("mark [NAME]", "mark this step for 'go NAME'; or list the marks"),
    Command("break [WHAT]", "set a breakpoint; or list all breakpoints", _WHERE, ("stop",)),
    Command("delete N", "delete breakpoint N", completes=("break",)),
    Command("disable N", "disable breakpoint N for now", completes=("break",)),
    Command("enable N", "enable breakpoint N again", completes=("break",)),
    Command(
        "watch [EXPRESSION]",
        "show a value after each step; or list the watches",
        f"{_EXPRESSION}\n'watch! EXPRESSION' also stops whenever its value changes.",
        ("expression",),
    ),
    Command("unwatch N", "remove watch N"),
    Command("why [not] WHAT", "show the evidence, down to frames and percepts", _WHY, ("why",)),
    Command("diff [A [B]]", "show changes since the last step, or from step A to B"),
    Command(
        "assert BELIEF",
        "what if: assume a belief, on a branch",
        f"""\
  assert touching 1 2 true       a relation; or false, unknown
  assert object 1 arm            an identity; 'unknown' for none of the models
  assert object 1 hidden         seen, hidden, left
{_BRANCH}""",
        ("relation", "object"),
    ),
    Command(
        "forget BELIEF",
        "what if: drop a belief, on a branch",
        f"  forget touching 1 2    forget object 1\n{_BRANCH}",
        ("relation", "object"),
    ),
    Command(
        "use rules|task FILE",
        "what if: other rules or another task, on a branch",
        _BRANCH,
        ("file",),
    ),
    Command("branch", "start another timeline here, unchanged so far", _BRANCH),
    Command("compare", "show how the events of this branch differ"),
    Command("leave", "return to the timeline that this branch left"),
    Command("mind", "show a summary of all beliefs"),
    Command(
        "show [why WHAT] [FILE]",
        "show the frame with the beliefs drawn over it",
        "'show why WHAT' highlights the regions on which the answer to 'why WHAT'\n"
        "is based, in its frame. A terminal that can show pictures (kitty,\n"
        "sixel) shows one, others draw it in characters; with FILE, or from a\n"
        "pipe, the picture is written to a file.",
    ),
    Command("percepts", "show the percepts of this step, by behaviour"),
    Command("regions", "show the moving regions of the last frame"),
    Command("objects", "show all objects and their most likely identities"),
    Command("candidates ID", "show all possible identities of object ID", completes=("object",)),
    Command("questions", "show the open questions to the operator"),
    Command(
        "answer ID NAME",
        "tell visup which model object ID is",
        "In the past or on a recorded run this starts a branch.",
        ("object",),
    ),
    Command(
        "relations [ID]", "show the relations that hold between objects", completes=("object",)
    ),
    Command("tasks", "show stages, actors and verdicts"),
    Command("alerts", "show the open alerts"),
    Command("events [N]", "show the latest events with their steps"),
    Command("directives", "show the requests made to behaviours, and why"),
    Command("behaviours", "show what each behaviour did in the last step"),
    Command("help [COMMAND]", "list the commands, or explain one", completes=("command",)),
)
COMMANDS: Mapping[str, Command] = MappingProxyType({c.name: c for c in _COMMANDS})
"""By name."""

_WIDTH = max(len(c.usage) for c in _COMMANDS)
HELP = "\n".join(
    [
        *(f"{c.usage:<{_WIDTH}} {c.effect}" for c in _COMMANDS),
        f"{'quit':<{_WIDTH}} leave the session",
        "Any unambiguous prefix of a command works; an empty line repeats the last one.",
    ]
)
