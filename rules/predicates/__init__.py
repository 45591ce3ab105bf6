"""The atoms of rules: the predicates and quantities available in formulas.

Read in this order: `snapshot.py` (a mind as arrays of truths and intervals), `definitions.py` (what defines
a predicate or quantity), `vocabulary.py` (all of them, with their evaluations), `motion.py` (predicates of
motion), `inputs_missing.py` (the percepts each one reads, and so when it is unknown). `_snapshot_jit.py`
holds the compiled loop over all pairs.
"""
