"""The LR automaton of a Lark grammar, as plain stacks of states.

Lark's parser builds a tree; trying thousands of edits needs only the states.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lark import Lark
from lark.parsers.lalr_analysis import Shift

Stack = tuple[int, ...]
END = "$END"
_NOT_TRIED: Stack = (-1,)


@dataclass
class LrAutomaton:
    """The states of an LALR parser.

    Attributes:
        states: Action of each state per terminal, and goto per nonterminal.
        initial: The initial state.
        accepting: The accepting state.
        cache: Cache of steps.
    """

    states: Mapping[int, Mapping[str, Any]]
    initial: int
    accepting: int
    cache: dict[tuple[Stack, str], Stack | None] = field(default_factory=dict)

    @classmethod
    def of(cls, parser: Lark, start: str) -> LrAutomaton:
        """The automaton of a parser, for one of its start symbols."""
        table = parser.parser.parser._parse_table
        return cls(table.states, table.start_states[start], table.end_states[start])

    def acceptable(self, stack: Stack) -> list[str]:
        """Terminals that may come next, and possibly some that may not."""
        return sorted(name for name in self.states[stack[-1]] if name.isupper() or name == END)

    def step(self, stack: Stack, terminal: str) -> Stack | None:
        """The stack after a terminal; None if it is not accepted."""
        key = stack, terminal
        after = self.cache.get(key, _NOT_TRIED)
        if after is _NOT_TRIED:
            after = self.cache[key] = self._step(stack, terminal)
        return after

    def _step(self, stack: Stack, terminal: str) -> Stack | None:
        while True:
            if terminal == END and stack[-1] == self.accepting:
                return stack
            found = self.states[stack[-1]].get(terminal)
            if found is None:
                return None
            action, argument = found
            if action is Shift:
                return (*stack, argument)
            size = len(argument.expansion)
            stack = stack[:-size] if size else stack
            stack = (*stack, self.states[stack[-1]][argument.origin.name][1])
