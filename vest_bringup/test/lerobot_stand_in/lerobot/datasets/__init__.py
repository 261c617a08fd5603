"""Stands in for LeRobot's data sets."""
