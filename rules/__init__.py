"""Reasoning: from what was perceived to what is going on (paper, section 5 and part of 7.4).

Read in this order: `reasoners.py` (all reasoners, in the order in which they run), then the rooms:
`presence` (who is there), `identity` (who is who), `pose` (which way it faces, how it turns),
`relations` (what holds between objects) and `coupling` (which move as one body); `formula`, `language`,
`predicates`, `monitoring` and `safety` (what rules watch for, the language that says so, how they are
judged); `activation` (which behaviours are needed) and `wording` (sentences, and conditions in words).
Below them lie `geometry` (outlines, fits) and `smoothing` (hysteresis, exponential means).

A decision and its explanation are the same conditions: `wording/conditions.py`.
"""
