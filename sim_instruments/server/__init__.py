"""The virtual bench on real sockets."""
