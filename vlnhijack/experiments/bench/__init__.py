"""What renderers and attacks cost, and how wrong they are."""
