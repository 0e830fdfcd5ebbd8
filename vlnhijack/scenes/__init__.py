"""Houses: surfaces, objects, files, and the procedural generator."""
