"""Evaluation of reasoning without perception: rules, relations, tasks.

Read `simulated_missions` (missions on simulated percepts) with `calibration`; `boxes` computes the relations
of plain boxes. Comparisons with oracles are in `tests/oracles/reasoning`.
"""
