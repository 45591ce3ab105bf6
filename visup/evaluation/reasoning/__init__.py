"""Evaluation of reasoning without perception: rules, relations, tasks.

Read `simulated_missions` (missions on simulated percepts, with `calibration`), then the comparisons with
oracles: `rules`, `relations`, `recognition`; `task_files` fuzzes the task language.
"""
