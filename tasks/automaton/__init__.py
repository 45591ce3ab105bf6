"""The task as an automaton, and the filter that tracks its state with a probability.

Read in this order: `states.py` (states of a course), `derivatives.py` (their successors),
`automaton.py` (numbered states), `stage_hmm.py` (the probabilities), `forward_recursion.py` (the forward
algorithm), `task_filter.py` (the filter and its model interface), `transitions.py` and `hidden_phases.py`
(the exact model), `backpointers.py` (the best path to a state), `entries.py` (observed beginnings of steps
that begin together), `prognosis.py` (next stages and the probability of success), `out_of_turn.py` (steps
done too soon). The second model, used for supervision, is in `supervision/`.
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
