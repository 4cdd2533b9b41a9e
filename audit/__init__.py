"""Proof of what the engine does: small decks, made of the blocks of the real ones, against published formulas.

Stands on all packages before it. A check is an entry in one of the modules of ``audit/checks``.
"""

from walkers.audit.check import Check, Line, Verdict
from walkers.audit.run import AuditReport, run_audit

__all__ = ["AuditReport", "Check", "Line", "Verdict", "run_audit"]
