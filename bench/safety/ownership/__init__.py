"""Ownership of instruments, across processes and users of one computer."""
