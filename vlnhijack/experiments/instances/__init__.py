"""Attack instances: which object, where, with which episodes (paper, section 3.2)."""
