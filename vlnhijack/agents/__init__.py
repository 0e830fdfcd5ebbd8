"""View encoders, policies, rollouts and the training of the small agent."""
