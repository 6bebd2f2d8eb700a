"""The ways in: Python (`api/`) and the command line (`cli/`)."""
