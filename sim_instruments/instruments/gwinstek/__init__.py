"""Simulated GPT-9800 safety tester."""
