"""What the console draws: frames, and over time, over the picture and over the task what is believed."""
