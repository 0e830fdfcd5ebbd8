"""Rollouts in attacked houses, records and tables."""
