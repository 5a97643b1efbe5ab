"""Contact safety in numbers: thousands of simulated people getting in the robot's way."""
