"""Procedural houses: floor plans, furniture, materials, episodes; deterministic by seed."""
