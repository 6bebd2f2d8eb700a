"""Holds every emitted kernel against the independent reference, and says where it was worst.

samples      inputs: joint vectors, rates, poses
subjects     what each kind of result must be, and how a kernel's numbers are compared with that
expectation  what a kernel must return at some inputs, and how far it is from it
ways         how a kernel can be called, each compared with the reference
calls        every other way of calling, which has to give the same bits
usage        what kernels do beyond the limits (beyond) and with numbers that are none (nonnumbers)
straight     that kernels are sums and products one after the other, read as text
files        what lies beside the kernels: tables, macros, defaults, functions (routines), limits of the joints
             (joint_limits), self-tests (selftests)
written      that what is written is what was proven
agreement    Jacobians against differences of poses, and against each other
proof        all comparisons of a build
tolerances   how close is close enough, and why
vectors      test vectors for the self-tests
"""
