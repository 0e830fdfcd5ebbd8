"""How the small agent is made: proxy tasks for its encoder, imitation for its policy."""
