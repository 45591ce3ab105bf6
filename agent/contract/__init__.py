"""The contract between an agent and its plug-ins: behaviours and reasoners.

Read `contract.py` (what a behaviour declares), `behaviour.py` (the protocols of behaviours and
reasoners), `limits.py` (limits of time and memory for behaviours), `phases.py` (the
phases of a step) and `saving.py` (behaviours whose state can be saved).
"""
