"""What users set: one table, for the command line, the panel, the .blend and the manifest."""
