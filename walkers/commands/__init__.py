"""The commands: the public functions of `runs` and `studies`, in the order of ``walkers --help``."""
