"""Why, and why not: trees of reasons for what the agent believes, down to what was perceived.

Read in this order: `evidence` (the trees), `why` (an alert, a belief, a stage, a verdict), `why_not`
(asks the reasoners which of their conditions is not met), `questions` (the same asked in words).
"""
