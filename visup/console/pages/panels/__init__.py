"""The panels beside the picture of a run, one for each tab."""
