"""The panels next to the picture of a run, one per tab."""
