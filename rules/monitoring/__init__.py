"""Runtime verification: formulas compiled once, monitored sample by sample.

Read in this order: `intervals.py` (three-valued robustness as intervals), `compiler.py` (formulas
to one program of shared operations), `samples.py`, `operators.py`, `further_operators.py`, `sliding.py`
(temporal operators and their immutable states), `linker.py` (a program laid out for n objects), `vm.py` (its
compiled loops), `states.py` (state retained from sample to sample), `monitor.py`
(one formula over plain signals), `cost.py` (memory and delay of a rule, known before it runs).
"""
