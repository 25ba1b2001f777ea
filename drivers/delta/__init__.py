"""Dynamometer with a Delta C2000 drive and a DYN-200 transducer, over Modbus."""
