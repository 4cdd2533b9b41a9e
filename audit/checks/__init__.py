"""The checks. To add one, add an entry to the ``CHECKS`` of a module here, or a module to `walkers.audit.run`."""
