"""The task files that ship with visup, found by their names."""
