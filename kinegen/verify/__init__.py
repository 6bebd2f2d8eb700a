"""Holds every emitted kernel against the independent reference, and says where it was worst.

samples      inputs: joint vectors, rates, poses
subjects     what each kind of result must be, and how a kernel's numbers are compared with that
expectation  what a kernel must return at some inputs, and how far it is from it
ways         how a kernel can be called
agreement    Jacobians against differences of poses, and against each other
proof        all comparisons of a build
tolerances   how close is close enough, and why
vectors      test vectors for the self-tests
"""
