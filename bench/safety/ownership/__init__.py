"""Who has which instrument, across processes and users of one computer."""
