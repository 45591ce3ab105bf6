"""Tasks, rules and zones that are written in the page: checked as they are typed, and saved where allowed."""
