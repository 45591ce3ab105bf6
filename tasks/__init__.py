"""Tasks: the language of task files, and the supervision of work against them.

The rooms, in reading order: `grammar/` (text to tree), `diagnostics/` and `checks/` (every error of
a file at once), `actions/` (what each action means in terms of relations), `automaton/` (where one
can be in a task), `verification/` (whether observations confirm a step), `casting/` (which object
plays which actor), `supervision/` (the reasoner: progress of the task, and what goes wrong), `tools/`
(formatter, diagram, simulation, editor support), `shipped/` (the tasks that ship with visup).
"""

from visup.tasks.checks.load import load_task, load_tasks, parse_task, shipped_tasks
from visup.tasks.grammar.nodes import Action, Actor, Choice, Sequence, Stage, Task, Together

__all__ = [
    "Action",
    "Actor",
    "Choice",
    "Sequence",
    "Stage",
    "Task",
    "Together",
    "load_task",
    "load_tasks",
    "parse_task",
    "shipped_tasks",
]
