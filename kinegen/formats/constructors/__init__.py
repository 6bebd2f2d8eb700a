"""Text that people paste to have a robot in another tool: Robotics Toolbox for Python, Pinocchio, MATLAB."""
