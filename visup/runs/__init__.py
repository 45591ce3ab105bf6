"""A run from its source to its folder: wiring, recording, resuming, replaying."""
