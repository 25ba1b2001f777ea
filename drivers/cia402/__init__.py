"""Drives with the CiA 402 profile over CANopen."""
