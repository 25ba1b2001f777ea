"""What a station will know of a type: virtual motors drawn from it, measured on the station's twin, held against the truth."""
