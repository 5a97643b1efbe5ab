"""Contact trials: thousands of simulated people in the robot's way, counted and measured."""
