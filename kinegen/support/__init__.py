"""What knows nothing of robots: files, the operating system, records as JSON, lines of text."""
