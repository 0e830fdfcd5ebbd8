"""Experiment files, their stages and the runner."""
