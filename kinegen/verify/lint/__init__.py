"""Numbers of a robot file that are valid and look like slips: nearly special, in another unit, too coarse a type."""
