"""One build: the stages in order, what goes into them and comes out of them, and builds that need not be made."""
