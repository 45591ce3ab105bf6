"""What was chosen or learnt on some families of sequences is scored on the others (`--folds`)."""
