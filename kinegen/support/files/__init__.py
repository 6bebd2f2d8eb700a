"""Files on disk, each whole or not at all, and which of them are kinegen's own."""
