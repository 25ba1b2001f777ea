"""VXI-11 over TCP without a portmapper: core, abort and interrupt channel (VXI-11 revision 1.0; RFC 5531, RFC 4506)."""
