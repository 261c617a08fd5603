"""Stands in for LeRobot in tests, where that is not installed. It has nothing of LeRobot's."""
