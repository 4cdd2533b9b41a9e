"""Dumps to motion, motion to tables and numbers: what a run has measured."""
