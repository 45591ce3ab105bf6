"""Oracles, peers and the comparisons with them: what only a source checkout runs.

Flat modules are the oracles: slow definitions of what visup computes fast (`rule_oracle`,
`relation_oracles`, `recognition_oracle`), another library (`rule_peer`), and what they are fed with. The
rooms hold the comparisons of `visup eval`: `reasoning` (rules, relations, recognition, task_files), `shape`
(robustness, scale), `runtime` (behaviour_faults). `make oracles` runs them with small counts.
"""
