"""Studies with people: films of the robot, questions in the browser, and a report."""
