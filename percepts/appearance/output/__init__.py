"""What is reported: regions of things, and moving regions that no thing explains."""
