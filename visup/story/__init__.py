"""What a run comes to, for people: one line a life of each object, and a summary at the end.

Read in this order: `lives.py` (where each object came from, went to, whom it came near), `places.py` and
`colour_words.py` (words for where and what), `life_sentences.py` (a life in a line, lives of one course in
one), `line_budget.py` (how many lines a minute), `narrative.py` (what of a step is worth a line),
`summary.py` (the run in a few lines).
"""

from visup.story.narrative import Detail, Narrative
from visup.story.summary import summary_lines

__all__ = ["Detail", "Narrative", "summary_lines"]
