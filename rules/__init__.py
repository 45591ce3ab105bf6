"""Interpreting: from what was seen to what is going on (paper, section 5 and part of 7.4).

Read in this order: `reasoners.py` (everything, in the order in which it runs), `objects.py` and
`presence.py` (who is there; one idea each in `adoption.py`, `merging.py`, `fragments.py`,
`entering.py` and `vanishing.py`), `votes.py` (who is who), `pose.py` with
`interpretation.py` and `spin.py` (which way it faces, how it turns), `relations.py` and `coupling.py` (what
holds between them), `safety.rules` and `rules.lark` (what to watch for, and the language that says
so), `program.py`, `layout.py` and `machine.py` (how it is judged), `sentences.py` (how it is told).
Below them lie `history.py` and `measure.py` (samples and quantities) and `geometry.py`,
`fit_loops.py`, `latch.py` (the mathematics).
"""
