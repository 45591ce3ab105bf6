"""Output: regions of objects, and moving regions that no object explains."""
