"""Operators, who do the manual work: a person at a terminal, a virtual operator, a file of answers."""
