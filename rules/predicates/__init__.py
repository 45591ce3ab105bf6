"""The atoms of rules: the predicates and quantities that formulas may name.

Read in this order: `snapshot.py` (one mind as arrays of truths and intervals), `vocabulary.py`
(every predicate and quantity, with how it is evaluated), `motion.py` (what moves), `inputs_missing.py`
(which percepts each one reads, and so when it is unknown). `_snapshot_jit.py` holds the compiled loop
over all pairs.
"""
