"""Simulated C2000 drive and DYN-200 transducer."""
