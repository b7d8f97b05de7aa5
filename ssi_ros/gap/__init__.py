"""The gap between simulator and recording: where it lies, which effect causes it, what remains."""
