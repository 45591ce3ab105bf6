"""The LR automaton of a Lark grammar, as plain stacks of states.

Lark's parser builds a tree; trying thousands of edits needs only the states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from lark import Lark
from lark.parsers.lalr_analysis import Shift

END = "$END"


@dataclass(eq=False, slots=True)
class Stack:
    """A stack of states.

    Equal stacks of an automaton are one object, so that they are hashed and compared by identity: searches do
    so a million times.

    Attributes:
        state: The state on top.
        below: The rest; None at the bottom.
        above: State -> the stack with it on top.
        after: Terminal -> the stack after it, or None if it is not accepted; those already tried.
    """

    state: int
    below: Stack | None = None
    above: dict[int, Stack] = field(default_factory=dict)
    after: dict[str, Stack | None] = field(default_factory=dict)

    def pushed(self, state: int) -> Stack:
        """The stack with a state on top."""
        found = self.above.get(state)
        if found is None:
            found = self.above[state] = Stack(state, self)
        return found

    def popped(self, count: int) -> Stack:
        """The stack without some states; it must have more."""
        found = self
        for _ in range(count):
            assert found.below is not None
            found = found.below
        return found


@dataclass
class LrAutomaton:
    """The states of an LALR parser.

    Attributes:
        states: Action of each state per terminal, and goto per nonterminal.
        initial: The initial stack.
        accepting: The accepting state.
    """

    states: Mapping[int, Mapping[str, Any]]
    initial: Stack
    accepting: int
    _acceptable: dict[int, Sequence[str]] = field(default_factory=dict)

    @classmethod
    def of(cls, parser: Lark, start: str) -> LrAutomaton:
        """The automaton of a parser, for one of its start symbols."""
        table = parser.parser.parser._parse_table
        return cls(table.states, Stack(table.start_states[start]), table.end_states[start])

    def acceptable(self, stack: Stack) -> Sequence[str]:
        """Terminals that may come next, and possibly some that may not."""
        found = self._acceptable.get(stack.state)
        if found is None:
            names = self.states[stack.state]
            found = sorted(name for name in names if name.isupper() or name == END)
            self._acceptable[stack.state] = found
        return found

    def step(self, stack: Stack, terminal: str) -> Stack | None:
        """The stack after a terminal; None if it is not accepted."""
        after = stack.after
        if terminal not in after:
            after[terminal] = self._step(stack, terminal)
        return after[terminal]

    def _step(self, stack: Stack, terminal: str) -> Stack | None:
        while True:
            if terminal == END and stack.state == self.accepting:
                return stack
            found = self.states[stack.state].get(terminal)
            if found is None:
                return None
            action, argument = found
            if action is Shift:
                return stack.pushed(argument)
            stack = stack.popped(len(argument.expansion))
            stack = stack.pushed(self.states[stack.state][argument.origin.name][1])
