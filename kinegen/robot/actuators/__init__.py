"""What drives the joints: readings, drives, and how far they go."""
