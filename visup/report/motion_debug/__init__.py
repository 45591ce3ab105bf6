"""motion_debug."""
