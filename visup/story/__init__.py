"""The narrative of a run for people: one line per object, and a summary at the end.

Read in this order: `lives.py` (where each object came from, went to, and what it came near), `places.py` and
`colour_words.py` (words for places and colours), `life_sentences.py` (one object in a line, similar ones in
one), `line_budget.py` (how many lines per minute), `narrative.py` (what is worth a line),
`summary.py` (the run in a few lines).
"""

from visup.story.narrative import Detail, Narrative
from visup.story.summary import summary_lines

__all__ = ["Detail", "Narrative", "summary_lines"]
