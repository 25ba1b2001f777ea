"""The expected uncertainty of a station for a type: virtual motors measured on its twin, compared with their true values."""
