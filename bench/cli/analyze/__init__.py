"""`motorbench analyze`: captures and tables that are evaluated without an instrument."""
