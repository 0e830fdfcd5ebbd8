"""Houses from meshes that others made: readers, reduction and assembly."""
