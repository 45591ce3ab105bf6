"""Reasoning: from percepts to an interpretation of the scene (paper, section 5 and part of 7.4).

Read in this order: `reasoners.py` (all reasoners, in the order in which they run), then the rooms:
`presence` (which objects exist), `identity` (what they are), `pose` (orientation and rotation),
`relations` (between objects) and `coupling` (objects that move as one body); `formula`, `language`,
`predicates`, `monitoring` and `safety` (safety rules: their language, and how they are
monitored); `activation` (which behaviours are needed) and `wording` (sentences, and conditions in words).
Below them lie `geometry` (outlines, fits) and `smoothing` (hysteresis, exponential means).

Decisions and their explanations are made from the same conditions: `wording/conditions.py`.
"""
