"""A nominal from a reference recording: what parts two recordings of one structure, and why."""
from ssi_ros.gap.reference.diagnose import diagnose_reference

__all__ = ['diagnose_reference']
