"""Tasks, rules and zones edited in the page: checked while typing, and saved where allowed."""
