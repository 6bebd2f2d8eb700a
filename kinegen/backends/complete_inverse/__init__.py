"""All solutions of any arm with six turning joints: the numbers of Raghavan and Roth's elimination for one arm."""
