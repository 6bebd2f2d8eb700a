"""Tools around the compiler: each imports the compiler and none imports another one."""
