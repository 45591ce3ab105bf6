"""Explanations (why, why not): trees of reasons for beliefs, down to percepts.

Read in this order: `evidence` (the trees), `why` (an alert, a belief, a stage, a verdict), `why_not`
(unmet conditions, reported by the reasoners), `questions` (textual questions).
"""
