"""Proof of what the engine does with the contact model: small decks, beside the second engine and closed forms.

Stands on all packages before it, and on the second engine of `walkers.studies.crosscheck`. A check is an entry in
``CHECKS`` of `scenes` or `forms`.
"""

from walkers.audit.check import Check, Line, Verdict
from walkers.audit.run import AuditReport, run_audit

__all__ = ["AuditReport", "Check", "Line", "Verdict", "run_audit"]
