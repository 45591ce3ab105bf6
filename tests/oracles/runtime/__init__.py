"""Behaviours that misbehave (`fault_injection`) and what comes of it (`behaviour_faults`)."""
