"""What needs the mind that reasoned: why, what if, where to stop, and the steps inside a step."""
