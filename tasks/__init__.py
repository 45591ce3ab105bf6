"""Tasks: the language of task files, and the supervision of tasks.

Read in this order: `tasks.lark` (the language), `tree.py` and `read.py` (text to tree),
`diagnostics.py` (mistakes: `syntax.py`, `mistakes.py`, `check.py`), `actions.py` (what actions
mean), `course.py` (where one can be in a task), `verify.py` (how a step stands), `readings.py`
(which courses fit what is seen), `matching.py` (who plays whom), `supervise.py` (the reasoner that
joins them).
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
