"""Contact trials with thousands of simulated people in the robot's way."""
