"""Whether figures can be true: consistency, known factor errors, and what the instruments are capable of."""
