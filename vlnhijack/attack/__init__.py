"""The texture attack: objective, projected Adam, optimisation."""
