"""Recorded shaking: files of loggers, and the motion that they describe."""
