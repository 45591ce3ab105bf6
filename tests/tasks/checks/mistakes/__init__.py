"""Deliberate mistakes of several sittings, and how many of them are told with a change that mends them."""
