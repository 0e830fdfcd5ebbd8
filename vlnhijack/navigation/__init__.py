"""Navigation graphs, episodes, candidates and path metrics."""
