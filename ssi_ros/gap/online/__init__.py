"""The gap as samples arrive."""
