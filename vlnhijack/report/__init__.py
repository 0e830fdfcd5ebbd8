"""Pictures of results: reads what the stages wrote, computes nothing."""
