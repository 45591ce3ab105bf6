"""One run from its first frame to its last: wiring, the loop, recording, resuming, replaying."""
