"""The narrative of a run for people: one line per object, and a summary at the end.

Read in this order: `visits.py` (when and where each object was in view), `places.py` and
`colour_words.py` (words for places and colours), `visit_sentences.py` (visits as sentences),
`rate_limit.py` (how many lines per minute), `narrative.py` (which events get a line),
`summary.py` (the run in a few lines).
"""

from visup.narrative.narrative import Detail, Narrative
from visup.narrative.summary import summary_lines

__all__ = ["Detail", "Narrative", "summary_lines"]
