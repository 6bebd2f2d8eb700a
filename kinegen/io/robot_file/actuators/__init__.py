"""The part `actuators` of a robot file."""
