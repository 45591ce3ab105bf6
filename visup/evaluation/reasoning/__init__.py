"""Evaluation of reasoning without perception: rules, relations, tasks.

Read `simulated_missions` (missions on simulated percepts) with `calibration`; `boxes` gives the relations of
plain boxes. The comparisons with oracles stand in `tests/oracles/reasoning`.
"""
