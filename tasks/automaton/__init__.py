"""The task as an automaton, and the filter that tracks its state with a probability.

Read in this order: `states.py` (where one can be in a course), `derivatives.py` (how it begins and goes on),
`automaton.py` (the states, numbered), `stage_hmm.py` (the probabilities), `forward_recursion.py` (the
forward algorithm), `task_filter.py` (the filter, and what a model gives it), `transitions.py` and
`hidden_phases.py` (the exact model), `backpointers.py` (the best way to a state), `prognosis.py` (what
comes next, and the probability of success). The second model, used for supervision, is in `supervision/`.
"""

from visup.tasks.automaton.automaton import END, Automaton, Transition
from visup.tasks.automaton.hidden_phases import HiddenPhases, hidden_filter
from visup.tasks.automaton.stage_hmm import ActionStatus, StageHmm
from visup.tasks.automaton.task_filter import TaskFilter, TaskModel, TaskPosterior

__all__ = [
    "END",
    "ActionStatus",
    "Automaton",
    "HiddenPhases",
    "StageHmm",
    "TaskFilter",
    "TaskModel",
    "TaskPosterior",
    "Transition",
    "hidden_filter",
]
