"""`visup eval`: figures against ground truth, as tables and as JSON."""
